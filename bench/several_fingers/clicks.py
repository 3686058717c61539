"""What clicks keep apart over time, beside what a score reckons, on random boards of a SPEC.

    python bench/several_fingers/clicks.py [SPEC] [BOARDS]

Layouts of coils as a search begins with, all else that is open drawn evenly. A click under each
finger of drawn pairs, with the real gains that its device finds, over time on the plate under both
(no pins: those add a decibel or two); the loudest under the finger over the loudest under the
other. Beside it are the reckoned click and the tone. Prints a row a board, and how far off it is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from chladni.design.evaluate import COARSE, completed_board
from chladni.design.spec import Spec, read_spec
from chladni.design.starts import document_at, layouts_of, point_of
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import first_natural_hz

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from played_clicks import clicks_over_time

SEED, SETS = 7, 24


def main() -> None:
    """Boards of the SPEC, the shipped one on feet if none is named."""
    spec = read_spec(sys.argv[1] if len(sys.argv) > 1 else "feet5")
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    print("| first mode, Hz | tone, dB | reckoned click | click over time |")
    print("|---|---|---|---|")
    off = []
    for board, _ in zip(boards_of(spec), range(count), strict=False):
        (two,) = score_fingers(board, (2,), sets=SETS, samples=0, seed=SEED, clicks=True).counts
        played = np.percentile(clicks_over_time(board, two.places), (50.0, 10.0))
        assert two.click_db is not None
        kept = [(own.median, own.p10) for own in (two.isolation_db, two.click_db)]
        off.append(np.subtract(kept, played))
        told = [f"{middle:.1f} / {tail:.1f}" for middle, tail in [*kept, played]]
        print(f"| {first_natural_hz(board):.0f} | {' | '.join(told)} |", flush=True)
    for name, own in zip(("tones", "reckoned clicks"), np.swapaxes(off, 0, 1), strict=True):
        for what, one in zip(("medians", "worst tenths"), own.T, strict=True):
            most = one[np.argmax(np.abs(one))]
            print(f"{name}, {what}: off by {one.mean():.1f} ± {one.std():.1f}, most {most:.1f} dB")


def boards_of(spec: Spec) -> Iterator[Board]:
    """Random ones without end."""
    rng = np.random.default_rng(1)
    while True:
        numbers = tuple(
            float(rng.integers(round(own.most) + 1) if own.is_whole else rng.random())
            for own in spec.variables
        )
        rows = layouts_of(spec, (spec.coils[0], numbers))["layouts"]
        if rows:
            chosen = point_of(rows[int(rng.integers(len(rows)))])
            yield completed_board(document_at(spec, chosen), COARSE)


if __name__ == "__main__":
    main()
