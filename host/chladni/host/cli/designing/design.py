"""`chladni design`: the board that meets a SPEC best, and the front of the others."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.design.evaluate import completed_board
from chladni.design.front import Design, Entry
from chladni.design.search import OnBoard, design
from chladni.design.spec import FIELD, WHAT, read_spec
from chladni.drives.checkpoint import remove_checkpoint
from chladni.drives.methods import SEED
from chladni.drives.scoring.survey import SAMPLES
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
from chladni.host.cli.common.output import answer, check_output, progress_bar, write_figure
from chladni.host.cli.common.ranges import MOST_SAMPLES, within
from chladni.host.cli.designing.answers import (
    about,
    about_entry,
    extent,
    is_answer,
    is_ended,
    parts_told,
    result,
)
from chladni.host.cli.designing.remarks import (
    is_kept,
    say_first,
    say_last,
    say_next,
    say_other,
    say_pace,
)
from chladni.sim.board.file import file_of, shipped_specs
from chladni.sim.board.writing import board_file
from chladni.sim.errors import ArgumentError, InputError
from chladni.sim.files import write_whole

TOML = (".toml",)
MOST_MINUTES = 100_000.0


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
            help="Random boards by which the last few are compared.",
        ),
    ] = SAMPLES,
    minutes: Annotated[
        float | None,
        typer.Option(
            callback=within(0.0, MOST_MINUTES),
            help="For the whole search; the best board is scored in full anyway. The same "
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
    read = file_of(spec, shipped_specs(), FIELD, WHAT)
    check_output(output, "-o", TOML, [read])
    check_figure(figure)
    asked = read_spec(spec)
    if front is not None:
        _make_folder(front, output, read)

    kept = output.with_name(output.name + PARTIAL)
    others: list[int] = []
    say_first(asked, seed, samples, kept if minutes == 0.0 else None)
    limit_s = None if minutes is None else 60.0 * minutes
    can_go_on = partial(is_kept, kept, others)
    try:
        with progress_bar("search", kept=can_go_on, limit_s=limit_s, in_percent=True) as progress:
            found = design(
                asked,
                seed=seed,
                jobs=jobs,
                scheduler=scheduler,
                partial_file=kept,
                samples=samples,
                minutes=minutes,
                progress=progress,
                on_board=written_on_board(output, asked.settings.samples, samples),
                on_pace=partial(say_pace, asked, minutes),
                on_last=say_last,
                on_other=partial(say_other, kept, others),
            )
    except InputError as error:
        if error.field == "spec" and can_go_on():
            remove_checkpoint(kept)  # no board of this SPEC is worth to go on from
        is_option = isinstance(error, ArgumentError) and error.field != "spec"
        raise (error if is_option else error.in_file(spec)) from None
    write_whole(output, board_file(found.board, about(found, spec, asked)))
    entries = _written_front(found, front, output.stem)
    if figure is not None:
        from chladni.host.figures.designs import front_figure  # noqa: PLC0415

        write_figure(front_figure(found), figure)
    if not is_ended(found, asked, minutes):
        remove_checkpoint(kept)
    if not as_json:
        # Beside parts `mass_g` is of one piece.
        for number, entry in enumerate(entries, 1):
            entry |= {"plate_and_magnets_g": entry.pop("mass_g"), "name": f"board {number}"}
    how_far = extent(found, asked, samples, minutes, kept)
    rows = result(found, asked, entries, output, how_far)
    answer(rows, as_json=as_json, title=f"{output} answers {spec}")
    if not as_json:
        say_next(found, asked, output, front)


def _make_folder(front: Path, output: Path, read: Path) -> None:
    if not front.parent.is_dir() or (front.exists() and not front.is_dir()):
        raise InputError("--front", str(front), "a folder, there or in one that is there")
    front.mkdir(exist_ok=True)
    for path in (front / f"{output.stem}-1.toml", *front.glob(f"{output.stem}-*.toml")):
        check_output(path, "--front", inputs=[read])


def _written_front(found: Design, front: Path | None, stem: str) -> list[dict[str, Any]]:
    """Numbers of the front's boards, each written to a file where a folder is given."""
    entries: list[dict[str, Any]] = []
    for number, one in enumerate(found.front, 1):
        board = completed_board(one.document)
        entries.append(dict(one.summary) | parts_told(board))
        if front is not None:
            path = front / f"{stem}-{number}.toml"
            write_whole(path, board_file(board, about_entry(one)))
            entries[-1]["path"] = str(path)
    return entries


def written_on_board(output: Path, drawn: int, samples: int) -> OnBoard:
    """Write each board that is better than all before it; over no answer that is complete."""
    stays = is_answer(output)

    def keep(entry: Entry, is_best: bool) -> None:
        if is_best and not stays:
            told = [
                "The best board so far. Its figures are too good: of many it is the luckiest one",
                f"by {drawn} random boards, and by fewer pairs of fingers than it gets at the end.",
                f"Then the last few get up to {samples} random boards.",
                "The same command continues the search if it was stopped,",
                "and with --minutes 0 ends it: with the front, the figure and the full scores.",
                *about_entry(entry),
            ]
            write_whole(output, board_file(completed_board(entry.document), told))

    return keep
