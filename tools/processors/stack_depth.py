"""How deep the core's stack gets: in the sample interrupt, and in a turn of the main loop.

    python tools/processors/stack_depth.py

Every function's frame and calls come from the compiler (RISC-V, -O2, as the processors' counts are
made); the deepest chain is added up. What is called through `Hal` is the chip's and not in it. The
ESP32's windowed registers take 16 to 48 bytes more per call: a bound is twice the figure.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from instruction_counts import PROCESSORS, compile_core

PROCESSOR = PROCESSORS[1]

ROOTS = {
    "sample interrupt": r"SamplePlayer::sample\(",
    "main loop": r"Device::poll\(\)",
    "console": r"run_command\(",
    "link": r"Link::receive\(",
    "network": r"Datagrams::receive\(",
    "start": r"Device::start\(",
}


class UnboundedError(Exception):
    """A function calls itself: there is no bound."""


def call_graph(folder: Path) -> tuple[dict[str, int], dict[str, set[str]], dict[str, str]]:
    """Frame bytes and callees by symbol, and symbols' readable names, of `compile_core`'s files."""
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = defaultdict(set)
    names: dict[str, str] = {}
    for path in sorted(folder.glob("*.ci")):
        text = path.read_text(encoding="utf-8")
        for title, label in re.findall(r'node: \{ title: "([^"]*)" label: "([^"]*)"', text):
            parts = label.split("\\n")
            names[title] = parts[0]
            found = re.search(r"(\d+) bytes \((\w+)", label)
            if found:
                if found[2] != "static":
                    raise UnboundedError(f"{parts[0]}: its frame has no fixed size")
                frames[title] = int(found[1])
        for caller, callee in re.findall(
            r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', text
        ):
            calls[caller].add(callee)
    return frames, calls, names


def deepest(
    symbol: str, frames: dict[str, int], calls: dict[str, set[str]], chain: tuple[str, ...] = ()
) -> tuple[int, tuple[str, ...]]:
    """Bytes of the deepest chain from a function, and the chain."""
    if symbol in chain:
        raise UnboundedError(f"{symbol} calls itself")
    best: tuple[int, tuple[str, ...]] = (0, ())
    for callee in sorted(calls.get(symbol, ())):
        if callee in frames:
            best = max(best, deepest(callee, frames, calls, (*chain, symbol)))
    return best[0] + frames[symbol], (symbol, *best[1])


def depths(folder: Path) -> dict[str, tuple[int, list[str]]]:
    """Bytes and readable chain for each root, of the core that was compiled there."""
    frames, calls, names = call_graph(folder)
    result = {}
    for what, pattern in ROOTS.items():
        symbol = next(s for s in frames if re.search(pattern, names[s]))
        size, chain = deepest(symbol, frames, calls)
        result[what] = (size, [names[s] for s in chain])
    return result


def main() -> int:
    """Print them."""
    with tempfile.TemporaryDirectory() as name:
        compile_core(PROCESSOR, Path(name))
        found = depths(Path(name))
    for what, (size, chain) in found.items():
        print(f"{what}: {size} bytes")
        for one in chain:
            print(f"    {one}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
