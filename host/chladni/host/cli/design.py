"""`chladni design`: the board that meets a SPEC best, and the front of the others."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.design.evaluate import TOO_WEAK, completed_board, document_of, least_um
from chladni.design.front import Design, Entry
from chladni.design.last_boards import boards_more
from chladni.design.search import OnBoard, design
from chladni.design.spec import FINGER_LEVEL, FINGER_TERMS, Spec, read_spec
from chladni.design.starts import spread_numbers
from chladni.drives.checkpoint import remove_checkpoint
from chladni.drives.methods import SEED
from chladni.drives.scoring.survey import SAMPLES
from chladni.host.cli.common.board_reports import of_waves, say_leftovers, say_panel
from chladni.host.cli.common.options import (
    PARTIAL,
    FigureOption,
    JobsOption,
    JsonOption,
    LargeOption,
    SchedulerOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import answer, check_output, progress_bar, say, write_figure
from chladni.host.cli.common.ranges import MOST_SAMPLES, within
from chladni.host.cli.common.verdicts import of_design
from chladni.host.manufacture.board_parts import sheet_of
from chladni.sim.board.panel_layer import layered_plate
from chladni.sim.board.writing import board_file
from chladni.sim.errors import ArgumentError, InputError
from chladni.sim.files import write_whole

TOML = (".toml",)
MOST_MINUTES = 100_000.0
WORTH, WORTH_OPEN = 60, 200
"""Boards up to which scores grow, of coils' places alone and with sheet or foam open
(docs/design.md)."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("design")(design_board)


def design_board(
    spec: Annotated[
        str,
        typer.Argument(
            metavar="SPEC",
            help="Board file with open values and [design], or a shipped one: strip, strip-open, …",
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Board file to write (.toml).")],
    front: Annotated[
        Path | None,
        typer.Option(help="Folder for the boards of the front, a file each; made if need be."),
    ] = None,
    figure: FigureOption = None,
    samples: Annotated[
        int,
        typer.Option(
            callback=within(1, MOST_SAMPLES),
            help="Drawn boards by which the last few are compared.",
        ),
    ] = SAMPLES,
    minutes: Annotated[
        float | None,
        typer.Option(
            callback=within(0.0, MOST_MINUTES),
            help="For the whole search, roughly; the last few boards are compared anyway. The same "
            "command goes on from what was looked at.",
        ),
    ] = None,
    seed: SeedOption = SEED,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find the board that focuses best, by the values that a SPEC leaves open.

    The output has the best board found so far, from the first one on. The same command continues a
    search that was stopped.
    """
    check_output(output, "-o", TOML)
    check_figure(figure)
    asked = read_spec(spec)
    if front is not None:
        _make_folder(front, output)

    kept = output.with_name(output.name + PARTIAL)
    others: list[int] = []
    _say_first(asked, seed, samples)
    try:
        limit_s = None if minutes is None else 60.0 * minutes
        is_kept = partial(_is_kept, kept, others)
        with progress_bar("boards", kept=is_kept, limit_s=limit_s) as progress:
            found = design(
                asked,
                seed=seed,
                jobs=jobs,
                scheduler=scheduler,
                partial_file=kept,
                samples=samples,
                minutes=minutes,
                progress=progress,
                on_board=_writing(output, asked.settings.samples, samples),
                on_pace=partial(_say_pace, asked, minutes),
                on_last=_say_last,
                on_other=partial(_say_other, kept, others),
            )
    except InputError as error:
        is_option = isinstance(error, ArgumentError) and error.field != "spec"
        raise (error if is_option else error.in_file(spec)) from None
    write_whole(output, board_file(found.board, _about(found, spec, asked)))
    entries = _written_front(found, front, output.stem)
    if figure is not None:
        from chladni.host.figures.designs import front_figure  # noqa: PLC0415

        write_figure(front_figure(found), figure)
    extent = _extent(found, asked, samples, minutes, kept)
    if not _is_ended(found, asked, minutes):
        remove_checkpoint(kept)
    if not as_json:
        # Beside parts `mass_g` is of one piece.
        for number, entry in enumerate(entries, 1):
            entry |= {"plate_and_magnets_g": entry.pop("mass_g"), "name": f"board {number}"}
    result = _result(found, asked, entries, output, extent)
    answer(result, as_json=as_json, title=f"{output} answers {spec}")
    if not as_json:
        _say_next(found, asked, output)


def _say_next(found: Design, spec: Spec, output: Path) -> None:
    """Which commands score the board as the search did, and say more."""
    if FINGER_TERMS.keys() & spec.weights.keys():
        own = f"{output} --samples {found.draws} --seed {found.seed}"
        say(f"`chladni fingers {own}` scores it within tolerances, as here.")
        pairs = f"chladni play click --pairs 20 --emulator --board {output}"
        say(f"Scores are of tones: `{pairs}` tells what clicks keep.")
    foam = " and how much foam twice as stiff takes" if found.board.foundation else ""
    say(f"`chladni board score {output}` says more{foam}.")


def _make_folder(front: Path, output: Path) -> None:
    if not front.parent.is_dir() or (front.exists() and not front.is_dir()):
        raise InputError("--front", str(front), "a folder, there or in one that is there")
    front.mkdir(exist_ok=True)
    check_output(front / f"{output.stem}-1.toml", "--front")


def _written_front(found: Design, front: Path | None, stem: str) -> list[dict[str, Any]]:
    """Numbers of the front's boards, each written to a file where a folder is given."""
    entries: list[dict[str, Any]] = [dict(one.summary) for one in found.front]
    if front is not None:
        for number, (one, entry) in enumerate(zip(found.front, entries, strict=True), 1):
            path = front / f"{stem}-{number}.toml"
            write_whole(path, board_file(completed_board(one.document), _about_entry(one)))
            entry["path"] = str(path)
    return entries


def _writing(output: Path, drawn: int, samples: int) -> OnBoard:
    """Writes each board that is better than all before it."""

    def keep(entry: Entry, is_best: bool) -> None:
        if is_best:
            about = [
                "The best board so far. Its figures are too good: of many it is the luckiest one",
                f"by {drawn} drawn boards. At the end the last few get {samples}.",
                "The same command continues the search if it was stopped,",
                "and with --minutes 0 ends it: with the front, the figure and the full scores.",
                *_about_entry(entry),
            ]
            write_whole(output, board_file(completed_board(entry.document), about))

    return keep


def _say_last(count: int, draws: int, seconds: float) -> None:
    """Before the last boards are compared, which may take long."""
    time = f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{seconds:.0f} s"
    boards = "the last board" if count == 1 else f"the last {count} boards"
    say(f"about {time} to compare {boards}, with {draws} drawn boards each")


def _say_pace(spec: Spec, minutes: float | None, most: int, board_s: float) -> None:
    """How many boards a search comes to in its time, and how many are worth it."""
    asked, worth = spec.settings.evaluations, WORTH_OPEN if spec.variables else WORTH
    told = f"a board takes {board_s:.2g} s"
    if minutes:
        told += f": this search looks at about {most} of {asked} boards in {minutes:g} min"
    elif minutes is None:
        told += f": {most} boards take about {most * board_s / 60.0:.2g} min"
    if most < worth:
        told += f"; scores of a SPEC like this grow up to some {worth} (docs/design.md)"
    say(told)


def _is_kept(kept: Path, others: list[int]) -> bool:
    """Whether there is something of this search, and not of the other one that it replaces."""
    return kept.exists() and kept.stat().st_mtime_ns not in others


def _say_other(kept: Path, others: list[int]) -> None:
    """Before what an earlier search kept is lost; `others` gets the time of its last change."""
    others.append(kept.stat().st_mtime_ns)
    say(
        f"{kept} has boards of another SPEC, seed or version: the search begins again, and its own "
        "take their place. To keep them stop it now, and write to another name"
    )


def _say_first(spec: Spec, seed: int, samples: int) -> None:
    """How long a search is, and what is missing in any board of the SPEC."""
    first = "layouts first, then " if spec.places_are_free else ""
    say(
        f"{first}{spec.settings.evaluations} boards, and to compare the last few takes as long as "
        f"some {boards_more(spec, samples)} more"
    )
    places = [(0.0, 0.0)] if spec.places_are_free else None
    try:
        board = completed_board(document_of(spec, spread_numbers(spec, seed)[0], places))
    except InputError:
        return  # The search says what is wrong.
    say_leftovers(board)
    if layered := layered_plate(board):
        say_panel(layered, for_several=board.is_for_several)


def _about(found: Design, spec: str, asked: Spec) -> list[str]:
    first = f"Answers {Path(spec).name}: the best of {found.evaluations} boards, seed {found.seed}."
    most = asked.settings.evaluations
    more = [f"({most} were asked for, and a round that has begun is finished.)"]
    lacking = _lacking(found, asked)
    return [
        first,
        *more * (found.evaluations > most),
        *_about_entry(found.best),
        *[lacking] * bool(lacking),
    ]


def _is_ended(found: Design, spec: Spec, minutes: float | None) -> bool:
    """Whether its time ended a search, so that the same command may go on."""
    return minutes is not None and found.evaluations < spec.settings.evaluations


def _extent(found: Design, spec: Spec, samples: int, minutes: float | None, kept: Path) -> str:
    """How far the search went, where its time ended it."""
    asked, drawn = spec.settings.evaluations, found.draws
    said = ""
    if _is_ended(found, spec, minutes):
        said = f"Time was up after {found.evaluations} of {asked} boards: a longer search may gain."
        said += f" The same command goes on from {kept}."
    if drawn < samples:
        few = f"The last few had {drawn} drawn boards each in place of {samples}"
        said += f" {few}: the worst tenth may be some dB less."
    return said.strip()


def _lacking(found: Design, spec: Spec) -> str:
    """What the best board's score lost where its finger gets less than the SPEC asks for."""
    level, asked = least_um(spec, found.board)
    several = level == FINGER_LEVEL
    um = found.best.summary.get("fingers_um" if several else "finger_um")
    if um is None or um >= asked:
        return ""
    lost = TOO_WEAK * 20.0 * math.log10(asked / um)
    who = "Each of two fingers" if several else "A finger"
    return (
        f"{who} gets {um:.2g} µm at the worst tenth, and design.finger_um asks for {asked:g}: "
        f"that took {lost:.1f} dB off the score, {TOO_WEAK:g} for each dB less."
    )


def _median(found: Design) -> str:
    """What the middle of all places has of one finger; the search goes by the worst tenth."""
    kept = found.full.perturbed
    db = kept.second_finger_20mm_db if kept else None
    um = kept.finger_um if kept else None
    if db is None:
        return ""
    level = "" if um is None else f" and {um.median:.2g} µm"
    return f"The median for one finger is {db.median:z.0f} dB 20 mm away{level}."


def _about_entry(entry: Entry) -> list[str]:
    own = entry.summary
    scores = (
        f"Score {entry.evaluation.score:.2f} as drawn, {entry.evaluation.robust_score:.2f} within "
        "tolerances, by [design.weights]. Within tolerances nine of ten places have"
    )
    several = [
        f"{FINGER_TERMS[name]} fingers {own[name]:z.1f} dB" for name in FINGER_TERMS if name in own
    ]
    if several:
        each = f", at {own['fingers_um']:.1f} µm or more each" if "fingers_um" in own else ""
        return [scores, f"{', '.join(several)} apart{each}."]
    um, db = own["finger_um"], own["second_finger_20mm_db"]
    apart = f"at least {db:.1f} dB below" if db >= 0.0 else f"up to {-db:.1f} dB above"
    return [
        scores,
        f"a second finger 20 mm away {apart} the finger"
        + (f", and {um:.1f} µm under it." if um is not None else "."),
    ]


def _result(
    found: Design, spec: Spec, entries: list[dict[str, Any]], output: Path, extent: str
) -> dict[str, Any]:
    verdict = of_design(
        found.best.summary,
        for_fingers={
            count: found.best.evaluation.terms[name]
            for name, count in FINGER_TERMS.items()
            if name in spec.weights
        },
    )
    waves = of_waves(found.board) if found.board.fingers is not None else ""
    remarks = (
        verdict,
        extent,
        _median(found),
        _lacking(found, spec),
        waves and f"T{waves[1:]}.",
    )
    return {
        "verdict": " ".join(one for one in remarks if one),
        "path": str(output),
        "score": found.best.evaluation.score,
        "robust_score": found.best.evaluation.robust_score,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "seed": found.seed,
        "sheet": sheet_of(found.board.plate),
        "actuators": [
            {"name": one.name, "at_mm": [round(1e3 * along, 6) for along in one.at]}
            for one in found.board.actuators
        ],
        "front": entries,
    }
