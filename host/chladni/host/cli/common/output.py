"""What every command shares: answers for people or programs, progress, figures, output paths."""

from __future__ import annotations

import contextlib
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import HEAVY_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table as RichTable

from chladni.host.cli.common.terms import LEFT_OUT, WORDS, unit_of, words_of
from chladni.sim.board.quantity import METRES, are_metres
from chladni.sim.errors import InputError, StoppedError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Place = tuple[float, float]


def parse_place(text: str, option: str) -> Place:
    """`X,Y` in millimetres."""
    parts = text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) != 2 or not all(math.isfinite(value) for value in values):
        raise InputError(option, text, "two numbers X,Y in mm from the board's centre")
    if are_metres(values):
        say(f"{option} {text}: {METRES}")
    return values[0], values[1]


def answer(result: dict[str, Any], *, as_json: bool, title: str = "") -> None:
    """Print a result: one JSON object for programs, a table for people.

    People read a `verdict` first, above the table.
    """
    if as_json:
        sys.stdout.write(json.dumps(result, allow_nan=False) + "\n")
        return
    table = sheet(title=escape(title) or None, show_header=False)
    for key, value in result.items():
        if key == "verdict":
            continue
        for row_key, text in _rows(key, value):
            # Names come from files; what looks like markup in them is a name all the same.
            table.add_row(escape(row_key), escape(text))
    console = Console()
    if result.get("verdict"):
        console.print(escape(result["verdict"]), highlight=False)
    console.print(table)


def sheet(*, title: str | None, show_header: bool = True) -> RichTable:
    """A table for people, its title on the left; without a frame where a terminal has no lines."""
    frame = None if os.environ.get("TERM") == "dumb" else HEAVY_HEAD
    return RichTable(title=title, title_justify="left", show_header=show_header, box=frame)


NAMES = ("actuator", "name", "channel", "waveform", "method", "at_ms", "pin", "port")
"""What an entry of a list is called by, the first that it has."""
ROUNDED = 1e-12
"""What is smaller, in whatever unit, is what rounding leaves of 0."""
SPREAD = ["median", "p10", "p90"]


def _rows(key: str, value: Any) -> Iterator[tuple[str, str]]:
    """What people read of one key: nothing of what is left out, unknown or empty."""
    is_name = isinstance(key, OwnName)
    if (key in LEFT_OUT and not is_name) or value is None or value == {}:
        return
    # A text has its unit; names of settings are to be typed.
    label = WORDS.get(key, key.replace("_", " ")) if isinstance(value, str) else words_of(key)
    label = str(key) if is_name else label
    if isinstance(value, dict) and list(value) != SPREAD:
        for name, item in value.items():
            for own, text in _rows(name, item):
                yield f"{label} · {own}", text
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            name = next((name for name in NAMES if name in item), next(iter(item)))
            rest = ((own, part) for own, part in item.items() if own != name)
            told = ", ".join(f"{own} {text}" for one in rest for own, text in _rows(*one))
            yield f"{label} · {_text(name, item[name])}", told
    else:
        yield label, _text(key, value)


def _text(key: str, value: Any) -> str:
    """A value with its unit."""
    if unit_of(key) == "dB":
        value = _to_a_thousandth(value)
    if isinstance(value, dict):
        middle, low, high = (_text("", part) for part in value.values())
        return _with_unit(f"{middle}, from {low} to {high} in the middle 80 %", key)
    if isinstance(value, (list, tuple)):
        between = "; " if any(isinstance(item, (list, tuple)) for item in value) else ", "
        return _with_unit(between.join(_text("", item) for item in value) or "none", key)
    if isinstance(value, str):
        return value
    return _with_unit(_number(value), key) if value is not None else "–"


def _to_a_thousandth(value: Any) -> Any:
    """Levels that are less than that apart are one."""
    if isinstance(value, dict):
        return {name: _to_a_thousandth(own) for name, own in value.items()}
    return round(value, 3) + 0.0 if isinstance(value, float) else value


def without_rounding(value: float) -> float:
    """A number, or 0 where only rounding is left of it."""
    return 0.0 if abs(value) < ROUNDED else value


def _number(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        value = without_rounding(value)
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    return str(value)


def _with_unit(text: str, key: str) -> str:
    unit = unit_of(key) if text != "none" else ""
    first, comma, rest = text.partition(", from ")
    return f"{first} {unit}{comma}{rest}".replace(" °", "°") if unit else text


def say(text: str) -> None:
    """A line on stderr: what a command is doing, beside its result."""
    sys.stderr.write(f"chladni: {text}\n")


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure, and print its path on stderr."""
    # What draws takes a third of a second to load, and most commands draw nothing. So commands too
    # load their figures where they draw them.
    from chladni.host.figures.fields import save  # noqa: PLC0415

    save(figure, path)
    say(f"figure: {path}")


def say_unmet(estimate: float, tolerance: float) -> None:
    """One line on stderr if fields are less exact than was asked for."""
    if estimate > tolerance:
        sys.stderr.write(
            f"chladni: the fields' estimated error is {estimate:.2g}, above the tolerance of "
            f"{tolerance:g}\n"
        )


NO_COIL = "the board file has no [coil]: no volts, and µm only per newton of the loudest coil"
ARRAYS = ("", ".npz")
"""Endings of what NumPy reads."""
TEXT = ("", ".csv")


class OwnName(str):
    """A key that is somebody's name: it stands as it is, though a key of ours is the same."""

    __slots__ = ()


def by_name(key: str, rows: Sequence[dict[str, Any]], *, as_json: bool) -> dict[str, Any]:
    """Rows with a `name` as programs have them, all under a key, or each under its name."""
    return {key: rows} if as_json else {OwnName(one["name"]): one | {"name": None} for one in rows}


def check_output(
    path: Path,
    option: str,
    endings: tuple[str, ...] = (),
    inputs: Sequence[str | Path] = (),
) -> Path:
    """A path that can be written, found out before any work is done.

    Parameters
    ----------
    endings
        That the name may have; another one would promise another format.
    inputs
        Files that the command reads, which a slip of the pen would write over.
    """
    if endings and path.suffix not in endings:
        expected = f"a name that ends in {' or '.join(filter(None, endings))}"
        expected += " or has no ending" if "" in endings else ""
        raise InputError(option, str(path), expected)
    for given in inputs:
        # By os.path, for which a name that no file can have is one that is not there.
        if os.path.exists(given) and os.path.exists(path) and os.path.samefile(given, path):
            hint = "nothing would be left of it"
            raise InputError(option, str(path), "another file than the one read", hint=hint)
    if path.exists() and not path.is_file():
        raise InputError(option, str(path), "a file name, not a folder or a device")
    if not path.parent.is_dir():
        raise InputError(option, str(path), "a file in a folder that exists")
    if not os.access(path.parent, os.W_OK):
        raise InputError(option, str(path), "a file in a folder that can be written")
    return path


FIRST_LINE_S, NEXT_LINE_S = 20.0, 60.0
SOON_S = 5.0
"""The first line of work that says before its first piece that it goes on."""
KEPT_S = 3.0
"""Pieces that come within so long an earlier run did."""
BASIS_S = 10.0
"""An estimate is by pieces of so long at least: those of several processes come together."""


class _Lines:
    """What a log gets in place of a bar: how far long work is, and what is left of it.

    What is left is estimated by the pieces since the line before: a machine gets other work.
    """

    def __init__(self, label: str, limit_s: float | None, batch: int) -> None:
        self._label, self._begun, self._due_s = label, time.monotonic(), FIRST_LINE_S
        self._limit_s, self._batch = limit_s or math.inf, batch
        self._total, self._is_told = 0, False
        # Before the first piece plates are solved and processes begin, and an earlier run may have
        # done a part: neither says how long the other pieces take.
        self._from_s, self._from_done, self._first = 0.0, 0, 0

    def tell(self, done: int, total: int, far: str) -> None:
        """`far`: how far it is, in words."""
        passed = time.monotonic() - self._begun
        if total != self._total or passed < KEPT_S or not done:
            self._first, self._total = done, total
        if done - self._first <= self._batch:
            self._from_s, self._from_done = passed, done
        if not done:
            self._due_s = SOON_S
        if passed < self._due_s or done >= total:
            return
        since, took_s = done - self._from_done, passed - self._from_s
        if since > 0 and took_s >= BASIS_S:
            left_s = took_s * (total - done) / since
            if passed < self._limit_s:
                left_s = min(left_s, self._limit_s - passed)
            say(f"{self._label}: {far}, about {left_s:.0f} s are left")
            self._from_s, self._from_done, self._due_s = passed, done, passed + NEXT_LINE_S
        elif not self._is_told:
            say(f"{self._label}: {far} so far")
        self._is_told = True


@contextlib.contextmanager
def progress_bar(
    label: str,
    *,
    kept: Path | Callable[[], bool] | bool | None = None,
    limit_s: float | None = None,
    batch: int = 0,
    in_percent: bool = False,
) -> Iterator[Callable[[int, int], None]]:
    """A callback (done, all) that draws a bar on stderr, or writes lines if that is no terminal.

    Parameters
    ----------
    kept
        File that a part of the work is kept in, or what tells whether one is; or whether a device
        keeps whatever was done. Only if there is something does Ctrl-C's message promise that the
        same command goes on from it.
    limit_s
        Seconds after which the work ends early; no estimate is longer.
    batch
        Pieces that are prepared together: the first so many say nothing of the others' time.
    in_percent
        How far the work is, not in pieces: for one whose number changes on the way.

    Raises
    ------
    StoppedError
        Ctrl-C.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn() if in_percent else MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    lines = _Lines(label, limit_s, batch)

    def tell(done: int, total: int) -> None:
        if in_percent:
            percent = max(bar.tasks[0].completed, 100.0 * done / max(total, 1))
            bar.update(task, completed=percent, total=100.0)
            far = f"{percent:.0f} %"
        else:
            bar.update(task, completed=done, total=total)
            far = f"{done} of {total}"
        if not console.is_terminal:
            lines.tell(done, total, far)

    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=None)
        try:
            yield tell
        except KeyboardInterrupt:
            if isinstance(kept, Path):
                is_kept = kept.exists()
            else:
                is_kept = bool(kept() if callable(kept) else kept and bar.tasks[0].completed)
            again = "the same command goes on from what was kept" if is_kept else ""
            raise StoppedError(f"{label}: interrupted", hint=again) from None
