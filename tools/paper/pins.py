"""What the emulated firmware's pins make of a drive that a host asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.demodulate import Play, drive_phasors
from chladni.host.emulation.emulator import Emulator, Recording
from chladni.sim.board.board import Board

ComplexArray = NDArray[np.complex128]

REPEAT_MS = 25.0
"""A live drive is to be repeated within the board's touch timeout, 100 ms."""
SETTLED_MS = 50.0
"""After the ramp of 4 ms, and until the error feedback has forgotten it."""
LEAST_MS = 100.0
"""Sixteen waves."""


@dataclass(frozen=True)
class Played:
    """A drive that plays steadily.

    Attributes
    ----------
    recording
        Of the pins, from the settled drive on.
    gains
        Amplitude and phase of every channel, 1 for full amplitude, shape (actuators,).
    supply_ma
        Mean current of all coils that the device reports.
    """

    recording: Recording
    gains: ComplexArray
    supply_ma: float

    @property
    def whole(self) -> Play:
        """All that was recorded."""
        return Play(0, self.recording.duty_steps.shape[0])


def play(board: Board, gains: ComplexArray, milliseconds: float = LEAST_MS) -> Played:
    """Power a device on, ask for a drive, and record it once it is steady."""
    frequency = board.drive.frequency_hz
    emulator = Emulator(board, None, must_play=False, level=1.0)
    device = Device(EmulatorWire(emulator))
    asked = [complex(gain) for gain in gains]

    def run(until_ms: float) -> Recording:
        pieces = []
        begun = emulator.core.now_us
        while emulator.core.now_us - begun < until_ms * 1e3:
            device.live(asked, frequency)
            pieces.append(emulator.run(REPEAT_MS))
        steps = np.concatenate([piece.duty_steps for piece in pieces])
        return Recording(steps, pieces[0].carrier_hz, pieces[0].pwm_bits)

    run(SETTLED_MS)
    recording = run(milliseconds)
    whole = Play(0, recording.duty_steps.shape[0])
    made = drive_phasors(recording, whole, frequency, level=1.0)
    return Played(recording, made, float(device.info()["supply_ma"]))
