"""How a command ends: its exit code, one line on stderr, and output that really was written."""

from __future__ import annotations

import codecs
import contextlib
import logging
import os
import sys
from collections.abc import Callable

from chladni.sim.errors import ChladniError, InputError, StoppedError

DONE, FAILED, WRONG_INPUT, STOPPED = 0, 1, 2, 130
PLAIN = {
    "µ": "u", "Ω": "ohm", "°": " deg", "²": "2", "³": "3", "·": "-", "–": "-", "…": "...",
    "−": "-", "×": "x", "λ": "lambda", "│": "|", "─": "-", "√": "sqrt", "⌀": "dia ",
    "→": "->", "±": "+-",
}  # fmt: skip
"""What stands for what a terminal without Unicode cannot show; "?" for all else."""


def run(name: str, command: Callable[[], object]) -> int:
    """Run a command; 0 done, 1 the work failed, 2 the input is wrong, 130 Ctrl-C.

    Parameters
    ----------
    name
        Of the program, before every line it says.
    """
    _open_streams()
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter(f"{name}: %(message)s"))
    logging.getLogger("chladni").handlers = [handler]
    logging.getLogger("chladni").setLevel(logging.INFO)
    try:
        code = _code_of(command)
        # A full disk may take an answer only now.
        sys.stdout.flush()
    except (StoppedError, KeyboardInterrupt) as error:
        return _complain(name, str(error) or "interrupted", STOPPED)
    except InputError as error:
        return _complain(name, str(error), WRONG_INPUT)
    except ChladniError as error:
        return _complain(name, str(error), FAILED)
    except BrokenPipeError:
        _drop_output()
        return FAILED
    except OSError as error:
        _drop_output()
        return _complain(name, f"{error.filename or 'output'}: {error.strerror or error}", FAILED)
    return code


def _open_streams() -> None:
    """Streams that take any text; for one that is closed, as by `>&-`, one that goes nowhere.

    Else a file that a command opens would get the number of the closed one. What is written to a
    closed output fails, as on a full disk.
    """
    if sys.stdin is None:
        sys.stdin = open(os.open(os.devnull, os.O_RDONLY), encoding="utf-8")  # noqa: SIM115
    if sys.stdout is None:
        nowhere = os.open(os.devnull, os.O_RDONLY)
        sys.stdout = open(nowhere, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")  # noqa: SIM115
    codecs.register_error("plain", _plain)
    for stream in (sys.stdout, sys.stderr):
        # Not where Python's caller has put something else there.
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="plain")  # type: ignore[union-attr]


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lost = error.object[error.start : error.end]
    return "".join(PLAIN.get(letter, "?") for letter in lost), error.end


def _code_of(command: Callable[[], object]) -> int:
    """What a command exits with; typer exits with it where others return."""
    try:
        command()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else DONE if end.code is None else FAILED
    return DONE


def _drop_output() -> None:
    """Let what cannot be written go: Python tries it again at its end, and shows a traceback."""
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
        return
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _complain(name: str, message: str, code: int) -> int:
    with contextlib.suppress(OSError):
        sys.stderr.write("".join(f"{name}: {line}\n" for line in message.splitlines()))
    return code
