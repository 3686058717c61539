"""A chip that crashes at its start, again and again, answers on the wire with its outputs off."""

from __future__ import annotations

from pathlib import Path

import pytest

from chladni.host.device.device import Device
from firmware.chip_process import retained_bytes
from firmware.chip_started import UNTIL_NETWORK, on_each_chip, started

pytestmark = on_each_chip

PANIC, WATCHDOG = 4, 6
"""ESP_RST_PANIC, ESP_RST_TASK_WDT."""
DID_NOT_LAST = b"\x0f"
"""A start that is begun and not settled (core/storage/boot_log.cpp)."""
OF_OUTPUTS = ("ledc_timer_config", "gptimer_new_timer", "xTaskCreatePinnedToCore")
OF_PANEL, OF_NETWORK = "i2c_new_master_bus", "esp_wifi_init"
OF_SAFETY = ("esp_task_wdt_add", "esp_register_shutdown_handler", "esp_brownout_register_callback")
OF_FLASH = (
    "esp_partition_find_first",
    "esp_partition_mmap",
    "esp_partition_read",
    "esp_partition_write",
)
OF_PINS = ("gpio_config", "uart_set_baudrate")


def retained_after(crashes: int) -> str:
    return f"retained={retained_bytes(crashes=crashes).hex()}"


@pytest.mark.parametrize("crash", ["esp_netif_init", "esp_wifi_init", "esp_wifi_start", "socket"])
def test_the_wire_answers_before_a_radio_that_crashes_and_after_it(
    chip_program: Path, crash: str
) -> None:
    """Three starts: each is heard until the radio is tried, and from the second on for good."""
    with started(chip_program, options=(f"crash={crash}",), turns=200) as chip:
        device = Device(chip)
        assert device.info()["standing"] == []
        chip.run(UNTIL_NETWORK)
        assert chip.ended.startswith("aborted")
    for boots in (DID_NOT_LAST, DID_NOT_LAST * 2):
        options = (f"crash={crash}", f"reset={PANIC}")
        with started(chip_program, options=options, boots=boots) as chip:
            device = Device(chip)
            chip.run(2 * UNTIL_NETWORK)
            assert not chip.ended
            assert device.info()["standing"] == ["network held back"]
            assert "stays off after a crash" in device.log
            device.touch(0.0, 0.0)
            chip.run(40)
            assert chip.on


@pytest.mark.parametrize("reset", [PANIC, WATCHDOG])
@pytest.mark.parametrize("crash", [*OF_OUTPUTS, OF_PANEL, OF_NETWORK, *OF_SAFETY])
def test_crashes_in_a_row_end_in_a_wire_that_answers(
    chip_program: Path, crash: str, reset: int
) -> None:
    options = (f"crash={crash}", f"reset={reset}")
    with started(chip_program, options=options, boots=DID_NOT_LAST * 4) as chip:
        device = Device(chip)
        assert "short starts in a row" in device.info()["standing"]
        assert "only the wire is started" in device.log
        assert not chip.calls.keys() & {*OF_OUTPUTS, OF_PANEL, OF_NETWORK, *OF_SAFETY}
        assert not chip.on
        assert not chip.ended


def test_a_supply_that_gives_way_in_a_row_plays_for_a_host(chip_program: Path) -> None:
    with started(chip_program, boots=DID_NOT_LAST * 4) as chip:
        device = Device(chip)
        assert {"short starts in a row", "network held back"} <= {*device.info()["standing"]}
        device.touch(0.0, 0.0)
        chip.run(40)
        assert chip.on


@pytest.mark.parametrize("crash", [*OF_FLASH, *OF_PINS])
def test_a_start_that_crashes_before_all_else_answers_as_a_blank_device(
    chip_program: Path, crash: str
) -> None:
    """After eight flash stays shut, and pins as the ROM left them."""
    options = (f"crash={crash}", f"reset={PANIC}")
    with started(chip_program, options=(*options, retained_after(6))) as chip:
        # The S3's wire is its USB, which has no rate.
        has_call = (crash, chip_program.name) != ("uart_set_baudrate", "esp32s3")
        assert chip.ended.startswith("aborted") == has_call
    with started(chip_program, options=(*options, retained_after(7))) as chip:
        device = Device(chip)
        assert "short starts in a row" in device.info()["standing"]
        assert not chip.calls.keys() & {*OF_FLASH, *OF_PINS, *OF_SAFETY, *OF_OUTPUTS}
        assert not chip.on
        assert not chip.ended


def test_crashes_count_however_long_a_start_lasts(chip_program: Path) -> None:
    """A firmware that crashes under every finger has no row of them in flash."""
    options = (f"reset={PANIC}", retained_after(3))
    with started(chip_program, options=options) as chip:
        assert "only the wire is started" in Device(chip).log
        assert not chip.on
    # By power, or as a host asked: from the beginning.
    with started(chip_program, options=("reset=1", retained_after(3))) as chip:
        assert "only the wire" not in Device(chip).log
