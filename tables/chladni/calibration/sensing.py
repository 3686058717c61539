"""What a device reads of its own coils: one plays, the others are listened to in turn.

A model of the whole way from the plate to numbers: coils and flux (`sim/fields/induced.py`), the
resistance that each coil really has, an amplifier and a 12-bit converter with noise and a bend,
sampled in step with the carrier, and a lock-in over whole periods. It is read once more at some
kilohertz, where the sheet's mass keeps it still and flux is most of it (`flux.py`).

It leaves out the settling of the multiplexer's input and the carrier's own residue: both are over
before a period is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.errors import MissingError, ToleranceError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import induced_voltages, open_coils, shared_inductances

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAMPLE_HZ = 80e6 / 4096.0
"""Every fourth carrier period, as the firmware makes its own samples."""
BASE_SAMPLES = 488
"""25 ms: two periods of the lowest frequency. All frequencies are multiples of its inverse."""
UNIT_HZ = SAMPLE_HZ / BASE_SAMPLES
"""Of which all frequencies are multiples, 40 Hz."""
MULTIPLES, FLUX_MULTIPLE = (2, 4, 6), 190
"""80, 160 and 240 Hz, and 7.6 kHz."""
FLUX_MULTIPLES = {10: FLUX_MULTIPLE, 11: 100, 12: 50}
"""By the carrier's bits: 7.6, 4 and 2 kHz, which samples of 19.5, 9.8 and 4.9 kHz can make."""
MOST_SECONDS, FEW_COILS = (10.0, 30.0), 8
"""A reading lasts so long at most, on boards of so few coils and on larger ones."""
SETTLE = 5e-3
"""s from one coil or frequency to the next, before a reading begins."""
LEVEL = 0.8
"""Of the current that a coil's supply allows around a bias of the same size."""
AMPLIFIER = 187.0
GAIN_ERROR, FLUX_ERROR = 0.01, 0.01
"""Of the amplifier (common to all coils), and of the flux at 7.6 kHz against that at 160 Hz."""
CONVERTER_V, CONVERTER_STEPS = 3.1, 4096
REACH_V, FULL_SCALE = 1.1, 0.95
"""About the amplifier's middle of 1.3 V, where an ESP32's converter is straight; and how much of
that a sine may take."""
CONVERTER_NOISE, CONVERTER_BEND = 4.0, 4.0
"""Steps, RMS and at most, within that reach."""


@dataclass(frozen=True)
class ReadAt:
    """What coils read at one frequency.

    Attributes
    ----------
    hz
        Frequency.
    volts
        Per ampere that was meant, (listening, playing).
    spread
        One standard deviation of its real and imaginary parts, by the converter's noise.
    """

    hz: float
    volts: ComplexArray
    spread: FloatArray


@dataclass(frozen=True)
class CoilReadings:
    """What coils read of each other, by motion and flux together.

    Attributes
    ----------
    frequencies_hz
        Shape (frequencies,).
    volts
        Per ampere that was meant, (frequencies, listening, playing), 0 on the diagonals.
    noise
        One standard deviation of its real and imaginary parts, the same shape.
    high
        At 7.6 kHz, where flux is most of it.
    seconds
        That the device took.
    """

    frequencies_hz: FloatArray
    volts: ComplexArray
    noise: FloatArray
    high: ReadAt
    seconds: float

    @classmethod
    def of(cls, low: Sequence[ReadAt], high: ReadAt, seconds: float) -> CoilReadings:
        """Of what was read at each frequency."""
        return cls(
            np.array([own.hz for own in low]),
            np.array([own.volts for own in low]),
            np.array([own.spread for own in low]),
            high,
            seconds,
        )


def reading_frequencies() -> FloatArray:
    """At which coils are read, Hz."""
    return np.asarray(np.array(MULTIPLES) * UNIT_HZ)


def periods_of(board: Board) -> int:
    """How often 25 ms are read for every pair of coils and frequency, within the time allowed."""
    count = len(board.actuators)
    readings = count * (count - 1) * (len(MULTIPLES) + 1)
    most = MOST_SECONDS[count > FEW_COILS]
    each = most / max(readings, 1) - SETTLE
    return max(1, int(each * UNIT_HZ))


def meant_current(board: Board) -> float:
    """Peak of the sine that the playing coil is given, A.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    if board.coil is None:
        raise MissingError("[coil]", "its force factor says what motion induces")
    electronics = board.electronics
    half = 1.0 if electronics.is_bridge else 2.0
    return LEVEL * electronics.supply_v / electronics.coil_ohm / half


def read_hidden(hidden: HiddenPlate, seed: int = 0) -> CoilReadings:
    """What a device reads of its coils on a plate that only it knows, without its firmware.

    `host/emulation/sensed_plate.py` has the same plate read by the firmware.
    """
    board = hidden.board
    rng = np.random.default_rng((hidden.seed, seed, 44))
    current, gain = meant_current(board), 1.0 + GAIN_ERROR * rng.standard_normal()
    # What flows is less where there is more resistance; coils pull and listen by their strength.
    flows = current / hidden.ohms
    periods = periods_of(board)
    unlike = 1.0 + FLUX_ERROR * rng.uniform(-1.0, 1.0)
    turned = turned_inductances(hidden)
    off = ~np.eye(len(turned), dtype=bool)

    def read_at(multiple: int, induced: ComplexArray, inductances: FloatArray) -> ReadAt:
        hz = multiple * UNIT_HZ
        both: ComplexArray = np.asarray(gain * (induced + 2j * np.pi * hz * inductances) * flows)
        share = fitting_share(both)
        read, spread = _lock_in(share * both, multiple, periods, rng)
        return ReadAt(hz, off * read / (share * current), spread / (share * current))

    *low, high = hidden_voltages(hidden, (*MULTIPLES, FLUX_MULTIPLE))
    flux = read_at(FLUX_MULTIPLE, high, unlike * turned)
    moved = [read_at(own, induced, turned) for own, induced in zip(MULTIPLES, low, strict=True)]
    count = len(board.actuators)
    each = periods / UNIT_HZ + SETTLE
    return CoilReadings.of(moved, flux, count * (count - 1) * (len(MULTIPLES) + 1) * each)


def hidden_voltages(hidden: HiddenPlate, multiples: Sequence[int]) -> ComplexArray:
    """What motion alone induces, V/A, (multiples of 40 Hz, listening, playing)."""
    model = plate_model(hidden.board)
    strength = np.outer(hidden.strengths, hidden.strengths)
    found: list[ComplexArray] = []
    for multiple in multiples:
        frequency = multiple * UNIT_HZ
        try:
            moving = open_coils(hidden.board, frequency, model=model, tolerance=DRAWN_TOLERANCE)
        except ToleranceError:
            if multiple in MULTIPLES:
                raise
            # Of a board with a heavy part on it, that high up: it stands still.
            found.append(np.zeros_like(found[0]))
            continue
        found.append(strength * induced_voltages(hidden.board, moving.compliance, frequency))
    return np.array(found)


def turned_inductances(hidden: HiddenPlate) -> FloatArray:
    """Of every pair of coils as they are connected, H: a dead one has none led to the amplifier."""
    strength = np.outer(hidden.strengths, hidden.strengths)
    return np.asarray(np.sign(strength) * shared_inductances(hidden.board))


def fitting_share(volts: ComplexArray) -> float:
    """Of the current, so that the loudest coil stays within the converter: 1, 1/2, 1/4 and so on.

    A device sees samples at the converter's ends in the first period, and plays again at half as
    much; that period is not counted.
    """
    share, loudest = 1.0, float(np.abs(volts).max(initial=0.0))
    while AMPLIFIER * share * loudest > FULL_SCALE * REACH_V:
        share /= 2.0
    return share


def _lock_in(
    volts: ComplexArray, multiple: int, periods: int, rng: np.random.Generator
) -> tuple[ComplexArray, FloatArray]:
    """Sines of these amplitudes as amplifier, converter and lock-in read them, and their spread."""
    samples = periods * BASE_SAMPLES
    turns = np.exp(2j * np.pi * multiple * np.arange(samples) / BASE_SAMPLES)
    step = CONVERTER_V / CONVERTER_STEPS
    seen = AMPLIFIER * np.real(volts[..., None] * turns) + CONVERTER_V / 2.0
    place = np.clip(seen / CONVERTER_V, 0.0, 1.0) - 0.5
    # A cubic that leaves both ends and the middle where they are.
    bend = CONVERTER_BEND * step * (4.0 * place**3 - place) / 0.19
    noisy = seen + bend + CONVERTER_NOISE * step * rng.standard_normal(seen.shape)
    taken = np.clip(np.rint(noisy / step), 0, CONVERTER_STEPS - 1) * step
    read = 2.0 * (taken @ turns.conj()) / samples / AMPLIFIER
    spread = CONVERTER_NOISE * step / AMPLIFIER * np.sqrt(2.0 / samples)
    return np.asarray(read), np.full(volts.shape, spread)
