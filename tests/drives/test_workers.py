"""Worker processes that are killed, and workers whose parent is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from chladni.drives.workers import Workers
from chladni.sim.errors import ChladniError

SCRIPT = """
import os, sys, time
from chladni.drives.workers import Workers

def name_and_wait(_):
    # In one write, so that two processes' lines stay apart.
    os.write(1, f"{os.getpid()}\\n".encode())
    time.sleep(300.0)

with Workers(2) as workers:
    list(workers.map(name_and_wait, range(2)))
"""
WAIT_S = 60.0
"""Long beside the second in which a worker sees that its parent is gone, on a busy machine too."""


def square_or_die(task: tuple[int, Path, int]) -> int:
    """The square; but of 3, the first few times, the end of the process as memory shortage has it.

    A file a death tells the next process how many there were.
    """
    number, folder, deaths = task
    if number == 3 and len(list(folder.iterdir())) < deaths:
        (folder / str(os.getpid())).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def test_what_a_killed_worker_had_is_done_again(tmp_path: Path) -> None:
    with Workers(2) as workers:
        found = list(workers.map(square_or_die, [(k, tmp_path, 1) for k in range(6)]))
    assert found == [k**2 for k in range(6)]
    assert len(list(tmp_path.iterdir())) == 1


def test_a_worker_that_is_killed_again_ends_the_work_with_a_remedy(tmp_path: Path) -> None:
    with Workers(2) as workers:
        work = workers.map(square_or_die, [(k, tmp_path, 2) for k in range(6)])
        with pytest.raises(ChladniError, match=r"killed, and one again .*; with fewer than 2 jobs"):
            list(work)
    assert len(list(tmp_path.iterdir())) == 2


def is_running(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text("utf-8")
    except FileNotFoundError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def test_workers_end_with_a_parent_that_could_not_tell_them() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdout is not None
        pids = [int(process.stdout.readline()) for _ in range(2)]
        process.kill()
    end = time.monotonic() + WAIT_S
    while any(map(is_running, pids)) and time.monotonic() < end:
        time.sleep(0.05)
    left = [pid for pid in pids if is_running(pid)]
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert left == []
