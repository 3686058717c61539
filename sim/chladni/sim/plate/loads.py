"""Forces on a plate, each of one newton in all."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Load:
    """A unit force spread evenly over a disc; a radius of 0 is a point force. Metres.

    A disc that overhangs an edge or a screw is clipped to the plate and still carries one newton.
    """

    x: float
    y: float
    radius: float = 0.0
