"""What effects come to at drawn places, each beside a finger that rests. Prints a table a board.

    python bench/several_fingers/effects.py [BOARD ...]

A click and a sweep under one finger of each set, 16 mm or more from the other; both press with 1 N,
on the board as drawn, through the emulated pins. Of switches twice: with the touch, whose bias
comes first, and after the finger has rested, when that stands.
"""

from __future__ import annotations

import sys
from itertools import product

import numpy as np

from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.effects import shipped_effects
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.played_effect import play_effect
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.tables.several_fingers.build_for import build_for

BOARDS = ("strip5", "phone5", "prototype", "phone15", "quiet16")
EFFECTS = ("click", "sweep")
SETS, SEED = 40, 7


def main() -> None:
    """A row for each board and effect."""
    print("| board | effect | isolation, dB | µm | rise, ms | envelope, dB | first duty, ms |")
    print("|---|---|---|---|---|---|---|")
    for name in sys.argv[1:] or BOARDS:
        board = load_board(name)
        table = build_for(board, "fingers")[0]
        plates = Plates.of(board)
        sets = finger_sets(board, 2, SETS, board.fingers_apart, np.random.default_rng(SEED)) / MM
        ways = (False,) if board.electronics.is_bridge else (False, True)
        for effect, rested in product(EFFECTS, ways):
            found = [
                play_effect(
                    table,
                    board,
                    shipped_effects()[effect],
                    (float(own[0]), float(own[1])),
                    other_mm=(float(other[0]), float(other[1])),
                    rested=rested,
                    plates=plates,
                )
                for own, other in sets
            ]
            isolation = [one.isolation_db for one in found]
            rows = {
                "isolation": np.percentile(np.array(isolation, dtype=float), (50.0, 10.0)),
                "µm": np.percentile([one.peak_um for one in found], (50.0, 10.0)),
                "rise": np.percentile([one.rise_ms for one in found], (50.0, 99.0)),
                "envelope": np.percentile([one.envelope_error_db for one in found], (50.0, 90.0)),
                "first": np.percentile([one.first_ms for one in found], (50.0, 99.0)),
            }
            values = " | ".join(f"{middle:.3g} / {tail:.3g}" for middle, tail in rows.values())
            then = ", rested" if rested else ""
            print(f"| `{name}` | {effect}{then} | {values} |", flush=True)


if __name__ == "__main__":
    main()
