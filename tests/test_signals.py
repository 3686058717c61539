"""Tests that run behind a shell, or under nohup, start processes that signals end all the same."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

from conftest import ROOT

IGNORING = """
import os, signal, subprocess, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
signal.signal(signal.SIGHUP, signal.SIG_IGN)
import conftest
os.kill(os.getpid(), signal.SIGHUP)
shown = "import signal; print(*(int(signal.getsignal(n) != signal.SIG_IGN) for n in (1, 2)))"
done = subprocess.run([sys.executable, "-c", shown], capture_output=True, text=True, check=True)
print("went on", done.stdout.strip())
"""


def test_what_a_test_starts_has_the_signals_defaults_back() -> None:
    """Whatever the process that runs the tests was started with; that one outlives a hangup."""
    assert (signal.SIGHUP, signal.SIGINT) == (1, 2)
    done = subprocess.run(
        [sys.executable, "-c", IGNORING],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert (done.returncode, done.stdout) == (0, "went on 1 1\n"), done.stderr
