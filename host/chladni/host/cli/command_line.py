"""All commands under one name: thin over `chladni.sim`, `chladni.tables` and `chladni.host`."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated

import typer

from chladni.host.cli import board as board_commands
from chladni.host.cli import compare as compare_command
from chladni.host.cli import design as design_command
from chladni.host.cli import plate as plate_commands
from chladni.host.cli import table as table_commands
from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer
from chladni.host.cli.device import commands as device_commands
from chladni.host.cli.emulate import emulate
from chladni.host.cli.refit import board_refit
from chladni.host.cli.solve import solve_command
from chladni.host.cli.studio import studio
from chladni.host.protocol import link as link_protocol
from chladni.sim.errors import MissingError
from chladni.tables import layout

app = typer.Typer(
    cls=CommandGroup,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
table_app = typer.Typer(cls=CommandGroup, help="Build and read drive tables.", no_args_is_help=True)
board_commands.board_app.command("refit")(board_refit)
app.add_typer(board_commands.board_app, name="board")
app.add_typer(table_app, name="table")

plate_commands.register(app)
app.command("solve")(solve_command)
app.command("emulate")(emulate)
app.command("studio")(studio)
compare_command.register(app)
design_command.register(app)
table_commands.register(table_app)
device_commands.register(app)


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
