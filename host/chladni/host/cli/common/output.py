"""What every command shares: parsing places, answering people or programs, writing whole files."""

from __future__ import annotations

import contextlib
import json
import math
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table as RichTable

from chladni.sim.errors import InputError, StoppedError

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
    return values[0], values[1]


def answer(result: dict[str, Any], *, as_json: bool, title: str = "") -> None:
    """Print a result: one JSON object for programs, a table for people."""
    if as_json:
        sys.stdout.write(json.dumps(result, allow_nan=False) + "\n")
        return
    table = RichTable(title=escape(title) or None, show_header=False, title_justify="left")
    for key, value in result.items():
        for row_key, text in _rows(key, value):
            # Names come from files; what looks like markup in them is a name all the same.
            table.add_row(escape(row_key), escape(text))
    Console().print(table)


def _rows(key: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        if list(value) == ["median", "p10", "p90"]:
            yield key.replace("_", " "), _text(value)
            return
        for name, item in value.items():
            yield f"{key} · {name.replace('_', ' ')}", _text(item)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for item in value:
            label, *rest = item.items()
            words = ", ".join(f"{name.replace('_', ' ')} {_text(part)}" for name, part in rest)
            yield f"{key} · {label[1]}", words
    else:
        yield key.replace("_", " "), _text(value)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    if isinstance(value, dict):
        if list(value) == ["median", "p10", "p90"]:
            return "{}, from {} to {} at 80 % of places".format(*map(_text, value.values()))
        return ", ".join(f"{name.replace('_', ' ')} {_text(item)}" for name, item in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_text(item) for item in value)
    return "–" if value is None else str(value)


def say(text: str) -> None:
    """A line on stderr: what a command is doing, beside its answer."""
    sys.stderr.write(f"chladni: {text}\n")


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


def check_output(path: Path, option: str, endings: tuple[str, ...] = ()) -> Path:
    """A path that can be written, found out before any work is done.

    Parameters
    ----------
    endings
        That the name may have; another one would promise another format.
    """
    if endings and path.suffix not in endings:
        raise InputError(option, str(path), f"a name that ends in {endings[-1]}")
    if path.exists() and not path.is_file():
        raise InputError(option, str(path), "a file name, not a folder or a device")
    if not path.parent.is_dir():
        raise InputError(option, str(path), "a file in a folder that exists")
    if not os.access(path.parent, os.W_OK):
        raise InputError(option, str(path), "a file in a folder that can be written")
    return path


@contextlib.contextmanager
def progress_bar(label: str, *, keeps: bool = False) -> Iterator[Callable[[int, int], None]]:
    """A callback (done, all) that draws a bar on stderr, if that is a terminal.

    Parameters
    ----------
    keeps
        Whether the same command, run again after Ctrl-C, goes on where it stopped.

    Raises
    ------
    StoppedError
        Ctrl-C.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
               TimeRemainingColumn())  # fmt: skip
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=None)
        try:
            yield lambda done, total: bar.update(task, completed=done, total=total)
        except KeyboardInterrupt:
            again = "; the same command goes on from what was kept" if keeps else ""
            raise StoppedError(f"{label}: interrupted{again}") from None
