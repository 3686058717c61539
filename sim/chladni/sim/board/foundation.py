"""What a plate lies on: foam and shut-in air."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from chladni.sim.board.quantity import MM, quantity

ATMOSPHERE = 1.4 * 101325.0
"""Adiabatic stiffness of air times its thickness, γp, N/m²: 1 mm makes 1.4e8 N/m³."""


@dataclass(frozen=True)
class Material:
    """A soft sheet under a board.

    Attributes
    ----------
    modulus
        Compression at 25 %: stress over strain, Pa. Small strains at 160 Hz are up to four times as
        stiff, so measure, or look at `board sensitivity`.
    loss_factor
        Estimated; data sheets do not have it.
    density
        kg/m³, where it is known.
    source
        Where the stress stands.
    """

    modulus: float
    loss_factor: float
    density: float | None
    source: str


FoamName = Literal["", "soft-pu-foam", "poron-4701-30", "poron-4701-30-thin", "sponge-rubber"]
MATERIALS: dict[FoamName, Material] = {
    "soft-pu-foam": Material(
        0.06e6,
        0.2,
        240.0,
        "15 kPa at 25 %, the softest PORON 4790-92 (240 kg/m³) and firm upholstery foam; estimated",
    ),
    "poron-4701-30": Material(
        0.136e6,
        0.2,
        320.0,
        "34 kPa at 25 % (21 to 55), Rogers data sheet, 1.6 to 2.4 mm, 320 kg/m³",
    ),
    "poron-4701-30-thin": Material(
        0.23e6, 0.2, 400.0, "58 kPa at 25 % (35 to 83), Rogers data sheet, 0.5 to 1.2 mm, 400 kg/m³"
    ),
    "sponge-rubber": Material(
        0.096e6,
        0.1,
        None,
        "24 kPa at 25 % (14 to 34), open-cell natural rubber, ASTM D1056 2A1 sheet",
    ),
}


@dataclass(frozen=True)
class CutOut:
    """A round hole in what lies under the plate. Metres."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    radius: float = quantity("radius_mm", MM, 0.05, 500.0)


@dataclass(frozen=True)
class Patch:
    """How stiff the sheet is about a place, over what it is elsewhere (`FoundationLayer.ratio`)."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    ratio: float = quantity("ratio", 1.0, 0.05, 20.0)


@dataclass(frozen=True)
class Strips:
    """How wide the strips along the edges are, m; 0 for none."""

    left: float = quantity("left_mm", MM, 0.0, 5000.0, default=0.0)
    right: float = quantity("right_mm", MM, 0.0, 5000.0, default=0.0)
    bottom: float = quantity("bottom_mm", MM, 0.0, 5000.0, default=0.0)
    top: float = quantity("top_mm", MM, 0.0, 5000.0, default=0.0)

    @property
    def is_none(self) -> bool:
        """Whether there are none, so that what lies under the plate is everywhere."""
        return not (self.left or self.right or self.bottom or self.top)


@dataclass(frozen=True)
class Foundation:
    """A soft sheet under the plate that resists deflection, k(1 + iη) per area. SI units.

    Either `stiffness` is given, or `material` (a key of `MATERIALS`) with `thickness`. At the
    drive's frequency it is `measured_ratio` times as stiff, 1 where that was not measured. Air that
    cannot escape from under the plate adds γp over the gap `sealed_air`. `coil_cut_out` is the
    radius of a hole in the sheet round every actuator. `patches` are places where it is stiffer or
    softer, as glue and foam come out.
    """

    stiffness: float = quantity("stiffness_n_per_mm3", 1e9, 0.0, 100.0, default=0.0)
    loss_factor: float | None = quantity("loss_factor", 1.0, 0.0, 2.0, default=None)
    material: FoamName = ""
    thickness: float = quantity("thickness_mm", MM, 0.0, 500.0, default=0.0)
    sealed_air: float = quantity("sealed_air_mm", MM, 0.0, 500.0, default=0.0)
    coil_cut_out: float = quantity("coil_cut_out_mm", MM, 0.0, 500.0, default=0.0)
    measured_ratio: float = quantity("stiffness_ratio", 1.0, 0.05, 50.0, default=1.0)
    strips: Strips = Strips()
    cut_outs: tuple[CutOut, ...] = ()
    patches: tuple[Patch, ...] = ()

    def stiffer(self, factor: float) -> Foundation:
        """The same with a sheet so many times as stiff; shut-in air stays as it is."""
        return replace(self, measured_ratio=factor * self.measured_ratio)

    @property
    def sheet_stiffness(self) -> float:
        """Of the sheet alone, N/m³."""
        slow = self.stiffness
        if self.material:
            slow = MATERIALS[self.material].modulus / self.thickness
        return self.measured_ratio * slow

    @property
    def air_stiffness(self) -> float:
        """Of shut-in air, N/m³."""
        return ATMOSPHERE / self.sealed_air if self.sealed_air else 0.0

    @property
    def total_stiffness(self) -> float:
        """Of both, N/m³."""
        return self.sheet_stiffness + self.air_stiffness

    @property
    def sheet_loss_factor(self) -> float:
        """Of the sheet alone."""
        if self.loss_factor is not None:
            return self.loss_factor
        return MATERIALS[self.material].loss_factor if self.material else 0.0

    @property
    def total_loss_factor(self) -> float:
        """Of both; air loses nothing."""
        return self.sheet_loss_factor * self.sheet_stiffness / self.total_stiffness

    def cut_off_hz(self, areal_mass: float) -> float:
        """√(k/ρh)/2π of a plate of that mass, kg/m², below which no wave travels."""
        return float(np.sqrt(self.total_stiffness / areal_mass) / (2.0 * np.pi))
