"""What a drive may be asked to be best at, each with the method that finds the best one."""

from __future__ import annotations

from functools import partial

from chladni.drives.methods.base import Method
from chladni.drives.methods.contrast import contrast
from chladni.drives.methods.focus import focus
from chladni.drives.methods.phasor import phasor

DECIBEL = 10.0 / 2.302585092994046
"""Decibels per unit of the natural logarithm of a power ratio."""
BALANCE = 0.02
"""SSIM that one decibel of contrast is worth in `balanced`; why, is in docs/five-actuators.md."""

OBJECTIVES: dict[str, Method] = {
    "ssim": phasor,
    "contrast": contrast,
    "balanced": partial(phasor, contrast=BALANCE * DECIBEL),
    "focus": focus,
}
"""By the name the command line knows. SSIM is what the paper is compared with."""
