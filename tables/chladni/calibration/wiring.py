"""Coils that are wired the wrong way round or dead, and readings that no board makes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.sensing import CoilReadings
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Actuator
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

NEIGHBOURS = 3
"""Of each coil, those that should read most of it."""
DEAD = 0.1
"""A coil of which less than this share of what is usual is read is dead: healthy ones are within
40 % of each other by force and foam."""
HEARD = 6.0
"""Standard deviations of noise from which something was read at all."""
CLEAR = 12.0
"""From which a coil lives, however little of it the expected foam would let through: of a dead one
its neighbours read two, of healthy ones on stiff foam a hundred."""
USUAL_DB = 2.5
"""That a force is off: a fifth is 1.9 dB less, 2 % of resistance and 2 % of error 0.4 more."""
LOPSIDED = 0.25
"""Of a pair's readings, that both may differ: resistances, converter and noise make up to 6 %."""


@dataclass(frozen=True)
class Wiring:
    """How each coil is connected.

    Attributes
    ----------
    signs
        1, −1 for one that is the wrong way round, 0 for a dead one, (actuators,).
    """

    signs: FloatArray

    @classmethod
    def of_forces(cls, forces: FloatArray, dead: float = DEAD) -> Wiring:
        """By each coil's force over the drawn one, (actuators,): NaN is right, as it was not read.

        Parameters
        ----------
        dead
            Share of the median below which a coil is.
        """
        read = np.where(np.isfinite(forces), forces, 1.0)
        usual = float(np.median(np.abs(forces[np.isfinite(forces)])))
        return cls(np.where(np.abs(read) < dead * usual, 0.0, np.sign(read)))

    @property
    def is_dead(self) -> NDArray[np.bool_]:
        """Which coils are dead, (actuators,)."""
        return np.asarray(self.signs == 0.0)

    def alike(self, volts: ComplexArray, expected: ComplexArray) -> float:
        """How alike what was read is to what coils so wired would read, at most 1."""
        own = np.outer(self.signs, self.signs) * expected
        off = ~np.eye(self.signs.size, dtype=bool)
        read, would = volts[:, off], own[:, off]
        size = float(np.linalg.norm(read) * np.linalg.norm(would))
        return float(np.real(np.vdot(would, read))) / max(size, 1e-300)


@dataclass(frozen=True)
class CoilFault:
    """What to look at on the desk.

    Attributes
    ----------
    kind
        Of it, in a word.
    said
        In a sentence.
    """

    kind: Literal["dead", "reversed", "force"]
    said: str


def coil_fault(own: Actuator) -> CoilFault | None:
    """What is wrong with a coil by its board's file; None if nothing is."""
    coil = f"Coil {own.name}"
    if own.is_dead:
        return CoilFault("dead", f"{coil} is dead: look at its wires and its driver.")
    if own.polarity < 0:
        return CoilFault("reversed", f"{coil} is reversed: swap its wires, or keep this file.")
    if abs(own.trim_db) > USUAL_DB:
        off = f"{abs(own.trim_db):.1f} dB {'less' if own.trim_db > 0.0 else 'more'}"
        said = f"{coil} has {off} force than drawn: look at its magnet and its gap."
        return CoilFault("force", said)
    return None


def find_wiring(board: Board, readings: CoilReadings, expected: ComplexArray) -> Wiring:
    """Which coils are reversed and which are dead.

    Most coils are taken to be right: a board of which all are reversed is one that pulls where it
    should push, and no finger can tell.

    Parameters
    ----------
    expected
        Voltages per ampere of a board, shaped as the readings'.

    Raises
    ------
    InputError
        Nothing was read, pairs of coils do not read alike, or a coil is heard that does not hear.
    """
    names = [own.name for own in board.actuators]
    _check_heard(readings)
    shares = np.abs(readings.volts) / np.maximum(np.abs(expected), 1e-300)
    played, heard = (
        np.array([_usual(shares, expected, coil, listening=is_own) for coil in range(len(names))])
        for is_own in (False, True)
    )
    usual = float(np.median(np.concatenate((played, heard))))
    silent, deaf = (
        (own < DEAD * usual) & (_above_noise(readings, axis) < CLEAR)
        for own, axis in ((played, 1), (heard, 2))
    )
    for coil in np.flatnonzero(silent != deaf):
        what = "plays, and hears nothing" if deaf[coil] else "hears, and does not play"
        raise InputError(
            f"coil {names[coil]}",
            what,
            "one that does both, or neither",
            hint="look at its line to the multiplexer" if deaf[coil] else "look at its driver",
        )
    _check_alike(names, readings, silent)
    return Wiring(np.where(silent, 0.0, _signs(readings.volts, expected, ~silent)))


def _check_heard(readings: CoilReadings) -> None:
    off = ~np.eye(readings.volts.shape[1], dtype=bool)
    if not np.any((np.abs(readings.volts) > HEARD * readings.noise)[:, off]):
        raise InputError("readings", "noise", "voltages of coils", hint="is the sensing pin wired?")


def unlike(readings: CoilReadings, share: float) -> NDArray[np.bool_]:
    """Where coil i does not read of j what j reads of i, but for noise and a share of both.

    Shape (frequencies, listening, playing).
    """
    volts, noise = readings.volts, readings.noise
    back = volts.transpose(0, 2, 1)
    apart = np.abs(volts - back) - HEARD * np.hypot(noise, noise.transpose(0, 2, 1))
    return np.asarray(apart > share * np.maximum(np.abs(volts), np.abs(back)))


def _check_alike(names: list[str], readings: CoilReadings, silent: NDArray[np.bool_]) -> None:
    """Coil i reads of j what j reads of i, at all frequencies together by their noise.

    A far pair is near the noise at 80 Hz, and clear at 240 Hz.
    """
    volts, noise = readings.volts, readings.noise
    back, both = volts.transpose(0, 2, 1), np.hypot(noise, noise.transpose(0, 2, 1))
    apart = np.linalg.norm((volts - back) / both, axis=0) - HEARD
    odd = apart - LOPSIDED * np.linalg.norm(np.maximum(np.abs(volts), np.abs(back)) / both, axis=0)
    odd[silent] = odd[:, silent] = 0.0
    if np.any(odd > 0.0):
        i, j = np.argwhere(odd == odd.max())[0].tolist()
        raise InputError(
            f"coils {names[j]} and {names[i]}",
            "unlike readings of each other",
            "alike ones, as all plates make them",
            hint="was something laid on the board, or bumped against, meanwhile?",
        )


def _usual(shares: FloatArray, expected: ComplexArray, coil: int, *, listening: bool) -> float:
    """Middle share of what should be read of a coil, or by it, with its strongest neighbours."""
    own, should = (
        (part[:, coil, :] if listening else part[:, :, coil]) for part in (shares, np.abs(expected))
    )
    level = should.mean(axis=0)
    level[coil] = 0.0
    strongest = np.argsort(-level)[:NEIGHBOURS]
    return float(np.median(own[:, strongest]))


def _above_noise(readings: CoilReadings, axis: int) -> FloatArray:
    """What is read of each coil (over axis 1, of who listens) or by it (over 2), over its noise.

    That of its `NEIGHBOURS`, at the frequency at which most is read.
    """
    level = np.abs(readings.volts) / readings.noise
    off = ~np.eye(level.shape[1], dtype=bool)
    strongest = np.sort(level * off, axis=axis)
    kept = np.take(strongest, range(-min(NEIGHBOURS, len(off) - 1), 0), axis=axis)
    return np.asarray(np.median(kept, axis=axis).max(axis=0))


def _signs(volts: ComplexArray, expected: ComplexArray, lives: NDArray[np.bool_]) -> FloatArray:
    """Signs s that make s sᵀ of what was expected most like what was read.

    The leading eigenvector of how well each pair agrees, which is a symmetric matrix.
    """
    level = np.abs(expected).mean(axis=0)
    agrees = np.real(volts * expected.conj()).mean(axis=0) / np.maximum(level, 1e-300)
    agrees = agrees * np.outer(lives, lives)
    np.fill_diagonal(agrees, 0.0)
    # A coil counts by its neighbours, wherever it lies.
    size = np.sqrt(np.abs(agrees).sum(axis=1))
    size = np.where(size > 0.0, size, 1.0)
    both = (agrees + agrees.T) / np.outer(size, size)
    _, vectors = np.linalg.eigh(both)
    signs = np.where(vectors[:, -1] < 0.0, -1.0, 1.0)
    return signs if signs[lives].sum() >= 0.0 else -signs
