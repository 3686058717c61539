"""Climb SSIM over one complex number per actuator, with its exact gradient: the default.

Many starts climb an eighth of the image's points each way, where an evaluation costs a sixtieth of
a full one; the best distinct ones go on to a quarter, a half and the whole image, each taking along
the curvature it has learnt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.field_space import as_complex, as_reals, in_phase
from chladni.drives.problem.problem import Problem

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RANDOM_STARTS = 12
SURVIVORS = (14, 8, 3, 1)
"""Shapes carried on from each level, by step 8, 4, 2 and 1."""
MARGINS = (0.1, 0.02, 4e-3, 0.0)
"""Climbs this far below the best are dropped: a finer image moves an optimum's value by less."""
STEPS = (40, 30, 25, 25)
TOLERANCES = (1e-6, 1e-6, 3e-6, 1e-6)
"""A climb ends when its next step promises less than this."""
SAME = 0.03
"""Two drives whose fields differ by less than this share of their energy have one shape."""
KICKED_LEVEL = 1
KICKS, KICK, KICK_STEPS = 8, 0.2, 15
"""On the second level the best shape is searched for its best quadrature part: from so many copies,
moved by this share of the drive. All numbers here were chosen on 64 random targets of each shipped
board and tried on 120 others (bench/solve.py repeats such a trial)."""


@dataclass
class _Climb:
    z: FloatArray
    curvature: FloatArray
    value: float = -np.inf


def phasor(problem: Problem, options: Options, *, contrast: float = 0.0) -> Found:
    """The best drive by SSIM + `contrast` · ln(contrast)."""
    space = problem.solved.space
    size = 2 * space.rank
    rng = np.random.default_rng(options.seed)
    climbs = [_Climb(as_reals(start), np.zeros((size, size))) for start in _starts(problem, rng)]
    evaluations = 0
    skipped = len(SURVIVORS) - len(space.levels)
    # A climb of more variables than the usual ten takes more steps.
    stretch = max(1.0, size / 10.0)
    for k, level in enumerate(space.levels, skipped):
        if level.step < options.finest:
            break
        objective = space.objective(level, problem.image, contrast=contrast, disc=problem.disc)
        steps = options.steps or round(STEPS[k] * stretch)
        for climb in climbs:
            climb.value = objective.climb(climb.z, climb.curvature, steps, TOLERANCES[k])
        if k == KICKED_LEVEL:
            kicked = _kicks(_best(climbs, 1, 0.0)[0], rng)
            for climb in kicked:
                climb.value = objective.climb(climb.z, climb.curvature, KICK_STEPS, TOLERANCES[k])
            climbs += kicked
        evaluations += objective.evaluations
        climbs = _best(climbs, SURVIVORS[k], MARGINS[k])
    return Found(space.drive(as_complex(climbs[0].z)), evaluations)


def _starts(problem: Problem, rng: np.random.Generator) -> list[ComplexArray]:
    """Where climbs begin: drives in closed form, every coil alone, and random ones."""
    space = problem.solved.space
    coils = np.eye(len(problem.board.actuators), dtype=np.complex128)[: space.rank]
    known = [
        space.nearest_field(problem.wanted),
        space.best_contrast(problem.disc),
        space.coordinates(problem.at_target.conj()),
        *(space.coordinates(coil) for coil in coils),
    ]
    shape = (RANDOM_STARTS, space.rank)
    random = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    # The plate is nearly quasi-static below its first mode, and good drives nearly in phase there.
    random[::2] = random[::2].real + 0.3j * random[::2].imag
    lengths = [(z, np.linalg.norm(z)) for z in [*known, *random]]
    return [np.asarray(z / length) for z, length in lengths if np.isfinite(length) and length > 0.0]


def _kicks(climb: _Climb, rng: np.random.Generator) -> list[_Climb]:
    """Copies of a climb moved in quadrature, which know nothing of its curvature.

    Where fields are nearly real, |W|² = (Re W)² + (Im W)² feels the drive's quadrature part only
    in second order: optima of one shape come in families that differ in it alone.
    """
    z = in_phase(as_complex(climb.z))
    moves = KICK * np.linalg.norm(z) / np.sqrt(z.size) * rng.normal(size=(KICKS, z.size))
    return [_Climb(as_reals(z.real + 1j * move), np.zeros_like(climb.curvature)) for move in moves]


def _best(climbs: list[_Climb], count: int, margin: float) -> list[_Climb]:
    """The best climbs, one per optimum. In orthonormal coordinates an angle compares fields."""
    kept: list[_Climb] = []
    directions: list[ComplexArray] = []
    ranked = sorted(climbs, key=lambda item: -item.value)
    for climb in ranked:
        if kept and climb.value < kept[0].value - margin:
            break
        z = as_complex(climb.z)
        length = np.linalg.norm(z)
        if not np.isfinite(length) or length == 0.0:
            continue
        z = z / length
        if all(abs(np.vdot(z, other)) ** 2 < 1.0 - SAME for other in directions):
            kept.append(climb)
            directions.append(z)
        if len(kept) == count:
            break
    return kept or ranked[:1]
