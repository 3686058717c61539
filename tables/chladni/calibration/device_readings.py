"""From what a device's converter read to what coils induce in each other.

The device tells sines in the converter's steps, by the phase of the playing coil's duty. Between
that duty and the value lie a sample that is held, the coil's current, plate and flux, the
amplifier, the converter and when it began. All but current, plate and flux a reference goes through
as well, which is a known share of the first coil's own voltage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.sensing import (
    FLUX_MULTIPLES,
    MULTIPLES,
    UNIT_HZ,
    CoilReadings,
    ReadAt,
)
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

REFERENCE, REFERENCE_SHARE = 16, 1.0 / 2001.0
"""Listened to as a coil of that number: so much of the first coil's own voltage, by two resistors
(docs/hardware.md). Of a bridge it is twice as much of half of each wave, 1/2002."""
CLEAR = 6.0
"""Deviations of noise from which something was read."""


@dataclass(frozen=True)
class Heard:
    """What one coil read while another played.

    Attributes
    ----------
    playing, listening
        Channels; `REFERENCE` for that.
    multiple
        Of `UNIT_HZ`, that was played.
    duty
        Amplitude.
    steps
        Amplitude in the converter's steps, by the phase of the duty.
    noise
        Standard deviation of a pair's mean, steps, whatever is no sine of that frequency.
    values
        Pairs of conversions, of which `steps` is the mean product.
    session
        Of the converter, which began once in it.
    """

    playing: int
    listening: int
    multiple: int
    duty: float
    steps: complex
    noise: float
    values: int
    session: int

    @property
    def spread(self) -> float:
        """Standard deviation of the real and the imaginary part of `steps`."""
        return float(self.noise * np.sqrt(2.0 / self.values))


def without_reference(heard: Sequence[Heard]) -> list[tuple[int, int]]:
    """What was read in a session that has no reference at its frequency: (playing, multiple)."""
    known = {(one.session, one.multiple) for one in heard if one.listening == REFERENCE}
    lacking = [one for one in heard if (one.session, one.multiple) not in known]
    return list(dict.fromkeys((one.playing, one.multiple) for one in lacking))


def readings_of(board: Board, heard: Sequence[Heard], seconds: float) -> CoilReadings:
    """What coils induce in each other, each by the reference of its own session.

    What a coil read of another one twice counts as it was read last.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    InputError
        Something was not read, or a session's reference is silent.
    """
    flux, *moved = (_read_at(board, heard, own) for own in (flux_multiple(board), *MULTIPLES))
    return CoilReadings.of(moved, flux, seconds)


def _read_at(board: Board, heard: Sequence[Heard], multiple: int) -> ReadAt:
    """Of all pairs."""
    count, hz = len(board.actuators), multiple * UNIT_HZ
    own = [one for one in heard if one.multiple == multiple]
    pairs = {(one.listening, one.playing): one for one in own}
    by_session = {
        session: _per_ampere(board, [one for one in own if one.session == session], hz)
        for session in {one.session for one in own}
    }
    volts = np.zeros((count, count), np.complex128)
    spread, duties, sessions = np.ones((count, count)), np.zeros(count), np.zeros(count)
    for listening, playing in np.argwhere(~np.eye(count, dtype=bool)).tolist():
        one = pairs.get((listening, playing))
        if one is None:
            expected = "a reading of every pair of coils"
            names = [own.name for own in board.actuators]
            given = f"none of {names[listening]} by {names[playing]}, {hz:.0f} Hz"
            raise InputError("readings", given, expected)
        per_ampere = by_session[one.session]
        volts[listening, playing] = one.steps / one.duty / per_ampere
        spread[listening, playing] = one.spread / one.duty / abs(per_ampere)
        duties[playing], sessions[playing] = one.duty, one.session
    return ReadAt(hz, volts, spread, duties, sessions)


def _per_ampere(board: Board, own: Sequence[Heard], hz: float) -> complex:
    """Steps that an ampere in a coil makes, of what was read in one session at one frequency."""
    reference = _reference(board, own, hz)
    # What a volt at a coil makes the device read, its phase and the late converter's with it.
    driver = board.electronics.driver_ohm
    across = duty_volts(board) * (1.0 - driver / coil_impedance(board, hz))
    per_volt = reference.steps / reference.duty / (REFERENCE_SHARE * across)
    return complex(per_volt * (duty_volts(board) / coil_impedance(board, hz)))


def _reference(board: Board, own: Sequence[Heard], hz: float) -> Heard:
    """Of what was read at one frequency.

    Raises
    ------
    InputError
        It is silent; says whether everything else is, too.
    """
    reference = next((one for one in own if one.listening == REFERENCE), None)
    if reference is not None and _is_clear(reference):
        return reference
    first = board.actuators[0].name
    if any(_is_clear(one) for one in own):
        hint = f"look at the resistors from {first} to the CD74HCT4053, and at {first}'s driver"
        given, expected = f"no reference at {hz:.0f} Hz", f"a share of {first}'s voltage"
        raise InputError("readings", given, expected, hint=hint)
    hint = (
        "look at the wire from the amplifier's output to the sensing pin, "
        "at the multiplexer's output and at the coils' supply"
    )
    raise InputError("readings", f"noise alone at {hz:.0f} Hz", "voltages of coils", hint=hint)


def _is_clear(one: Heard) -> bool:
    return abs(one.steps) >= CLEAR * one.spread


def flux_multiple(board: Board) -> int:
    """At which flux is read: below half the rate of samples, which a finer carrier lowers."""
    return FLUX_MULTIPLES[board.electronics.pwm_bits]


def duty_volts(board: Board) -> float:
    """What a duty of 1 changes a coil's mean voltage by: a diode's, too, where a switch is off."""
    own = board.electronics
    return own.supply_v if own.is_bridge else own.supply_v + own.diode_v


def coil_impedance(board: Board, hz: float | FloatArray) -> ComplexArray:
    """Of a coil that does not move, and its driver, Ω.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    coil = board.known_coil
    ohms = coil.resistance + board.electronics.driver_ohm
    return np.asarray(ohms + 2j * np.pi * np.asarray(hz) * coil.inductance)
