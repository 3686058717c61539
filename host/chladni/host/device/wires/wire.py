"""Wires, which carry bytes to a device and back: a serial port, and the emulated device."""

from __future__ import annotations

import time
from typing import Protocol

import serial

from chladni.host.emulation.emulator import Emulator
from chladni.sim.errors import ArgumentError, ChladniError

BAUD = 115_200
STEP_MS = 0.25
"""An emulated device runs so long before its wire is looked at again."""


USB_VENDORS = {0x10C4, 0x1A86, 0x0403, 0x303A}
"""Of bridges that boards have: Silicon Labs, WCH, FTDI, Espressif. Nothing is said to other
measuring devices."""


class WireError(ChladniError):
    """The port could not be opened, or went away."""


class Wire(Protocol):
    """Bytes to a device and back, and the time that its answers are waited for in."""

    @property
    def baud(self) -> float:
        """Bits per second."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def read(self, timeout_s: float) -> bytes:
        """What has come; waits for it at most so long."""

    def now_s(self) -> float:
        """Seconds on the clock that timeouts are counted on."""

    def close(self) -> None:
        """Let go of it."""


class EmulatorWire:
    """The wire of an emulated device; its clock is the emulator's own."""

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator

    @property
    def baud(self) -> float:
        """The device's own, which changes with its configuration."""
        return self.emulator.core.baud

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.emulator.core.uart_write(data)

    def read(self, timeout_s: float) -> bytes:
        """What has come; the emulator runs on until there is something."""
        end = self.now_s() + timeout_s
        while True:
            data = self.emulator.core.uart_read()
            if data or self.now_s() >= end:
                return data
            self.emulator.core.run_us(round(STEP_MS * 1e3))

    def now_s(self) -> float:
        """Virtual seconds."""
        return self.emulator.core.now_us / 1e6

    def close(self) -> None:
        """Nothing to let go of."""


class SerialWire:
    """A serial port, or a pseudo-terminal.

    Raises
    ------
    WireError
        There is no such port, it is busy, or one may not open it.
    """

    def __init__(self, port: str, *, baud: int = BAUD) -> None:
        self.baud: float = float(baud)
        try:
            # Neither line may pull a board into its boot loader, and no one else may listen in.
            self.serial = serial.Serial(exclusive=True)
            self.serial.port, self.serial.baudrate, self.serial.timeout = port, baud, 0
            self.serial.dtr = self.serial.rts = False
            self.serial.open()
        except (serial.SerialException, OSError) as error:
            raise _wire_error(port, error) from None
        except ValueError as error:
            raise ArgumentError("baud", baud, "a rate that the port can do") from error

    @classmethod
    def of(cls, opened: serial.Serial) -> SerialWire:
        """The wire of a port that somebody else has opened and will close."""
        wire = cls.__new__(cls)
        wire.serial, wire.baud = opened, float(opened.baudrate)
        return wire

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self.serial.write(data)
        except (serial.SerialException, OSError) as error:
            raise _wire_error(self.serial.port, error) from None

    def read(self, timeout_s: float) -> bytes:
        """What has come."""
        try:
            self.serial.timeout = max(timeout_s, 0.0)
            first = self.serial.read(1)
            return bytes(first + self.serial.read(self.serial.in_waiting)) if first else b""
        except (serial.SerialException, OSError, TypeError) as error:
            raise _wire_error(self.serial.port, error) from None

    def now_s(self) -> float:
        """Seconds of this machine."""
        return time.monotonic()

    def close(self) -> None:
        """Close the port."""
        self.serial.close()


def _wire_error(port: str | None, error: Exception) -> WireError:
    """With what a user can do about it."""
    text = str(error)
    number = getattr(error, "errno", None)
    for code, word, why, hint in (
        (2, "No such file", "no such port", "chladni device list shows the ports there are"),
        (13, "Permission denied", "no permission", "on Linux join the group that owns the port"),
        (16, "busy", "busy: another program has it", "close that program"),
        (11, "exclusively lock", "busy: another program has it", "close that program"),
    ):
        if number == code or word in text:
            return WireError(f"{port}: {why}", hint=hint)
    return WireError(f"{port}: {text or 'the device is gone'}", hint="plug it in again")
