"""A chip that crashes at its start, again and again, answers on the wire with its outputs off."""

from __future__ import annotations

from pathlib import Path

import pytest

from chladni.host.device.device import Device
from firmware.chip_started import UNTIL_NETWORK, on_each_chip, started

pytestmark = on_each_chip

PANIC, WATCHDOG = 4, 6
"""ESP_RST_PANIC, ESP_RST_TASK_WDT."""
DID_NOT_LAST = b"\x0f"
"""A start that is begun and not settled (core/storage/boot_log.cpp)."""
OF_OUTPUTS = ("ledc_timer_config", "gptimer_new_timer", "xTaskCreatePinnedToCore")
OF_PANEL, OF_NETWORK = "i2c_new_master_bus", "esp_wifi_init"


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
@pytest.mark.parametrize("crash", [*OF_OUTPUTS, OF_PANEL, OF_NETWORK])
def test_crashes_in_a_row_end_in_a_wire_that_answers(
    chip_program: Path, crash: str, reset: int
) -> None:
    options = (f"crash={crash}", f"reset={reset}")
    with started(chip_program, options=options, boots=DID_NOT_LAST * 4) as chip:
        device = Device(chip)
        assert "short starts in a row" in device.info()["standing"]
        assert "only the wire is started" in device.log
        assert not chip.calls.keys() & {*OF_OUTPUTS, OF_PANEL, OF_NETWORK}
        assert not chip.on
        assert not chip.ended


def test_a_supply_that_gives_way_in_a_row_plays_for_a_host(chip_program: Path) -> None:
    with started(chip_program, boots=DID_NOT_LAST * 4) as chip:
        device = Device(chip)
        assert {"short starts in a row", "network held back"} <= {*device.info()["standing"]}
        device.touch(0.0, 0.0)
        chip.run(40)
        assert chip.on
