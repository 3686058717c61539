"""The most that a board's coils can be given: duty, supply and heat, as the firmware keeps them.

A duty d is bias + amplitude · sin, the bias being the amplitude and a rest for rounding and for the
shortest pulse. A coil's current is d V/R, and the supply feeds it only while its switch is on: it
delivers d² V/R.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import CLOCK_HZ

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ROUNDING_STEPS = 2
"""Duty steps below a wave, and as many above, by which error feedback may round. The firmware
counts an amplitude a step larger than it is."""
SPAN_MARGIN_STEPS = 3
"""What an amplitude of full scale lacks of half the carrier period."""
SUPPLY_WINDOW_S = 0.064
"""A supply's limit holds for the mean over any time so long (core/synthesis/output_limits.hpp)."""
SUPPLY_RECKONED = 31.0 / 32.0
"""Of the limit, against which waves are reckoned: the rest is for what no one knows beforehand."""


@dataclass(frozen=True)
class FullDrive:
    """A drive at the most its loudest coil may be given in a touch without end.

    Attributes
    ----------
    duty
        Amplitude of that coil's duty, 0 to 0.5.
    limited_by
        What keeps it there: "duty", "supply" or "heat".
    volts, amperes
        Peak of that coil's sine, bias aside.
    newtons
        Peak of its force if it were held still.
    bias
        Mean duty of every coil, shape (actuators,).
    bias_newtons
        Steady force of every coil, shape (actuators,), N.
    """

    duty: float
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
    """The lowest duty of a board's waves."""
    return lowest_duty(board.electronics.shortest_on_ns, board.electronics.pwm_bits)


def full_drive(board: Board, drive: ComplexArray, frequency_hz: float) -> FullDrive | None:
    """The most of a drive that continuous touch allows.

    None where the board file has no coil, or the drive is silent.

    Parameters
    ----------
    drive
        complex128, shape (actuators,), any scale.
    """
    coil, own = board.coil, board.electronics
    sizes = np.abs(drive)
    if coil is None or not sizes.max() > 0.0:
        return None
    shares = sizes / sizes.max()
    steps = 2**own.pwm_bits
    rest = least_duty(board)
    plays = shares > 0.0
    full_current = own.supply_v / own.coil_ohm
    limits = {
        "duty": min(
            0.5 - SPAN_MARGIN_STEPS / steps,
            (own.max_duty - rest - ROUNDING_STEPS / steps) / 2.0 - 1.0 / steps,
        ),
        "supply": _by_supply(
            SUPPLY_RECKONED * own.supply_limit_ma * 1e-3 / full_current,
            shares[plays],
            rest,
            frequency_hz,
        ),
        "heat": _by_heat(own.coil_limit_k / own.coil_k_per_w, own.supply_v**2 / own.coil_ohm, rest),
    }
    limited_by = min(limits, key=lambda name: limits[name])
    duty = max(0.0, float(limits[limited_by]))
    volts = duty * own.supply_v
    omega = 2.0 * np.pi * frequency_hz
    amperes = volts / abs(coil.resistance + 1j * omega * coil.inductance)
    bias = np.where(plays, duty * shares + rest, 0.0) if duty > 0.0 else np.zeros(shares.shape)
    steady = coil.force_factor * own.supply_v / coil.resistance
    return FullDrive(
        duty=duty,
        limited_by=limited_by,
        volts=volts,
        amperes=float(amperes),
        newtons=float(coil.force_factor * amperes),
        bias=bias,
        bias_newtons=steady * bias,
    )


def _by_supply(most: float, shares: FloatArray, rest: float, frequency_hz: float) -> float:
    """The amplitude a of the loudest coil at which no window's Σ d² is above `most`.

    Of coil k with its amplitude a_k = a s_k and bias a_k + r the mean of d² is
    (a_k + r)² + a_k²/2. A window may have more of the crest than of the trough, by half a period's
    area: of the wave 1/π of a period, of its square about the mean 1/(4 π). The firmware allows for
    that twice, where one touch follows another. Below some hertz a window sees nothing but the
    crest, (2 a_k + r)².
    """
    periods = 2.0 / (frequency_hz * SUPPLY_WINDOW_S)
    squares, sums = float((shares**2).sum()), float(shares.sum())
    rests = rest**2 * shares.size
    swinging = _root(
        squares * (1.5 + periods * 9.0 / (4.0 * np.pi)),
        sums * rest * (2.0 + 2.0 * periods / np.pi),
        most - rests,
    )
    return max(swinging, _root(4.0 * squares, 4.0 * sums * rest, most - rests))


def _root(square: float, linear: float, room: float) -> float:
    """The positive x at which square x² + linear x = room; 0 if there is no room."""
    if room <= 0.0:
        return 0.0
    return float((np.sqrt(linear**2 + 4.0 * square * room) - linear) / (2.0 * square))


def _by_heat(watts: float, full_watts: float, rest: float) -> float:
    """The amplitude a of which the mean square (a + r)² + a²/2 of the duty heats no more."""
    # 1.5 a² + 2 r a + r² = share
    share = watts / full_watts
    inner = rest**2 - 1.5 * (rest**2 - share)
    return float((np.sqrt(inner) - rest) / 1.5) if inner > rest**2 else 0.0
