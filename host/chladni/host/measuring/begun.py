"""What was read of some of a board's coils, kept until all of them are.

JSON, as complete readings are (`calibration/readings_file.py`), with another kind: one entry for
each coil that listened, in the converter's steps, and the level at which each coil played.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from chladni.calibration.device_readings import Heard
from chladni.calibration.readings_file import BEGUN, MOST_BYTES
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.files import read_text

COUNTS = ("playing", "listening", "multiple", "values", "session")
SIZES = ("duty", "real", "imag", "noise")


@dataclass(frozen=True)
class Begun:
    """Readings that are not complete.

    Attributes
    ----------
    heard
        Of earlier sessions, by numbers below 0, which no device gives.
    levels
        By coil and multiple of 40 Hz, of the current that its supply allows.
    seconds
        That the device took.
    """

    heard: tuple[Heard, ...] = ()
    levels: dict[tuple[int, int], float] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def coils(self) -> int:
        """That played."""
        return len({one.playing for one in self.heard})


def begun_file(begun: Begun, board: Board) -> bytes:
    """The file's bytes."""
    heard = []
    for one in begun.heard:
        row = asdict(one)
        steps = row.pop("steps")
        heard.append(row | {"real": steps.real, "imag": steps.imag})
    levels = [[*key, level] for key, level in begun.levels.items()]
    found = {"kind": BEGUN, "board": board.name, "fingerprint": f"{board.fingerprint():#018x}"}
    told = {"seconds": begun.seconds, "levels": levels, "heard": heard}
    return json.dumps(found | told, indent=1).encode()


def load_begun(path: Path, board: Board) -> Begun:
    """Read it back; nothing of a file that is not there, or of complete readings.

    Raises
    ------
    InputError
        It is damaged, or of another board.
    """
    if not path.exists():
        return Begun()
    try:
        found: Any = json.loads(read_text(path, "readings", MOST_BYTES))
    except (ValueError, RecursionError):
        return Begun()
    if not isinstance(found, dict) or found.get("kind") != BEGUN:
        return Begun()
    if found.get("fingerprint") != f"{board.fingerprint():#018x}":
        given, hint = f"readings of {found.get('board')} that were begun", "keep these elsewhere"
        raise InputError(str(path), given, f"those of {board.name}, as it is drawn now", hint=hint)
    try:
        heard = tuple(_heard(row) for row in found["heard"])
        levels = {(int(coil), int(own)): float(level) for coil, own, level in found["levels"]}
        seconds = float(found["seconds"])
    except (KeyError, TypeError, ValueError) as error:
        hint = "remove it, and all coils are read"
        expected = "what `chladni calibrate` writes"
        raise InputError(str(path), f"{error}", expected, hint=hint) from None
    numbers = {own: -1 - k for k, own in enumerate(sorted({one.session for one in heard}))}
    earlier = tuple(
        Heard(**(vars(one) | {"session": numbers[one.session]}))  # a device counts from 1 again
        for one in heard
    )
    return Begun(earlier, levels, seconds)


def _heard(row: dict[str, Any]) -> Heard:
    playing, listening, multiple, values, session = (int(row[key]) for key in COUNTS)
    duty, real, imag, noise = (float(row[key]) for key in SIZES)
    return Heard(playing, listening, multiple, duty, complex(real, imag), noise, values, session)
