"""The emulated hardware is stricter than the chip: what the chip loses is an error here."""

from __future__ import annotations

from typing import Any

import pytest

from chladni.host import _emulator


@pytest.fixture
def board() -> _emulator.Emulator:
    return _emulator.Emulator(
        channels=2, pwm_bits=10, level=0.5, panel_period_us=10000, flash_sectors=2
    )


def test_flash_programs_ones_to_zeros_only(board: _emulator.Emulator) -> None:
    board.program(10, b"\xf0")
    board.program(10, b"\x30")
    with pytest.raises(RuntimeError, match="byte 10 programmed from 0 to 1"):
        board.program(10, b"\x31")
    board.erase_sector(0)
    board.program(10, b"\x31")


def test_flash_is_erased_by_whole_sectors_within_the_partition(board: _emulator.Emulator) -> None:
    with pytest.raises(RuntimeError, match="not the start of a sector"):
        board.erase_sector(100)
    with pytest.raises(RuntimeError, match="not the start of a sector"):
        board.erase_sector(2 * _emulator.SECTOR_BYTES)
    with pytest.raises(RuntimeError, match="leaves the partition"):
        board.program(2 * _emulator.SECTOR_BYTES - 1, b"\x00\x00")


def test_a_second_duty_within_a_carrier_period_is_a_fault() -> None:
    pwm = _emulator.Pwm(channels=2, bits=10)
    pwm.write(period=5, channel=0, duty=3)
    pwm.write(period=5, channel=1, duty=3)
    with pytest.raises(RuntimeError, match="written twice in carrier period 5"):
        pwm.write(period=5, channel=0, duty=4)
    pwm.write(period=6, channel=0, duty=4)


def test_a_duty_of_two_to_the_bits_overflows() -> None:
    pwm = _emulator.Pwm(channels=1, bits=10)
    pwm.write(period=0, channel=0, duty=1023)
    with pytest.raises(RuntimeError, match="overflows"):
        pwm.write(period=1, channel=0, duty=1024)
    with pytest.raises(RuntimeError, match="channel 1"):
        pwm.write(period=2, channel=1, duty=0)
    with pytest.raises(ValueError, match="channels"):
        _emulator.Pwm(channels=100, bits=10)


@pytest.mark.parametrize(
    "wrong", [{"channels": 0}, {"channels": 17}, {"pwm_bits": 9}, {"pwm_bits": 13}, {"level": 1.5}]
)
def test_impossible_hardware_is_refused(wrong: dict[str, Any]) -> None:
    settings: dict[str, Any] = {
        "channels": 5, "pwm_bits": 10, "level": 0.5, "panel_period_us": 10000, "flash_sectors": 1,
    }  # fmt: skip
    with pytest.raises(ValueError, match=next(iter(wrong))):
        _emulator.Emulator(**(settings | wrong))
