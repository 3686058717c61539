"""`make demo`: the whole chain, from boards' files to the pins and back.

One finger on two boards, and two fingers on two.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table as RichTable

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.scorecard import Scorecard, score_field
from chladni.drives.scoring.several_fingers.fingers_play import FingersPlay
from chladni.host.cli.common import ending
from chladni.host.cli.common.output import progress_bar, sheet
from chladni.host.emulation.closed_loop import LoopReport, run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.emulation.played_fingers import play_fingers
from chladni.host.figures.chains import Chain, chains_figure
from chladni.host.figures.fields import save
from chladni.host.figures.two_fingers import two_fingers_figure
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.files import write_whole
from chladni.sim.image import metrics
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.several_fingers.build import responses_table

TOUCHES_MM = {"prototype": (10.0, 25.0), "strip5": (0.0, 6.0)}
"""One of the paper's own targets, and a place between two coils."""
TOUCH_AT_MS = 20.0
LENGTH_MS = 300.0
FINGERS_MM = ((-20.0, 45.0), (20.0, 45.0))
"""Two thumbs, and the boards that they are on: made for fingers, and the authors' own."""
FINGERS_BOARDS = ("phone5", "prototype")


@dataclass(frozen=True)
class BoardRun:
    """What came of one board in the whole chain."""

    board: Board
    built: TableReport
    loop: LoopReport
    card: Scorecard

    @property
    def chain(self) -> Chain:
        """For the figure."""
        card = self.card
        level = card.second_finger_db
        gets = f"another finger gets {abs(level):.1f} dB {'less' if level >= 0.0 else 'more'}"
        caption = f"SSIM {card.ssim:.2f}, maximum {card.focal_error_mm:.0f} mm off,\n{gets}"
        return Chain(
            self.board, self.loop.target_mm, self.loop.target_field, self.loop.field, caption
        )


def run(folder: Path) -> None:
    """Build tables, flash them into the emulator, touch the boards, score what the pins do."""
    folder.mkdir(parents=True, exist_ok=True)
    console = Console()
    runs = [_run_board(console, folder, name) for name in TOUCHES_MM]
    console.print(_scorecard(runs))
    picture = folder / "demo.png"
    save(chains_figure([one.chain for one in runs]), picture)
    console.print(f"figure: {picture}")
    plays = [play_two_fingers(name) for name in FINGERS_BOARDS]
    console.print(_fingers_scorecard(plays))
    picture = folder / "two-fingers.png"
    save(two_fingers_figure(plays), picture)
    console.print(f"figure: {picture}")


def play_two_fingers(name: str) -> FingersPlay:
    """Two fingers on a shipped board, by a table of its responses and the emulated pins."""
    board = load_board(name)
    with progress_bar("two fingers") as progress:
        table, _ = responses_table(board, progress=progress)
    return play_fingers(table, board, FINGERS_MM)


def _fingers_scorecard(plays: list[FingersPlay]) -> RichTable:
    """What two fingers get, each of its own signal and of the other's."""
    places = " and ".join(f"{x:g}, {y:g}" for x, y in FINGERS_MM)
    table = sheet(title=f"Two fingers at {places} mm, each playing")
    for heading in ("", *(one.board.name for one in plays), "compare"):
        table.add_column(heading)
    own = [" / ".join(f"{value:.2g}" for value in one.finger_um) for one in plays]
    apart = [" / ".join(f"{value:.0f}" for value in one.isolation_db) for one in plays]
    table.add_row("own signal, µm", *own, "0.36 µm at 160 Hz is just felt")
    table.add_row("the other has less of it, dB", *apart, "0 is as much")
    return table


def _run_board(console: Console, folder: Path, name: str) -> BoardRun:
    """One board's chain."""
    board, touched = load_board(name), TOUCHES_MM[name]
    fields = solved_board(board).fields
    console.print(
        f"[bold]{board.name}[/]: plate and {len(board.actuators)} transfer fields, "
        f"{fields.modes_used} functions, estimated error {fields.error_estimate:.1e}"
    )
    with progress_bar("solving") as progress:
        table, built = build_table(board, progress=progress)
    path = folder / ("demo.chl" if name == next(iter(TOUCHES_MM)) else f"demo-{name}.chl")
    write_whole(path, pack(table))
    console.print(
        f"  table for {built.objective}: one region per {board.regions.pitch / MM:g} mm, "
        f"{built.regions} regions, {built.bytes} bytes in {built.seconds:.1f} s → {path}"
    )
    console.print(f"  the firmware plays a touch at {touched[0]:g}, {touched[1]:g} mm")
    _, loop = run_loop(table, board, [TouchEvent(TOUCH_AT_MS, touched)], LENGTH_MS)
    card = score_field(
        solved_board(board), loop.field, loop.target_field, loop.target_mm, drive=loop.played
    )
    return BoardRun(board, built, loop, card)


def _scorecard(runs: list[BoardRun]) -> RichTable:
    """The demo's numbers, with what each is to be compared with."""
    table = sheet(title="What the pins really do")
    for heading in ("", *(one.board.name for one in runs), "compare"):
        table.add_column(heading)
    columns = [_column(one) for one in runs]
    for row, compare in _COMPARE.items():
        table.add_row(row, *(column[row] for column in columns), compare)
    return table


_COMPARE = {
    "touched": "",
    "distance to the maximum": "0 mm is a focus",
    "second finger": "above 0: louder here than there",
    "second finger from 20 mm on": "a finger tells 2.3 dB apart",
    "contrast": "the second is the limit of all drives",
    "under the finger": "0.36 µm at 160 Hz is just felt",
    "pressing changes": "",
    "SSIM of the PWM's field": "the paper's score",
    "  of the table's own drive": "the difference is the firmware's loss",
    "  nothing moves": "null model",
    "  nearest coil alone": "null model",
    "  a focus elsewhere": "null model",
    "worst gain error": "0.1 dB",
    "worst phase error": "0.5°",
    "touch to first duty": "25 ms to feel immediate",
}
"""Rows, and what each number is to be compared with."""


def _column(one: BoardRun) -> dict[str, str]:
    """A board's numbers by row."""
    loop, card = one.loop, one.card
    worst_gain = max(abs(c.gain_error_db or 0.0) for c in loop.channels)
    worst_phase = max(abs(c.phase_error_deg or 0.0) for c in loop.channels)
    felt = card.felt
    under = "–" if felt is None or felt.finger_um is None else f"{felt.finger_um:.1f} µm"
    pressing = "–" if felt is None else f"{felt.finger_load.level_db:+.2f} dB"
    return {
        "touched": f"{loop.target_mm[0]:.1f}, {loop.target_mm[1]:.1f} mm",
        "distance to the maximum": f"{card.focal_error_mm:.1f} mm",
        "second finger": f"{card.second_finger_db:+.1f} dB",
        "second finger from 20 mm on": f"{_from_20_mm(one):+.1f} dB",
        "contrast": f"{card.contrast_db:.1f} of {card.contrast_limit_db:.1f} dB",
        "under the finger": under,
        "pressing changes": pressing,
        "SSIM of the PWM's field": f"{card.ssim:.4f}",
        "  of the table's own drive": f"{loop.ssim_table:.4f}",
        "  nothing moves": f"{card.nulls.silent:.4f}",
        "  nearest coil alone": f"{card.nulls.nearest_actuator:.4f}",
        "  a focus elsewhere": f"{card.nulls.misplaced:.4f}",
        "worst gain error": f"{worst_gain:.4f} dB",
        "worst phase error": f"{worst_phase:.4f}°",
        "touch to first duty": f"{loop.latency_ms:.2f} ms",
    }


def _from_20_mm(one: BoardRun) -> float:
    """RMS under the finger over the loudest fingertip 20 mm away or more, dB."""
    board, (x, y) = one.board, one.loop.target_mm
    discs = metrics.FingertipDiscs(board.x, board.y)
    return discs.second_finger_db(one.loop.field, (x * MM, y * MM), [20e-3])[0]


def main() -> int:
    """Run the demo; 0 done, 1 failed, 130 Ctrl-C."""
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the results")
    folder: Path = parser.parse_args().out
    return ending.run("demo", lambda: run(folder))
