"""The shipped firmware on a virtual clock: flash a table, touch the board, record the pins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.host import _emulator
from chladni.sim.errors import ChladniError, InputError
from chladni.tables.format import pack
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]

TIMER_HZ = 80_000_000
"""Clock of the ESP32's LEDC timers."""
LEVEL = 0.8
"""Share of full amplitude that is played: the rest is headroom."""
PANEL_PERIOD_US = 10_000
"""A phone-size panel reports 100 times a second while touched."""
PARTITION_BYTES = 128 * 1024
"""Size of the `tables` partition (firmware/esp32/chip/partitions.csv)."""


class EmulatorError(ChladniError):
    """The firmware refused the table, or did what the hardware would not forgive."""


@dataclass(frozen=True)
class TouchEvent:
    """A finger at a place (mm from the board's centre) from a time on; None lifts it."""

    at_ms: float
    place_mm: tuple[float, float] | None


@dataclass(frozen=True)
class Recording:
    """What the pins did.

    Attributes
    ----------
    duty_steps
        Latched duties, uint16, one row per carrier period, shape (periods, channels).
    carrier_hz
        Carrier frequency.
    pwm_bits
        A duty of 1 is 2^pwm_bits steps.
    """

    duty_steps: NDArray[np.uint16]
    carrier_hz: float
    pwm_bits: int

    @property
    def duty(self) -> FloatArray:
        """Duties from 0 to 1, shape (periods, channels)."""
        return self.duty_steps / float(1 << self.pwm_bits)

    @property
    def t_s(self) -> FloatArray:
        """Begin of every carrier period, s."""
        return np.arange(self.duty_steps.shape[0]) / self.carrier_hz


class Emulator:
    """An emulated board with a table in flash, powered on.

    Parameters
    ----------
    table
        A table, or the bytes of one (which may be damaged: the device decides).
    channels
        PWM channels of the device; those of the table by default.
    pwm_bits
        10, 11 or 12.
    level
        Share of full amplitude, 0 to 1.
    frequency_hz
        Of the drives to play; those of the table's first section by default.

    Raises
    ------
    EmulatorError
        The device refused the table; says why.
    """

    def __init__(
        self,
        table: Table | bytes,
        *,
        channels: int | None = None,
        pwm_bits: int = 10,
        level: float = LEVEL,
        frequency_hz: float | None = None,
    ) -> None:
        if channels is None:
            if isinstance(table, bytes):
                raise TypeError("channels is needed with the bytes of a table")
            channels = table.actuators
        data = table if isinstance(table, bytes) else pack(table)
        if len(data) > PARTITION_BYTES:
            raise InputError("table", f"{len(data)} bytes", f"at most {PARTITION_BYTES}")
        self.pwm_bits = pwm_bits
        self.carrier_hz = TIMER_HZ / (1 << pwm_bits)
        self.core = _emulator.Emulator(
            channels=channels,
            pwm_bits=pwm_bits,
            level=level,
            panel_period_us=PANEL_PERIOD_US,
            flash_sectors=PARTITION_BYTES // _emulator.SECTOR_BYTES,
        )
        for offset in range(0, len(data), _emulator.SECTOR_BYTES):
            self.core.erase_sector(offset)
        self.core.program(0, data)
        status = self.core.boot()
        if status != "ok":
            raise EmulatorError(f"the device refused the table: {status}")
        if frequency_hz is not None:
            self.core.command(f"frequency {round(frequency_hz * 1000.0)}")
            if self.core.printed[-1] != "ok":
                raise EmulatorError(f"{frequency_hz:g} Hz: {self.core.printed[-1]}")

    def touch(self, event: TouchEvent) -> None:
        """Let a finger arrive, move or leave at a time that has not passed yet."""
        at_us = round(event.at_ms * 1000.0)
        if event.place_mm is None:
            self.core.finger_up(at_us)
        else:
            x, y = event.place_mm
            self.core.finger_down(at_us, round(x * 1000.0), round(y * 1000.0))

    def run(self, milliseconds: float) -> Recording:
        """Advance the clock and return what the pins did meanwhile.

        Raises
        ------
        EmulatorError
            The firmware did something the hardware would not forgive.
        """
        try:
            self.core.run_us(round(milliseconds * 1000.0))
        except RuntimeError as error:
            raise EmulatorError(f"at {self.core.now_us / 1000.0:.3f} ms: {error}") from None
        return Recording(self.core.take_duties(), self.carrier_hz, self.pwm_bits)


def emulate(
    table: Table, touches: Sequence[TouchEvent], milliseconds: float, *, pwm_bits: int = 10,
    level: float = LEVEL, frequency_hz: float | None = None,
) -> Recording:  # fmt: skip
    """Power on with a table, play touches (any order), and record the pins."""
    emulator = Emulator(table, pwm_bits=pwm_bits, level=level, frequency_hz=frequency_hz)
    for event in sorted(touches, key=lambda event: event.at_ms):
        emulator.touch(event)
    return emulator.run(milliseconds)
