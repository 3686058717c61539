"""The most that a board's coils can be given: duty, supply and heat, as the firmware keeps them.

A duty d is bias + amplitude · sin. A switch's bias is the amplitude and a rest for rounding and for
the shortest pulse. A bridge has no bias: its d has either sign. A coil's current is d V/R, where R
has a bridge's two transistors in it, and the supply feeds it only during pulses: it delivers
d² V/R. What a bridge loses of each pulse (`lost_ns`) is left out: 0.4 % of a full amplitude.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import CLOCK_HZ, Coil, Electronics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ROUNDING_STEPS = 2
"""Duty steps below a wave, and as many above, by which error feedback may round. The firmware
counts an amplitude a step larger than it is."""
SPAN_MARGIN_STEPS = 3
"""What an amplitude of full scale lacks of half the carrier period, with bridges of all of it."""
SUPPLY_WINDOW_S = 0.064
"""A supply's limit holds for the mean over any time so long (core/synthesis/output_limits.hpp)."""
SUPPLY_RECKONED = 31.0 / 32.0
"""Of the limit, against which waves are reckoned: the rest is for what no one knows beforehand."""


@dataclass(frozen=True)
class FullDrive:
    """A drive at the most its loudest coil may be given in a touch without end.

    Attributes
    ----------
    duties
        Amplitude of every coil's duty, shape (actuators,): 0 to 0.5, with bridges to 1.
    limited_by
        What keeps them there: "duty", "supply" or "heat".
    volts, amperes
        Peak of the sine of the coil with the largest, bias aside.
    newtons
        Peak of the largest force that is asked for, if its coil were held still.
    bias
        Mean duty of every coil, shape (actuators,); 0 with bridges.
    bias_newtons
        Steady force of every coil, shape (actuators,), N.
    """

    duties: FloatArray
    limited_by: str
    volts: float
    amperes: float
    newtons: float
    bias: FloatArray
    bias_newtons: FloatArray


def lowest_duty(shortest_on_ns: float, pwm_bits: int) -> float:
    """Of a wave as the firmware plays it, whose shortest pulse is given."""
    return float((ROUNDING_STEPS + np.ceil(shortest_on_ns * 1e-9 * CLOCK_HZ)) / 2**pwm_bits)


def least_duty(board: Board) -> float:
    """The lowest duty of a board's waves; 0 with bridges, whose waves pass through it."""
    if board.electronics.is_bridge:
        return 0.0
    return lowest_duty(board.electronics.shortest_on_ns, board.electronics.pwm_bits)


def full_drive(board: Board, drive: ComplexArray, frequency_hz: float) -> FullDrive | None:
    """The most of a drive that continuous touch allows.

    None where the board file has no coil, or the drive is silent. A coil that is weak by its
    `trim_db` gets more than the others, which lowers what all can do.

    Parameters
    ----------
    drive
        Forces that are asked for: complex128, shape (actuators,), any scale.
    """
    coil, own = board.coil, board.electronics
    sizes = np.abs(drive)
    if coil is None or not sizes.max() > 0.0:
        return None
    shares = sizes / sizes.max() * coil_shares(board)
    plays = shares > 0.0
    swing = _Swing(biased=not own.is_bridge, rest=least_duty(board))
    limits = {
        "duty": _by_duty(own, swing.rest),
        "supply": _by_supply(
            SUPPLY_RECKONED * own.supply_limit_ma * 1e-3 / own.full_current_a,
            shares[plays],
            swing,
            frequency_hz,
        ),
        "heat": swing.by_heat(own.coil_limit_k / own.coil_k_per_w / own.full_heat_w)
        / float(shares.max()),
    }
    limited_by = min(limits, key=lambda name: limits[name])
    full = max(0.0, float(limits[limited_by]))
    ohm = coil.resistance + own.driver_ohm
    duties = full * shares
    bias = np.where(plays, swing.bias(duties), 0.0) if full > 0.0 else np.zeros(shares.shape)
    steady = coil.force_factor * own.supply_v / ohm
    return FullDrive(
        duties=duties,
        limited_by=limited_by,
        volts=float(duties.max()) * own.supply_v,
        amperes=float(duties.max()) * _amperes_per_duty(board, coil, frequency_hz),
        newtons=newtons_of(board, full, frequency_hz),
        bias=bias,
        bias_newtons=steady * bias * np.abs(strengths(board)),
    )


def newtons_of(board: Board, duty: float, frequency_hz: float) -> float:
    """Peak force of a coil that is asked for a sine of this duty and held still, N.

    What each coil gets of it makes up for polarity and trim.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    coil = board.known_coil
    amperes = duty * _amperes_per_duty(board, coil, frequency_hz)
    return coil.force_factor * amperes * weakest(board)


def _amperes_per_duty(board: Board, coil: Coil, frequency_hz: float) -> float:
    ohm = coil.resistance + board.electronics.driver_ohm
    return float(
        board.electronics.supply_v / abs(ohm + 2j * np.pi * frequency_hz * coil.inductance)
    )


def coil_shares(board: Board) -> FloatArray:
    """Of a full drive, that each coil gets where all are to do alike, (actuators,); 1 at most."""
    return weakest(board) / np.abs(strengths(board))


def untrimmed(board: Board) -> Board:
    """The board with coils as strong as drawn, which tables are for: devices make up for trims."""
    return replace(board, actuators=tuple(replace(own, trim_db=0.0) for own in board.actuators))


def full_newtons(board: Board, frequency_hz: float) -> float | None:
    """Peak that each coil can push while all of them work alike, N; None without a coil."""
    alike = np.ones(len(board.actuators), dtype=np.complex128)
    full = full_drive(untrimmed(board), alike, frequency_hz)
    return None if full is None else full.newtons


def weakest(board: Board) -> float:
    """What the weakest coil does of what it is drawn with: no coil can do more than all."""
    return float(np.abs(strengths(board)).min(initial=1.0))


def strengths(board: Board) -> FloatArray:
    """Force of each coil per newton that it is driven with, by its file, (actuators,)."""
    return np.array([own.strength for own in board.actuators])


@dataclass(frozen=True)
class _Swing:
    """What a coil's duty swings about: its amplitude and a rest, or with bridges nothing."""

    biased: bool
    rest: float

    def bias(self, amplitude: FloatArray) -> FloatArray:
        return amplitude * self.biased + self.rest

    def by_heat(self, most: float) -> float:
        """The amplitude a of which the mean square (b a + r)² + a²/2 of the duty is `most`.

        b is 1 with a bias and 0 without.
        """
        return _root(self.biased + 0.5, 2.0 * self.biased * self.rest, most - self.rest**2)


def _by_duty(own: Electronics, rest: float) -> float:
    """The amplitude of which the crest, rounded up, just keeps `max_duty`."""
    steps = 1 << own.pwm_bits
    crest = own.max_duty - ROUNDING_STEPS / steps
    if own.is_bridge:
        return min(1.0 - SPAN_MARGIN_STEPS / steps, crest - 1.0 / steps)
    return min(0.5 - SPAN_MARGIN_STEPS / steps, (crest - rest) / 2.0 - 1.0 / steps)


def _by_supply(most: float, shares: FloatArray, swing: _Swing, frequency_hz: float) -> float:
    """The amplitude a of the loudest coil at which no window's Σ d² is above `most`.

    Of coil k with its amplitude a_k = a s_k and bias b a_k + r, b being 1 with a bias and 0
    without, the mean of d² is (b a_k + r)² + a_k²/2. A window may have more of the crest than of
    the trough, by half a period's area: of the wave 1/π of a period, of its square about the mean
    1/(4 π). The firmware allows for that twice, where one touch follows another. Below some hertz a
    window sees nothing but the crest, ((1 + b) a_k + r)².
    """
    periods = 2.0 / (frequency_hz * SUPPLY_WINDOW_S)
    squares, sums = float((shares**2).sum()), float(shares.sum())
    biased, rest = float(swing.biased), swing.rest
    rests, crest = rest**2 * shares.size, 1.0 + biased
    swinging = _root(
        squares * (biased + 0.5 + periods * (8.0 * biased + 1.0) / (4.0 * np.pi)),
        sums * rest * (2.0 * biased + 2.0 * periods / np.pi),
        most - rests,
    )
    return max(swinging, _root(crest**2 * squares, 2.0 * crest * sums * rest, most - rests))


def _root(square: float, linear: float, room: float) -> float:
    """The positive x at which square x² + linear x = room; 0 if there is no room."""
    if room <= 0.0:
        return 0.0
    return float((np.sqrt(linear**2 + 4.0 * square * room) - linear) / (2.0 * square))
