"""What coils read of each other's motion: the flux that they share is taken off.

It is known twice: from the windings and how far apart coils are drawn, and from a reading at
7.6 kHz, where little moves. Of coils that nearly touch the reading tells it, of those far apart the
drawing. Where windings are not known, what the drawn plate moves at 7.6 kHz is taken off first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.device_readings import coil_impedance
from chladni.calibration.sensing import FLUX_ERROR, CoilReadings
from chladni.drives.scoring.tolerances import COIL_PLACE, DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.errors import ToleranceError
from chladni.sim.fields.induced import open_coils, shared_inductances

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MODEL_ERROR = 0.005
"""Of every reading: what the fields that it is compared with are not exact."""
LEFT_OF_SOLVED = 0.7
"""Of what a drawn board's motion adds, that the board as it came out may differ by: on `prototype`
at 7.6 kHz 0.4 to 0.7."""
WINDING_ERROR, REVERBERATION = 0.05, 3.0
"""Of flux that is reckoned from the drawing; and how much more than on an endless plate one coil
moves another at 7.6 kHz; `phone5` has 1 to 6 times as much at 6 kHz."""
CARRIER_LEFT = 0.016
"""Of the carrier, whose pulses a neighbour couples in as a transformer does: the amplifier passes
0.8 % at 78 kHz, half of a pulse on either side of it."""


@dataclass(frozen=True)
class MotionReadings:
    """What motion alone induces.

    Attributes
    ----------
    frequencies_hz
        Shape (frequencies,).
    volts
        Per ampere, (frequencies, listening, playing), 0 on the diagonals.
    noise
        One standard deviation of its real and imaginary parts, the same shape; 1 on the diagonals.
    flux, flux_spread
        Inductances that were taken off, and how far they may be off, H, (listening, playing).
    carrier
        What all pairs together may have read of the carrier, one deviation, V/A, (patterns,
        frequencies, listening, playing): each pattern is there as often as one number says, which
        no one knows.
    """

    frequencies_hz: FloatArray
    volts: ComplexArray
    noise: FloatArray
    flux: FloatArray
    flux_spread: FloatArray
    carrier: ComplexArray

    def by_deviations(self, off: ComplexArray) -> FloatArray:
        """What readings are off in standard deviations that do not go together.

        Flux that was taken off wrongly is one inductance of a pair at all frequencies, and what is
        left of the carrier is a few patterns of all of them.

        Parameters
        ----------
        off
            Volts per ampere, (…, frequencies, listening, playing).

        Returns
        -------
        FloatArray
            Of the real parts and the imaginary ones, (…, 2, frequencies, listening, playing).
        """
        patterns = self._weighted(self.carrier)
        ways, sizes, _ = np.linalg.svd(patterns.reshape(len(patterns), -1).T, full_matrices=False)
        less = ways * (1.0 - 1.0 / np.sqrt(1.0 + sizes**2))
        found = self._weighted(off)
        flat = found.reshape(*found.shape[:-4], -1)
        return np.asarray((flat - (flat @ ways) @ less.T).reshape(found.shape))

    def _weighted(self, off: ComplexArray) -> FloatArray:
        """In deviations of each pair on its own."""
        omega = 2.0 * np.pi * self.frequencies_hz
        noise = np.moveaxis(self.noise, 0, -1)
        wrong = self.flux_spread[..., None] * omega
        covariance = (
            noise[..., None] ** 2 * np.eye(omega.size) + wrong[..., None] * wrong[..., None, :]
        )
        weights = np.linalg.inv(np.linalg.cholesky(covariance))
        imaginary = np.einsum("lpfg,...glp->...flp", weights, off.imag)
        return np.stack((off.real / self.noise, imaginary), axis=-4)


def motion_of(
    board: Board, readings: CoilReadings, signs: FloatArray, moving: ComplexArray | None = None
) -> MotionReadings:
    """Take the flux off.

    Parameters
    ----------
    board
        As it is drawn.
    signs
        How its coils are turned: 1, −1, or 0 for one that is dead, (actuators,).
    moving
        What the drawn board's motion adds to the high reading, H (`drawn_motion`), where it is
        solved: then as much of it is taken off. What is read beyond it is believed to be motion
        too, and `LEFT_OF_SOLVED` of it at least.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    high = readings.high
    turned = np.outer(signs, signs)
    read = high.volts.imag / (2.0 * np.pi * high.hz)
    left = moving_inductance(board, high.hz)
    if moving is not None:
        read = read - turned * moving.real
        # Where the board as it came out resonates there, what is left tells it.
        left = np.full(read.shape, max(LEFT_OF_SOLVED * _usual(moving), _usual(read)))
    unsure = np.hypot(high.spread / (2.0 * np.pi * high.hz), left)
    drawn, off_drawn = drawn_inductances(board)
    off = ~np.eye(len(read), dtype=bool)
    ratio = np.divide(off_drawn, unsure, out=np.zeros_like(read), where=off)
    # A flux that the drawing does not tell has an endless deviation, and a dead coil none at all.
    weight = np.where(off & (turned != 0.0), 1.0 / (1.0 + ratio**2), 0.0)
    flux = off * np.where(turned != 0.0, weight * turned * drawn + (1.0 - weight) * read, 0.0)
    left = np.sqrt(1.0 - weight) * unsure
    taken = 2j * np.pi * readings.frequencies_hz[:, None, None] * flux
    volts = readings.volts - taken
    noise = np.sqrt(
        readings.noise**2
        + (MODEL_ERROR * np.abs(volts)) ** 2
        + (2.0 * FLUX_ERROR * np.abs(taken)) ** 2
    )
    noise = np.where(off, noise, 1.0)
    carrier = _carrier_patterns(board, readings, flux)
    return MotionReadings(readings.frequencies_hz, volts * off, noise, flux, left * off, carrier)


def _carrier_patterns(board: Board, readings: CoilReadings, flux: FloatArray) -> ComplexArray:
    """As much of the duty for all that is played at one level; and of flux, which was read so too.

    A converter in step with the carrier sees its pulses at one moment of a session, which no one
    knows: what it has of them grows with the duty, but not in proportion.
    """
    hz = readings.frequencies_hz[:, None, None]
    pulses = coil_impedance(board, hz) / board.known_coil.inductance * flux
    every, levels = _each_of(readings.sessions), _each_of(readings.duties)
    patterns = [
        np.where((session & level)[:, None, :], pulses, 0.0)
        for session in every
        for level in levels
        if np.any(session & level)
    ]
    patterns += [
        np.where(session, 2j * np.pi * hz * flux, 0.0)
        for session in _each_of(readings.high.sessions)
    ]
    return np.asarray(CARRIER_LEFT * np.stack(patterns))


def _each_of(values: FloatArray) -> list[NDArray[np.bool_]]:
    """Where each of the values stands."""
    return [np.isclose(values, one) for one in np.unique(values)]


def drawn_motion(board: Board, hz: float) -> ComplexArray | None:
    """What motion adds to a reading of the flux, H, of a board whose windings are not known.

    Where they are, flux is better reckoned from them.
    """
    if board.winding is not None or board.coil is None:
        return None
    try:
        coils = open_coils(board, hz, tolerance=DRAWN_TOLERANCE)
    except ToleranceError:
        return None
    return np.asarray(board.coil.force_factor**2 * coils.compliance)


def _usual(moving: FloatArray | ComplexArray) -> float:
    """RMS between different coils."""
    off = ~np.eye(len(moving), dtype=bool)
    return float(np.sqrt(np.mean(np.abs(moving[off]) ** 2)))


def drawn_inductances(board: Board) -> tuple[FloatArray, FloatArray]:
    """Of every pair, H, and their deviation: windings, and coils that lie elsewhere."""
    drawn = shared_inductances(board)
    if board.winding is None:
        return drawn, np.full(drawn.shape, np.inf)
    # Far apart, flux goes with the cube of the distance, and nearer by less.
    moved = np.minimum(3.0 * COIL_PLACE * np.sqrt(2.0 / 3.0) / board.coils_apart, 0.5)
    return drawn, np.abs(drawn) * np.hypot(WINDING_ERROR, moved)


def moving_inductance(board: Board, hz: float) -> FloatArray:
    """What motion adds to a reading of the flux, H, one deviation, of every pair.

    A wave on an endless plate, from a point to another one (Cremer, Heckl and Petersson,
    Structure-Borne Sound), whose magnets hold both still, and which edges send back.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    coil, magnet, plate = board.known_coil, board.magnet, board.plate
    omega = 2.0 * np.pi * hz
    heavy = plate.density * plate.thickness
    mobility = 1.0 / (8.0 * np.sqrt(plate.bending_stiffness * heavy))
    mass = 0.0 if magnet is None else magnet.areal_mass * np.pi * magnet.radius**2
    held = 1.0 + (omega * mass * mobility) ** 2
    along = (heavy * omega**2 / plate.bending_stiffness) ** 0.25 * board.coils_apart
    spread = np.minimum(np.sqrt(2.0 / (np.pi * along)), 1.0)
    return np.asarray(REVERBERATION * coil.force_factor**2 * mobility * spread / (omega * held))
