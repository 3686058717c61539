"""Effects: what a finger feels over time, and the files that haptic designers have them in."""

from chladni.effects.effect import Click, Clip, Curve, Effect, Noise, Tone
from chladni.effects.files import ReadEffect, read_effect, shipped_effects

__all__ = [
    "Click",
    "Clip",
    "Curve",
    "Effect",
    "Noise",
    "ReadEffect",
    "Tone",
    "read_effect",
    "shipped_effects",
]
