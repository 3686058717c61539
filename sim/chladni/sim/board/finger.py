"""What a pressing finger adds to a plate, and the fingers that a board file may name."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.sim.board.quantity import quantity

FINGERTIP_RADIUS = 6e-3
"""Radius of the disc a fingertip covers, m."""


@dataclass(frozen=True)
class Finger:
    """What a pressing fingertip adds to the plate: a mass, a damper and a spring, in parallel.

    SI units, at 160 Hz, spread over a contact of 6 mm radius. Values are of the right order: pulp
    stiffness under a flat probe goes from 0.6 to 4.4 N/mm between 0.2 and 2 N (Pawluk and Howe, J.
    Biomech. Eng. 121, 1999, 178-183), the damping of fingertips along the skin from 0.5 to 2 N·s/m
    (Wiertlewski and Hayward, J. Biomech. 45, 2012, 1869-1874).
    """

    mass: float = quantity("mass_g", 1e-3, 0.0, 1000.0, default=2e-3, is_written=True)
    damping: float = quantity("damping_n_s_per_m", 1.0, 0.0, 1000.0, default=2.0, is_written=True)
    stiffness: float = quantity(
        "stiffness_n_per_mm", 1e3, 0.0, 1000.0, default=600.0, is_written=True
    )


NO_FINGER = Finger(0.0, 0.0, 0.0)
FINGERS = {
    "none": NO_FINGER,
    "light": Finger(1e-3, 1.0, 300.0),
    "usual": Finger(2e-3, 2.0, 600.0),
    "firm": Finger(5e-3, 3.0, 1000.0),
}
USUAL = "usual"
"""Where a board names none. On a board with "none" drives make up for no finger; what the usual one
changes is reported all the same."""
