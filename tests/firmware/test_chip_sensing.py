"""Coils that measure each other, through chip/ on the fake, whose converter reads a sine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chladni.calibration.device_readings import Heard
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.measuring.coil_readings import ReadingError, sense
from chladni.host.protocol.config import DeviceConfig
from firmware.chip_started import CONFIG, on_each_chip, started

pytestmark = on_each_chip

SENSE_PINS = {"esp32": 36, "esp32s3": 1}
STEPS, MULTIPLE = 300.0, 4
"""Of the sine that the fake's converter reads."""
CALLS = (
    "adc_continuous_new_handle",
    "adc_continuous_io_to_channel",
    "adc_continuous_config",
    "adc_continuous_register_event_callbacks",
    "adc_continuous_start",
)


def configured(chip_program: Path) -> DeviceConfig:
    return CONFIG.with_values(sense_pin=SENSE_PINS[chip_program.name])


def asked(**others: int) -> dict[str, int]:
    usual = {
        "playing": 1,
        "multiple": MULTIPLE,
        "level_q15": 20_000,
        "settle_ms": 10,
        "readings": 2,
    }
    return usual | others


def heard_by(device: Device, **others: int) -> list[Heard]:
    found = sense(device, **asked(**others))
    assert found is not None
    return found


def test_what_the_converter_reads_is_found_by_the_phase_of_the_duty(chip_program: Path) -> None:
    with started(chip_program, config=configured(chip_program)) as chip:
        device = Device(chip)
        heard = heard_by(device)
        assert [own.listening for own in heard] == [0, 2, 3, 4]
        for own in heard:
            assert abs(own.steps) == pytest.approx(STEPS, rel=1e-3)
            # All coils of a request by one phase: the one that plays goes on.
            assert np.angle(own.steps / heard[0].steps) == pytest.approx(0.0, abs=1e-3)
            # Whole numbers, and a cosine of 16 bits.
            assert 0.2 < own.noise < 0.7
        # The first coil brings the reference with it.
        with_reference = heard_by(device, playing=0)
        assert [own.listening for own in with_reference] == [1, 2, 3, 4, 16]
        assert {own.session for own in heard + with_reference} == {1}
        chip.run(1000)
        assert chip.calls["adc_continuous_stop"] == chip.calls["adc_continuous_deinit"] == 1
        assert {own.session for own in heard_by(device)} == {2}
        assert device.info()["state"] == "idle"


@pytest.mark.parametrize("call", CALLS)
def test_a_converter_that_does_not_start_is_said(chip_program: Path, call: str) -> None:
    with started(chip_program, fail=f"{call}:1", config=configured(chip_program)) as chip:
        device = Device(chip)
        with pytest.raises(ReadingError, match="converter fails"):
            sense(device, **asked())
        chip.run(20)
        assert not chip.on
        assert device.info()["state"] == "idle"
        assert len(heard_by(device)) == 4  # the call fails once


def test_values_that_were_not_fetched_end_the_reading(chip_program: Path) -> None:
    with started(
        chip_program, fail="adc_continuous_read:9", config=configured(chip_program)
    ) as chip:
        device = Device(chip)
        with pytest.raises(ReadingError, match="samples lost"):
            sense(device, **asked())
        device.link.request("sense", b"", **asked())
        chip.run(30)
        for _ in range(180):
            chip.ask("position")  # time without a turn of the main loop
        chip.run(20)
        assert device.link.request("sensed").fields["state"] == 7
        assert not chip.on


def test_without_an_expander_nothing_is_chosen(chip_program: Path) -> None:
    options = ("mute",)
    with started(chip_program, options=options, config=configured(chip_program)) as chip:
        device = Device(chip)
        with pytest.raises(ReadingError, match="expander missing"):
            sense(device, **asked())


def test_without_a_sensing_pin_it_is_refused(chip_program: Path) -> None:
    with started(chip_program) as chip, pytest.raises(LinkError, match="no sensing pin"):
        sense(Device(chip), **asked())
