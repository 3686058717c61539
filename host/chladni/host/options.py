"""Arguments that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

BoardArgument = Annotated[
    str, typer.Argument(metavar="BOARD", help="Board file, or a shipped name: paper, prototype.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Answer with one JSON object.")]
SeedOption = Annotated[int, typer.Option(help="Seed of the random starts.")]
