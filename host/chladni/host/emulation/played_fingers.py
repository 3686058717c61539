"""What a device's pins play for several fingers: each one's drive, all of them down at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.scoring.several_fingers.fingers_play import FingersPlay, fingers_play
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import LEVEL, Emulator, TouchEvent
from chladni.host.protocol.board_config import coil_gains
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.errors import ChladniError
from chladni.sim.image.finger import PRESS
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STEP_HZ = 24.0
"""Between two voices, which tells them apart. All lie within 48 Hz of the table's frequency."""
SETTLED_MS = 60.0
"""A panel's report, all slices of the drives' solver, the ramp."""
MEASURED_MS, TOLD_APART_HZ = 250.0, 16.0
"""The window's main lobe is so wide to either side."""


@dataclass(frozen=True)
class FingerVoice:
    """A finger that is put down, and what it plays.

    Attributes
    ----------
    place_mm
        Millimetres from the board's centre.
    frequency_hz
        Of its signal. Two of them are told apart from 16 Hz on.
    level
        Of the configured level, 0 to 1; at 0 it feels, and is silent.
    """

    place_mm: tuple[float, float]
    frequency_hz: float
    level: float = 1.0


@dataclass(frozen=True)
class PlayedVoices:
    """What the pins play for several fingers.

    Attributes
    ----------
    drives
        complex128, shape (fingers, actuators), in units of a duty of 1; each with a common phase of
        its own.
    of_loudest
        Each finger's own signal by its drive, over that by the loudest drive for its place, as the
        device reckons; 0 where it plays the table's own drive, or is silent; shape (fingers,).
    state
        Of the firmware's states, at the end.
    """

    drives: ComplexArray
    of_loudest: FloatArray
    state: str


def played_voices(
    table: Table, board: Board, voices: Sequence[FingerVoice], *, frequency_hz: float | None = None
) -> PlayedVoices:
    """What the pins play once fingers have come down, all at once, on a device powered on for them.

    Parameters
    ----------
    table
        With responses.
    voices
        One a finger. Their drives are told apart by their frequencies.
    frequency_hz
        Of the table's responses; the first by default.

    Raises
    ------
    InputError
        The panel does not reach there.
    ChladniError
        The device did not hear all fingers.
    """
    emulator = Emulator(board, table, level=LEVEL, frequency_hz=frequency_hz)
    for finger, voice in enumerate(voices):
        level_q15 = round(voice.level * 32767.0)
        emulator.core.set_voice(finger, round(voice.frequency_hz * 1e3), level_q15)
        emulator.touch(TouchEvent(1.0, voice.place_mm, finger))
    emulator.run(SETTLED_MS)
    touches = emulator.core.touches()
    if sum(one[0] for one in touches) != len(voices):
        raise ChladniError(
            "the emulated panel lost a finger",
            hint="fingers lie 12 mm apart or more, and some panels have two at most",
        )
    recording = emulator.run(MEASURED_MS)
    play = Play(0, len(recording.duty_steps))
    circuit = circuit_of(board)
    found = [phasors(recording, play, own.frequency_hz, circuit) for own in voices]
    return PlayedVoices(
        drives=np.asarray(np.stack(found) / np.array(coil_gains(board))),
        of_loudest=np.array([one[4] for one in touches[: len(voices)]]) / 1e3,
        state=emulator.core.state,
    )


def tones_near(middle_hz: float, count: int) -> list[float]:
    """Frequencies for so many fingers that the pins tell apart."""
    return [middle_hz + STEP_HZ * (k - count // 2) for k in range(count)]


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
    voices = [
        FingerVoice((x / MM, y / MM), own)
        for (x, y), own in zip(places.tolist(), tones_near(middle, len(places)), strict=True)
    ]
    return played_voices(table, board, voices, frequency_hz=frequency_hz).drives


def play_fingers(
    table: Table, board: Board, places_mm: Sequence[tuple[float, float]], newtons: float = PRESS
) -> FingersPlay:
    """Put fingers on a board whose table has responses, and look at what its pins make.

    Parameters
    ----------
    places_mm
        Middles of the fingertips, two to five.
    newtons
        How hard each presses.

    Raises
    ------
    ChladniError
        As of `played_finger_drives`.
    """
    places = np.array(places_mm) * MM
    return fingers_play(board, places, played_finger_drives(table, board, places), newtons)
