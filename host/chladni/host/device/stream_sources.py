"""What is streamed: a drive, the rows of a CSV file, a script's function, a finger's samples."""

from __future__ import annotations

import cmath
import io
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ArgumentError, InputError
from chladni.sim.files import read_text, read_whole

FloatArray = NDArray[np.float64]
Duties = Callable[[FloatArray], Any]
CSV_BYTES = 32_000_000
"""Fifty seconds of sixteen channels at 9,766 frames a second and four characters a duty."""
ROW_CHARACTERS = 1000
"""Sixteen duties with all their digits have 400."""
SCRIPT_BYTES = 1_000_000


def parse_drive(text: str) -> list[complex]:
    """Gains of "1@0,0.5@90": shares of full amplitude at phases in degrees.

    Raises
    ------
    InputError
        Not of that form, or a gain above 1.
    """
    gains = []
    for part in text.split(","):
        gain, _, phase = part.partition("@")
        try:
            value = cmath.rect(float(gain), cmath.pi / 180.0 * float(phase or 0.0))
            if not cmath.isfinite(value):
                raise ValueError
        except ValueError:
            raise ArgumentError("drive", part, "GAIN@DEGREES, the gain from 0 to 1") from None
        if not 0.0 <= float(gain) <= 1.0:
            raise ArgumentError("drive", part, "a gain from 0 to 1")
        gains.append(value)
    return gains


def read_duties(path: Path) -> FloatArray:
    """Duties, a row per frame and a column per channel; `check_duties` knows their range.

    Raises
    ------
    InputError
        Not readable, too long, not such numbers, or no rows.
    """
    data = read_whole(path, "csv", CSV_BYTES)
    try:
        # Lines, since loadtxt unpacks a file of .gz or .xz, however much is in it.
        with warnings.catch_warnings(action="ignore"):  # of no rows, which is said below
            duties = np.loadtxt(_short_lines(data), delimiter=",", ndmin=2)
    except ValueError as error:
        raise ArgumentError("csv", str(error), "rows of numbers", file=str(path)) from None
    if duties.size == 0:
        raise ArgumentError("csv", "nothing", "rows of numbers", file=str(path))
    return np.asarray(duties, dtype=np.float64)


def _short_lines(data: bytes) -> Iterator[str]:
    """Lines of a row of duties each; loadtxt takes many bytes for every character of a line."""
    for number, line in enumerate(io.TextIOWrapper(io.BytesIO(data), "utf-8-sig"), 1):
        if len(line) > ROW_CHARACTERS:
            raise ValueError(f"line {number} of {len(line):,} characters, for one row")
        yield line


def load_script(path: Path) -> Duties:
    """The function `duties(t)` of a Python file, which is run for it.

    Raises
    ------
    InputError
        Not readable, no Python, an error of its own, or no such function.
    """
    source = read_text(path, "script", SCRIPT_BYTES, "a Python file")
    names: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    try:
        exec(compile(source, str(path), "exec"), names)
    except (Exception, SystemExit) as error:
        raise ArgumentError("script", _message(error), "a file that runs", file=str(path)) from None
    function = names.get("duties")
    if not callable(function):
        raise ArgumentError("script", "no duties(t)", "a function of that name", file=str(path))
    return _ScriptFunction(function, path)


def scripted_duties(function: Duties, rate_hz: float, seconds: float) -> FloatArray:
    """What a script's function says for every frame; shape (frames, channels).

    Raises
    ------
    InputError
        It fails, or does not give a row per time.
    """
    t = np.arange(max(round(seconds * rate_hz), 1)) / rate_hz
    duties = function(t)
    if duties.ndim != 2 or len(duties) != len(t):
        raise InputError("duties(t)", f"shape {duties.shape}", f"({len(t)}, channels)")
    return np.asarray(duties)


class _ScriptFunction:
    """A script's function, whose errors name its file."""

    def __init__(self, function: Duties, path: Path) -> None:
        self._function, self._path = function, path

    def __call__(self, t: FloatArray) -> FloatArray:
        try:
            return np.asarray(self._function(t), dtype=np.float64)
        except (Exception, SystemExit) as error:
            expected = "an array of times taken, one of duties given back"
            raise InputError("duties(t)", _message(error), expected, file=str(self._path)) from None


def _message(error: BaseException) -> str:
    line = getattr(error, "lineno", None)
    where = f" in line {line}" if line else ""
    return f"{type(error).__name__}{where}: {error}"


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
    isolation_db, level_db
        As of `DeviceFingers.all`, by the device's table, at the end.
    """

    place_mm: tuple[float, float]
    samples: int
    fewest_waiting: int
    isolation_db: float | None
    level_db: float | None


class SignalSource:
    """A finger's samples out of blocks, which wait until the device has room for them."""

    def __init__(self, blocks: Iterable[FloatArray]) -> None:
        self._blocks = iter(blocks)
        self._waiting = np.zeros(0)
        self._has_more = True

    @property
    def is_over(self) -> bool:
        """Whether there are none any more."""
        self.next(1)
        return not self._has_more and not len(self._waiting)

    def next(self, count: int) -> FloatArray:
        """As many, or all that are left."""
        while self._has_more and len(self._waiting) < count:
            block = next(self._blocks, None)
            if block is None:
                self._has_more = False
            else:
                self._waiting = np.concatenate((self._waiting, np.asarray(block, dtype=float)))
        return self._waiting[:count]

    def drop(self, count: int) -> None:
        """Forget the first of them: they were sent."""
        self._waiting = self._waiting[count:]
