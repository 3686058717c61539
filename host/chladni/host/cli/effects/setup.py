"""What an emulated device plays effects on: its board, its table, and the plate under fingers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chladni.calibration.hidden import HiddenPlate
from chladni.host.cli.common.hidden_plates import named_plate
from chladni.host.cli.common.output import Place, progress_bar, say
from chladni.host.cli.device.connection import Connection
from chladni.host.emulation.over_frequency import Plates
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.transfer import check_target
from chladni.tables.format import read_table
from chladni.tables.inspection.owner import board_for
from chladni.tables.several_fingers.build_for import build_for
from chladni.tables.table import Table


@dataclass(frozen=True)
class Setup:
    """What is played on.

    Attributes
    ----------
    table, board
        That the device knows.
    plate
        That fingers are on; None where it is the board's own.
    hidden
        What `plate` was asked for by.
    file
        The table's, if it has one.
    """

    table: Table
    board: Board
    plate: HiddenPlate | None
    hidden: str | None
    file: Path | None

    def plates(self) -> Plates:
        """As `play_effect` takes them."""
        with progress_bar("plate" if self.plate is None else "plates") as progress:
            return Plates.of(self.board, self.plate, progress)

    @property
    def title(self) -> str:
        """Above a figure."""
        told = [f"{self.board.name} {self.board.known_as}"]
        told += [] if self.hidden is None else [f"hidden plate {self.hidden}"]
        told += [] if self.file is None else [f"table {self.file.name}"]
        return ", ".join(told)

    @property
    def played_on(self) -> str:
        """Title of an answer."""
        return f"Played on {self.title} (emulated)"

    def rows(self, *, as_json: bool) -> dict[str, Any]:
        """The same in an answer: words for people, a name for programs."""
        if as_json:
            return {"board": self.board.name, "plate": self.hidden}
        return {
            "board": f"{self.board.name}, {self.board.known_as}",
            "hidden plate": self.hidden,
            "table": None if self.file is None else str(self.file),
        }


def setup_of(connection: Connection, places: Sequence[Place], hidden: str | None) -> Setup:
    """The file's table, which must be the board's; else responses, made once all else is right."""
    path = connection.emulated_table
    table = None if path is None else read_table(path)
    if table is None:
        board = load_board(connection.emulated_board)
    else:
        board = board_for(table, connection.board, file=str(path))
    for option, place in zip(("--at", "--other"), places, strict=False):
        check_target(board, place, option)
        _say_inactive(board, place, option)
    _say_near(board, places)
    plate = named_plate(board, hidden)
    if table is None:
        with progress_bar("table") as progress:
            table, _, report = build_for(board, "fingers", progress=progress)
        assert report is not None
        pitch = " × ".join(f"{along:.2g}" for along in report.pitch_mm)
        say(
            f"without --table: plays responses at places {pitch} mm apart, made for {board.name} "
            f"now; `chladni table build {connection.emulated_board} --for fingers -o T.chl` keeps "
            "them"
        )
    return Setup(table, board, plate, hidden, path)


def _say_inactive(board: Board, place: Place, option: str) -> None:
    """Remark on a place where no score expects a finger."""
    if not board.is_active(place[0] * MM, place[1] * MM):
        x, y = (f"{low / MM:g} to {high / MM:g}" for low, high in board.active_area)
        say(f"{option} lies beyond the active area, x {x} and y {y} mm, in which boards are scored")


def _say_near(board: Board, places: Sequence[Place]) -> None:
    """Remark on two fingers nearer to each other than those that the board is for."""
    least = board.fingers_apart / MM
    if board.fingers and len(places) == 2 and (apart := math.dist(*places)) < least:
        say(
            f"these fingers are {apart:.3g} mm apart, and {board.name} is for fingers that lie "
            f"{least:g} mm apart or more (fingers.apart_mm)"
        )
