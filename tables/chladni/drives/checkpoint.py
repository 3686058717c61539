"""Work that takes long keeps what it has done beside its output, and goes on from there."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any, TextIO

Result = dict[str, Any]
"""Numbers, texts and lists of them. JSON keeps floating-point numbers to the last bit."""


class Checkpoint(contextlib.AbstractContextManager["Checkpoint"]):
    """Finished results by name, one JSON line each, appended as they come.

    Parameters
    ----------
    path
        The file; None keeps results in memory only.
    key
        What the results are of. A file with another key is from other work, and begun anew.

    Notes
    -----
    Left without an exception, it is done and its file is removed; otherwise the file stays if
    there is a result in it, and a line that was torn when the work was cut off is dropped at the
    next start.
    """

    def __init__(self, path: Path | None, key: Result) -> None:
        self._path = path
        self._key = key
        self._done: dict[str, Result] = {}
        self._file: TextIO | None = None

    def __enter__(self) -> Checkpoint:
        if self._path is None:
            return self
        self._done = _read(self._path, self._key)
        self._file = self._path.open("w", encoding="utf-8")
        self._write(self._key)
        for name, result in self._done.items():
            self._write({"name": name, "result": result})
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if self._file is not None and self._path is not None:
            self._file.close()
            if kind is None or not self._done:
                self._path.unlink(missing_ok=True)

    def get(self, name: str) -> Result | None:
        """A finished result."""
        return self._done.get(name)

    def put(self, name: str, result: Result) -> Result:
        """Keep a result."""
        self._done[name] = result
        self._write({"name": name, "result": result})
        return result

    def _write(self, line: Result) -> None:
        if self._file is not None:
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()


def _read(path: Path, key: Result) -> dict[str, Result]:
    done: dict[str, Result] = {}
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return done
    for number, text in enumerate(lines):
        try:
            line = json.loads(text)
        except json.JSONDecodeError:
            break
        if number == 0 and line != key:
            break
        if number > 0:
            if not isinstance(line, dict) or line.keys() != {"name", "result"}:
                break
            done[line["name"]] = line["result"]
    return done
