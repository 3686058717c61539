"""A fingertip on the board: what it feels, and what it changes by pressing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.fingers import Finger

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

THRESHOLDS = {
    40.0: 4.0, 63.0: 2.5, 80.0: 1.6, 100.0: 1.0, 125.0: 0.64, 160.0: 0.36, 200.0: 0.23, 250.0: 0.16,
    315.0: 0.15, 400.0: 0.20, 500.0: 0.36, 640.0: 0.80, 800.0: 2.3,
}  # fmt: skip
"""Displacement by frequency, µm peak, that is just felt on 1.13 cm², a disc of 6 mm radius.

The curve of R. Verrillo (J. Acoust. Soc. Am. 35, 1963, 1962-1966) and Bolanowski and others (the
same, 84, 1988, 1680-1694) for 2.9 cm² of the thenar eminence within a surround, to ±3 dB from 63 to
400 Hz and ±5 dB beyond. From 63 Hz on 4.1 dB are added for the smaller contact, by Verrillo's 3 dB
per halved area. It is for a finger that rests. One that presses feels weaker vibrations: thresholds
in active touch lie considerably lower and fall with the force (S. Papetti and others, IEEE Trans.
Haptics 10, 2017, 113-122). `PRESSING_DB` is how much lower.
"""
PRESS = 1.0
"""N, with which a finger presses as usual."""
NOTICED_DB = 2.3
"""A difference of level that a fingertip tells, 30 % of amplitude (docs/feel.md)."""
PRESSING_DB = 30.0
"""dB by which a pressing finger's threshold may lie below that of a resting one; 10 at least."""


def threshold_um(frequency_hz: float) -> float | None:
    """Peak displacement that is just felt, µm; None outside 40 to 800 Hz."""
    known, levels = list(THRESHOLDS), list(THRESHOLDS.values())
    if not known[0] <= frequency_hz <= known[-1]:
        return None
    logarithm = np.interp(np.log(frequency_hz), np.log(known), np.log(levels))
    return float(np.exp(logarithm))


def sensation_db(displacement_um: float, frequency_hz: float) -> float | None:
    """Level above that threshold, dB; None outside its range or for no displacement at all."""
    threshold = threshold_um(frequency_hz)
    if threshold is None or displacement_um <= 0.0:
        return None
    return float(20.0 * np.log10(displacement_um / threshold))


def dynamic_stiffness(finger: Finger, frequency_hz: float) -> complex:
    """Force over displacement of a fingertip, k + iωc − ω²m, N/m."""
    omega = 2.0 * np.pi * frequency_hz
    return finger.stiffness + 1j * omega * finger.damping - omega**2 * finger.mass


def fields_under_finger(
    fields: ComplexArray,
    means: ComplexArray,
    answer: ComplexArray,
    own: complex,
    stiffness: complex,
) -> ComplexArray:
    """Fields of a plate on which a finger presses: a rank-one change of those without it.

    It pushes back with Z times the mean displacement w̄ under it, evenly over its contact, so that
    W′ = W − g Z w̄/(1 + Z ḡ).

    Parameters
    ----------
    fields, means
        Fields (…, nx, ny) and their means under the finger (…,), by whatever unit.
    answer, own
        g, what one newton spread over the contact does, (nx, ny) in m/N, and its mean ḡ under the
        finger.
    stiffness
        Z, N/m.
    """
    share = stiffness * means / (1.0 + stiffness * own)
    return np.asarray(fields - share[..., None, None] * answer)


def pressing_stiffness(newtons: float, frequency_hz: float) -> complex:
    """Force over displacement of a fingertip that presses: pulp before a mass, N/m.

    The mass behind the pulp hardly moves at 160 Hz, so the pulp is a spring to the bone. It has
    2 N/mm and 2 N·s/m at 1 N, 5 N/mm and 4 N·s/m at 3 N, straight lines between logarithms, before
    10 g. Pulp under a flat probe has 0.6 to 4.4 N/mm between 0.2 and 2 N (Pawluk and Howe, J.
    Biomech. Eng. 121, 1999, 178-183).
    """
    omega = 2.0 * np.pi * frequency_hz
    steep, damped = np.log(2.5) / np.log(3.0), np.log(2.0) / np.log(3.0)
    pulp = 2e3 * newtons**steep + 1j * omega * 2.0 * newtons**damped
    bone = -(omega**2) * 10e-3
    return complex(pulp * bone / (pulp + bone))
