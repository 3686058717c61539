"""The matrices of each parity class of a plate: stiffness, mass, foundation and supports."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.forms.bending import plate_bending
from chladni.sim.ritz.forms.features import added_inertia, added_stiffness, foundation_form
from chladni.sim.ritz.forms.overlap import own_overlap
from chladni.sim.ritz.forms.samples import Samples
from chladni.sim.ritz.forms.supports import SupportConditions, support_conditions

FloatArray = NDArray[np.float64]


class Assembly:
    """Forms over one basis; `samples` are shared by all parity classes."""

    def __init__(self, basis: Basis, mirrors: Mirrors, area_points: tuple[int, int]) -> None:
        self.samples = Samples(basis, mirrors, area_points)

    def stiffness(self, parity: ParityBasis) -> FloatArray:
        """Strain energy form without the foundation's, shape (size, size), real symmetric."""
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

    def foundation(self, parity: ParityBasis, overlap: FloatArray) -> FloatArray | None:
        """Strain energy form of the foundation, shape (size, size); None where there is none."""
        return foundation_form(self.samples, parity, self.samples.own, overlap)

    def supports(self, parity: ParityBasis) -> SupportConditions:
        """What must vanish for the supports to hold."""
        return support_conditions(self.samples, parity)
