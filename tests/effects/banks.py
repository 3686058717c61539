"""A bank that has all that there is, and what makes it again with other bytes."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from chladni.effects import Area, Bank, Circle, Clip, Curve, Effect, Noise, Polygon, Tone
from chladni.effects import shipped_effects as shipped
from chladni.effects.bank.pack import pack_bank

HUM = Effect(
    "hum",
    (
        Tone(0.0, 0.3, Curve((0.0, 0.1, 0.3), (0.0, 0.6, 0.1)), Curve((0.0, 0.3), (90.0, 200.0))),
        Tone(0.1, 0.2, Curve.constant(0.3), Curve.constant(120.0)),
    ),
    (0.1, 0.2),
)
RECORDED = Effect(
    "recorded", (Clip(0.01, np.sin(np.linspace(0.0, 12.0 * np.pi, 200)) * 0.7, 1000.0),)
)
HISS = Effect("hiss", (Noise(0.0, 0.2, Curve.constant(0.5)),))
ALL = Bank(
    "all",
    {name: shipped()[name] for name in ("click", "tick", "thud", "double-click")}
    | {"hum": HUM, "recorded": RECORDED, "hiss": HISS},
    (
        Area("key", Polygon.rectangle(-25.0, 20.0, -5.0, 40.0), press="click", release="thud"),
        Area(
            "knob",
            Circle((10.0, 30.0), 9.0),
            hold="tick",
            every_mm=4.0,
            level_db=-6.0,
            level_um=12.5,
        ),
        Area(
            "slide", Polygon.rectangle(0.0, -40.0, 20.0, 0.0), hold="tick", every_mm=5.0, along="y"
        ),
        Area("rest", enter="recorded", hold="hum", level_db=-3.0),
    ),
)
BYTES = pack_bank(ALL)


def with_crc(body: bytes) -> bytes:
    """Bytes whose last four are right again."""
    return body[:-4] + struct.pack("<I", zlib.crc32(body[:-4]))
