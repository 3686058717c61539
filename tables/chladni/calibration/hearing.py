"""Foam or stand-offs from the sound of a sweep: where a board rings tells how stiff it is held.

A microphone hears the volume that the plate moves, |ω² ∫W dA|, through a response of its own and a
room, of which only the average level and slope are taken to be unknown. One value is found: how
stiff the foam is, or the stand-offs of a board without. The rest of the board stays as it is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from chladni.calibration.fit import Parameter
from chladni.calibration.sweep import sweep_frequencies
from chladni.calibration.unknowns import unknowns_of
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, with_foam, with_soft_screws
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import open_coils

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Report = Callable[[int, int], None]

TRIED, REACH = 7, 2.0
"""Values that are solved, and how many deviations they reach to either side."""
LEVEL_DB = 2.5
"""Of one band: room, microphone, patches of foam, all that one value leaves out."""
COIL_DB = 1.0
"""Coils' forces."""
SHEET = {"foam": 0.10, "screws": 0.45}
"""Deviations of a value's logarithm by a sheet that is not the drawn one: modes of a plate on
stand-offs go with both."""
TOLD_APART = 0.8
"""Of its deviation before, that a value's must be below to count as measured."""
UNLIKE_DB = 6.0
"""RMS that no board of this kind is off."""


@dataclass(frozen=True)
class Heard:
    """What a recording tells.

    Attributes
    ----------
    board
        With foam or stand-offs as they were found.
    parameter
        That one value, over the drawn one.
    left_db
        RMS of levels that it does not explain.
    """

    board: Board
    parameter: Parameter
    left_db: float


def sound(board: Board, hz: FloatArray) -> ComplexArray:
    """What a microphone far off hears of a volt at each coil, any unit, (coils, frequencies).

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    coil = board.known_coil
    model = plate_model(board)
    found = np.empty((len(board.actuators), hz.size), np.complex128)
    for k, one in enumerate(hz.tolist()):
        omega = 2.0 * np.pi * one
        fields = open_coils(board, one, model=model, tolerance=DRAWN_TOLERANCE).fields.values
        volume = np.asarray(fields).mean(axis=(1, 2)) * float(np.prod(board.plate.size))
        blocked = coil.force_factor / (coil.resistance + 1j * omega * coil.inductance)
        found[:, k] = -(omega**2) * volume * blocked
    return found


def fit_sound(board: Board, levels: FloatArray, progress: Report | None = None) -> Heard:
    """Find how stiff a board is held, from levels of a sweep, dB, (coils, frequencies).

    NaN stands for what was not heard.

    Raises
    ------
    InputError
        The board has neither foam nor screws, or sounds like none that may come out.
    """
    unknowns, hz = unknowns_of(board), sweep_frequencies()
    name = next((own for own in ("foam", "screws") if own in unknowns.scales), None)
    if name is None:
        hint = "its coils tell what feet are like" if board.springs else ""
        raise InputError("recording", board.name, "a board on foam or on screws", hint=hint)
    row = unknowns.scales.index(name)
    mean, spread = float(unknowns.mean[row]), float(unknowns.spread[row])
    tried = mean + spread * np.linspace(-REACH, REACH, TRIED)
    curves = []
    for done, value in enumerate(tried.tolist(), 1):
        own = _held(board, name, float(np.exp(value)))
        curves.append(20.0 * np.log10(np.maximum(np.abs(sound(own, hz)), 1e-300)))
        if progress:
            progress(done, TRIED)
    curve = CubicSpline(tried, np.array(curves))
    fine = np.linspace(tried[0], tried[-1], 400)
    left = np.array([_left(levels - curve(value), hz) for value in fine])
    cost = left + ((fine - mean) / spread) ** 2
    best = int(np.argmin(cost))
    # The width of the posterior, by its own moments: there may be more than one hill.
    weight = np.exp(-(cost - cost[best]) / 2.0)
    weight /= weight.sum()
    middle = float(weight @ fine)
    deviation = float(np.hypot(np.sqrt(weight @ (fine - middle) ** 2), SHEET[name]))
    count = int(np.isfinite(levels).sum())
    off = float(np.sqrt(left[best] / count)) * LEVEL_DB
    if off > UNLIKE_DB:
        raise InputError(
            "recording", f"levels {off:.0f} dB off", f"those of {board.name}, as it may come out"
        )
    value = float(fine[best])
    parameter = Parameter.of_logarithm(name, value, deviation, deviation < TOLD_APART * spread)
    return Heard(_known(board, name, float(np.exp(value))), parameter, off)


def _held(board: Board, name: str, factor: float) -> Board:
    return with_foam(board, factor) if name == "foam" else with_soft_screws(board, factor)


def _known(board: Board, name: str, factor: float) -> Board:
    """Drives are then for this foam, and no stiffer one."""
    focus = replace(board.focus, foam_ratio=1.0) if board.focus and name == "foam" else board.focus
    return replace(_held(board, name, factor), focus=focus)


def _left(off: FloatArray, hz: FloatArray) -> float:
    """χ² of levels less a common level, a slope over octaves and a level of each coil."""
    coils, count = off.shape
    octaves = np.log2(hz / hz[0])
    columns = [np.ones(off.size), np.tile(octaves, coils)]
    columns += [np.repeat(np.eye(coils)[k], count) for k in range(coils)]
    design = np.stack(columns, axis=1) / LEVEL_DB
    values = off.ravel() / LEVEL_DB
    is_heard = np.isfinite(values)
    # Forces are believed to be as drawn.
    beliefs = np.zeros((coils, design.shape[1]))
    beliefs[:, 2:] = np.eye(coils) / COIL_DB
    rows = np.concatenate((design[is_heard], beliefs))
    wanted = np.concatenate((values[is_heard], np.zeros(coils)))
    found = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    return float(np.sum((rows @ found - wanted) ** 2))
