"""Arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeVar

import typer

from chladni.host.cli.common.output import check_output
from chladni.host.cli.common.ranges import MOST_JOBS, MOST_SAMPLES, SEEDS, within
from chladni.sim.cost import allow_large_cost
from chladni.sim.errors import ConflictError, InputError, MissingError

BoardArgument = Annotated[
    str, typer.Argument(metavar="BOARD", help="Board file, or a shipped name: prototype, strip5, …")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Answer with one JSON object.")]
SeedOption = Annotated[int, typer.Option(callback=SEEDS, help="Seed of the random starts.")]
SamplesOption = Annotated[
    int,
    typer.Option(
        callback=within(0, MOST_SAMPLES), help="Boards drawn within their tolerances; 0 for none."
    ),
]
PerturbedOption = Annotated[
    bool, typer.Option("--perturbed/--no-perturbed", help="Score such boards too, or not.")
]
JobsOption = Annotated[
    int | None,
    typer.Option(callback=within(1, MOST_JOBS), help="Threads; all cores by default."),
]

SchedulerOption = Annotated[
    str | None, typer.Option(help="tcp://HOST:PORT of a Dask scheduler, whose workers do the work.")
]


def _allow_large(large: bool) -> bool:
    allow_large_cost(large)
    return large


LargeOption = Annotated[
    bool,
    typer.Option(
        "--large", callback=_allow_large, help="Allow work that takes more than 2 GB of memory."
    ),
]
"""Takes effect by itself; commands need not look at it."""
FigureOption = Annotated[
    Path | None, typer.Option("--figure", help="Draw a figure (.png, .svg, .pdf).")
]

PARTIAL = ".partial"
"""Ending of the file in which long work keeps what it has done, beside its output."""


Given = TypeVar("Given")


def required(option: str, value: Given | None, what: str) -> Given:
    """An option's value, where a command cannot do without.

    Raises
    ------
    MissingError
        It is left out; says what it is for.
    """
    if value is None:
        raise MissingError(option, what)
    return value


def check_one_of(what: str = "", **given: bool) -> None:
    """Refuse none or several of some options; `udp_port` stands for --udp-port, `TABLE` for TABLE.

    Raises
    ------
    MissingError
        None is given.
    ConflictError
        Several are.
    """
    names = {n: n if n.isupper() else "--" + n.replace("_", "-") for n in given}
    taken = [names[name] for name, is_given in given.items() if is_given]
    if not taken:
        *others, last = names.values()
        raise MissingError(f"one of {', '.join(others)} and {last}", what)
    if len(taken) > 1:
        raise ConflictError(taken[0], " or ".join(taken[1:]))


def check_figure(figure: Path | None) -> None:
    """A figure that can be written in a format that can be drawn, if one is asked for.

    Raises
    ------
    InputError
        Another ending, or no folder to write to.
    """
    if figure is None:
        return
    # What draws takes a third of a second to load, as in `write_figure`.
    from chladni.host.figures.fields import FORMATS  # noqa: PLC0415

    check_output(figure, "--figure")
    if figure.suffix not in FORMATS:
        expected = "a name that ends in " + ", ".join(FORMATS)
        raise InputError("--figure", str(figure), expected)
