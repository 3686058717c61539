"""The studio's socket as tests speak to it, without a page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect

from studio.conftest import Studio

TIMEOUT_S = 60.0
PRESS = {"type": "press", "number": 1, "finger": 0, "x_mm": 10.0, "y_mm": 25.0}

VOICE = {"type": "voice", "number": 1, "finger": 0, "tone_hz": 100.0, "level": 0.5}


@contextmanager
def opened(studio: Studio, **options: Any) -> Iterator[ClientConnection]:
    """As the page opens it, and its board received."""
    origin = f"http://127.0.0.1:{studio.port}"
    with connect(studio.socket_url, **({"origin": origin} | options)) as own:
        while told(own)["type"] != "board":
            pass
        own.recv(TIMEOUT_S)
        yield own


def told(own: ClientConnection) -> dict[str, Any]:
    message = json.loads(own.recv(TIMEOUT_S))
    assert isinstance(message, dict)
    return message


def told_of(own: ClientConnection, kind: str) -> dict[str, Any]:
    while (message := told(own))["type"] != kind:
        pass
    return message


def read_fields(board: dict[str, Any], data: bytes) -> NDArray[np.complex128]:
    """Fields as they travel, as (actuators, nx, ny)."""
    shape = len(board["actuators"]), 2, len(board["y_mm"]), len(board["x_mm"])
    planes = np.frombuffer(data, "<f4").reshape(shape)[:, :, ::-1].swapaxes(2, 3)
    return np.asarray(planes[:, 0] + 1j * planes[:, 1])
