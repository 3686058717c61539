"""What a Ritz plate is made of, and how finely it is resolved. SI units throughout."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Clamp:
    """A screw: w = 0 and ∂w/∂n = 0 on the circle, m."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True)
class Inclusion:
    """A glued disc: added mass per area (kg/m²) and a factor on the bending stiffness under it."""

    x: float
    y: float
    radius: float
    areal_mass: float
    stiffness_ratio: float


@dataclass(frozen=True)
class PlateGeometry:
    """A rectangle with free edges, centred on the origin.

    Parameters
    ----------
    width, length
        Along x and y, m.
    bending_stiffness
        D = Eh³/(12(1 − ν²)), N·m.
    poisson
        ν.
    areal_mass
        ρh, kg/m².
    clamps, inclusions
        What holds and loads the plate.
    """

    width: float
    length: float
    bending_stiffness: float
    poisson: float
    areal_mass: float
    clamps: tuple[Clamp, ...] = ()
    inclusions: tuple[Inclusion, ...] = ()


@dataclass(frozen=True)
class Resolution:
    """How many functions a basis has.

    Parameters
    ----------
    nx, ny
        Polynomials along x and y.
    clamp_rings, inclusion_rings, inclusion_bubbles
        Highest angular order of the functions on each circle (rings.py).
    """

    nx: int
    ny: int
    clamp_rings: int = 3
    inclusion_rings: int = 4
    inclusion_bubbles: int = 2
