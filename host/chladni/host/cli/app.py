"""The `chladni` command: thin over `chladni.sim`, `chladni.tables` and `chladni.host`."""

from __future__ import annotations

import logging
import sys
from importlib.metadata import version
from typing import Annotated

import typer

from chladni.host.cli import compare as compare_command
from chladni.host.cli import device as device_commands
from chladni.host.cli import plate as plate_commands
from chladni.host.cli import table as table_commands
from chladni.host.cli.emulate import emulate
from chladni.host.cli.options import (
    BoardArgument,
    JsonOption,
    LargeOption,
)  # fmt: skip
from chladni.host.cli.output import (
    answer,
)  # fmt: skip
from chladni.host.cli.solve import solve_command
from chladni.host.protocol import link as link_protocol
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ChladniError, InputError, MissingError
from chladni.sim.fields.transfer import plate_model
from chladni.tables import layout

app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
board_app = typer.Typer(help="Look at board files.", no_args_is_help=True)
table_app = typer.Typer(help="Build and read drive tables.", no_args_is_help=True)
app.add_typer(board_app, name="board")
app.add_typer(table_app, name="table")

plate_commands.register(app)
app.command("solve")(solve_command)
app.command("emulate")(emulate)
compare_command.register(app)
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


@board_app.command("show")
def board_show(
    board: BoardArgument, large: LargeOption = False, as_json: JsonOption = False
) -> None:
    """Show a board and its first ten natural frequencies."""
    loaded = load_board(board)
    modes = plate_model(loaded).natural_frequencies(10)
    result = {
        "name": loaded.name,
        "size_mm": [side / MM for side in loaded.plate.size],
        "actuators": [
            {"name": a.name, "at_mm": [round(value / MM, 9) for value in a.at]}
            for a in loaded.actuators
        ],
        "modes_hz": [round(float(mode), 4) for mode in modes],
        "wavelength_mm": loaded.plate.wavelength(loaded.drive.frequency_hz) / MM,
        "fingerprint": f"{loaded.fingerprint():#018x}",
    }
    answer(result, as_json=as_json, title=f"Board {loaded.name}")


def main() -> None:
    """Run the command line; 0 done, 1 the work failed, 2 the input is wrong."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("chladni: %(message)s"))
    logging.getLogger("chladni").handlers = [handler]
    logging.getLogger("chladni").setLevel(logging.INFO)
    try:
        app(prog_name="chladni")
    except InputError as error:
        sys.exit(_complain(str(error), 2))
    except ChladniError as error:
        sys.exit(_complain(str(error), 1))
    except OSError as error:
        sys.exit(_complain(f"{error.filename or 'output'}: {error.strerror}", 1))


def _complain(message: str, code: int) -> int:
    sys.stderr.write(f"chladni: {message}\n")
    return code


if __name__ == "__main__":
    main()
