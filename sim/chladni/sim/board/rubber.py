"""Rubber feet and grommets by name: stiffness follows from hardness and size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from chladni.sim.errors import InputError

DYNAMIC = 1.3
"""Stiffness at 160 Hz over that of a slow press: 1.2 to 1.4 for mounts of natural rubber, as their
makers say. Filled and hard compounds have more."""


@dataclass(frozen=True)
class RubberPart:
    """A cylinder or a ring of rubber that is pressed between flat faces.

    Attributes
    ----------
    shore_a
        Hardness.
    outer, inner, height
        mm; `inner` is 0 for a cylinder.
    loss_factor
        Estimated; catalogues do not have it.
    faces
        How many such rings act at once: a grommet has one on either side of the plate.
    """

    shore_a: float
    outer: float
    inner: float
    height: float
    loss_factor: float
    faces: int = 1

    @property
    def modulus(self) -> float:
        """Young's modulus of a slow strain, MPa, from the hardness; 20 to 80 Shore A.

        References
        ----------
        A. N. Gent, On the relation between indentation hardness and Young's modulus, Rubber
        Chemistry and Technology 31 (1958), 896.
        """
        return 0.0981 * (56.0 + 7.62336 * self.shore_a) / (0.137505 * (254.0 - 2.54 * self.shore_a))

    @property
    def stiffness(self) -> float:
        """At the frequencies of a board, N/mm.

        Faces that cannot slide stiffen it by 1 + 2 S², with S the loaded area over the free one.

        References
        ----------
        A. N. Gent and P. B. Lindley, The compression of bonded rubber blocks, Proceedings of the
        Institution of Mechanical Engineers 173 (1959), 111.
        """
        area = math.pi / 4.0 * (self.outer**2 - self.inner**2)
        shape = area / (math.pi * (self.outer + self.inner) * self.height)
        slow = self.modulus * (1.0 + 2.0 * shape**2) * area / self.height
        return DYNAMIC * slow * self.faces


FEET = {
    "silicone-foot-8x3": RubberPart(30.0, 8.0, 0.0, 3.0, 0.1),
    "rubber-foot-10x5": RubberPart(50.0, 10.0, 0.0, 5.0, 0.1),
    "rubber-foot-6x6": RubberPart(40.0, 6.0, 0.0, 6.0, 0.1),
}
"""For `[[springs]]`: under a plate at a point. Diameter and height are in the name."""

GROMMETS = {
    "silicone-grommet-m3": RubberPart(30.0, 8.0, 4.0, 1.5, 0.1, faces=2),
    "rubber-grommet-m3": RubberPart(50.0, 8.0, 4.0, 1.5, 0.1, faces=2),
}
"""For `[[screws]]`: a sleeve round the screw, with a collar of ⌀8 × 1.5 mm on either side."""


def with_feet(document: dict[str, Any]) -> dict[str, Any]:
    """A board's document with the numbers of `[[springs]]` that name a `part`, where it has none.

    Raises
    ------
    InputError
        There is no such part.
    """
    return _with_parts(document, "springs", FEET)


def with_grommets(document: dict[str, Any]) -> dict[str, Any]:
    """The same of `[[screws]]`; a grommet's springs lie on the middle of its ring.

    Raises
    ------
    InputError
        There is no such part.
    """
    return _with_parts(document, "screws", GROMMETS)


def _with_parts(
    document: dict[str, Any], kind: str, known: dict[str, RubberPart]
) -> dict[str, Any]:
    entries = document.get(kind)
    if not isinstance(entries, list):
        return document
    return document | {
        kind: [_completed(own, known, f"{kind}[{k}].part") for k, own in enumerate(entries)]
    }


def _completed(entry: Any, known: dict[str, RubberPart], where: str) -> Any:
    if not isinstance(entry, dict) or "part" not in entry:
        return entry
    name = entry["part"]
    part = known.get(name) if isinstance(name, str) else None
    if part is None:
        raise InputError(where, name, f"one of: {', '.join(map(repr, known))}")
    made: dict[str, Any] = {
        "stiffness_n_per_mm": round(part.stiffness, 1),
        "loss_factor": part.loss_factor,
    }
    if part.inner:
        made |= {"support": "sprung", "radius_mm": (part.outer + part.inner) / 4.0}
    return made | entry
