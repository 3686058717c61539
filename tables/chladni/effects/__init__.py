"""Effects: what a finger feels over time, and the files that haptic designers have them in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chladni.sim.lazy_names import lazy_names

if TYPE_CHECKING:
    from chladni.effects.bank.areas import Area, Bank, Circle, Everywhere, Polygon
    from chladni.effects.bank.bank_file import read_bank
    from chladni.effects.bank.pack import pack_bank
    from chladni.effects.bank.unpack import unpack_bank
    from chladni.effects.effect import Click, Clip, Curve, Effect, Noise, Tone
    from chladni.effects.files import ReadEffect, read_effect, shipped_effects

_PLACES = {
    "bank.areas": ("Area", "Bank", "Circle", "Everywhere", "Polygon"),
    "bank.bank_file": ("read_bank",),
    "bank.pack": ("pack_bank",),
    "bank.unpack": ("unpack_bank",),
    "effect": ("Click", "Clip", "Curve", "Effect", "Noise", "Tone"),
    "files": ("ReadEffect", "read_effect", "shipped_effects"),
}

__all__ = [
    "Area",
    "Bank",
    "Circle",
    "Click",
    "Clip",
    "Curve",
    "Effect",
    "Everywhere",
    "Noise",
    "Polygon",
    "ReadEffect",
    "Tone",
    "pack_bank",
    "read_bank",
    "read_effect",
    "shipped_effects",
    "unpack_bank",
]

__getattr__ = lazy_names(__name__, _PLACES)
