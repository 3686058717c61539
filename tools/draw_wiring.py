"""Draw the wiring of `prototype`, and write its parts into the page about hardware.

    python tools/draw_wiring.py          write docs/images/wiring.svg, and the table
    python tools/draw_wiring.py --check  exit with 1 if what is committed says something else

Versions of matplotlib and of fonts place the same drawing a little differently. So the check
compares what the drawing says, text by text in the order in which it is drawn, and not its bytes.
A test does so too (tests/host/manufacture/test_wiring.py).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

from chladni.host.figures.fields import save
from chladni.host.manufacture.wiring.figure import wiring_figure
from chladni.host.manufacture.wiring.parts import parts_list
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board

DOCS = Path(__file__).resolve().parents[1] / "docs"
BEGIN, END = "<!-- written by tools/draw_wiring.py -->\n", "<!-- until here -->\n"


def texts_of(picture: Path) -> list[str]:
    """What an SVG says, in the order in which it is drawn."""
    root = ET.parse(picture).getroot()
    return ["".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")]


def parts_table(board: Board) -> str:
    """The parts list in Markdown."""
    rows = ["| part | count | value | why |", "|---|---|---|---|"]
    rows += [f"| {p.part} | {p.count} | {p.value} | {p.why} |" for p in parts_list(board)]
    return "\n".join(rows) + "\n"


def with_table(page: str, table: str) -> str:
    """The page with this table between its two marks."""
    before, _, rest = page.partition(BEGIN)
    _, mark, after = rest.partition(END)
    if not mark:
        raise SystemExit(f"docs/hardware.md lacks {BEGIN.strip()} or {END.strip()}")
    return before + BEGIN + table + END + after


def faults(docs: Path) -> list[str]:
    """Which files of a folder of pages say something else than the board file does."""
    board, found = load_board("prototype"), []
    page, picture = docs / "hardware.md", docs / "images" / "wiring.svg"
    (axes,) = wiring_figure(board).axes
    drawn = [text.get_text() for text in axes.texts]
    if not picture.is_file() or texts_of(picture) != drawn:
        found.append("docs/images/wiring.svg")
    text = page.read_text(encoding="utf-8")
    if with_table(text, parts_table(board)) != text:
        found.append("docs/hardware.md")
    return found


def main() -> int:
    """Write or compare drawing and table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true")
    if parser.parse_args().check:
        found = faults(DOCS)
        for name in found:
            print(f"{name} is not the wiring of prototype: run tools/draw_wiring.py")
        return 1 if found else 0
    board, page = load_board("prototype"), DOCS / "hardware.md"
    save(wiring_figure(board), DOCS / "images" / "wiring.svg")
    text = with_table(page.read_text(encoding="utf-8"), parts_table(board))
    page.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
