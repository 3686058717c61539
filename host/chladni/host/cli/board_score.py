"""Command that scores a board: for one finger, for two, as drawn, within tolerances, as built."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.drives.methods import SEED
from chladni.drives.objectives import default_objective
from chladni.drives.scoring.as_built import (
    LEAST_PRESS,
    MOST_PRESS,
    AsBuilt,
    score_as_built,
)
from chladni.drives.scoring.board_score import PITCH, BoardScore, score_board
from chladni.drives.scoring.remedies import Remedy, tried_remedies
from chladni.drives.scoring.several_fingers.fingers_as_built import on_stiffer_foam
from chladni.drives.scoring.several_fingers.fingers_score import CountScore, score_fingers
from chladni.drives.scoring.several_fingers.kept_apart import KeptApart
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.solve import check_request
from chladni.host.cli.common.board_reports import (
    say_purpose,
    say_warm_magnets,
    score_rows,
)
from chladni.host.cli.common.drive_options import OwnObjectiveOption, on_less
from chladni.host.cli.common.finger_remarks import say_mirrored, say_tones, say_waves
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
from chladni.host.cli.common.output import (
    answer,
    progress_bar,
    say,
    say_unmet,
    write_figure,
)
from chladni.host.cli.common.ranges import PITCHES, within
from chladni.host.cli.common.terms import of_loudest
from chladni.host.cli.common.verdicts import of_board, of_built
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.image.finger import NOTICED_DB, PRESS

OF_SEVERAL = (
    *("name", "verdict", "two_fingers", "foam_twice", "one_finger", "built"),
    *("coil_spacing_mm", "foam_length_mm", "room_for", "error_estimate", "seconds"),
)
PRESSES = within(LEAST_PRESS, MOST_PRESS, "N")


def board_score(
    board: BoardArgument,
    pitch: Annotated[
        float | None,
        typer.Option(callback=PITCHES, help="Between places, mm; 6, or 3 on a small board."),
    ] = None,
    objective: OwnObjectiveOption = None,
    samples: SamplesOption = SAMPLES,
    perturbed: PerturbedOption = True,
    built: Annotated[
        bool, typer.Option("--built", help="Also pressed, warm, under a film, on stiffer foam.")
    ] = False,
    press: Annotated[
        float, typer.Option(callback=PRESSES, help="How hard a finger presses, N.")
    ] = PRESS,
    figure: FigureOption = None,
    seed: SeedOption = SEED,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Score a board as drawn and within its tolerances: its focus, or with [fingers] alone two."""
    check_figure(figure)
    check_request("phasor", objective or "ssim", seed, None, None)
    started, loaded = time.perf_counter(), load_board(board)
    rated = objective or default_objective(loaded)
    loaded = on_less(loaded) if rated == "focus" else loaded
    say_purpose(loaded, objective, rated)
    drawn = samples if perturbed else 0
    is_of_several = loaded.is_for_several and objective is None
    with progress_bar("boards") as progress:
        score = score_board(
            loaded,
            pitch=None if pitch is None else pitch * MM,
            objective=rated,
            samples=drawn if as_json or not is_of_several else 0,  # people are not shown them
            border=True,
            in_full=rated == "focus" and not is_of_several,
            seed=seed,
            progress=progress,
        )
    say_unmet(score.error_estimate, TOLERANCE)
    one, two, foam_twice = _fingers(loaded, drawn if is_of_several else 0, seed)
    verdict = of_board(
        score,
        two,
        frequency_hz=loaded.drive.frequency_hz,
        known_as=loaded.known_as,
        for_fingers=loaded.is_for_several,
        has_fingers=loaded.fingers is not None,
        apart=loaded.fingers_apart,
        foam_twice=foam_twice,
        tried=_tried(loaded, score),
    )
    if figure is not None:
        _draw(figure, loaded, score, None if objective else two, verdict)
    result = {"name": loaded.name, "verdict": verdict} | score_rows(loaded, score, one, two)
    result["foam_twice"] = asdict(foam_twice) if foam_twice else None
    if built:
        if is_of_several:
            say(f"--built is of drives for one finger; of several: chladni fingers {board} --built")
        found = _as_built(loaded, pitch, rated, press, samples, seed)
        result["built"] = asdict(found)
        if not is_of_several:
            result["verdict"] += of_built(found.together)
    result["seconds"] = time.perf_counter() - started
    title = f"{loaded.name}: {'two fingers' if is_of_several else 'one finger, and two'}"
    told = result if as_json else of_loudest(_of_purpose(board, loaded, objective, result))
    answer(told, as_json=as_json, title=title)


def _as_built(
    board: Board, pitch: float | None, rated: str, newtons: float, samples: int, seed: int
) -> AsBuilt:
    with progress_bar("steps") as progress:
        found = score_as_built(
            board,
            pitch=PITCH if pitch is None else pitch * MM,
            objective=rated,
            newtons=newtons,
            samples=max(samples, 1),
            seed=seed,
            progress=progress,
        )
    say_warm_magnets(found)
    return found


def _draw(
    path: Path, board: Board, score: BoardScore, two: CountScore | None, verdict: str
) -> None:
    # What draws takes a third of a second to load.
    from chladni.host.figures.boards import board_figure  # noqa: PLC0415

    write_figure(board_figure(board, score, two, verdict), path)


def _of_purpose(
    named: str, board: Board, objective: str | None, result: dict[str, Any]
) -> dict[str, Any]:
    """What people get: of a board for several fingers no focus, which its device does not play."""
    if not board.is_for_several or objective is not None:
        if board.focus is not None and board.coil is not None:
            say_tones(named, board)
        return result
    say("its device plays no focus: --objective focus shows how one finger would get it")
    say_tones(named, board, clicks=True)
    return {key: value for key, value in result.items() if key in OF_SEVERAL}


def _tried(board: Board, score: BoardScore) -> list[Remedy]:
    """Other sheets and foams, where a board that is to focus does not."""
    known = score.second_finger_20mm_db
    if board.is_for_several or known is None or known.median >= NOTICED_DB:
        return []
    with progress_bar("other sheets and foams") as progress:
        return tried_remedies(board, progress=progress)


def _fingers(
    board: Board, samples: int, seed: int
) -> tuple[CountScore, CountScore | None, KeptApart | None]:
    """What one finger alone gets, and how far apart two are kept, as `chladni fingers` has it.

    The second is None without room for two. Then the same of these on foam twice as stiff; None
    without foam, or where it was measured.
    """
    if board.fingers is not None:
        say_waves(board)
        say_mirrored(board)
    with progress_bar("sets of one and two fingers") as progress:
        clicks = board.is_for_several
        found = score_fingers(
            board, (1, 2), samples=samples, seed=seed, clicks=clicks, progress=progress
        )
    one, *more = found.counts
    if not more:
        return one, None, None
    return one, more[0], None if board.measured else on_stiffer_foam(board, more[0])
