"""A signal under a finger that a host holds, sent as the device has room for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.device_fingers import DeviceFingers
from chladni.host.device.link import Link, LinkError
from chladni.host.protocol.link import SIGNAL_HZ, SIGNAL_SAMPLES

FloatArray = NDArray[np.float64]

TURN_S = 0.01
"""Between two sendings: a fifth of what a device keeps."""
AFTER_S = 0.05
"""For which the finger stays, so that the last of it rings on."""


@dataclass(frozen=True)
class PlayedSignal:
    """How a signal went.

    Attributes
    ----------
    place_mm
        Where it played: the nearest place on the board.
    samples
        That were sent.
    fewest_waiting
        The fewest that waited on the device before the last were sent; at 0 there was a gap.
    """

    place_mm: tuple[float, float]
    samples: int
    fewest_waiting: int


def play_signal(
    link: Link,
    fingers: DeviceFingers,
    samples: FloatArray,
    at_mm: tuple[float, float],
    *,
    finger: int = 0,
    level: float = 1.0,
) -> PlayedSignal:
    """Put a finger down, play a signal under it, and lift it once that is over.

    Parameters
    ----------
    samples
        -1 to 1, `SIGNAL_HZ` of them a second.
    at_mm
        Where, mm from the board's centre.
    finger
        0 to 4. Others that are held stay, and are left still where the table has responses.
    level
        Of the configured level, 0 to 1.

    Raises
    ------
    LinkError
        The device has no table, or ended the touch.
    """
    fingers.set_signal(finger, level)
    sent, filled = fingers.send(finger, samples[:SIGNAL_SAMPLES])
    place = fingers.touch(finger, *at_mm)
    fewest = SIGNAL_SAMPLES
    while sent < len(samples):
        begun = link.wire.now_s()
        link.wait(TURN_S)
        # A wire is slow: no more than there may be room for.
        played = int((link.wire.now_s() - begun) * SIGNAL_HZ)
        room = SIGNAL_SAMPLES - filled + played
        taken, filled = fingers.send(finger, samples[sent : sent + room])
        fewest = min(fewest, filled - taken)
        sent += taken
    _, left = fingers.send(finger, [])
    link.wait(left / SIGNAL_HZ + AFTER_S)
    is_down = any(one["finger"] == finger for one in fingers.all())
    if not is_down:
        raise LinkError(
            "the device ended the touch", hint="`chladni device info` shows its state and faults"
        )
    fingers.lift(finger)
    return PlayedSignal(place, sent, fewest)
