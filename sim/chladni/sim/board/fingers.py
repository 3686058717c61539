"""Fingers: what a pressing one adds to a plate, where they are expected, what they are to feel."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.sim.board.quantity import MM, check_keys, part_of, quantity
from chladni.sim.errors import InputError

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


@dataclass(frozen=True)
class Focus:
    """What a drive of the objective `focus` keeps to. SI units unless the name says otherwise.

    A second finger `quieter_from` or more away gets at least `quieter_db` less than the finger, one
    `silent_from` or more away as little as can be, and the finger itself at least `floor_um` (peak
    of the sine, at the coils' limit).

    A fingertip covers 12 mm, so that is where the next one can lie at all; neighbours held side by
    side are 16 to 20 mm apart. 3 dB is just above the JND of 2.3 dB. 5 µm is 23 dB above what is
    just felt at 160 Hz (`sim.image.finger.THRESHOLDS`).

    Drives are made for foam `foam_ratio` times as stiff as the board file says, which has it from
    slow compression: at 160 Hz it may be 1 to 4 times as stiff, and drives for twice suit all that.

    A drive whose margin is the largest there is cannot be silent further off. Where less than
    `reserve_db` is left between the margin asked for and the largest, the margin gives way.
    """

    quieter_from: float = quantity("quieter_from_mm", MM, 0.0, 500.0, default=12e-3)
    quieter_db: float = quantity("quieter_db", 1.0, 0.0, 60.0, default=3.0)
    silent_from: float = quantity("silent_from_mm", MM, 1.0, 500.0, default=20e-3)
    floor_um: float = quantity("floor_um", 1.0, 0.0, 1000.0, default=5.0)
    reserve_db: float = quantity("reserve_db", 1.0, 0.0, 60.0, default=0.0)
    foam_ratio: float = quantity("foam_ratio", 1.0, 0.1, 10.0, default=1.0)


LEAST_APART = 16e-3
"""m, from one fingertip's middle to the next of a hand at rest."""


@dataclass(frozen=True)
class SeveralFingers:
    """A board's tables have responses, for drives of several fingers at once.

    Attributes
    ----------
    pitch
        Between stored responses, m; None for the coarsest that costs little isolation.
    frequencies_hz
        A section is made for each; none for the drive's own.
    apart
        Between two fingers' middles at least, m, wherever pairs are drawn: two hands lie farther
        apart than two fingers of one.
    """

    pitch: float | None = quantity("pitch_mm", MM, 0.5, 500.0, default=None)
    frequencies_hz: tuple[float, ...] = quantity(
        "frequencies_hz", 1.0, 1.0, 1000.0, count=0, default=()
    )
    apart: float = quantity("apart_mm", MM, 1e3 * LEAST_APART, 5000.0, default=LEAST_APART)


@dataclass(frozen=True)
class Active:
    """Where fingers are expected: the plate less a margin along all its edges, m."""

    margin: float = quantity("margin_mm", MM, 0.0, 500.0, default=3e-3)


def finger_from(value: object) -> Finger:
    """A finger by name, or by its numbers."""
    if isinstance(value, str) and value in FINGERS:
        return FINGERS[value]
    if not isinstance(value, dict):
        known = ", ".join(map(repr, FINGERS))
        raise InputError("finger", value, f"one of: {known}, or a block of the form [finger]")
    if not value:
        raise InputError(
            "finger", "an empty block", "a name or numbers", hint="is [fingers] meant?"
        )
    if "name" in value:
        check_keys(value, ["name"], required=[], where="finger.")
        return finger_from(value["name"])
    return part_of(Finger, value, "finger", lambda _, given, __: given)
