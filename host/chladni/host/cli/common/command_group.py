"""A group of commands: what Ctrl-C does in it, and which options its errors name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer
from typer.core import TyperArgument, TyperGroup

from chladni.sim.errors import InputError, StoppedError

ARGUMENTS = {
    "address": ("udp",),
    "frequencies_hz": ("frequency",),
    "frequency_hz": ("frequency",),
    "milliseconds": ("ms",),
    "table": ("table", "emulated_table"),
    "target_mm": ("target", "at", "touch"),
    "touches": ("touch",),
}
"""Arguments of the library, and the parameters of commands where they are called otherwise."""


class CommandGroup(TyperGroup):
    """Commands of which Ctrl-C is an error like others, and whose errors speak of options."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        """Run the command that was asked for.

        Raises
        ------
        StoppedError
            Ctrl-C, at work or at a question.
        InputError
            As the library raises it, with options and not arguments named; or an option is no
            number, of which typer would say so in words of its own.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise StoppedError from None
        except typer.Abort as error:
            if isinstance(error.__context__, KeyboardInterrupt):
                raise StoppedError from None
            raise
        except typer.BadParameter as error:
            if wrong := _no_number(error):
                raise wrong from None
            raise
        except InputError as error:
            error.on_command_line(dict(_options(self.commands.get(ctx.invoked_subcommand or ""))))
            raise


def _no_number(error: typer.BadParameter) -> InputError | None:
    """What is wrong with an option that is to be a number; None where something else is wrong."""
    kind = re.search(r"\b(number|integer|float)\b", error.message)
    # Typer has had two ways to name what was given: in its cause, and before in its words.
    cause: Any = error.__cause__
    words = re.match(r"'(.*)' is not", error.message)
    given = cause.errors()[0]["input"] if hasattr(cause, "errors") else words and words[1]
    if kind is None or error.param is None or given is None:
        return None
    unit = re.fullmatch(r"-?[\d.]+ ?([^\d\s.,]\D*)", str(given))
    hint = f"without {unit[1]!r}: -h says what it is in" if unit else ""
    expected = "a whole number" if kind[1] == "integer" else "a number"
    return InputError(name_of(error.param), given, expected, hint=hint)


def _options(command: Any) -> Iterator[tuple[str, str]]:
    """What a command's user calls each argument of the library."""
    if command is None:
        return
    known = {parameter.name: name_of(parameter) for parameter in command.params}
    yield from known.items()
    for argument, names in ARGUMENTS.items():
        given = [known[name] for name in names if name in known]
        if given:
            yield argument, ", ".join(given)


def name_of(parameter: Any) -> str:
    """What a command's user calls an option or an argument."""
    if isinstance(parameter, TyperArgument):
        return (parameter.metavar or str(parameter.name).upper()).strip("[]")
    return str(max(parameter.opts, key=len))
