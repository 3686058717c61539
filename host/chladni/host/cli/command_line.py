"""All commands under one name: thin over `chladni.sim`, `chladni.tables` and `chladni.host`."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Any

import typer

from chladni.host.cli.command_modules import MODULES
from chladni.host.cli.common.command_group import CommandGroup, LoadedCommands
from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer
from chladni.host.protocol import link as link_protocol
from chladni.sim.errors import MissingError
from chladni.tables import layout

COMMANDS = LoadedCommands(MODULES)


class AllCommands(CommandGroup):
    """All commands, of which each is loaded when it is asked for."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        # Read, never changed.
        self.commands = COMMANDS  # type: ignore[assignment]


app = typer.Typer(
    cls=AllCommands,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def versions(
    context: typer.Context,
    show: Annotated[
        bool, typer.Option("--version", help="Show the versions of program, tables and link.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Put a vibration where a finger is."""
    if show:
        known = {
            "chladni": version("chladni"),
            "table_format": f"{layout.VERSION_MAJOR}.{layout.VERSION_MINOR}",
            "link": f"{link_protocol.VERSION_MAJOR}.{link_protocol.VERSION_MINOR}",
        }
        answer(known, as_json=as_json, title="Chladni")
        raise typer.Exit
    if context.invoked_subcommand is None:
        raise MissingError("COMMAND", "`chladni -h` lists them")
