"""What fingers of a set get of their own signals and of the others', limits kept for their sum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet
from chladni.drives.scoring.spread import Spread
from chladni.sim.board.board import Board
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.image.finger import threshold_um

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PRESSING_THRESHOLD_DB = 15.0
"""By which a pressing finger's threshold lies below that of a resting one: about the middle of the
10 to 30 dB of S. Papetti and others (IEEE Trans. Haptics 10, 2017, 113-122)."""


@dataclass(frozen=True)
class KeptApart:
    """What fingers of drawn sets get; each finger of each set counts once, p10 is the bad tail.

    Attributes
    ----------
    isolation_db
        RMS over the finger's disc of its own signal, over the largest RMS of that signal in another
        finger's disc.
    level_db
        Its own signal against the loudest that the coils' limits allow at that place.
    finger_um
        Peak of its own signal with all voices on, limits kept for their sum; None without a coil.
    unfelt
        Share of fingers under which each other finger's signal stays below what a resting finger
        feels (RMS over the disc, peak in time); None without a coil, or outside 40 to 800 Hz.
    unfelt_pressing
        The same 15 dB below that.
    click_db, click_um
        What a click keeps in place of the tone, and its peak, of a finger that alone plays and has
        the coils to itself; None where that was not asked for, µm without a coil too.
    """

    isolation_db: Spread
    level_db: Spread
    finger_um: Spread | None
    unfelt: float | None
    unfelt_pressing: float | None
    click_db: Spread | None
    click_um: Spread | None


def kept_apart(board: Board, rows: FloatArray, clicks: FloatArray | None = None) -> KeptApart:
    """Of all rows (rows_of) of all sets, and of what their clicks keep, dB and µm (fingers, 2)."""
    threshold = threshold_um(board.drive.frequency_hz)
    has_coil = bool(np.all(np.isfinite(rows[:, 2])))
    can_tell = has_coil and threshold is not None
    limit = threshold or 0.0
    pressing = limit * 10.0 ** (-PRESSING_THRESHOLD_DB / 20.0)
    return KeptApart(
        isolation_db=Spread.of(rows[:, 0].tolist()),
        level_db=Spread.of(rows[:, 1].tolist()),
        finger_um=Spread.of(rows[:, 2].tolist()) if has_coil else None,
        unfelt=float(np.mean(rows[:, 3] < limit)) if can_tell else None,
        unfelt_pressing=float(np.mean(rows[:, 3] < pressing)) if can_tell else None,
        click_db=None if clicks is None else Spread.of(clicks[:, 0].tolist()),
        click_um=None if clicks is None or not has_coil else Spread.of(clicks[:, 1].tolist()),
    )


def most_newtons(board: Board, drives: ComplexArray) -> float | None:
    """Newtons for each unit of drives (drives, actuators) that are on at once; None without a coil.

    Amplitudes of one coil are added as if all were in phase: that keeps every limit whatever the
    signals are.
    """
    sums = np.abs(drives).sum(axis=0).astype(np.complex128)
    full = full_drive(board, sums, board.drive.frequency_hz)
    return None if full is None else full.newtons / float(sums.real.max())


def rows_of(
    board: Board, fingers: FingerSet, drives: ComplexArray, forces: FloatArray
) -> FloatArray:
    """Isolation (dB), level (dB), own µm, and the largest share of another's signal (µm).

    Parameters
    ----------
    drives
        Of each finger, any common scale, shape (fingers, actuators).
    forces
        Of coils over those that limits are reckoned with, shape (actuators,).

    Returns
    -------
    float64, shape (fingers, 4); µm are NaN without a coil.
    """
    newtons = most_newtons(board, drives)
    unit = np.nan if newtons is None else newtons / MICROMETRE
    played = drives * forces
    shares = fingers.shares(played)
    strangers = np.where(np.eye(len(drives), dtype=bool), 0.0, shares).max(axis=0)
    own = np.abs(np.diag(fingers.means(played)))
    return np.stack(
        (
            fingers.isolation_db(played),
            20.0 * np.log10(np.maximum(own * (newtons or 1.0), 1e-300) / _loudest(board, fingers)),
            own * unit,
            strangers * unit,
        ),
        axis=1,
    )


def _loudest(board: Board, fingers: FingerSet) -> FloatArray:
    """The most that any drive's own displacement is under each finger at the coils' limits, m.

    By two drives: all coils full and in phase there, and each in proportion to what it does, which
    draws least. Without a coil one newton is the most.
    """
    means = np.stack([disc.mean(axis=0) for disc in fingers.discs])
    most = np.zeros(len(means))
    for sizes in (np.ones(means.shape), np.abs(means)):
        for k, size in enumerate(sizes):
            drive = size / max(float(size.max()), 1e-300)
            newtons = most_newtons(board, drive[None].astype(np.complex128))
            moved = float((np.abs(means[k]) * drive).sum()) * (1.0 if newtons is None else newtons)
            most[k] = max(most[k], moved)
    return np.maximum(most, 1e-300)
