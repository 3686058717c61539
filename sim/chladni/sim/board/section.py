"""A plate of several layers as one: bending about the common neutral plane, mass and loss.

Layers are bonded without slip. That is the stiffest they can be together: a soft glue shears, and
leaves less (a film on 50 µm of optical glue at wavelengths below some centimetres).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Layer:
    """One isotropic layer. SI units."""

    thickness: float
    youngs_modulus: float
    poissons_ratio: float
    density: float
    loss_factor: float


@dataclass(frozen=True)
class Section:
    """What bends and moves, as one plate.

    Attributes
    ----------
    bending_stiffness
        D, N·m.
    poissons_ratio
        Of bending: the share D₁₂/D₁₁.
    areal_mass
        kg/m².
    loss_factor
        η in D(1 + iη).
    """

    bending_stiffness: float
    poissons_ratio: float
    areal_mass: float
    loss_factor: float


def section_of(layers: Sequence[Layer]) -> Section:
    """Layers from the bottom up, as one plate that is free to stretch.

    Classical laminate theory. For isotropic layers the stiffnesses of equal curvatures, with
    E/(1 − ν), and of opposite ones, with E/(1 + ν), do not meet: with A, B and D the sums of
    E' h, E' h z and E' (h z² + h³/12), each leaves D − B²/A. Moduli are E(1 + iη), so that the loss
    is each layer's share of the bending energy.

    References
    ----------
    R. M. Jones, Mechanics of Composite Materials, 2nd ed., chapter 4.
    """
    total = sum(layer.thickness for layer in layers)
    even = _reduced(layers, total, -1.0)
    odd = _reduced(layers, total, 1.0)
    d11, d12 = (even + odd) / 2.0, (even - odd) / 2.0
    return Section(
        d11.real,
        d12.real / d11.real,
        sum(layer.density * layer.thickness for layer in layers),
        d11.imag / d11.real,
    )


def _reduced(layers: Sequence[Layer], total: float, sign: float) -> complex:
    """D − B²/A with the modulus E(1 + iη)/(1 ± ν)."""
    a = b = d = 0.0 + 0.0j
    bottom = -total / 2.0
    for layer in layers:
        h = layer.thickness
        z = bottom + h / 2.0
        own = layer.youngs_modulus * (1.0 + 1j * layer.loss_factor)
        own /= 1.0 + sign * layer.poissons_ratio
        a += own * h
        b += own * h * z
        d += own * (h * z**2 + h**3 / 12.0)
        bottom += h
    return d - b**2 / a
