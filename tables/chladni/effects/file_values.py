"""Values of a JSON or TOML file, each with the place it stands at, for errors that name it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from chladni.sim.board.quantity import perhaps
from chladni.sim.errors import ArgumentError, Faults, InputError, MissingError
from chladni.sim.files import read_text

MOST_BYTES = 8 << 20
_MISSING = object()


@dataclass(frozen=True)
class FileValue:
    """A value, `_MISSING` where there is none, and where it stands."""

    file: str
    place: str
    value: object

    def error(self, expected: str, hint: str = "") -> InputError:
        """That it should have been something else."""
        if self.value is _MISSING:
            return MissingError(self.place, expected, file=self.file)
        shown = self.value
        if isinstance(shown, str):
            shown = shown[:40]
        elif not isinstance(shown, int | float):
            shown = "a table" if isinstance(shown, dict) else "a list" if shown else "nothing"
        return InputError(self.place or "file", shown, expected, file=self.file, hint=hint)

    def __getitem__(self, key: str) -> FileValue:
        """Of an object."""
        if not isinstance(self.value, dict):
            raise self.error("a table of keys")
        place = f"{self.place}.{key}" if self.place else key
        return FileValue(self.file, place, self.value.get(key, _MISSING))

    def __iter__(self) -> Iterator[FileValue]:
        """Of a list."""
        if not isinstance(self.value, list):
            raise self.error("a list")
        for k, one in enumerate(self.value):
            yield FileValue(self.file, f"{self.place}[{k}]", one)

    def keys(self) -> list[str]:
        """Of an object."""
        if not isinstance(self.value, dict):
            raise self.error("a table of keys")
        return list(self.value)

    def check_keys(self, known: Iterable[str], faults: Faults) -> None:
        """Keep an error for each key that is none of the known ones."""
        for key in self.keys():
            if key not in known:
                with faults.kept():
                    expected = f"one of {', '.join(known)} for a key"
                    raise self[key].error(expected, perhaps(key, known))

    @property
    def is_there(self) -> bool:
        """Whether the file has it, and not as null."""
        return self.value is not _MISSING and self.value is not None

    def number(
        self, low: float, high: float, default: float | None = None, *, unit: str = ""
    ) -> float:
        """A number within bounds."""
        if not self.is_there and default is not None:
            return default
        value = self.value
        if isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high:
            return float(value)
        raise self.error(f"a number from {low:g} to {high:g}{unit and ' '}{unit}")

    def text(self) -> str:
        """A string."""
        if not isinstance(self.value, str):
            raise self.error("a string")
        return self.value


def read_json(path: Path, field: str) -> FileValue:
    """A whole file.

    Raises
    ------
    InputError
        It cannot be read, is too long, or is no JSON; names the line.
    """
    text = read_text(path, field, MOST_BYTES, "a JSON file")
    try:
        return FileValue(str(path), "", json.loads(text))
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}"
        raise InputError(place, error.msg, "JSON", file=str(path), hint="is it whole?") from None
    except (RecursionError, ValueError):
        got = "lists within lists, or a number of thousands of digits"
        raise ArgumentError(field, got, "JSON", file=str(path)) from None


def read_toml(path: Path, field: str) -> FileValue:
    """A whole file.

    Raises
    ------
    InputError
        It cannot be read, is too long, or is no TOML; names the line.
    """
    text = read_text(path, field, MOST_BYTES, "a TOML file")
    try:
        return FileValue(str(path), "", tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ArgumentError(field, str(error)[:80], "TOML", file=str(path)) from None
