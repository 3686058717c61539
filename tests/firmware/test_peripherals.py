"""The emulated hardware is stricter than the chip: what the chip loses is an error here."""

from __future__ import annotations

import pytest

from chladni.host.emulation import _emulator


@pytest.fixture
def board() -> _emulator.Emulator:
    hardware = _emulator.Hardware()
    hardware.table_sectors = 2
    return _emulator.Emulator(hardware)


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


def test_power_fails_in_the_middle_and_flash_may_lie(board: _emulator.Emulator) -> None:
    board.cut_power_after(3)
    board.program(0, b"\x01\x02\x03\x04")
    board.program(8, b"\x05")
    assert board.flash_bytes()[:9] == b"\x01\x02\x03\xff\xff\xff\xff\xff\xff"
    board.restore_power()
    board.let_flash_lie(True)
    board.program(8, b"\x05")
    board.erase_sector(0)
    assert board.flash_bytes()[:9] == b"\x01\x02\x03\xff\xff\xff\xff\xff\xff"


def test_second_duties_within_a_carrier_period_are_a_fault() -> None:
    pwm = _emulator.Pwm(channels=2, bits=10)
    pwm.write(period=5, duties=[3, 3])
    with pytest.raises(RuntimeError, match="written twice in carrier period 5"):
        pwm.write(period=5, duties=[4, 3])
    pwm.write(period=6, duties=[4, 3])


def test_a_duty_of_two_to_the_bits_overflows() -> None:
    pwm = _emulator.Pwm(channels=1, bits=10)
    pwm.write(period=0, duties=[1023])
    with pytest.raises(RuntimeError, match="overflows"):
        pwm.write(period=1, duties=[1024])
    with pytest.raises(RuntimeError, match="2 channels"):
        pwm.write(period=2, duties=[0, 0])
    with pytest.raises(ValueError, match="channels"):
        _emulator.Pwm(channels=100, bits=10)


@pytest.mark.parametrize(
    ("name", "value"),
    [("table_sectors", 0), ("erase_us", -1.0), ("jitter_us", 1e9), ("panel", "ouija")],
)
def test_impossible_hardware_is_refused(name: str, value: object) -> None:
    def build() -> None:
        hardware = _emulator.Hardware()
        setattr(hardware, name, value)
        _emulator.Emulator(hardware)

    with pytest.raises(ValueError, match=r"sectors|times|panel"):
        build()
