"""What a finger feels of a drive: micrometres and volts, and what pressing itself changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.pressing import with_finger
from chladni.drives.problem.problem import Problem
from chladni.sim.coil.full_drive import FullDrive, full_drive
from chladni.sim.image import metrics
from chladni.sim.image.finger import sensation_db

ComplexArray = NDArray[np.complex128]

SSIM_LOOKS_GOOD = 0.9
"""From here on an SSIM is taken for a focus, as the paper does."""
MICROMETRE = 1e-6


@dataclass(frozen=True)
class FingerLoad:
    """What the pressing finger changes, dB and SSIM."""

    level_db: float
    ssim: float
    second_finger_db: float


@dataclass(frozen=True)
class Felt:
    """A drive as a finger feels it, its loudest coil at the most it may be given for ever.

    Attributes
    ----------
    finger_um
        |mean of W under the fingertip|, peak, µm; None on a board without a coil.
    um_per_newton
        The same with the loudest coil at one newton.
    full_volts, full_amperes, limited_by
        As of `FullDrive`; None on a board without a coil.
    sensation_db
        `finger_um` above the detection threshold at the drive's frequency; None outside 40 to 800
        Hz.
    static_um
        Deflection under the finger by the coils' bias; None where nothing holds the board, and with
        bridges, which have no bias.
    finger_load
        What the finger of the board file changes, or the usual one.
    """

    finger_um: float | None
    um_per_newton: float
    full_volts: float | None
    full_amperes: float | None
    limited_by: str | None
    sensation_db: float | None
    static_um: float | None
    finger_load: FingerLoad


def felt(problem: Problem, drive: ComplexArray) -> Felt:
    """What a finger at the target feels of a drive.

    Parameters
    ----------
    drive
        complex128, shape (actuators,), any scale.
    """
    board, solved = problem.board, problem.solved
    frequency = solved.fields.frequency_hz
    largest = float(np.abs(drive).max())
    field = np.tensordot(drive, problem.transfer, axes=1) / max(largest, 1e-300)
    per_newton = float(abs(field[problem.disc].mean())) / MICROMETRE
    full = full_drive(board, drive, frequency)
    level = per_newton * full.newtons if full else None
    return Felt(
        finger_um=level,
        um_per_newton=per_newton,
        full_volts=full.volts if full else None,
        full_amperes=full.amperes if full else None,
        limited_by=full.limited_by if full else None,
        sensation_db=sensation_db(level, frequency) if level is not None else None,
        static_um=_static_um(problem, full),
        finger_load=finger_load(problem, field),
    )


def _static_um(problem: Problem, full: FullDrive | None) -> float | None:
    static = problem.solved.static
    if full is None or static is None or problem.board.electronics.is_bridge:
        return None
    deflection = np.tensordot(full.bias_newtons, static[:, problem.disc].mean(axis=1), axes=1)
    return float(deflection) / MICROMETRE


def finger_load(problem: Problem, field: ComplexArray) -> FingerLoad:
    """What the finger changes of a field."""
    board, loaded = problem.board, with_finger(problem, field)
    before, after = (abs(w[problem.disc].mean()) for w in (field, loaded))
    ratio = after / before if before > 0.0 else 1.0
    wanted = np.abs(problem.wanted)
    ssim = [metrics.ssim(np.abs(w), wanted) for w in (field, loaded)]
    second = [metrics.second_finger_db(w, board.x, board.y, problem.place) for w in (field, loaded)]
    return FingerLoad(
        level_db=float(20.0 * np.log10(max(ratio, 1e-15))),
        ssim=ssim[1] - ssim[0],
        second_finger_db=second[1] - second[0],
    )


def disagreement(ssim: float, focal_error_mm: float, second_finger_db: float) -> str | None:
    """A sentence for a field whose image looks right and whose maximum is elsewhere.

    None where SSIM and focus agree.
    """
    is_off = focal_error_mm > metrics.SECOND_FINGER_DISTANCE * 1e3
    if ssim < SSIM_LOOKS_GOOD or not is_off:
        return None
    louder = f", and another finger gets {-second_finger_db:.1f} dB more" * (second_finger_db < 0.0)
    return (
        f"The image is like the target's (SSIM {ssim:.3f}), but the maximum lies "
        f"{focal_error_mm:.0f} mm from the finger{louder}: this is no focus."
    )


def remedy(objective: str | None) -> str:
    """What follows a `disagreement`: the objective that makes a focus, if there is one."""
    if objective is None:
        return "No objective makes one of these coils here."
    return f"--objective {objective} makes one."


def remark(misled: int, places: int, focused: int | None = None) -> str | None:
    """Sentences about places where SSIM and focus disagree; None if there are none.

    Parameters
    ----------
    misled
        How many of the places.
    focused
        At how many of those the objective focus makes one, if that is known.
    """
    if not misled:
        return None
    remedied = f" --objective focus makes one at {focused or 'none'} of them."
    return (
        f"At {misled} of {places} places the image is like the target's (SSIM above "
        f"{SSIM_LOOKS_GOOD:g}), but the maximum is more than 12 mm from the finger: "
        "SSIM alone is no focus." + remedied * (focused is not None)
    )


def remark_on(problem: Problem, drive: ComplexArray) -> str | None:
    """`disagreement` of a drive."""
    board, field = problem.board, np.tensordot(drive, problem.transfer, axes=1)
    second = metrics.second_finger_db(field, board.x, board.y, problem.place)
    return disagreement(*ssim_and_focal_error(problem, drive), second)


def ssim_and_focal_error(problem: Problem, drive: ComplexArray) -> tuple[float, float]:
    """Of a drive's field; the focal error in mm."""
    field = np.tensordot(drive, problem.transfer, axes=1)
    ssim = metrics.ssim(np.abs(field), np.abs(problem.wanted))
    error = metrics.focal_error(field, problem.board.x, problem.board.y, problem.place)
    return ssim, error * 1e3
