"""What coils read of each other, kept in a file: a board need not be read again to be fitted again.

JSON: the board's name and fingerprint, frequencies in Hz, and for each the voltages per ampere of
every pair of coils, real and imaginary, with one standard deviation, and the duty of each coil.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from chladni.calibration.sensing import CoilReadings, ReadAt
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.files import read_text

KIND, BEGUN = "chladni coil readings", "chladni coil readings, begun"
"""Of all coils, and of some, which host/measuring/begun.py keeps."""
MOST_BYTES = 1_000_000
"""Sixteen coils take 150,000."""


def readings_file(readings: CoilReadings, board: Board) -> bytes:
    """The file's bytes."""
    found = {
        "kind": KIND,
        "board": board.name,
        "fingerprint": f"{board.fingerprint():#018x}",
        "seconds": readings.seconds,
        "frequencies_hz": readings.frequencies_hz.tolist(),
        "volts_per_ampere_real": readings.volts.real.tolist(),
        "volts_per_ampere_imag": readings.volts.imag.tolist(),
        "noise": readings.noise.tolist(),
        "duties": readings.duties.tolist(),
        "sessions": readings.sessions.tolist(),
        "high_hz": readings.high.hz,
        "high_volts_per_ampere_real": readings.high.volts.real.tolist(),
        "high_volts_per_ampere_imag": readings.high.volts.imag.tolist(),
        "high_noise": readings.high.spread.tolist(),
        "high_duties": readings.high.duties.tolist(),
        "high_sessions": readings.high.sessions.tolist(),
    }
    return json.dumps(found, indent=1).encode()


def load_readings(path: Path, board: Board) -> CoilReadings:
    """Read it back.

    Raises
    ------
    InputError
        No such file, or it is damaged, or of another board.
    """
    try:
        found: Any = json.loads(read_text(path, "readings", MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise InputError(
            str(path), f"{error}", "JSON", hint="`chladni calibrate` writes it"
        ) from None
    if not isinstance(found, dict) or found.get("kind") != KIND:
        if isinstance(found, dict) and found.get("kind") == BEGUN:
            hint = "the same command with the device reads the coils that are missing"
            raise InputError(str(path), "readings that were begun", "those of all coils", hint=hint)
        raise InputError(str(path), "another kind of file", f"{KIND!r} as its kind")
    if found.get("fingerprint") != f"{board.fingerprint():#018x}":
        given = f"readings of {found.get('board')}"
        raise InputError(str(path), given, f"those of {board.name}, as it is drawn now")
    count = len(board.actuators)
    try:
        hz = np.array(found["frequencies_hz"], np.float64)
        shape = (hz.size, count, count)
        keys = ("volts_per_ampere_real", "volts_per_ampere_imag", "noise", "duties")
        # Older files are of one session.
        sessions, high_sessions = (
            np.array(found.get(f"{begins}sessions", np.zeros(own)), np.float64)
            for begins, own in (("", shape[:2]), ("high_", shape[2:]))
        )
        low, high = (
            [np.array(found[begins + key], np.float64) for key in keys] for begins in ("", "high_")
        )
        seconds, high_hz = float(found["seconds"]), float(found["high_hz"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(str(path), f"{error}", "what `chladni calibrate` writes") from None
    fits = hz.ndim == 1 and hz.size > 0 and bool(np.all(hz > 0.0))
    fits = fits and 0.0 < high_hz < np.inf and 0.0 <= seconds < np.inf
    fits = fits and all(own.shape == shape for own in low[:3]) and low[3].shape == shape[:2]
    fits = fits and all(own.shape == shape[1:] for own in high[:3]) and high[3].shape == shape[2:]
    fits = fits and (sessions.shape, high_sessions.shape) == (shape[:2], shape[2:])
    numbers = (hz, sessions, high_sessions, *low, *high)
    fits = fits and all(np.all(np.isfinite(own)) for own in numbers)
    if not fits or not all(np.all(own > 0.0) for own in (*low[2:], *high[2:])):
        raise InputError(str(path), "damaged readings", f"numbers of {count} coils")
    at_high = ReadAt(high_hz, high[0] + 1j * high[1], high[2], high[3], high_sessions)
    return CoilReadings(hz, low[0] + 1j * low[1], low[2], low[3], sessions, at_high, seconds)
