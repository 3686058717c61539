"""Second fingers of the boards that focus, on fields by finite elements: prints a table.

    python bench/second_finger.py [BOARD ...]

The drives are those of the model. Both meshes follow every magnet and cut-out.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from chladni.sim.board.file import load_board

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from plate_fem.boards import compared_second_fingers

PLACES = {
    "strip5": [(0.0, 0.0), (0.0, 6.0), (0.0, -13.0), (1.5, 18.0), (0.0, 25.0), (-3.0, -20.0)],
    "quiet5": [(0.0, 0.0), (0.0, 6.0), (0.0, -13.0), (1.5, 18.0), (0.0, 25.0), (-3.0, -20.0)],
    "pad16": [(0.0, 0.0), (5.5, 5.5), (-11.0, 3.0), (20.0, -17.0)],
    "quiet16": [(0.0, 0.0), (5.5, 5.5), (-11.0, 3.0), (20.0, -17.0)],
    "phone15": [(0.0, 0.0), (12.0, 14.5), (-24.0, -58.0), (30.0, 40.0)],
}
"""Coils, between coils, near edges and in corners; mm."""
MESHES = {
    "strip5": ((3e-3, 24), (1.5e-3, 48)),
    "quiet5": ((2e-3, 36), (1.2e-3, 60)),
    "pad16": ((3e-3, 24), (2e-3, 36)),
    "quiet16": ((2.5e-3, 30), (1.7e-3, 42)),
    "phone15": ((5e-3, 24), (3e-3, 36)),
}
"""Largest edge of a triangle, m, and edges round each circle."""


def main() -> None:
    """All boards, or those that are named."""
    print("| board | place, mm | second finger ≥ 12, 16, 20 mm, dB | elements, coarse | fine |")
    print("|---|---|---|---|---|")
    for name in sys.argv[1:] or PLACES:
        board, started = load_board(name), time.perf_counter()
        coarse, fine = (
            compared_second_fingers(board, PLACES[name], *mesh) for mesh in MESHES[name]
        )
        rows = zip(PLACES[name], fine.own, coarse.elements, fine.elements, strict=True)
        for place, *levels in rows:
            cells = (", ".join(f"{one:.2f}" for one in level) for level in levels)
            print(f"| `{name}` | {place[0]:g}, {place[1]:g} | {' | '.join(cells)} |")
        apart = [np.abs(one.elements - one.own).max() for one in (coarse, fine)]
        print(
            f"{name}: {coarse.unknowns:,} and {fine.unknowns:,} unknowns, at most {apart[0]:.3f} "
            f"and {apart[1]:.3f} dB apart, {time.perf_counter() - started:.0f} s",
            file=sys.stderr,
        )


if __name__ == "__main__":
    main()
