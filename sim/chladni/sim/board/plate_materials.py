"""Materials of plates by name, each with its source; those of foams are in foundation.py."""

from __future__ import annotations

import re
from typing import Any

from chladni.sim.board.parts import EDGE_KINDS, BoardParts
from chladni.sim.errors import InputError

LABEL_PATTERN = re.compile(r"[\w .,+/()-]{0,40}")

SHEETS: dict[str, dict[str, float]] = {
    "FR4": {"youngs_modulus_gpa": 22.0, "poissons_ratio": 0.15, "density_kg_m3": 1900.0,
            "loss_factor": 0.02},
    "aluminium": {"youngs_modulus_gpa": 70.0, "poissons_ratio": 0.33, "density_kg_m3": 2700.0,
                  "loss_factor": 0.002},
    "steel": {"youngs_modulus_gpa": 200.0, "poissons_ratio": 0.29, "density_kg_m3": 7850.0,
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
differs by ±20 % among makers and directions of the weave. Loss factors are estimates, glued parts
and mounts not counted."""


def with_material(plate: Any) -> Any:
    """A `[plate]` block with the numbers of its `material` where it has none of its own.

    Another name than those here is allowed where the numbers are given: parts lists show it.

    Raises
    ------
    InputError
        There is no such material, and a number of it is left out.
    """
    if not isinstance(plate, dict) or "material" not in plate:
        return plate
    name = plate["material"]
    if isinstance(name, str) and name in SHEETS:
        return SHEETS[name] | plate
    lacking = [key for key in SHEETS["FR4"] if key not in plate and key != "loss_factor"]
    if lacking:
        known = ", ".join(map(repr, SHEETS))
        raise InputError("plate.material", name, f"one of: {known}, or with {', '.join(lacking)}")
    return plate


def check_plate(board: BoardParts) -> None:
    """Refuse edges that are held in no way there is, and a material with no name for a list."""
    for edge, kind in board.plate.edges.kinds().items():
        if kind not in EDGE_KINDS:
            expected = "one of: " + ", ".join(map(repr, EDGE_KINDS))
            raise InputError(f"plate.edges.{edge}", kind, expected)
    material = board.plate.material
    if not isinstance(material, str) or not LABEL_PATTERN.fullmatch(material):
        raise InputError("plate.material", material, "up to 40 letters, digits, spaces or .,+-/()")
