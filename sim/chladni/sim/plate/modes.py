"""Mode shapes of a plate, and what follows from them in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class ModeShapes:
    """The lowest modes of a plate, sampled on a grid or at points.

    Attributes
    ----------
    frequencies_hz
        Without loss, ascending, shape (modes,).
    shapes
        Mass-normalised: ∫ρh φ² dA (added masses included) is 1; shape (modes, …), kg^(−1/2).
    participation
        Work of each unit load on each mode, the mean of φ over it; shape (loads, modes).
    """

    frequencies_hz: FloatArray
    shapes: FloatArray
    participation: FloatArray

    @property
    def modal_masses(self) -> FloatArray:
        """Kinetic mass of each mode when its largest sampled deflection is 1; (modes,), kg."""
        largest = np.abs(self.shapes.reshape(self.shapes.shape[0], -1)).max(axis=1)
        return np.asarray(1.0 / np.maximum(largest, 1e-300) ** 2)

    def steady(self, frequency_hz: float, loss_factors: FloatArray) -> ComplexArray:
        """Sum of the modes' steady-state fields per newton; shape (loads, …).

        q = f/(ω²ₙ(1 + iηₙ) − ω²). Truncated: use the plate's own `respond` for whole fields.
        """
        squares = (2.0 * np.pi * self.frequencies_hz) ** 2
        omega = 2.0 * np.pi * frequency_hz
        gain = 1.0 / (squares * (1.0 + 1j * loss_factors) - omega**2)
        return np.asarray(np.tensordot(self.participation * gain, self.shapes, axes=1))

    def from_rest(
        self,
        forces: ComplexArray,
        frequency_hz: float,
        times: FloatArray,
        loss_factors: FloatArray,
    ) -> FloatArray:
        """Displacement of a plate that lies still until its loads set in at t = 0.

        Every mode obeys q̈ + ηₙωₙq̇ + ω²ₙq = Re(f exp(iωt)); its answer is the steady state plus
        the free vibration that cancels it at t = 0, both in closed form. The viscous coefficient
        ηₙωₙ dissipates at the mode what the structural loss does.

        Parameters
        ----------
        forces
            Complex amplitude of every load, N; shape (loads,).
        frequency_hz
            Drive frequency.
        times
            Seconds from the start, shape (times,).
        loss_factors
            ηₙ per mode, below 2; shape (modes,).

        Returns
        -------
        FloatArray
            Shape (times, …), m.
        """
        omega, own = 2.0 * np.pi * frequency_hz, 2.0 * np.pi * self.frequencies_hz
        force = self.participation.T @ forces
        decay = loss_factors * own / 2.0
        ringing = np.sqrt(own**2 - decay**2)
        steady = force / (own**2 + 1j * loss_factors * own * omega - omega**2)
        # q(0) = 0 and q̇(0) = 0 fix the free part A cos + B sin.
        a = -steady.real
        b = -(decay * steady.real + (1j * omega * steady).real) / ringing
        t = times[:, None]
        free = np.exp(-decay * t) * (a * np.cos(ringing * t) + b * np.sin(ringing * t))
        motion = (steady * np.exp(1j * omega * t)).real + free
        return np.asarray(np.tensordot(motion, self.shapes, axes=1))
