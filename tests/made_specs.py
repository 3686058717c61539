"""Small SPECs for tests."""

from __future__ import annotations

import copy
from typing import Any

SMALL: dict[str, Any] = {
    "name": "small",
    "actuators": "free",
    "design": {"coils": 2, "evaluations": 8, "samples": 1, "pitch_mm": 6.0},
    "plate": {"size_mm": [12.0, 32.0], "thickness_mm": 0.2, "material": "FR4"},
    "foundation": {"stiffness_n_per_mm3": 0.03, "loss_factor": 0.2},
    "drive": {"frequency_hz": 160.0, "max_gain": 10.0},
    "regions": {"pitch_mm": 4.0},
    "electronics": {
        "pwm_bits": 10, "ramp_ms": 4.0, "touch_timeout_ms": 100.0, "max_on_s": 10.0,
    },
}  # fmt: skip


def small(**blocks: Any) -> dict[str, Any]:
    """The small SPEC with these blocks' entries changed; None takes an entry out."""
    document = copy.deepcopy(SMALL)
    for name, value in blocks.items():
        if isinstance(value, dict) and isinstance(document.get(name), dict):
            document[name] |= value
            document[name] = {k: v for k, v in document[name].items() if v is not None}
        else:
            document[name] = value
    return document
