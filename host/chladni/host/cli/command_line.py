"""All commands under one name: thin over `chladni.sim`, `chladni.tables` and `chladni.host`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.command_modules import MODULES
from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer
from chladni.host.protocol import link as link_protocol
from chladni.sim.errors import ConflictError, MissingError
from chladni.tables import layout

if TYPE_CHECKING:
    # What MODULES names: import-linter and the drawing of the house see no names in strings.
    from chladni.host.cli import (  # noqa: F401
        board,
        compare,
        emulate,
        plate,
        solve,
        studio,
        table,
    )
    from chladni.host.cli.designing import design  # noqa: F401
    from chladni.host.cli.device import commands  # noqa: F401
    from chladni.host.cli.effects import commands as effects_commands  # noqa: F401
    from chladni.host.cli.effects import play  # noqa: F401
    from chladni.host.cli.measured import calibrate  # noqa: F401
    from chladni.host.cli.several_fingers import fingers  # noqa: F401


class LoadedCommands(Mapping[str, Any]):
    """Commands by name, each loaded from its module when it is first asked for.

    Parameters
    ----------
    modules
        Below `chladni.host.cli`, by command.
    """

    def __init__(self, modules: Mapping[str, str]) -> None:
        self._modules = modules
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            app = typer.Typer(rich_markup_mode=None)
            import_module(f"chladni.host.cli.{self._modules[name]}").register(app)
            self._loaded |= typer.main.get_group(app).commands
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._modules)

    def __len__(self) -> int:
        return len(self._modules)


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
    if as_json and context.invoked_subcommand is not None:
        raise ConflictError(
            "--json before a command", context.invoked_subcommand, hint="it goes after the command"
        )
    if context.invoked_subcommand is None:
        raise MissingError("COMMAND", "`chladni -h` lists them")
