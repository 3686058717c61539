"""chip/ on a fake of ESP-IDF: start-up, every failing call in turn, and every way down."""

from __future__ import annotations

import subprocess
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.link import LinkError
from chladni.host.protocol.config import PANELS, DeviceConfig, pack_config
from chladni.host.protocol.network import NetworkSettings, pack_network
from chladni.sim.board.gpio import GATES
from chladni.tables.format import pack
from firmware.chip_process import FIRMWARE, RESET_PIN, Chip, branches, build, gates_of
from firmware.chip_started import CONFIG, PINS, playing, started
from made_up import make_table


@pytest.fixture(scope="session")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("chip"))


def test_it_starts_and_plays_over_the_link(program: Path) -> None:
    with started(program) as chip, Device(chip) as device:
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


@pytest.mark.parametrize("way", ["panic", "brownout"])
def test_every_way_down_leaves_the_gates_low(program: Path, way: str) -> None:
    with started(program) as chip:
        device = Device(chip)
        playing(chip, device)
        assert chip.down(way) == set()


def test_a_restart_cuts_the_outputs_first(program: Path) -> None:
    with started(program) as chip:
        device = Device(chip)
        playing(chip, device)
        device.link.request("restart")
        chip.run(500)
        assert chip.ended.startswith("restarted")
        assert not gates_of(chip.ended.split()[1])


def test_a_dead_interrupt_is_cut_off_by_the_main_loop(program: Path) -> None:
    with started(program) as chip:
        device = Device(chip)
        playing(chip, device)
        chip.tell("die 1")
        chip.run(8)
        chip.run(1)
        assert not chip.on
        assert "interrupt stopped" in [fault["cause"] for fault in device.faults()]


def calls_made(program: Path) -> list[str]:
    """Every call of start-up and of a little use that can fail, with how often it is made."""
    with started(program) as chip:
        device = Device(chip)
        playing(chip, device)
        device.lift()
        chip.run(60)
        device.set_config(device.config())
        return [f"{name}:{k}" for name, count in chip.calls.items() for k in range(1, count + 1)]


OF_NETWORK = (
    "esp_netif", "esp_event", "esp_wifi", "socket", "bind", "mbedtls_md_info", "mbedtls_md_setup",
)  # fmt: skip


def test_every_failing_call_leaves_outputs_off_or_harmless_and_a_link_that_answers(
    program: Path,
) -> None:
    """In turn: nothing is on that was not asked for, and the link says what went wrong."""
    tried = 0
    for call in calls_made(program):
        name = call.split(":")[0]
        if name in ("uart_driver_install", "uart_param_config"):
            continue  # Without a wire there is none to answer on: a restart, tested below.
        with started(program, fail=call) as chip:
            assert chip.ended == "", call
            assert not chip.on, call
            device = Device(chip)
            info = device.info()
            said = device.log + str(device.faults()) + str(info)
            tried += 1
            if name in ("gptimer_get_raw_count", "gptimer_set_raw_count"):
                assert "near the carrier" in said, call
            elif name.startswith(("ledc", "gptimer", "xTask")) or name in (
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


def test_without_a_wire_it_starts_again_with_outputs_off(program: Path) -> None:
    for call in ("uart_driver_install:1", "uart_param_config:1"):
        with started(program, fail=call) as chip:
            assert chip.ended.startswith("aborted")
            assert not gates_of(chip.ended.split()[1])


def test_missing_partitions_are_said(program: Path) -> None:
    chip = Chip(program, config=pack_config(CONFIG))
    try:
        chip.run(20)
        with Device(chip) as device:
            assert "no room for tables" in device.log
            assert device.info()["state"] == "fault"
    finally:
        chip.close()


@pytest.mark.parametrize(
    ("reason", "told"),
    [(1, None), (3, "software"), (4, "panic"), (5, "watchdog"), (6, "watchdog"), (7, "watchdog"),
     (9, "brown-out"), (99, "other")],
)  # fmt: skip
def test_why_it_started_is_kept(program: Path, reason: int, told: str | None) -> None:
    with started(program, options=(f"reset={reason}",)) as chip, Device(chip) as device:
        resets = [fault for fault in device.faults() if fault["cause"] == "reset"]
        assert len(resets) == (told is not None)
        assert not chip.on


def test_gates_above_31_play_and_are_cut(program: Path) -> None:
    config = DeviceConfig(pwm_pins=(25, 26, 27, 32, 33, *(255,) * 11))
    with started(program, config=config) as chip, Device(chip) as device:
        device.touch(0.0, 0.0)
        chip.run(30)
        assert chip.on == {25, 26, 27, 32, 33}
        assert chip.down("panic") == set()


def test_pins_that_cannot_be_leave_the_link(program: Path) -> None:
    with started(program, config=CONFIG.with_values(channels=6)) as chip, Device(chip) as device:
        assert "configuration refused" in [fault["cause"] for fault in device.faults()]
        chip.run(50)
        assert not chip.on


@pytest.mark.parametrize("option", ["mute", "stuck"])
def test_a_panel_that_fails_is_looked_for_and_the_link_goes_on(program: Path, option: str) -> None:
    with started(program, options=(option,)) as chip, Device(chip) as device:
        chip.run(400)
        assert device.info()["state"] in ("idle", "fault")
        assert not chip.on


def test_an_open_network_and_a_flood_of_rubbish(program: Path) -> None:
    network = pack_network(NetworkSettings("net", "", bytes(range(32)), 5555))
    with started(program, network=network) as chip, Device(chip) as device:
        for k in range(40):
            chip.tell(f"udp {bytes([k] * 40).hex()}")
        chip.run(20)
        assert device.info()["state"] == "idle"


def test_tables_that_have_too_little_room_are_said(program: Path) -> None:
    chip = Chip(program, options=("tables:small",), config=pack_config(CONFIG))
    try:
        chip.run(20)
        with Device(chip) as device:
            assert "no room for tables" in device.log
    finally:
        chip.close()


def test_an_interrupt_just_before_the_next_drops_a_duty_and_waits_for_nothing(
    program: Path,
) -> None:
    """Two writes would fall into one carrier period: the fake forbids it, the chip drops one."""
    with started(program) as chip:
        device = Device(chip)
        playing(chip, device)
        for cycles in range(11_000, 12_288, 64):
            chip.tell(f"late {cycles}")
            chip.run(2)
            assert chip.ended == ""
        chip.tell("twice")
        chip.run(2)
        assert chip.ended == ""


@pytest.mark.parametrize("call", ["esp_partition_erase_range:1", "esp_partition_write:1"])
def test_flash_that_fails_refuses_a_configuration_and_keeps_the_old(
    program: Path, call: str
) -> None:
    with started(program, fail=call) as chip:
        device = Device(chip)
        before = device.config()
        with pytest.raises(LinkError):
            device.set_config(before.with_values(attack_ms=9))
        assert device.config() == before


def test_the_device_takes_no_room_in_the_image(tmp_path: Path, program: Path) -> None:
    """Its 20 KB lie in .bss, optimised or not: what is initialised would be copied from flash."""
    made = tmp_path / "app_main.o"
    include = [f"-I{program.parent / 'include'}", f"-I{FIRMWARE.parents[1] / 'tests/firmware/idf'}",
               f"-I{FIRMWARE}", f"-I{FIRMWARE / 'chip'}"]  # fmt: skip
    for level in ("-O0", "-O2"):
        source = str(FIRMWARE / "chip" / "app_main.cpp")
        subprocess.run(["g++", "-std=c++17", level, "-c", source, "-o", str(made), *include],
                       check=True)  # fmt: skip
        _, sizes = subprocess.run(
            ["size", str(made)], capture_output=True, text=True, check=True
        ).stdout.splitlines()
        _, data, bss = map(int, sizes.split()[:3])
        assert data < 256
        assert bss > 20_000


def test_the_fake_reaches_the_branches_of_chip(program: Path) -> None:
    """What no scenario takes was not tested; by gcov, branches of exceptions aside."""
    calls_made(program)
    test_every_failing_call_leaves_outputs_off_or_harmless_and_a_link_that_answers(program)
    for way in ("panic", "brownout"):
        test_every_way_down_leaves_the_gates_low(program, way)
    test_a_restart_cuts_the_outputs_first(program)
    test_without_a_wire_it_starts_again_with_outputs_off(program)
    test_missing_partitions_are_said(program)
    for reason in (3, 4, 5, 6, 9, 99):
        test_why_it_started_is_kept(program, reason, "known")
    test_gates_above_31_play_and_are_cut(program)
    test_pins_that_cannot_be_leave_the_link(program)
    test_an_open_network_and_a_flood_of_rubbish(program)
    test_tables_that_have_too_little_room_are_said(program)
    test_an_interrupt_just_before_the_next_drops_a_duty_and_waits_for_nothing(program)
    for option in ("mute", "stuck"):
        test_a_panel_that_fails_is_looked_for_and_the_link_goes_on(program, option)
    for call in ("esp_partition_erase_range:1", "esp_partition_write:1"):
        test_flash_that_fails_refuses_a_configuration_and_keeps_the_old(program, call)
    test_sixteen_channels_play_on_both_groups(program)
    for apart in (-200, 200):
        test_groups_that_do_not_start_together_are_not_played(program, apart)
    test_a_carrier_that_will_not_stand_still_is_said_once(program)
    test_writes_are_moved_away_from_the_carrier_s_end(program)
    test_a_timer_that_cannot_be_moved_is_said_once(program)
    test_a_panel_without_its_lines_and_a_device_without_partitions(program)
    taken, total, missed = branches(program)
    assert taken / total >= 0.95, f"{taken} of {total}: {sorted(missed)}"


SIXTEEN = pack(make_table(np.array([[10.0 - 0.5 * k for k in range(16)]])))
ALL_CHANNELS = DeviceConfig(
    channels=16, pwm_pins=GATES[:16], full_current_ma=(50,) * 16, full_rise_dk=(100,) * 16
)


def sixteen(program: Path, *options: str) -> AbstractContextManager[Chip]:
    return started(program, config=ALL_CHANNELS, options=options, tables=SIXTEEN)


def test_sixteen_channels_play_on_both_groups(program: Path) -> None:
    with sixteen(program) as chip:
        device = Device(chip)
        assert device.info()["state"] == "idle", device.faults()
        device.touch(0.0, 0.0)
        chip.run(40)
        assert chip.on | {RESET_PIN} == set(GATES[:16])
        assert chip.down("panic") == set()


@pytest.mark.parametrize("read_cycles", [8, 60, 150])
@pytest.mark.parametrize("apart", [0, -7, 9])
def test_the_lag_that_is_printed_is_that_of_the_groups(
    program: Path, read_cycles: int, apart: int
) -> None:
    """Started some 3,000 steps apart, they are brought together; however long a read takes."""
    with sixteen(program, f"read={read_cycles}", f"apart={apart}") as chip:
        device = Device(chip)
        device.info()
        (said,) = [line for line in device.log.splitlines() if "channels 8 and up" in line]
        lag = float(chip.ask("lag"))
        # A step is lost where a count is cut off, and half of one in the mean.
        assert abs(int(said.split("lag by ")[1].split()[0]) - lag) <= 1.5
        assert abs(lag + apart) < 3.0


@pytest.mark.parametrize("read_cycles", [8, 36])
def test_sixteen_duties_are_written_in_one_carrier_period(program: Path, read_cycles: int) -> None:
    """Also where the bus is slow: 36 cycles a read and 12 a write are three eighths of a period."""
    with sixteen(program, f"read={read_cycles}", "write=12") as chip:
        device = Device(chip)
        device.touch(0.0, 0.0)
        for shift in range(60, 1024, 120):
            chip.tell(f"shift {shift}")
            chip.run(20)
            assert chip.ask("position").split()[1] == "-"
        assert "near the carrier" not in device.log


@pytest.mark.parametrize("apart", [-200, 200])
def test_groups_that_do_not_start_together_are_not_played(program: Path, apart: int) -> None:
    with sixteen(program, f"apart={apart}") as chip:
        device = Device(chip)
        chip.run(20)
        device.info()
        assert "synthesis did not start" in device.log
        assert "interrupt stopped" in [fault["cause"] for fault in device.faults()]
        assert not chip.on


def test_a_carrier_that_will_not_stand_still_is_said_once(program: Path) -> None:
    with started(program) as chip:
        device = Device(chip)
        for _ in range(40):
            chip.tell("shift 512")
            chip.run(1)
        device.info()
        assert device.log.count("near the carrier") == 1


def test_writes_are_moved_away_from_the_carrier_s_end(program: Path) -> None:
    """Wherever the carrier stands beside the alarm: found at the writes, put right in turns."""
    with started(program) as chip:
        device = Device(chip)
        playing(chip, device)
        for shift in range(60, 1024, 120):
            chip.tell(f"shift {shift}")
            chip.run(20)
            at = int(chip.ask("position").split()[0])
            assert 1024 * 3 // 8 <= at <= 1024 * 7 // 8
            assert not chip.ended
        assert "near the carrier" not in device.log


def test_a_timer_that_cannot_be_moved_is_said_once(program: Path) -> None:
    for call in ("gptimer_set_raw_count:1", "gptimer_get_raw_count:1"):
        with started(program, fail=call) as chip:
            device = Device(chip)
            for shift in (300, 300, 300):
                chip.tell(f"shift {shift}")
                chip.run(3)
            chip.run(20)
            device.info()
            assert device.log.count("near the carrier") == 1


def test_a_panel_without_its_lines_and_a_device_without_partitions(program: Path) -> None:
    config = CONFIG.with_values(panel=PANELS.index("find"), interrupt_pin=255, reset_pin=255)
    with started(program, config=config) as chip, Device(chip) as device:
        chip.run(50)
        assert device.info()["state"] == "idle"
    chip = Chip(program)
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
