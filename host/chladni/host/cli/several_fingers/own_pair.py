"""Two fingers at places of one's own: what each gets of the other's signal, and a figure of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.fingers import responses_at
from chladni.drives.problem.problem import solved_board
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.several_fingers.fingers_play import fingers_play
from chladni.drives.scoring.several_fingers.fingers_score import Solve, solver_of
from chladni.host.cli.common.finger_remarks import say_mirrored
from chladni.host.cli.common.output import Place, answer, parse_place, say, write_figure
from chladni.host.cli.common.ranges import check_apart
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Area
from chladni.sim.board.quantity import MM, SAME_PLACE
from chladni.sim.errors import ConflictError, MissingError
from chladni.sim.fields.transfer import check_target
from chladni.sim.image.finger import threshold_um

FloatArray = NDArray[np.float64]


def own_pair(
    board: Board, at: str | None, other: str | None, count: int, *, built: bool
) -> FloatArray | None:
    """Two fingers of the user's own, m; None where sets are to be drawn."""
    say_mirrored(board)
    if at is None and other is None:
        return None
    if at is None or other is None:
        option = "--at" if at is None else "--other"
        raise MissingError(option, "X,Y, the other of two fingers, mm")
    for option, is_given in ((f"--fingers {count}", count != 2), ("--built", built)):
        if is_given:
            raise ConflictError(option, "--at", hint="leave --at and --other out to draw fingers")
    places = parse_place(at, "--at"), parse_place(other, "--other")
    for place, option in zip(places, ("--at", "--other"), strict=True):
        check_target(board, place, option)
        if board.panel is not None and not _is_sensed(board.panel.area, place):
            say(f"{option} {place[0]:g},{place[1]:g}: the panel senses no finger there")
    check_apart(*places, "--other", other)
    return np.array(places) * MM


def _is_sensed(area: Area, place_mm: Place) -> bool:
    return all(
        low - SAME_PLACE <= at * MM <= high + SAME_PLACE
        for at, (low, high) in zip(place_mm, area, strict=True)
    )


def tell_pair(
    board: Board,
    places: FloatArray,
    plate: HiddenPlate | None,
    played: Solve | None,
    numbers: tuple[float | None, float],
    figure: Path | None,
    *,
    as_json: bool,
    **known: Any,
) -> None:
    """Fingers are on `plate`, if one is hidden, and `played` by a device, if there is one.

    `numbers`: λ and newtons; `known`: more rows of the answer.
    """
    with one_blas_thread():
        solve = played or solver_of(board, responses_at(solved_board(board)), numbers[0])
    on = None if plate is None else plate.on(board)
    play = fingers_play(board, places, solve(places), numbers[1], on)
    title = title_of(board, plate, "two fingers", is_played=played is not None)
    if figure is not None:
        from chladni.host.figures.two_fingers import two_fingers_figure  # noqa: PLC0415

        write_figure(two_fingers_figure([play], title), figure)
    rows = [
        {
            "name": name,
            "at_mm": list(place),
            "isolation_db": float(play.isolation_db[own]),
            "finger_um": float(um) if np.isfinite(um := play.finger_um[own]) else None,
        }
        for own, (name, place) in enumerate(zip("AB", play.places_mm, strict=True))
    ]
    told = [
        f"{one['name']} plays: {other} gets {one['isolation_db']:z.0f} dB less{_weak(board, one)}"
        for one, other in zip(rows, "BA", strict=True)
    ]
    where = f"On {plate.name}: " if plate else ""
    result = {"verdict": f"{where}{'. '.join(told)}.", "name": board.name, "newtons": numbers[1]}
    answer(result | known | {"fingers": rows}, as_json=as_json, title=title)


def title_of(board: Board, plate: HiddenPlate | None, what: str, *, is_played: bool) -> str:
    """Above a table of what fingers get."""
    where = f", on {plate.name}" if plate else ""
    return f"{board.name}, {board.known_as}{where}: {what}{', by the pins' if is_played else ''}"


def _weak(board: Board, one: dict[str, Any]) -> str:
    """Where the finger that plays has less of its own than a resting one feels."""
    um, least = one["finger_um"], threshold_um(board.drive.frequency_hz)
    if um is None or least is None or um >= least:
        return ""
    return f" of {um:.2g} µm, which {one['name']} does not feel while it rests"
