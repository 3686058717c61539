"""Fuzz the parsers: the device's with libFuzzer under the sanitizers, the host's with atheris.

    python tools/fuzz.py --seconds 60      each so long, two at a time

What is found is left in build/fuzz as crash-*; the corpora in tests/corpus only ever grow by hand.
Needs clang and atheris.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FIRMWARE = ROOT / "firmware" / "esp32"
OUT = ROOT / "build" / "fuzz"
TARGETS = ("link", "datagrams", "table", "bank", "touch")
FLAGS = (
    "-std=c++17",
    "-O1",
    "-g",
    "-fsanitize=fuzzer,address,undefined",
    "-fno-sanitize-recover=undefined",
)


def compile_core() -> list[Path]:
    """The core's objects, which all fuzzers are linked with."""
    folder = OUT / "core"
    shutil.rmtree(folder, ignore_errors=True)  # of files that are gone
    folder.mkdir(parents=True)
    halves = [sorted((FIRMWARE / "core").rglob("*.cpp"))[k::2] for k in range(2)]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda files: _clang(["-c", *files], folder), halves))
    return sorted(folder.glob("*.o"))


def build(target: str, core: Sequence[Path]) -> Path:
    """Compile one of the device's fuzzers."""
    program = OUT / target
    _clang([FIRMWARE / "fuzz" / f"{target}.cpp", *core, "-o", program], OUT)
    return program


def _clang(arguments: Sequence[str | Path], folder: Path) -> None:
    subprocess.run(["clang++", *FLAGS, "-I", FIRMWARE, *arguments], check=True, cwd=folder)


def run(name: str, command: list[str | Path], seconds: int) -> tuple[str, int, str]:
    """Fuzz for a while; the tool's last lines."""
    corpus = OUT / f"{name}-corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    kept = ROOT / "tests" / "corpus" / name
    known = [kept] if kept.is_dir() else []
    done = subprocess.run(
        [
            *command,
            f"-max_total_time={seconds}",
            "-max_len=4096",
            "-timeout=20",
            f"-artifact_prefix={OUT}/{name}-",
            corpus,
            *known,
        ],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT / "tests"), "ASAN_OPTIONS": "detect_leaks=0"},
    )
    return name, done.returncode, done.stderr


def main() -> int:
    """Build, run, and say how many inputs each has tried."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=int, default=60)
    seconds = parser.parse_args().seconds
    if shutil.which("clang++") is None:
        print("not installed: clang++", file=sys.stderr)
        return 1
    core = compile_core()
    with ThreadPoolExecutor(2) as pool:
        programs = list(pool.map(lambda target: build(target, core), TARGETS))
        jobs: list[tuple[str, list[str | Path]]] = [
            (target, [program]) for target, program in zip(TARGETS, programs, strict=True)
        ]
        jobs.append(("host", [sys.executable, ROOT / "tests" / "fuzz_host.py"]))
        results = list(pool.map(lambda job: run(job[0], job[1], seconds), jobs))
    for name, code, text in results:
        runs = [line for line in text.splitlines() if line.startswith(("Done", "stat::"))]
        print(f"{name}: {'clean' if code == 0 else 'FAILED'}; {runs[-1] if runs else ''}")
        if code != 0:
            print("\n".join(text.splitlines()[-40:]))
    return 0 if all(code == 0 for _, code, _ in results) else 1


if __name__ == "__main__":
    sys.exit(main())
