"""A board as a page draws it: its parts in millimetres, and its fields in bytes."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.wiring import coil_fault
from chladni.drives.fingers.silence import MOST_FINGERS
from chladni.host.studio.boards.measured_message import measured_message
from chladni.host.studio.boards.prepared import Prepared, ReadyBoard
from chladni.sim.board.parts import Actuator
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MOST_POINTS = 20_000
"""Of a field that is sent: 90 × 184 of the prototype's 179 × 367."""


def sent_axis(count: int, points: tuple[int, int]) -> FloatArray:
    """Which of an axis' image points are sent, as indices with fractions; both ends are."""
    stride = max(1, math.ceil(math.sqrt(points[0] * points[1] / MOST_POINTS)))
    return np.linspace(0.0, count - 1.0, math.ceil((count - 1) / stride) + 1)


def _resampled(values: ComplexArray, at: FloatArray, axis: int) -> ComplexArray:
    """Values between points, linearly. A field bends little from one image point to the next."""
    low = np.minimum(at.astype(np.intp), values.shape[axis] - 2)
    shape = [1] * values.ndim
    shape[axis] = -1
    share = (at - low).reshape(shape)
    return np.asarray(
        np.take(values, low, axis) * (1.0 - share) + np.take(values, low + 1, axis) * share
    )


def board_message(ready: Prepared, source: str, *, is_draft: bool = False) -> dict[str, Any]:
    """What a page draws of a board, and the shape of the fields that follow in bytes.

    Parameters
    ----------
    source
        Where drives come from, in a sentence.
    is_draft
        Whether it is the board before with a part elsewhere, which no table is built for.
    """
    board, fields = ready.board, ready.solved.fields
    points = board.image.points
    axes = [
        np.interp(sent_axis(axis.size, points), np.arange(axis.size), axis / MM)
        for axis in (fields.x, fields.y)
    ]
    return {
        "type": "board",
        "name": board.name,
        "objective": ready.choice.objective,
        "method": ready.choice.method,
        "source": source,
        "is_draft": is_draft,
        "has_table": not is_draft and isinstance(ready, ReadyBoard),
        "most_fingers": _most_fingers(ready) if not is_draft else 1,
        "frequency_hz": fields.frequency_hz,
        "size_mm": [side / MM for side in board.plate.size],
        "corner_radius_mm": board.plate.corner_radius / MM,
        "x_mm": axes[0].tolist(),
        "y_mm": axes[1].tolist(),
        "actuators": [
            {"name": one.name, "at_mm": _mm(one.at), "fault": _fault(one)}
            for one in board.actuators
        ],
        "measured": measured_message(board),
        "magnet_radius_mm": board.magnet.radius / MM if board.magnet else 0.0,
        "screws": [{"at_mm": _mm(s.at), "radius_mm": s.radius / MM} for s in board.screws],
        "feet_mm": [_mm(s.at) for s in board.springs] + [_mm(pin.at) for pin in board.pins],
        "fingertip_mm": metrics.FINGERTIP_RADIUS / MM,
        "second_finger_mm": metrics.SECOND_FINGER_DISTANCE / MM,
        "error_estimate": fields.error_estimate,
        "tolerance_met": fields.tolerance_met,
    }


def _most_fingers(ready: Prepared) -> int:
    """How many fingers get a signal of their own."""
    if not isinstance(ready, ReadyBoard) or not ready.follows_several:
        return 1
    panel = ready.board.panel
    return MOST_FINGERS if panel is None else panel.most_fingers


def _fault(own: Actuator) -> dict[str, str] | None:
    """What to look at, as `kind` and what is `said` of it."""
    fault = coil_fault(own)
    return asdict(fault) if fault else None


def _mm(place: tuple[float, float]) -> list[float]:
    return [value / MM for value in place]


def fields_bytes(ready: Prepared) -> bytes:
    """The actuators' fields: little-endian float32, (actuators, 2, y from the top, x), m/N.

    Real and imaginary parts are planes, so that a page adds them row by row as it paints.
    """
    values, points = ready.solved.fields.values, ready.board.image.points
    for axis in (1, 2):
        values = _resampled(values, sent_axis(values.shape[axis], points), axis)
    planes = np.stack((values.real, values.imag), axis=1)  # (actuators, 2, nx, ny)
    return planes.swapaxes(2, 3)[:, :, ::-1].astype("<f4").tobytes()
