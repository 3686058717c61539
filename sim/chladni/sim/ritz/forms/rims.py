"""Energies on the rims of circles: the jumps that rim functions make there, and springs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.circles.terms import radial_derivative
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]


def add_jump_work(samples: Samples, parity: ParityBasis, rows: FloatArray) -> None:
    """Add the work of the jumps in moment and shear that rim functions have on their rim, by D."""
    rims, own = samples.sets.rims, samples.own.rims
    moments = {k: rim.moments(own[k], parity) for k, rim in rims.items()}
    for k, member in enumerate(parity.members):
        circle = samples.basis.circles[member.circle]
        function, sine = circle.members[member.column]
        if not function.outside:
            continue
        second, third = (
            radial_derivative(function.outside, k) - radial_derivative(function.inside, k)
            for k in (2, 3)
        )
        # Moment jump −f'' and shear jump −(f''' + f''), in units of D/R² and D/R³.
        component = 2 * function.order - (0 if sine or function.order == 0 else 1)
        value, slope = (moment[component] for moment in moments[member.circle])
        scale = np.pi * (2.0 if function.order == 0 else 1.0) / circle.radius**2
        rows[k] += member.orbit * scale * ((second + third) * value - second * slope)


def add_springs(
    samples: Samples,
    parity: ParityBasis,
    tables: Tables,
    total: FloatArray,
    loss_factor: float | None,
) -> None:
    """Add the strain energy of sprung rims that lose so much; (functions, size)."""
    for k, support in enumerate(samples.basis.geometry.rims):
        if k in samples.sets.rims and support.is_sprung and support.loss_factor == loss_factor:
            rim = samples.sets.rims[k]
            orbit = samples.mirrors.orbit(support.x, support.y)
            value, slope = rim.values(tables.rims[k], parity)
            basis_value, basis_slope = rim.values(samples.own.rims[k], parity)
            # `values` gives R ∂w/∂r, the spring resists ∂w/∂r.
            rotational = support.rotational / support.radius**2
            mean = orbit * rim.points.weights
            total += support.stiffness * (value.T * mean) @ basis_value
            total += rotational * (slope.T * mean) @ basis_slope
