"""What discs, holes, round corners, springs, masses and a foundation add to a plate's energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.geometry import FoundationLayer, Inclusion, PlateGeometry
from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.forms.discs import bending_rows, signed_product
from chladni.sim.ritz.forms.foundation_points import is_left_out
from chladni.sim.ritz.forms.overlap import overlap_with, own_overlap
from chladni.sim.ritz.forms.rims import add_springs
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class DampedForms:
    """What has loss factors of its own: a foundation, feet and grommets of rubber.

    Attributes
    ----------
    stiffness
        Strain energy form of all of them, (functions, size).
    loss
        Each times its loss factor, summed, the same shape.
    loss_factors
        All there are.
    """

    stiffness: FloatArray
    loss: FloatArray
    loss_factors: frozenset[float]


def added_stiffness(samples: Samples, parity: ParityBasis, tables: Tables) -> FloatArray:
    """Strain energy with the basis of glued discs, holes and springs; (functions, size).

    Without the springs that have a loss factor of their own (`damped_forms`).
    """
    own, basis = samples.on_discs(parity, tables), samples.on_discs(parity, samples.own)
    geometry, sets = samples.basis.geometry, samples.sets
    total = samples.discs.added_stiffness(own, basis)
    if sets.offcuts.x.size:
        bent = _bend(samples, parity, samples.own)
        total -= (bent if tables is samples.own else _bend(samples, parity, tables)).T @ bent
    total = geometry.bending_stiffness * np.asarray(total)
    return np.asarray(total + _of_springs(samples, parity, tables, None))


def _of_springs(
    samples: Samples, parity: ParityBasis, tables: Tables, loss_factor: float | None
) -> FloatArray:
    """Strain energy of springs that lose so much, at points and on rims; (functions, size)."""
    points = [samples.basis.geometry.points[k] for k in samples.sets.point_index]
    stiffness = [own.stiffness * (own.loss_factor == loss_factor) for own in points]
    total = _at_points(samples, parity, tables, np.array(stiffness))
    add_springs(samples, parity, tables, total, loss_factor)
    return total


def added_inertia(samples: Samples, parity: ParityBasis, tables: Tables) -> FloatArray:
    """Kinetic energy with the basis of glued discs, holes and point masses; (functions, size)."""
    own, basis = samples.on_discs(parity, tables), samples.on_discs(parity, samples.own)
    geometry, sets = samples.basis.geometry, samples.sets
    total = samples.discs.added_inertia(own, basis)
    if sets.offcuts.x.size:
        weights = geometry.areal_mass * sets.offcuts.weights
        cut = tables.offcuts.values(parity, (0, 0)).T * weights
        total -= cut @ samples.own.offcuts.values(parity, (0, 0))
    features = [geometry.points[k].mass for k in sets.point_index]
    return np.asarray(total + _at_points(samples, parity, tables, np.array(features)))


def damped_forms(
    samples: Samples, parity: ParityBasis, tables: Tables, overlap: FloatArray
) -> DampedForms | None:
    """Forms of what has a loss factor of its own, of functions' `overlap` with the basis."""
    parts = {}
    for loss_factor in sprung_loss_factors(samples.basis.geometry):
        parts[loss_factor] = _of_springs(samples, parity, tables, loss_factor)
    layer = samples.basis.geometry.foundation
    if layer is not None:
        form = foundation_form(samples, parity, tables, overlap)
        parts[layer.loss_factor] = parts.get(layer.loss_factor, 0.0) + form
    if not parts:
        return None
    return DampedForms(
        np.asarray(sum(parts.values())),
        np.asarray(sum(factor * form for factor, form in parts.items())),
        frozenset(parts),
    )


def sprung_loss_factors(geometry: PlateGeometry) -> set[float]:
    """Loss factors that springs have of their own."""
    factors = [own.loss_factor for own in geometry.points if own.stiffness > 0.0]
    factors += [own.loss_factor for own in geometry.rims if own.is_sprung]
    return {factor for factor in factors if factor is not None}


def foundation_form(
    samples: Samples, parity: ParityBasis, tables: Tables, overlap: FloatArray
) -> FloatArray:
    """Strain energy form of the foundation with the basis, of functions' `overlap` with it."""
    layer = samples.basis.geometry.foundation
    assert layer is not None, "a plate on nothing has no such form"
    form = overlap
    if layer.strips:
        form = np.zeros(overlap.shape)
    elif layer.patches and tables is samples.own:
        form = own_overlap(samples, parity, layer.ratio)
    elif layer.patches:
        form = overlap_with(samples, parity, tables, layer.ratio)
    basis = samples.own.foundation.values(parity, (0, 0))
    own = basis if tables is samples.own else tables.foundation.values(parity, (0, 0))
    beside = signed_product(own, basis, samples.sets.foundation.weights)
    on_discs = samples.on_discs(parity, tables), samples.on_discs(parity, samples.own)
    left_out = samples.discs.overlap(*on_discs, lambda disc: _left_out(layer, disc))
    return np.asarray(layer.stiffness * (form + beside - left_out))


def _left_out(layer: FoundationLayer, disc: Inclusion) -> float:
    """How stiff the foundation would be under a disc where it has none, over what it is; else 0."""
    ratio = layer.ratio(np.array(disc.x), np.array(disc.y))
    return float(is_left_out(layer, disc)) * float(ratio)


def _bend(samples: Samples, parity: ParityBasis, tables: Tables) -> FloatArray:
    """B with BᵀB the energy form by D over the offcuts; shape (3 · points, functions)."""
    root = np.sqrt(samples.sets.offcuts.weights)[:, None]
    xx, xy, yy = (root * tables.offcuts.values(parity, d) for d in ((2, 0), (1, 1), (0, 2)))
    return bending_rows(xx, xy, yy, samples.basis.geometry.poisson)


def _at_points(
    samples: Samples, parity: ParityBasis, tables: Tables, strength: FloatArray
) -> FloatArray:
    """Σ strength · u v over the point features; shape (functions, size)."""
    own = tables.points.values(parity, (0, 0))
    weights = strength * samples.sets.points.weights
    return np.asarray((own.T * weights) @ samples.own.points.values(parity, (0, 0)))
