"""Long checks by hand: every parser fuzzed, and sweeps over ever new boards, targets and regions.

    python tools/soak.py --seconds 3600            seeds drawn at random
    python tools/soak.py --seconds 120 --first 1   the same seeds each time, 1, 2, 3, ...

A fifth of the time goes to fuzzing, the rest to rounds of the tests marked `sweep`; where there are
ten minutes or more, those marked `soak` come first. Each round has a seed of its own, which is
printed: with CHLADNI_SOAK_SEED set to it the round comes again. A round ends with the first thing
it finds, which is a failure; a round that the time cuts short is none. Random seeds look for what
no one knows yet; CI takes the same ones each time, so that it refuses a change for what it changed.
"""

from __future__ import annotations

import argparse
import itertools
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PARSERS_AT_ONCE, PARSERS = 2, 6
LONG_S = 600.0


def fuzz(seconds: float) -> bool:
    """Fuzz all parsers; whether nothing was found."""
    if shutil.which("clang++") is None:
        print("not fuzzed: clang++ is not installed", flush=True)
        return True
    each = max(1, int(seconds * PARSERS_AT_ONCE / PARSERS))
    command = [sys.executable, str(ROOT / "tools" / "fuzz.py"), "--seconds", str(each)]
    return subprocess.run(command, check=False).returncode == 0


def sweep(seed: int, marks: str, seconds: float) -> bool | None:
    """One round of the tests so marked; None if the time was up before it ended."""
    print(f"round {seed}: CHLADNI_SOAK_SEED={seed}", flush=True)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-n",
        str(os.cpu_count() or 1),
        "--dist",
        "worksteal",
        "-m",
        marks,
        f"--hypothesis-seed={seed}",
        "-x",
        "tests",
    ]
    environment = os.environ | {"CHLADNI_SOAK_SEED": str(seed)}
    process = subprocess.Popen(command, cwd=ROOT, env=environment, start_new_session=True)
    try:
        return process.wait(seconds) == 0
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)  # its workers too
        process.wait()
        print("\nthe time is up")
        return None


def drawn_seeds() -> Iterator[int]:
    """Seeds drawn at random."""
    while True:
        yield random.randrange(1_000_000)


def main() -> int:
    """Soak for so long; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--first", type=int, help="the first round's seed, without it random")
    options = parser.parse_args()
    seconds: float = options.seconds
    seeds = itertools.count(options.first) if options.first is not None else drawn_seeds()
    end = time.monotonic() + seconds
    is_clean, rounds, marks = fuzz(seconds / 5.0), 0, "soak" if seconds >= LONG_S else "sweep"
    while (left := end - time.monotonic()) > 1.0:
        ended = sweep(next(seeds), marks, left)
        marks = "sweep"
        if ended is None:
            break
        is_clean, rounds = is_clean and ended, rounds + 1
    print(f"{rounds} whole rounds, {'nothing found' if is_clean else 'FAILED'}")
    return 0 if is_clean else 1


if __name__ == "__main__":
    sys.exit(main())
