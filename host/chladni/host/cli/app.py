"""The `chladni` command as a process: what Ctrl-C does before, during and after the work.

Nothing large is imported here: NumPy, matplotlib and others take a second to load. Before this
runs, Python itself loads for some hundredths of a second; Ctrl-C then is Python's to answer.
"""

from __future__ import annotations

import os
import sys

# What `signal` is made of: that would load enum and others before Ctrl-C is answered.
from _signal import (  # type: ignore[import-not-found]
    SIG_DFL,
    SIG_IGN,
    SIGHUP,
    SIGINT,
    SIGTERM,
    default_int_handler,
    getsignal,
    signal,
)

from chladni.host.cli.common.command_modules import MODULES

TYPE_CHECKING = False  # typing's own would load still more
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
"""Read as NumPy loads. Two threads of linear algebra make `sweep strip5` four times as long: the
matrices are small, and threads wait for each other in a loop."""
STOPPED = 130
"""Exit code of what Ctrl-C ended: 128 + SIGINT, as shells have it."""


def main() -> int:
    """Run the command line; 0 done, 1 the work failed, 2 the input is wrong, 130 Ctrl-C."""
    from chladni.host.cli.command_line import app  # noqa: PLC0415
    from chladni.host.cli.common.ending import run  # noqa: PLC0415

    return run("chladni", lambda: app(prog_name="chladni"))


def start() -> None:
    """As `main`, in a process of its own, which ends with the code."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    words = ("command_line", *(MODULES[word] for word in sys.argv[1:2] if word in MODULES))
    as_process([f"chladni.host.cli.{word}" for word in words], main)


def as_process(loads: Sequence[str], work: Callable[[], int]) -> None:
    """Do a process's work and exit with its code; Ctrl-C is 130 and no traceback, at any time.

    SIGTERM and SIGHUP end the work in the same way, with 143 and 129: what it holds is let go, such
    as a finger on a device, and workers, links and temporary files go with it.

    Parameters
    ----------
    loads
        Modules that take a while to load; `work` imports them again.
    """
    # Where it is ignored, as in the background of a shell, it stays so.
    is_heard = getsignal(SIGINT) is default_int_handler
    ends = [number for number in (SIGTERM, SIGHUP) if getsignal(number) == SIG_DFL]
    code, ended_by = STOPPED, []

    def end(number: int, _: object) -> None:
        # A second one, while the work tidies up, is answered already.
        for own in ends:
            signal(own, SIG_IGN)
        ended_by.append(number)
        raise KeyboardInterrupt

    try:
        if is_heard:
            signal(SIGINT, _leave)
        # Loaded here: an exception would come up within any of its modules, as their traceback.
        for module in loads:
            __import__(module)
        if is_heard:
            signal(SIGINT, default_int_handler)
        for number in ends:
            signal(number, end)
        code = work()
    except KeyboardInterrupt:
        pass
    except RuntimeError as error:
        # Python raises this over what comes up while a class is made, as in a module that is
        # loaded during the work.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
    if is_heard:
        # All is written; what Python still puts in order would show a traceback.
        signal(SIGINT, _leave)
    for number in ends:
        signal(number, SIG_DFL)
    # Python remembers a Ctrl-C that came while it ran text, as dataclasses do, and would end `-m`
    # by the signal. It forgets that when it runs text again.
    exec("")
    sys.exit(128 + ended_by[0] if ended_by else code)


def _leave(*_: object) -> None:
    """End at once. Before and after the work there is nothing to put in order."""
    os._exit(STOPPED)


if __name__ == "__main__":
    start()
