"""What a drive may be asked to be best at. SSIM is what the paper is compared with."""

from __future__ import annotations

from dataclasses import dataclass

DECIBEL = 10.0 / 2.302585092994046
"""Decibels per unit of the natural logarithm of a power ratio."""


@dataclass(frozen=True)
class Weights:
    """ssim · SSIM + contrast · ln(contrast)."""

    ssim: float
    contrast: float


BALANCE = 0.02
"""SSIM that one decibel of contrast is worth in `balanced`; why, is in docs/five-actuators.md."""

OBJECTIVES = {
    "ssim": Weights(1.0, 0.0),
    "contrast": Weights(0.0, 1.0),
    "balanced": Weights(1.0, BALANCE * DECIBEL),
    "focus": Weights(0.0, 1.0),
}
"""By name. `contrast` is solved as an eigenproblem and `focus` as a cone program (methods/)."""
