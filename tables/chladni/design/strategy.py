"""CMA-ES from a point of a search, by the library of that name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from chladni.design.evaluate import beyond
from chladni.design.spec import Spec
from chladni.design.starts import Point, document_at, steps_of

STEP = 0.2
"""CMA-ES's first standard deviation, as a share of a range."""
NEAR = 0.1
"""The same of a coil's place, as a share of the least spacing of two."""
DRAWN = 30
"""Boards drawn for each that is looked at, so that its coils fit beside each other: of sixteen that
move at random, two come too close in most draws."""


def strategy(spec: Spec, start: Point, seed: int, evaluations: int) -> Any:
    """A `cma.CMAEvolutionStrategy` that begins at a point and ends after so many boards."""
    # It brings scipy.stats, which takes a third of a second to load.
    import cma  # noqa: PLC0415

    size = len(start.numbers) + len(start.shares)
    most = [one.most for one in spec.variables] + [1.0] * len(start.shares)
    spread = [STEP * max(one.most, 1.0) for one in spec.variables]
    spread += steps_of(spec, start, NEAR * spec.settings.coil_spacing)
    # The library needs two dimensions; one that does nothing costs nothing.
    idle = max(0, 2 - size)
    options: dict[str, Any] = {
        "bounds": [[0.0] * (size + idle), most + [1.0] * idle],
        "CMA_stds": spread + [1.0] * idle,
        "integer_variables": [k for k, one in enumerate(spec.variables) if one.is_whole],
        "seed": seed,
        "maxfevals": evaluations,
        "verbose": -9,
        "verb_filenameprefix": "",
        "verb_log": 0,
    }
    at = np.clip([*start.numbers, *start.shares], 0.0, most)  # 1 but for the last bit is beyond
    return cma.CMAEvolutionStrategy([*at.tolist(), *[0.5] * idle], 1.0, options)


def fitting(spec: Spec, drawn: Sequence[Any], start: Point, count: int) -> list[Any]:
    """So many of the boards drawn: the first whose coils fit, and others if there are none."""
    fit: list[Any] = []
    others: list[Any] = []
    for x in drawn:
        is_fit = not beyond(spec, document_at(spec, start.at(x)))
        (fit if is_fit else others).append(x)
        if len(fit) == count:
            break
    return [*fit, *others][:count]
