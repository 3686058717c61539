"""By what a SPEC weighs boards: the terms of `[design.weights]`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from chladni.sim.board.quantity import perhaps
from chladni.sim.errors import InputError

TERMS = (
    "second_finger_db", "second_finger_16mm_db", "second_finger_20mm_db", "second_finger_25mm_db",
    "finger_db", "focal_error_mm", "coils", "area_cm2", "mass_g", "built_20mm_db",
    "built_finger_db", "fingers_2_db", "fingers_3_db", "fingers_4_db", "fingers_5_db",
    "fingers_click_db", "fingers_um_db",
)  # fmt: skip
"""What weights may be given to. Of dB and µm the 10th percentile over places and random boards
counts, of the focal error the 90th; it, coils, area and mass count against a board. `finger_db` is
20·log₁₀ of the micrometres under the finger. `built_…` are what is left as built: under a film,
pressed with 1 N, warm, on stiffer foam. `fingers_…` are the isolation of so many fingers that all
press, and, at the largest number with a weight, what a click keeps in place of a tone, and
20·log₁₀ of the micrometres that each then gets."""
OF_COILS = frozenset({"finger_db", "built_finger_db"})
"""Without a coil's force they are of no micrometres at all."""
BUILT_TERMS = frozenset({"built_20mm_db", "built_finger_db"})
FINGER_TERMS = {f"fingers_{count}_db": count for count in (2, 3, 4, 5)}
FINGER_CLICK, FINGER_LEVEL = "fingers_click_db", "fingers_um_db"
OF_FINGERS = frozenset({*FINGER_TERMS, FINGER_CLICK, FINGER_LEVEL})
"""Terms of several."""
COSTS = frozenset({"coils", "area_cm2", "mass_g"})
"""Terms that are of no finger."""
PLAIN_WEIGHTS = {"second_finger_20mm_db": 1.0}
"""Where a SPEC gives none."""


def weights_of(weights: Any) -> Mapping[str, float]:
    """The weights of a block; an error names the one that is wrong."""
    if weights is None:
        return dict(PLAIN_WEIGHTS)
    if not isinstance(weights, dict) or not weights:
        raise InputError("design.weights", weights, "a block of weights by name")
    for name, weight in weights.items():
        if name not in TERMS:
            known = f"one of: {', '.join(TERMS)}"
            raise InputError(f"design.weights.{name}", weight, known, hint=perhaps(name, TERMS))
        is_number = isinstance(weight, int | float) and not isinstance(weight, bool)
        if not is_number or not 0.0 <= weight <= 1e6:
            raise InputError(f"design.weights.{name}", weight, "a number from 0 to 1e6")
    return {name: float(weight) for name, weight in weights.items()}
