"""Loads as a parity class meets them, and what deflections of their own bring into a class."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.forms.bending import edge_work
from chladni.sim.ritz.forms.features import (
    DampedForms,
    added_inertia,
    added_stiffness,
    damped_forms,
)
from chladni.sim.ritz.forms.overlap import overlap_with
from chladni.sim.ritz.forms.samples import Samples, Tables
from chladni.sim.ritz.forms.supports import support_moments

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ClassLoad:
    """Loads as one parity class meets them, each of shape (class size or conditions, loads).

    `force` acts at every frequency, `inertia` times ω²/(1 + iη), what is `damped` by loss factors
    of its own times −(1 + iη′)/(1 + iη), and the solution's support moments must cancel
    `supports`/(1 + iη); None where the loads bring no deflection of their own.
    """

    force: NDArray[Any]
    inertia: FloatArray
    supports: FloatArray | None
    damped: DampedForms | None = None


def load_of_deflections(samples: Samples, parity: ParityBasis, tables: Tables) -> ClassLoad:
    """What loads do to a class by their deflections on the endless plate, given by `tables`."""
    geometry = samples.basis.geometry
    edges = geometry.bending_stiffness * edge_work(samples, parity, tables)
    overlap = overlap_with(samples, parity, tables)
    damped = damped_forms(samples, parity, tables, overlap)
    inertia = geometry.areal_mass * overlap + added_inertia(samples, parity, tables)
    return ClassLoad(
        force=-(edges + added_stiffness(samples, parity, tables)).T,
        inertia=inertia.T,
        supports=support_moments(samples, parity, tables),
        damped=damped and DampedForms(damped.stiffness.T, damped.loss.T, damped.loss_factors),
    )
