"""One table: the best drive of every place, as a device plays it.

python examples/table.py [OUT_DIR]
"""

import sys
from pathlib import Path

from chladni.host import score_table
from chladni.host.figures import save, score_figure
from chladni.sim import load_board
from chladni.tables import build_table, pack


def main(out: Path) -> None:
    """Solve every region, write the table, play it all over the emulated board, draw that."""
    board = load_board("strip5")
    table, report = build_table(board)
    (out / "strip5.chl").write_bytes(pack(table))
    print(f"{report.regions} regions, {report.bits} bits, {report.bytes} bytes")
    score = score_table(table, board, size=report.bytes, samples=0)
    second, touched = score.second_finger_20mm_db, score.finger_um
    assert second is not None
    assert touched is not None
    print(
        f"second finger 20 mm away: {second.median:.1f} dB below, {second.p10:.1f} at worst tenth"
    )
    print(f"under the finger: {touched.median:.1f} µm at the coils' limit")
    save(score_figure(board, score), out / "example-table.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    main(folder)
