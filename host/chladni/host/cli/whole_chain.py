"""`make demo`: the whole chain on one board, from its file to the pins and back."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console
from rich.table import Table as RichTable

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.scorecard import Scorecard, score_field
from chladni.host.cli.common import ending
from chladni.host.cli.common.output import progress_bar
from chladni.host.cli.solve import drive_entries
from chladni.host.emulation.closed_loop import LoopReport, run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.figures.fields import chain_figure, save
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.files import write_whole
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table

TOUCH_MM = (10.0, 25.0)
TOUCH_AT_MS = 20.0
LENGTH_MS = 300.0


def run(folder: Path) -> None:
    """Build a table, flash it into the emulator, touch the board, score what the pins do."""
    folder.mkdir(parents=True, exist_ok=True)
    console = Console()
    board = load_board("prototype")
    console.print(
        f"[bold]1[/] board {board.name}: plate and {len(board.actuators)} transfer fields"
    )
    fields = solved_board(board).fields
    console.print(f"  {fields.modes_used} functions, estimated error {fields.error_estimate:.1e}")
    console.print(f"[bold]2[/] drive table, one region per {board.regions.pitch / MM:g} mm")
    with progress_bar("solving") as progress:
        table, built = build_table(board, progress=progress)
    path = folder / "demo.chl"
    write_whole(path, pack(table))
    console.print(
        f"  {built.regions} regions, {built.bytes} bytes in {built.seconds:.1f} s → {path}"
    )
    console.print(f"[bold]3[/] the firmware plays a touch at {TOUCH_MM[0]:g}, {TOUCH_MM[1]:g} mm")
    recording, report = run_loop(table, board, [TouchEvent(TOUCH_AT_MS, TOUCH_MM)], LENGTH_MS)
    card = score_field(
        solved_board(board), report.field, report.target_field, report.target_mm,
        drive=report.played,
    )  # fmt: skip
    console.print(_scorecard(board, table, built, report, card))
    figure = chain_figure(
        board,
        report.target_mm,
        report.target_field,
        report.field,
        recording,
        span_ms=(TOUCH_AT_MS - 12.0, TOUCH_AT_MS + 35.0),
        captions=["Target: unit load at +", f"Made by the PWM, SSIM {report.ssim:.3f}"],
    )
    picture = folder / "demo.png"
    save(figure, picture)
    console.print(f"figure: {picture}")


def _scorecard(
    board: Board, table: Table, built: TableReport, report: LoopReport, card: Scorecard
) -> RichTable:
    """The demo's numbers, with what each is to be compared with."""
    sheet = RichTable(title="What the pins really do", title_justify="left")
    for heading in ("", "value", "compare"):
        sheet.add_column(heading)
    worst_gain = max(abs(c.gain_error_db or 0.0) for c in report.channels)
    worst_phase = max(abs(c.phase_error_deg or 0.0) for c in report.channels)
    place = f"{report.target_mm[0]:.1f}, {report.target_mm[1]:.1f} mm"
    rows = [
        ("SSIM of the PWM's field", f"{card.ssim:.4f}", f"table entry {report.ssim_table:.4f}"),
        ("  nothing moves", f"{card.nulls.silent:.4f}", "null model"),
        ("  nearest coil alone", f"{card.nulls.nearest_actuator:.4f}", "null model"),
        ("  a focus elsewhere", f"{card.nulls.misplaced:.4f}", "null model"),
        ("peak off the target", f"{card.focal_error_mm:.1f} mm", f"touched: {place}"),
        ("contrast", f"{card.contrast_db:.2f} dB", f"no drive beats {card.contrast_limit_db:.2f}"),
        ("second finger", f"{card.second_finger_db:.2f} dB", "above 0: felt here, not there"),
        *_felt_rows(card),
        ("worst gain error", f"{worst_gain:.4f} dB", "0.1 dB"),
        ("worst phase error", f"{worst_phase:.4f}°", "0.5°"),
        ("touch to first duty", f"{report.latency_ms:.2f} ms", "25 ms to feel immediate"),
        ("SSIM over the table", f"{built.ssim_mean:.3f}", f"worst region {built.ssim_min:.3f}"),
    ]
    for row in rows:
        sheet.add_row(*row)
    drive = drive_entries(board, report.promised)
    for entry in drive:
        text = f"gain {entry['gain']:.2f}, phase {entry['phase_deg']:.0f}°"
        sheet.add_row(f"drive of {entry['actuator']}", text, "")
    return sheet


def _felt_rows(card: Scorecard) -> list[tuple[str, str, str]]:
    """What a finger feels of it, and what pressing changes."""
    own = card.felt
    if own is None or own.finger_um is None or own.full_volts is None:
        return []
    above = "" if own.sensation_db is None else f"{own.sensation_db:.0f} dB above threshold"
    load = own.finger_load
    return [
        ("under the finger", f"{own.finger_um:.2f} µm", f"{own.full_volts:.2f} V peak, {above}"),
        ("pressing changes", f"{load.level_db:+.2f} dB", f"{load.ssim:+.4f} of SSIM"),
    ]


def main() -> int:
    """Run the demo; 0 done, 1 failed, 130 Ctrl-C."""
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the results")
    folder: Path = parser.parse_args().out
    return ending.run("demo", lambda: run(folder))
