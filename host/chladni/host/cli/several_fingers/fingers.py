"""`chladni fingers`: how well a board keeps several fingers apart."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.methods import SEED
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.as_built import LEAST_PRESS, MOST_PRESS
from chladni.drives.scoring.several_fingers.fingers_as_built import (
    FingersAsBuilt,
    score_fingers_as_built,
)
from chladni.drives.scoring.several_fingers.fingers_score import (
    MOST_SETS,
    SETS,
    CountScore,
    FingersScore,
    Solve,
    score_fingers,
)
from chladni.drives.scoring.several_fingers.kept_apart import KeptApart
from chladni.drives.scoring.survey import SAMPLES
from chladni.host.cli.common.drive_options import on_less
from chladni.host.cli.common.finger_remarks import of_fingers, say_tones
from chladni.host.cli.common.hidden_plates import named_plate
from chladni.host.cli.common.options import (
    BoardArgument,
    FigureOption,
    JsonOption,
    LargeOption,
    PerturbedOption,
    SamplesOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import answer, progress_bar, say_unmet, write_figure
from chladni.host.cli.common.ranges import within
from chladni.host.cli.common.terms import of_loudest
from chladni.host.cli.several_fingers.own_pair import own_pair, tell_pair, title_of
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ConflictError, InputError
from chladni.sim.image.finger import PRESS, threshold_um
from chladni.tables.format import read_table
from chladni.tables.inspection.owner import board_for
from chladni.tables.responses import TableResponses

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

COUNTS = (2, 3, 4, 5)
FOR_FIGURES = ("places", "drives", "rows", "perturbed_rows")


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("fingers")(fingers)


CountOption = Annotated[
    int | None,
    typer.Option("--fingers", callback=within(2, 5), help="How many; 2, 3, 4 and 5 if left out."),
]
ApartOption = Annotated[
    float | None,
    typer.Option(
        callback=within(1.0, 1000.0, "mm"),
        help="Between two fingers, mm; the board's fingers.apart_mm if left out.",
    ),
]
SetsOption = Annotated[
    int, typer.Option(callback=within(1, MOST_SETS), help="Sets of fingers that are drawn.")
]
RegularisationOption = Annotated[
    float | None,
    typer.Option(
        "--lambda",
        callback=within(1e-9, 1e9),
        help="Level against silence, for all drives; chosen for each finger if left out.",
    ),
]
PressOption = Annotated[
    float, typer.Option(callback=within(LEAST_PRESS, MOST_PRESS, "N"), help="Of each finger, N.")
]
BesideOption = Annotated[
    float,
    typer.Option(
        callback=within(0.0, 20.0, "mm"),
        help="How far fingers lie from where the panel has them, mm.",
    ),
]
TableOption = Annotated[
    Path | None,
    typer.Option(
        help="Table with responses: the pins of a device that is emulated make the drives."
    ),
]
BuiltOption = Annotated[
    bool, typer.Option("--built", help="Also pressed, warm, under a film, on stiffer foam.")
]
HiddenOption = Annotated[
    str | None,
    typer.Option(
        metavar="[BOARD@]SEED",
        help="Fingers are on the plate of `calibrate --board BOARD --hidden SEED`, or of a "
        "FILE.toml; no boards within tolerances are scored beside it.",
    ),
]
AtOption = Annotated[
    str | None, typer.Option("--at", metavar="X,Y", help="Two fingers of your own: one, mm.")
]
OtherOption = Annotated[
    str | None, typer.Option(metavar="X,Y", help="And the other; a figure has what moves.")
]


def fingers(
    board: BoardArgument,
    at: AtOption = None,
    other: OtherOption = None,
    count: CountOption = None,
    apart: ApartOption = None,
    sets: SetsOption = SETS,
    regularisation: RegularisationOption = None,
    press: PressOption = PRESS,
    beside: BesideOption = 0.0,
    table: TableOption = None,
    built: BuiltOption = False,
    hidden: HiddenOption = None,
    samples: SamplesOption = SAMPLES,
    perturbed: PerturbedOption = True,
    figure: FigureOption = None,
    seed: SeedOption = SEED,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Score what fingers that press a board at once feel of each other's signals: steady tones.

    `chladni play` does so for two fingers' effects.
    """
    check_figure(figure)
    loaded = load_board(board)
    _check_asked(hidden, table, regularisation, built=built)
    pair = own_pair(loaded, at, other, count or 2, built=built)
    solve, known = (None, None) if table is None else _device_of(table, loaded, board)
    loaded = on_less(loaded)
    plate = named_plate(loaded, hidden)
    if pair is not None:
        told: dict[str, Any] = {"table": table and str(table), "hidden": hidden, "as_json": as_json}
        tell_pair(loaded, pair, plate, solve, (regularisation, press), figure, **told)
        return
    drawn: dict[str, Any] = {"apart": None if apart is None else apart * MM, "sets": sets}
    drawn |= {"regularisation": regularisation, "newtons": press, "seed": seed}
    with progress_bar("sets of fingers") as progress:
        score = score_fingers(
            loaded,
            _numbers(count, loaded, is_played=table is not None),
            beside=beside * MM,
            samples=samples if perturbed and plate is None else 0,
            solve=solve,
            plate=known,
            clicks=True,
            on=None if plate is None else plate.on(loaded),
            progress=progress,
            **drawn,
        )
    fields = solved_board(loaded).fields
    say_unmet(fields.error_estimate, fields.tolerance)
    _draw(figure, loaded, score, is_played=table is not None, plate=plate)
    counts = [_as_keys(own) for own in score.counts]
    for keys in counts if built else ():
        found = _as_built(loaded, keys["fingers"], samples, drawn)
        keys["built"] = asdict(found) if as_json else _in_short(found)
    result: dict[str, Any] = {
        "verdict": _verdict(loaded, score, plate),
        "name": loaded.name,
        "apart_mm": score.apart_mm,
        "newtons": press,
        "beside_mm": beside,
        "lambda": regularisation,
        "table": None if table is None else str(table),
        "hidden": hidden,
        "seed": seed,
        "seconds": score.seconds,
    }
    result |= {"counts": counts} if as_json else _by_number(counts)
    title = title_of(loaded, plate, "several fingers", is_played=table is not None)
    answer(result, as_json=as_json, title=title)
    if not as_json:
        say_tones(board, loaded, table, hidden=hidden, clicks=True)


def _verdict(board: Board, score: FingersScore, plate: HiddenPlate | None) -> str:
    just_felt = threshold_um(board.drive.frequency_hz)
    where = f"On {plate.name}: " if plate else ""
    return where + " ".join(of_fingers(own, score.apart_mm, just_felt) for own in score.counts)


def _as_built(board: Board, count: int, samples: int, drawn: dict[str, Any]) -> FingersAsBuilt:
    samples = max(samples, 1)
    with progress_bar(f"sets of {count} fingers as built") as progress:
        return score_fingers_as_built(board, count, samples=samples, progress=progress, **drawn)


def _check_asked(
    hidden: str | None,
    table: Path | None,
    regularisation: float | None,
    *,
    built: bool,
) -> None:
    """Raise `ConflictError` for what does not go together."""
    if hidden is not None and built:
        raise ConflictError("--built", "--hidden", hint="that plate is what was built")
    if table is not None and regularisation is not None:
        raise ConflictError("--lambda", "--table", hint="a device chooses it for each finger")
    if table is not None and built:
        raise ConflictError("--built", "--table", hint="drives that know a film come of its board")


def _draw(
    path: Path | None,
    board: Board,
    score: FingersScore,
    *,
    is_played: bool,
    plate: HiddenPlate | None = None,
) -> None:
    if path is None:
        return
    # What draws takes a third of a second to load.
    from chladni.host.figures.fingers import fingers_figure  # noqa: PLC0415

    threshold = threshold_um(board.drive.frequency_hz)
    known_as = f"{board.known_as}, on {plate.name}" if plate else board.known_as
    drawn = fingers_figure(board.name, score, threshold, is_played=is_played, known_as=known_as)
    write_figure(drawn, path)


def _numbers(count: int | None, board: Board, *, is_played: bool) -> tuple[int, ...]:
    """Of fingers that are scored: where a device plays them, no more than its panel hears of."""
    most = COUNTS[-1]
    if is_played and board.panel is not None:
        most = board.panel.most_fingers
    if count is None:
        return tuple(own for own in COUNTS if own <= most)
    if count > most:
        raise InputError(
            "--fingers",
            count,
            f"at most {most}, which the board's panel hears of",
            hint="leave --table out, which scores the board without its panel",
        )
    return (count,)


def _device_of(table: Path, board: Board, named: str) -> tuple[Solve, TableResponses]:
    """What an emulated device plays of a table that was made for the board, and knows by it."""
    # The firmware takes a moment to load.
    from chladni.host.emulation.played_fingers import played_finger_drives  # noqa: PLC0415

    loaded = read_table(table)
    board_for(loaded, named, file=str(table))
    frequency_hz = board.drive.frequency_hz
    try:
        known = TableResponses.of(loaded, frequency_hz)
    except InputError as error:
        raise error.in_file(str(table)) from None

    def solve(places: FloatArray) -> ComplexArray:
        return played_finger_drives(loaded, board, places, frequency_hz=frequency_hz)

    return solve, known


def _by_number(counts: list[dict[str, Any]]) -> dict[str, Any]:
    """Rows for each number of fingers, which people read."""
    return of_loudest({f"{own['fingers']} fingers": own | {"fingers": None} for own in counts})


def _in_short(found: FingersAsBuilt) -> dict[str, str]:
    """A row for each way in which a board is built."""
    rows = {}
    for key in ("nominal", "film", "stretched", "warm", "foam_twice", "together"):
        own: KeptApart | None = getattr(found, key)
        if own is None:
            continue
        apart = own.isolation_db
        rows[key] = f"{apart.median:z.0f} dB, {apart.p10:z.0f} at the worst tenth"
        if own.finger_um is not None:
            rows[key] += f"; {own.finger_um.median:.2g} µm"
    return rows


def _as_keys(score: CountScore) -> dict[str, Any]:
    return {key: value for key, value in asdict(score).items() if key not in FOR_FIGURES}
