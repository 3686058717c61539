"""chip/ on a fake of ESP-IDF: start-up, every failing call in turn, and every way down."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.protocol.config import PANELS, DeviceConfig, pack_config
from chladni.host.protocol.network import NetworkSettings, pack_network
from chladni.sim.board.electronics import ChipName
from effects.banks import BYTES
from firmware.chip_process import FIRMWARE, Chip, gates_of, includes
from firmware.chip_started import CONFIG, NETWORK, PINS, TABLE, on_each_chip, playing, started

pytestmark = on_each_chip


def test_it_starts_and_plays_over_the_link(chip_program: Path) -> None:
    with started(chip_program) as chip, Device(chip) as device:
        assert not chip.on
        info = device.info()
        assert (info["state"], info["stack_free"]) == ("idle", 5000)
        device.touch(0.0, 0.0)
        chip.run(30)
        assert chip.on == set(PINS)
        device.lift()
        chip.run(40)
        chip.run(5)
        assert not chip.on


def test_the_first_lines_name_what_stands_in_the_way(chip_program: Path) -> None:
    """Of a board that was just powered: its coils may be hot, which the first turn finds out."""
    with started(chip_program, options=("retained=00",), turns=2) as chip:
        device = Device(chip)
        device.info()
        lines = device.log.split("\r\n")
        first = lines.index("fault")
        assert lines[first : first + 3] == ["fault", "stands: coil hot", "ok"]


@pytest.mark.parametrize("way", ["panic", "brownout"])
def test_every_way_down_leaves_the_gates_low(chip_program: Path, way: str) -> None:
    with started(chip_program) as chip:
        device = Device(chip)
        playing(chip, device)
        assert chip.down(way) == set()


def test_a_restart_cuts_the_outputs_first(chip_program: Path) -> None:
    with started(chip_program) as chip:
        device = Device(chip)
        playing(chip, device)
        device.link.request("restart")
        chip.run(500)
        assert chip.ended.startswith("restarted")
        assert not gates_of(chip.ended.split()[1])


def test_an_interrupt_that_would_answer_another_timer_is_not_started(chip_program: Path) -> None:
    """The driver does not say which timer it gave: what it was told must show in ours."""
    with started(chip_program, options=("another-timer",)) as chip, Device(chip) as device:
        assert "did not start" in device.log
        assert "interrupt stopped" in [fault["cause"] for fault in device.faults()]
        assert not chip.on


def test_a_dead_interrupt_is_cut_off_by_the_main_loop(chip_program: Path) -> None:
    with started(chip_program) as chip:
        device = Device(chip)
        playing(chip, device)
        chip.tell("die 1")
        chip.run(8)
        chip.run(1)
        assert not chip.on
        assert "interrupt stopped" in [fault["cause"] for fault in device.faults()]


def calls_made(chip_program: Path) -> list[str]:
    """Every call of start-up and of a little use that can fail, with how often it is made."""
    with started(chip_program) as chip:
        device = Device(chip)
        playing(chip, device)
        device.lift()
        chip.run(60)
        device.set_config(device.config())
        return [f"{name}:{k}" for name, count in chip.calls.items() for k in range(1, count + 1)]


WIRES = {
    "esp32": ("uart_driver_install", "uart_param_config"),
    "esp32s3": ("usb_serial_jtag_driver_install",),
}
OF_NETWORK = (
    "esp_netif",
    "esp_event",
    "esp_wifi",
    "socket",
    "bind",
    "mbedtls_md_info",
    "mbedtls_md_setup",
)


# The first two are of the start.
MOVES = tuple(f"gptimer_set_raw_count:{k}" for k in range(3, 99))


def test_every_failing_call_leaves_outputs_off_or_harmless_and_a_link_that_answers(
    chip_program: Path,
) -> None:
    """In turn: nothing is on that was not asked for, and the link says what went wrong."""
    tried = 0
    for call in calls_made(chip_program):
        name = call.split(":")[0]
        if name in WIRES[chip_program.name]:
            continue  # Without a wire there is none to answer on: a restart, tested below.
        with started(chip_program, fail=call) as chip:
            assert chip.ended == "", call
            assert not chip.on, call
            device = Device(chip)
            info = device.info()
            said = device.log + str(device.faults()) + str(info)
            tried += 1
            if name == "gptimer_get_raw_count" or call in MOVES:
                assert "near the carrier" in said, call
            elif name.startswith(("ledc", "gptimer", "xTask", "esp_intr")) or name in (
                "esp_register_shutdown_handler",
                "esp_brownout_register_callback",
                "esp_task_wdt_add",
            ):
                # What outputs rest on: they stay off whatever is asked for.
                assert "interrupt stopped" in said or "did not start" in said, call
                device.link.request("touch", x_um=0, y_um=0) if info["state"] == "idle" else None
                chip.run(60)
                assert not chip.on, call
            elif name.startswith(OF_NETWORK) and name != "esp_wifi_connect":
                assert "network did not start" in said, call
    assert tried > 40


def test_without_a_wire_it_starts_again_with_outputs_off(chip_program: Path) -> None:
    for call in WIRES[chip_program.name]:
        with started(chip_program, fail=f"{call}:1") as chip:
            assert chip.ended.startswith("aborted")
            assert not gates_of(chip.ended.split()[1])


def test_missing_partitions_are_said(chip_program: Path) -> None:
    chip = Chip(chip_program, config=pack_config(CONFIG))
    try:
        chip.run(20)
        with Device(chip) as device:
            assert "no room for tables" in device.log
            assert device.info()["state"] == "fault"
    finally:
        chip.close()


@pytest.mark.parametrize(
    ("reason", "told"),
    [
        (1, None),
        (3, "software"),
        (4, "panic"),
        (5, "watchdog"),
        (6, "watchdog"),
        (7, "watchdog"),
        (9, "brown-out"),
        (99, "other"),
    ],
)
def test_why_it_started_is_kept(chip_program: Path, reason: int, told: str | None) -> None:
    with started(chip_program, options=(f"reset={reason}",)) as chip, Device(chip) as device:
        resets = [fault for fault in device.faults() if fault["cause"] == "reset"]
        assert len(resets) == (told is not None)
        assert not chip.on


def test_gates_above_31_play_and_are_cut(chip_program: Path) -> None:
    pins = {"esp32": (25, 26, 27, 32, 33), "esp32s3": (1, 2, 6, 7, 38)}[chip_program.name]
    config = DeviceConfig(pwm_pins=(*pins, *(255,) * 11))
    with started(chip_program, config=config) as chip, Device(chip) as device:
        device.touch(0.0, 0.0)
        chip.run(30)
        assert chip.on == set(pins)
        assert chip.down("panic") == set()


def test_pins_that_cannot_be_leave_the_link(chip_program: Path) -> None:
    with (
        started(chip_program, config=CONFIG.with_values(channels=6)) as chip,
        Device(chip) as device,
    ):
        assert "configuration refused" in [fault["cause"] for fault in device.faults()]
        chip.run(50)
        assert not chip.on


@pytest.mark.parametrize("option", ["mute", "stuck"])
def test_a_panel_that_fails_is_looked_for_and_the_link_goes_on(
    chip_program: Path, option: str
) -> None:
    with started(chip_program, options=(option,)) as chip, Device(chip) as device:
        chip.run(400)
        assert device.info()["state"] in ("idle", "fault")
        assert not chip.on


def test_an_open_network_and_a_flood_of_rubbish(chip_program: Path) -> None:
    network = pack_network(NetworkSettings("net", "", bytes(range(32)), 5555))
    with started(chip_program, network=network) as chip, Device(chip) as device:
        for k in range(40):
            chip.tell(f"udp {bytes([k] * 40).hex()}")
        chip.run(20)
        assert device.info()["state"] == "idle"


def test_tables_that_have_too_little_room_are_said(chip_program: Path) -> None:
    chip = Chip(chip_program, options=("tables:small",), config=pack_config(CONFIG))
    try:
        chip.run(20)
        with Device(chip) as device:
            assert "no room for tables" in device.log
    finally:
        chip.close()


def test_an_interrupt_just_before_the_next_drops_a_duty_and_waits_for_nothing(
    chip_program: Path,
) -> None:
    """Two writes would fall into one carrier period: the fake forbids it, the chip drops one."""
    with started(chip_program) as chip:
        device = Device(chip)
        playing(chip, device)
        for cycles in range(11_000, 12_288, 64):
            chip.tell(f"late {cycles}")
            chip.run(2)
            assert chip.ended == ""
        chip.tell("twice")
        chip.run(2)
        assert chip.ended == ""


@pytest.mark.parametrize("call", ["esp_partition_erase_range:1", "esp_partition_write:3"])
def test_flash_that_fails_refuses_a_configuration_and_keeps_the_old(
    chip_program: Path, call: str
) -> None:
    with started(chip_program, fail=call) as chip:
        device = Device(chip)
        before = device.config()
        with pytest.raises(LinkError):
            device.set_config(before.with_values(attack_ms=9))
        assert device.config() == before


def test_the_device_takes_no_room_in_the_image(tmp_path: Path, chip_program: Path) -> None:
    """Its 20 KB lie in .bss, optimised or not: what is initialised would be copied from flash."""
    made = tmp_path / "app_main.o"
    chip: ChipName = "esp32" if chip_program.name == "esp32" else "esp32s3"
    include = includes(chip_program.parent, chip)
    for level in ("-O0", "-O2"):
        source = str(FIRMWARE / "chip" / "app_main.cpp")
        subprocess.run(
            ["g++", "-std=c++17", level, "-c", source, "-o", str(made), *include], check=True
        )
        _, sizes = subprocess.run(
            ["size", str(made)], capture_output=True, text=True, check=True
        ).stdout.splitlines()
        _, data, bss = map(int, sizes.split()[:3])
        assert data < 256
        assert bss > 20_000


def test_a_panel_without_its_lines_and_a_device_without_partitions(chip_program: Path) -> None:
    config = CONFIG.with_values(panel=PANELS.index("find"), interrupt_pin=255, reset_pin=255)
    with started(chip_program, config=config) as chip, Device(chip) as device:
        chip.run(50)
        assert device.info()["state"] == "idle"
    chip = Chip(chip_program)
    try:
        chip.run(20)
        device = Device(chip)
        assert device.info()["state"] == "fault"
        # It has no pins and starts all the same: the interrupt is heard, and nothing is driven.
        assert "did not start" not in device.log
        assert "interrupt stopped" not in [fault["cause"] for fault in device.faults()]
        assert not chip.on
        with pytest.raises(LinkError):
            device.set_config(CONFIG)
    finally:
        chip.close()


def test_an_effect_bank_comes_into_its_own_partition(chip_program: Path) -> None:
    """One finger comes down on a key; a chip without the partition says so, and plays its tone."""
    with started(chip_program) as chip, Device(chip) as device:
        assert device.effects.flash(BYTES).verified
        device.touch(-15.0, 30.0)
        chip.run(30)
        assert chip.on == set(PINS)
        assert [one.area for one in device.effects.events()] == ["key"]
    with started(chip_program, effects=BYTES) as chip, Device(chip) as device:
        assert device.effects.info()["name"] == "all"
    chip = Chip(chip_program, tables=TABLE, config=pack_config(CONFIG), network=NETWORK)
    try:
        chip.run(20)
        device = Device(chip)
        with pytest.raises(LinkError, match="partitioned before there were effect banks"):
            device.effects.flash(BYTES)
        playing(chip, device)
    finally:
        chip.close()
