"""Effects that come with Chladni."""

from __future__ import annotations

from chladni.effects.effect import Click, Curve, Effect, Noise, Tone

SHIPPED = (
    Effect("click", (Click(0.0, 1.0, 160.0),)),
    Effect("double-click", (Click(0.0, 1.0, 160.0), Click(0.12, 0.7, 200.0))),
    Effect("tick", (Click(0.0, 0.6, 220.0),)),
    Effect("thud", (Click(0.0, 1.0, 80.0),)),
    Effect(
        "pulse", (Tone(0.0, 0.3, Curve((0.0, 0.12, 0.3), (0.0, 1.0, 0.0)), Curve.constant(160.0)),)
    ),
    Effect(
        "sweep",
        (
            Tone(
                0.0,
                1.0,
                Curve((0.0, 0.05, 0.95, 1.0), (0.0, 1.0, 1.0, 0.0)),
                Curve((0.0, 1.0), (80.0, 220.0)),
            ),
        ),
    ),
    Effect("texture", (Noise(0.0, 1.0, Curve((0.0, 0.05, 0.95, 1.0), (0.0, 1.0, 1.0, 0.0))),)),
)
