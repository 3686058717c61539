"""What a device's pins play for several fingers: each one's drive, all of them down at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import LEVEL, Emulator, TouchEvent
from chladni.host.protocol.board_config import coil_gains
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.errors import ChladniError
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STEP_HZ = 24.0
"""Between two voices, which tells them apart. All lie within 48 Hz of the table's frequency."""
SETTLED_MS = 60.0
"""A panel's report, all slices of the drives' solver, the ramp."""
MEASURED_MS = 250.0
"""The window's main lobe is 16 Hz wide to either side."""


def played_finger_drives(
    table: Table, board: Board, places: FloatArray, *, frequency_hz: float | None = None
) -> ComplexArray:
    """The drive that each finger gets from the pins, as the coils have it.

    A device is powered on, its coils cold, and all fingers come down at once. Each has a frequency
    of its own near the table's, by which its part of the currents is told apart; what a flyback
    diode keeps from following the pins is in them, and so is the panel's rounding of places.

    Parameters
    ----------
    table
        With responses.
    places
        Middles of the fingertips, m, shape (fingers, 2).
    frequency_hz
        Of the table's responses; the first by default.

    Returns
    -------
    complex128, shape (fingers, actuators), in units of a duty of 1; each with a common phase of its
    own.

    Raises
    ------
    ChladniError
        The device did not hear all fingers.
    """
    middle = table.responses_section(frequency_hz).frequency_hz
    emulator = Emulator(board, table, level=LEVEL, frequency_hz=frequency_hz)
    hertz = [middle + STEP_HZ * (k - len(places) // 2) for k in range(len(places))]
    for finger, ((x, y), own) in enumerate(zip(places.tolist(), hertz, strict=True)):
        emulator.core.set_voice(finger, round(own * 1e3), 32767)
        emulator.touch(TouchEvent(1.0, (x / MM, y / MM), finger))
    emulator.run(SETTLED_MS)
    if sum(one[0] for one in emulator.core.touches()) != len(places):
        raise ChladniError("the emulated panel lost a finger")
    recording = emulator.run(MEASURED_MS)
    play = Play(0, len(recording.duty_steps))
    found = [phasors(recording, play, own, circuit_of(board)) for own in hertz]
    return np.asarray(np.stack(found) / np.array(coil_gains(board)))
