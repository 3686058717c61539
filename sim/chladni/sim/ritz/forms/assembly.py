"""The matrices of each parity class of a plate: stiffness, mass, what is damped, supports."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.forms.bending import plate_bending
from chladni.sim.ritz.forms.features import (
    DampedForms,
    added_inertia,
    added_stiffness,
    damped_forms,
)
from chladni.sim.ritz.forms.overlap import own_overlap
from chladni.sim.ritz.forms.samples import Samples
from chladni.sim.ritz.forms.supports import SupportConditions, support_conditions

FloatArray = NDArray[np.float64]


class Assembly:
    """Forms over one basis; `samples` are shared by all parity classes."""

    def __init__(self, basis: Basis, mirrors: Mirrors, area_points: tuple[int, int]) -> None:
        self.samples = Samples(basis, mirrors, area_points)

    def stiffness(self, parity: ParityBasis) -> FloatArray:
        """Strain energy form without what is `damped`, shape (size, size), real symmetric."""
        form = plate_bending(self.samples, parity)
        form *= self.samples.basis.geometry.bending_stiffness
        return form + added_stiffness(self.samples, parity, self.samples.own)

    def overlap(self, parity: ParityBasis) -> FloatArray:
        """∫ of the functions' products over the whole rectangle, shape (size, size), symmetric."""
        return own_overlap(self.samples, parity)

    def mass(self, parity: ParityBasis, overlap: FloatArray) -> FloatArray:
        """Kinetic energy form, shape (size, size), real symmetric."""
        added = added_inertia(self.samples, parity, self.samples.own)
        return self.samples.basis.geometry.areal_mass * overlap + added

    def damped(self, parity: ParityBasis, overlap: FloatArray) -> DampedForms | None:
        """Forms of what has loss factors of its own, shape (size, size); None of nothing."""
        return damped_forms(self.samples, parity, self.samples.own, overlap)

    def supports(self, parity: ParityBasis) -> SupportConditions:
        """What must vanish for the supports to hold."""
        return support_conditions(self.samples, parity)
