"""What plays after a press, and how a page hears of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.host.studio.boards.prepared import Prepared
from chladni.host.studio.messages.requests import Place
from chladni.host.studio.playing.finger_shares import PlayedFingers
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Played:
    """What the pins do once a touch has settled.

    Attributes
    ----------
    place_mm
        Of the finger that plays.
    drive
        As demodulated from the duties, newtons per newton of gain 1, shape (actuators,); the image
        point nearest to the finger moves in phase 0.
    latency_ms
        From the touch to the first changed duty, on the device's clock; None of a finger that
        moves, whose pins never rest.
    state
        Of the firmware's states, at the end.
    fingers
        All of them, where each has a signal of its own.
    """

    place_mm: Place
    drive: ComplexArray
    latency_ms: float | None
    state: str
    fingers: PlayedFingers | None = None


def turned(ready: Prepared, drive: ComplexArray, place_mm: Place) -> ComplexArray:
    """A drive with the common phase by which the board moves in phase 0 at a place."""
    fields = ready.solved.fields
    i = int(np.argmin(np.abs(fields.x - place_mm[0] * MM)))
    j = int(np.argmin(np.abs(fields.y - place_mm[1] * MM)))
    return np.asarray(drive * np.exp(-1j * np.angle(drive @ fields.values[:, i, j])))


def played_message(ready: Prepared, number: int, played: Played) -> dict[str, Any]:
    """A drive that plays: ten numbers of five coils, and what one gain is worth in newtons."""
    board, drive = ready.board, played.drive
    full = full_drive(board, drive, ready.solved.fields.frequency_hz)
    largest = float(np.abs(drive).max())
    several = {} if played.fingers is None else played.fingers.message()
    return {
        "type": "played",
        "number": number,
        "place_mm": list(played.place_mm),
        "drive": [[float(value.real), float(value.imag)] for value in drive],
        "newtons_per_gain": full.newtons / largest if full and largest > 0.0 else None,
        "latency_ms": played.latency_ms,
        "state": played.state,
    } | several
