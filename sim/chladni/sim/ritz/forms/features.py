"""What discs, holes, round corners, springs, masses and a foundation add to a plate's energies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.geometry import FoundationLayer, Inclusion
from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.forms.discs import bending_rows, signed_product
from chladni.sim.ritz.forms.foundation_points import is_left_out
from chladni.sim.ritz.forms.rims import add_springs
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]


def added_stiffness(samples: Samples, parity: ParityBasis, tables: Tables) -> FloatArray:
    """Strain energy with the basis of glued discs, holes and springs; (functions, size)."""
    own, basis = samples.on_discs(parity, tables), samples.on_discs(parity, samples.own)
    geometry, sets = samples.basis.geometry, samples.sets
    total = samples.discs.added_stiffness(own, basis)
    if sets.offcuts.x.size:
        bent = _bend(samples, parity, samples.own)
        total -= (bent if tables is samples.own else _bend(samples, parity, tables)).T @ bent
    total = geometry.bending_stiffness * np.asarray(total)
    features = [geometry.points[k].stiffness for k in sets.point_index]
    total += _at_points(samples, parity, tables, np.array(features))
    add_springs(samples, parity, tables, total)
    return np.asarray(total)


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


def foundation_form(
    samples: Samples, parity: ParityBasis, tables: Tables, overlap: FloatArray
) -> FloatArray | None:
    """Strain energy form of the foundation with the basis, of functions' `overlap` with it."""
    layer = samples.basis.geometry.foundation
    if layer is None:
        return None
    form = overlap if not layer.strips else np.zeros(overlap.shape)
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
