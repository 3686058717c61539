"""What parts that are not as drawn do to a board's focus, drive and place unchanged.

Drives are found for the board as it is drawn. Each parameter then goes to both ends of its
tolerance, alone, and the same drives are scored on that board against the images first wanted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.batch import over_targets
from chladni.drives.methods import SEED, Options, Progress
from chladni.drives.methods.phasor import phasor
from chladni.drives.problem.problem import Problem, SolvedBoard, solved_board
from chladni.drives.problem.region_grid import region_grid
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.tolerances import (
    COIL_PLACE,
    FOAM,
    FORCE,
    with_foam,
    with_moved_coils,
    with_soft_screws,
)
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.fields.driven import driven_fields
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

PLACES = 16
"""Regions that are looked at, drawn with a fixed seed."""
DRAWS = 3
"""Boards whose coils are all off their places at once, and drives whose forces are."""
THICKNESS, MODULUS, LOSS, MAGNET = 0.10, 0.10, 0.5, 0.05
"""± shares. Printed boards come within 10 % of their thickness (usual of shops; IPC-4101 allows
0.10 mm on 1.0), FR4's modulus varies by 10 % about a sheet's own value and from 15 to 24 GPa
between sheets; the loss is known to a factor of two, magnets' mass by their sizes."""
FEET = 4.0
"""A rubber foot is as much stiffer at 160 Hz as its compound and its preload make it: 5 to 80 N/mm
of the same size."""
FEET_LOSS = 2.0
"""And loses as much more or less: catalogues do not have it."""


@dataclass(frozen=True)
class Influence:
    """What one parameter does within its tolerance, at the worse of its ends.

    Attributes
    ----------
    name, tolerance
        Of the parameter, in words.
    level_db
        Change of the mean under the finger, |dB|, that 90 % of places stay below.
    ssim, second_finger_db
        Change that only 10 % of places fall below: negative is worse; None for several fingers.
    isolation_db
        Change of several fingers' isolation at the worst tenth, as scores have it; None for one.
    """

    name: str
    tolerance: str
    level_db: float
    ssim: float | None = None
    second_finger_db: float | None = None
    isolation_db: float | None = None


@dataclass(frozen=True)
class Variant:
    """A board or a drive as it may come out: one of its parameters off."""

    name: str
    tolerance: str
    board: Board
    gains: ComplexArray | None = None


@dataclass(frozen=True)
class _FocusNumbers:
    """Of one drive at one place."""

    level: float
    ssim: float
    second_finger_db: float


def sensitivity(
    board: Board, *, seed: int = SEED, progress: Progress | None = None
) -> list[Influence]:
    """What each parameter of a board does, the largest change of level first."""
    solved = solved_board(board)
    grid = region_grid(board)
    chosen = np.random.default_rng(seed).permutation(grid.count)[:PLACES]
    targets = [grid.centre_mm(int(region)) for region in chosen]
    found = list(over_targets(solved, targets, lambda problem: _best(problem, seed)))
    cases = [(one["problem"], one["drive"]) for one in found]
    plain = _score_all(cases, solved.fields.values)
    changes: dict[tuple[str, str], list[list[_FocusNumbers]]] = {}
    variants = variants_of(board, np.random.default_rng(seed))
    for number, variant in enumerate(variants, 1):
        values = _fields_of(solved, variant)
        changes.setdefault((variant.name, variant.tolerance), []).append(_score_all(cases, values))
        if progress:
            progress(number, len(variants))
    result = [
        _influence(name, tolerance, plain, ends) for (name, tolerance), ends in changes.items()
    ]
    return sorted(result, key=lambda one: -one.level_db)


def _best(problem: Problem, seed: int) -> dict[str, Any]:
    return {"problem": problem, "drive": phasor(problem, Options("ssim", seed)).drive}


def _fields_of(solved: SolvedBoard, variant: Variant) -> ComplexArray:
    """A variant's fields, per drive as it was meant."""
    if variant.gains is not None:
        return np.asarray(variant.gains[:, None, None] * solved.fields.values)
    with one_blas_thread():
        return driven_fields(variant.board, allow_unmet=True).values


def _score_all(
    cases: Sequence[tuple[Problem, ComplexArray]], values: ComplexArray
) -> list[_FocusNumbers]:
    def one(case: tuple[Problem, ComplexArray]) -> _FocusNumbers:
        problem, drive = case
        field, board = np.tensordot(drive, values, axes=1), problem.board
        return _FocusNumbers(
            level=float(abs(field[problem.disc].mean())),
            ssim=metrics.ssim(np.abs(field), np.abs(problem.wanted)),
            second_finger_db=metrics.second_finger_db(field, board.x, board.y, problem.place),
        )

    return list(in_threads(one, cases, ahead=len(cases)))


def _influence(
    name: str,
    tolerance: str,
    plain: Sequence[_FocusNumbers],
    ends: Sequence[Sequence[_FocusNumbers]],
) -> Influence:
    def changes(of: Callable[[_FocusNumbers, _FocusNumbers], float]) -> list[NDArray[np.float64]]:
        return [
            np.array([of(before, after) for before, after in zip(plain, end, strict=True)])
            for end in ends
        ]

    levels = changes(lambda b, a: 20.0 * np.log10(max(a.level, 1e-300) / max(b.level, 1e-300)))
    ssims = changes(lambda b, a: a.ssim - b.ssim)
    second = changes(lambda b, a: a.second_finger_db - b.second_finger_db)
    return Influence(
        name=name,
        tolerance=tolerance,
        level_db=float(max(np.percentile(np.abs(end), 90.0) for end in levels)),
        ssim=float(min(np.percentile(end, 10.0) for end in ssims)),
        second_finger_db=float(min(np.percentile(end, 10.0) for end in second)),
    )


Change = tuple[str, str, Callable[[], Board]]
"""Name, tolerance, and how the board comes out."""


def variants_of(board: Board, rng: np.random.Generator) -> list[Variant]:
    """Every variant that can be built: an end at which parts touch or leave a range is left out."""
    found = []
    for name, tolerance, make in _changes(board, rng):
        with suppress(InputError):
            found.append(Variant(name, tolerance, make()))
    for _ in range(DRAWS):
        gains = 1.0 + FORCE * rng.uniform(-1.0, 1.0, len(board.actuators))
        found.append(Variant("coils' forces", _percent(FORCE), board, gains.astype(np.complex128)))
    return found


def _changes(board: Board, rng: np.random.Generator) -> Iterator[Change]:
    """Every change that is looked at; both ends of a parameter share its name."""
    plate, magnet = board.plate, board.magnet

    def of_plate(**values: Any) -> Callable[[], Board]:
        return lambda: replace(board, plate=replace(plate, **values))

    def of_magnet(**values: Any) -> Callable[[], Board]:
        assert magnet is not None
        return lambda: replace(board, magnet=replace(magnet, **values))

    for f in _ends(THICKNESS):
        yield "thickness", _percent(THICKNESS), of_plate(thickness=f * plate.thickness)
    for f in _ends(MODULUS):
        changed = of_plate(youngs_modulus=f * plate.youngs_modulus)
        yield "Young's modulus", _percent(MODULUS), changed
    if plate.loss_factor > 0.0:
        for f in _ends(LOSS):
            yield "sheet's loss factor", _percent(LOSS), of_plate(loss_factor=f * plate.loss_factor)
    yield from _support_changes(board)
    if magnet is not None:
        for f in _ends(MAGNET):
            yield "magnets' mass", _percent(MAGNET), of_magnet(density=f * magnet.density)
        if magnet.stiffness_ratio > 1.0:
            yield "magnets' glue", "rigid to soft", of_magnet(stiffness_ratio=1.0)
    for _ in range(DRAWS):
        moves = COIL_PLACE * rng.uniform(-1.0, 1.0, (len(board.actuators), 2))
        yield "coils' places", f"±{COIL_PLACE * 1e3:g} mm", partial(with_moved_coils, board, moves)


def _ends(share: float) -> tuple[float, float]:
    return 1.0 - share, 1.0 + share


def _support_changes(board: Board) -> Iterator[Change]:
    """Screws on soft stand-offs, feet and foam of another stiffness."""
    if any(screw.support != "sprung" for screw in board.screws):
        yield "screws", "rigid to nylon", lambda: with_soft_screws(board)
    if any(foot.stiffness > 0.0 for foot in board.springs):
        for factor in (1.0 / FEET, FEET):
            feet = tuple(replace(foot, stiffness=factor * foot.stiffness) for foot in board.springs)
            yield (
                "feet's stiffness",
                f"÷ {FEET:g} to × {FEET:g}",
                partial(replace, board, springs=feet),
            )
        loss = board.section.loss_factor
        for factor in (1.0 / FEET_LOSS, FEET_LOSS):
            feet = tuple(
                replace(
                    foot,
                    loss_factor=factor * (loss if foot.loss_factor is None else foot.loss_factor),
                )
                for foot in board.springs
            )
            yield (
                "feet's damping",
                f"÷ {FEET_LOSS:g} to × {FEET_LOSS:g}",
                partial(replace, board, springs=feet),
            )
    if board.foundation is None or not board.foundation.sheet_stiffness:
        return
    for factor in _ends(FOAM):
        yield "foam's stiffness", _percent(FOAM), partial(with_foam, board, factor)


def _percent(share: float) -> str:
    return f"±{100.0 * share:g} %"
