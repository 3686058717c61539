"""What several tests ask of a scorecard."""

from __future__ import annotations

import dataclasses

import numpy as np

from chladni.drives.scoring.scorecard import Scorecard


def all_finite(card: Scorecard) -> bool:
    """Whether no number of a scorecard is NaN or infinite."""
    numbers = dataclasses.asdict(card)
    numbers.pop("remark")
    felt = numbers.pop("felt") or {}
    # None says that there is no such number.
    known = [value for value in felt.values() if isinstance(value, float)]
    known += [*felt.get("finger_load", {}).values(), *numbers.pop("nulls").values()]
    known += [value for value in numbers.values() if value is not None]
    return bool(np.all(np.isfinite(known)))
