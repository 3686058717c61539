"""Commands that run one after the other in one new process: one loading of Python for all."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

Run = tuple[Path, Sequence[str]]
"""A folder to run in, and the words after `chladni`."""

SCRIPT = """
import contextlib, io, json, os, sys
from chladni.host.cli.app import main
ended = []
for folder, words in json.loads(sys.argv[1]):
    os.chdir(folder)
    sys.argv = ["chladni", *words]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main()
    ended.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(ended))
"""


def run_all(
    runs: Sequence[Run], *, first: str = "", before: Callable[[], object] | None = None
) -> list[tuple[int, str, str]]:
    """Exit code, output and errors of each; `first` is Python that runs before all of them.

    `before` is called in the new process, before Python loads. That keeps nothing of what it
    compiles: where a file may have 40 bytes, so would what others load.
    """
    given = json.dumps([(str(folder), list(words)) for folder, words in runs])
    done = subprocess.run(
        [sys.executable, *(["-B"] if before else []), "-c", first + SCRIPT, given],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        preexec_fn=before,
    )
    ended: list[Any] = json.loads(done.stdout)
    return [(code, out, err) for code, out, err in ended]
