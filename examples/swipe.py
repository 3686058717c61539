"""A swipe over the emulated board: what the finger feels at every report of the panel.

python examples/swipe.py [OUT_DIR]
"""

import sys
from math import sin
from pathlib import Path

from chladni.host import TouchEvent, run_loop
from chladni.host.figures import save, swipe_figure
from chladni.sim import load_board
from chladni.tables import build_table

REPORTS, EVERY_MS = 41, 10.0


def main(out: Path) -> None:
    """Build a table, swipe along the board, score each touch from what the pins did."""
    board = load_board("strip5")
    table, _ = build_table(board)
    swipe = [
        TouchEvent(20.0 + EVERY_MS * k, (4.0 * sin(k / 6.0), -24.0 + 1.2 * k))
        for k in range(REPORTS)
    ]
    end_ms = swipe[-1].at_ms + EVERY_MS
    _, report = run_loop(table, board, [*swipe, TouchEvent(end_ms, None)], end_ms + 20.0)
    for touch in report.touches[::5]:
        card = touch.card
        print(
            f"{touch.at_ms:4.0f} ms  second finger {card.second_finger_db:+5.1f} dB  "
            f"maximum {card.focal_error_mm:4.1f} mm off  SSIM {card.ssim:.2f}"
        )
    save(swipe_figure(board, report.touches), out / "example-swipe.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    main(folder)
