"""Draw which room uses which, from the imports and includes as they are.

    python tools/draw_house.py          write docs/images/house.svg
    python tools/draw_house.py --check  exit with 1 if the committed drawing differs

A room stands above all that it uses. An arrow that follows from two others is left out. A circle
has no floor, and is an error.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "house.svg"
NAMES = ("sim", "drives", "tables", "design", "effects", "host")
PACKAGES = tuple(f"chladni.{one}" for one in NAMES)
FIRMWARE = ROOT / "firmware" / "esp32"
SOURCES = {".cpp", ".hpp"}
COLOURS = {
    "sim": "#dbe9f6", "drives": "#dff0d8", "tables": "#fcefc9", "design": "#fbe3cf",
    "effects": "#f5d9e8", "host": "#f6dedb",
    "core": "#e6e0f0", "chip": "#e8e8e8", "emulator": "#e8e8e8",
}  # fmt: skip
WIDTH, HEIGHT, GAP, RISE, MARGIN = 132, 30, 14, 62, 24

Graph = dict[str, set[str]]


def python_rooms() -> Graph:
    """Rooms of the packages, and the rooms that their files import."""
    graph: Graph = defaultdict(set)
    imports = grimp.build_graph(*PACKAGES, cache_dir=None)
    for module in imports.modules:
        for used in imports.find_modules_directly_imported_by(module):
            here, there = python_room(module, imports), python_room(used, imports)
            if here and there and here != there:
                graph[here].add(there)
                graph.setdefault(there, set())
    return dict(graph)


def python_room(module: str, imports: grimp.ImportGraph) -> str | None:
    """The folder of a module, from its package on; None for a package's face."""
    _, package, *rest = module.split(".")
    if imports.find_children(module):
        # The face of the methods is their list, which others read; others only hand names on.
        return f"{package}/methods" if rest == ["methods"] else None
    return "/".join((package, *rest[:-1]))


def cpp_rooms() -> Graph:
    """Rooms of the firmware, and the rooms whose headers their files include."""
    graph: Graph = defaultdict(set)
    for part in ("core", "emulator", "chip"):
        for path in sorted((FIRMWARE / part).rglob("*")):
            if path.suffix not in SOURCES:
                continue
            here = cpp_room(path.relative_to(FIRMWARE))
            graph.setdefault(here, set())
            for name in re.findall(r'#include "([\w/]+\.hpp)"', path.read_text(encoding="utf-8")):
                header = FIRMWARE / name
                header = header if header.is_file() else FIRMWARE / "chip" / name
                there = cpp_room(header.relative_to(FIRMWARE)) if header.is_file() else here
                if there != here:
                    graph[here].add(there)
    return dict(graph)


def cpp_room(path: Path) -> str:
    """The folder of a file; what a whole part stands on is a room of its own."""
    return path.as_posix() if path.name in ("hal.hpp", "board.hpp") else path.parent.as_posix()


def floors(graph: Graph) -> dict[str, int]:
    """How many rooms stand under each, one upon the other."""
    known: dict[str, int] = {}

    def floor(room: str, above: tuple[str, ...]) -> int:
        if room in above:
            raise SystemExit("a circle: " + " -> ".join((*above[above.index(room) :], room)))
        if room not in known:
            known[room] = max((floor(r, (*above, room)) + 1 for r in graph[room]), default=0)
        return known[room]

    for room in graph:
        floor(room, ())
    return known


def without_shortcuts(graph: Graph) -> Graph:
    """The arrows that do not follow from others."""

    def reach(room: str) -> set[str]:
        return graph[room].union(*(reach(below) for below in graph[room]))

    return {
        room: used - set().union(*(reach(below) for below in used)) for room, used in graph.items()
    }


def drawn(graph: Graph, left: float) -> tuple[list[str], float, float]:
    """SVG of one graph: arrows under boxes; the right and lower ends."""
    levels = floors(graph)
    top = max(levels.values())
    rows = [sorted(r for r in graph if levels[r] == k) for k in range(top, -1, -1)]
    widest = max(len(row) for row in rows) * (WIDTH + GAP)
    at = {}
    for line, row in enumerate(rows):
        start = left + (widest - len(row) * (WIDTH + GAP)) / 2.0
        for k, room in enumerate(row):
            at[room] = (start + k * (WIDTH + GAP), MARGIN + line * RISE)
    arrows = [
        f'<path d="M{at[a][0] + WIDTH / 2:g} {at[a][1] + HEIGHT:g} L{at[b][0] + WIDTH / 2:g} '
        f'{at[b][1] - 3:g}" marker-end="url(#tip)"/>'
        for a, used in sorted(without_shortcuts(graph).items())
        for b in sorted(used)
    ]
    boxes = [box(room, *at[room]) for room in sorted(at)]
    return [*arrows, *boxes], left + widest, MARGIN + len(rows) * RISE


def box(room: str, x: float, y: float) -> str:
    """One room."""
    colour = COLOURS[room.split("/", maxsplit=1)[0]]
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="4" fill="{colour}" '
        f'stroke="#555"/><text x="{x + WIDTH / 2:g}" y="{y + 19:g}">{room}</text>'
    )


def picture() -> str:
    """The whole drawing: Python on the left, firmware on the right."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    python, middle, low = drawn(python_rooms(), MARGIN)
    cpp, right, lower = drawn(cpp_rooms(), middle + 2 * MARGIN)
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {right + MARGIN:g} '
        f'{max(low, lower):g}" font-family="sans-serif" font-size="12" text-anchor="middle">'
    )
    yield '<rect width="100%" height="100%" fill="white"/>'
    yield (
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#555"/></marker></defs>'
    )
    yield '<g stroke-width="1.1"><g stroke="#555" fill="none">'
    boxes = [line for line in (*python, *cpp) if not line.startswith("<path")]
    yield from (line for line in (*python, *cpp) if line.startswith("<path"))
    yield "</g>"
    yield from boxes
    yield "</g></svg>"


def main() -> int:
    """Write or compare the drawing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true")
    text = picture()
    if parser.parse_args().check:
        if PICTURE.is_file() and PICTURE.read_text(encoding="utf-8") == text:
            return 0
        print("docs/images/house.svg is not the house as it is: run tools/draw_house.py")
        return 1
    PICTURE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
