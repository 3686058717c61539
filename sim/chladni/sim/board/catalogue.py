"""Sheets, rubber feet and grommets by name, each with its source; foams are in foundation.py."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from chladni.sim.board.parts import Plate, Spring
from chladni.sim.board.quantity import MM, near_name
from chladni.sim.errors import Faults, InputError, MissingError

LABEL_PATTERN = re.compile(r"[\w .,+/()-]{0,40}")

SHEETS: dict[str, dict[str, float]] = {
    "FR4": {"youngs_modulus_gpa": 22.0, "poissons_ratio": 0.15, "density_kg_m3": 1900.0,
            "loss_factor": 0.02},
    "aluminium": {"youngs_modulus_gpa": 70.0, "poissons_ratio": 0.33, "density_kg_m3": 2700.0,
                  "loss_factor": 0.002},
    "steel": {"youngs_modulus_gpa": 200.0, "poissons_ratio": 0.29, "density_kg_m3": 7850.0,
              "loss_factor": 0.002},
    "stainless-steel": {"youngs_modulus_gpa": 193.0, "poissons_ratio": 0.29,
                        "density_kg_m3": 8000.0, "loss_factor": 0.002},
    "brass": {"youngs_modulus_gpa": 103.0, "poissons_ratio": 0.34, "density_kg_m3": 8440.0,
              "loss_factor": 0.002},
    "glass": {"youngs_modulus_gpa": 70.0, "poissons_ratio": 0.23, "density_kg_m3": 2500.0,
              "loss_factor": 0.002},
    "polycarbonate": {"youngs_modulus_gpa": 2.35, "poissons_ratio": 0.37, "density_kg_m3": 1200.0,
                      "loss_factor": 0.02},
    "acrylic": {"youngs_modulus_gpa": 3.2, "poissons_ratio": 0.35, "density_kg_m3": 1190.0,
                "loss_factor": 0.05},
    "pet": {"youngs_modulus_gpa": 4.5, "poissons_ratio": 0.38, "density_kg_m3": 1390.0,
            "loss_factor": 0.02},
}  # fmt: skip
"""Moduli and densities as data sheets of usual sheets have them, FR4 as in the paper's board; FR4
differs by ±20 % among makers and directions of the weave. Brass is CuZn37. Stainless steel is
AISI 304, hardly magnetic; ferritic kinds are magnetic as plain steel is. Loss factors are
estimates, glued parts and mounts not counted."""


SOLD_AS = {
    **dict.fromkeys(("pmma", "plexiglass", "plexiglas", "perspex", "acrylic glass"), "acrylic"),
    **dict.fromkeys(("makrolon", "lexan", "pc"), "polycarbonate"),
    **dict.fromkeys(("mylar", "polyester"), "pet"),
    **dict.fromkeys(("pcb", "glass epoxy", "fr-4", "g10"), "FR4"),
    **dict.fromkeys(("aluminum", "alu"), "aluminium"),
    **dict.fromkeys(("inox", "aisi 304", "1.4301"), "stainless-steel"),
}
"""Names that people buy sheets by: plexiglass is like glass in its name alone."""


def with_material(plate: Any) -> Any:
    """A `[plate]` block with the numbers of its `material` where it has none of its own.

    Another name than those here is allowed where the numbers are given: parts lists show it.

    Raises
    ------
    InputError
        There is no such material, or none, and a number of it is left out.
    """
    if not isinstance(plate, dict):
        return plate
    name = plate.get("material")
    if isinstance(name, str) and name in SHEETS:
        return SHEETS[name] | plate
    lacking = [key for key in SHEETS["FR4"] if key not in plate and key != "loss_factor"]
    known = ", ".join(map(repr, SHEETS))
    if lacking and "material" not in plate:
        raise MissingError("plate.material", f"{known}; or {', '.join(lacking)}")
    if lacking:
        close = _known_as(str(name)) or near_name(name, SHEETS)
        raise InputError(
            "plate.material",
            name,
            f"one of: {known}, or with {', '.join(lacking)}",
            hint=f"{close!r}, perhaps" if close else "",
        )
    return plate


def _known_as(name: str) -> str | None:
    """The sheet of a name in other letters, or that people buy it by."""
    plain = name.casefold().strip()
    same = next((own for own in SHEETS if own.casefold() == plain), None)
    return same or SOLD_AS.get(plain)


METALS = ("steel", "stainless-steel", "aluminium", "brass")
STIFF, HEAVY = 60e9, 2600.0
"""Pa and kg/m³ from which a sheet of another name may be a metal: aluminium has 70e9 and 2700, and
usual glass 2500."""


def metal_of(plate: Plate) -> str:
    """What a sheet that conducts is called; nothing of one that does not."""
    if known := _known_as(plate.material):
        return known if known in METALS else ""
    may_be = plate.youngs_modulus >= STIFF and plate.density >= HEAVY
    return f"{plate.material or 'this sheet'}, if it is a metal," if may_be else ""


RUBBER = 0.25
"""± share by which compounds of one hardness differ."""
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


def foot_radius(spring: Spring) -> float:
    """Of the foot that a spring stands for, m; 0 where no part is named."""
    return FEET[spring.part].outer * MM / 2.0 if spring.part in FEET else 0.0


def lowest_foot(springs: Sequence[Spring]) -> float | None:
    """Height of the lowest foot of this catalogue, m; None without one."""
    heights = [FEET[spring.part].height * MM for spring in springs if spring.part in FEET]
    return min(heights, default=None)


def with_rubber_parts(document: dict[str, Any]) -> dict[str, Any]:
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
    faults, completed = Faults(), []
    for k, own in enumerate(entries):
        with faults.kept():
            completed.append(_completed(own, known, f"{kind}[{k}]", "measured" in document))
    faults.tell()
    return document | {kind: completed}


def _completed(entry: Any, known: dict[str, RubberPart], where: str, is_measured: bool) -> Any:
    if not isinstance(entry, dict) or "part" not in entry:
        return entry
    name = entry["part"]
    part = known.get(name) if isinstance(name, str) else None
    if part is None:
        kinds = {"springs": FEET, "screws": GROMMETS}
        own = next((k for k, parts in kinds.items() if isinstance(name, str) and name in parts), "")
        hint = f"this one goes into [[{own}]]" if own else ""
        raise InputError(f"{where}.part", name, f"one of: {', '.join(map(repr, known))}", hint=hint)
    given = entry.get("stiffness_n_per_mm")
    # What was measured of a part may be far from what its maker says.
    is_unlike = isinstance(given, int | float) and abs(given / part.stiffness - 1.0) > RUBBER
    if is_unlike and not is_measured:
        expected = f"within a quarter of {part.stiffness:.1f}, which {name} has"
        hint = "leave out its stiffness and loss_factor, which follow from the part, or the part"
        raise InputError(f"{where}.stiffness_n_per_mm", given, expected, hint=hint)
    made: dict[str, Any] = {
        "stiffness_n_per_mm": round(part.stiffness, 1),
        "loss_factor": part.loss_factor,
    }
    if part.inner:
        made |= {"support": "sprung", "radius_mm": (part.outer + part.inner) / 4.0}
    return made | entry
