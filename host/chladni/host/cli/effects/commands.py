"""`chladni effects`: what there is, what a file says, and the same in another format or a bank."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from chladni.effects.bank.areas import Bank, reach_mm
from chladni.effects.bank.bank_file import is_bank, read_bank, shipped_banks
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.effect import kinds
from chladni.effects.files import WRITERS, read_effect, shipped_effects
from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.options import FigureOption, JsonOption, check_figure
from chladni.host.cli.common.output import answer, check_output, say, write_figure
from chladni.host.cli.effects.bank import build, flash, show_bank
from chladni.host.cli.effects.listening import listen
from chladni.host.cli.effects.remarks import say_filtered
from chladni.sim.errors import ConflictError, InputError
from chladni.sim.files import write_whole

effects_app = typer.Typer(
    cls=CommandGroup, no_args_is_help=True, help="List, show and convert effects; build banks."
)
LONG_S = 20.0
"""Effects that last longer are asked about: their times may be milliseconds."""
EffectArgument = Annotated[
    str,
    typer.Argument(metavar="EFFECT", help="Its name, or a .haptic, .ahap, .hjif, .wav or .toml."),
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    effects_app.command("build")(build)
    effects_app.command("flash")(flash)
    app.add_typer(effects_app, name="effects")


@effects_app.command("list")
def effects_list(as_json: JsonOption = False) -> None:
    """List the effects and banks that come with Chladni."""
    found = [
        {"name": effect.name, "lasts_ms": 1e3 * effect.lasts_s, "parts": kinds(effect)}
        for effect in shipped_effects().values()
    ]
    banks = {
        name: f"{len(own.areas)} areas on {_size(own)}: {', '.join(own.effects)}"
        for name, own in ((name, read_bank(name).bank) for name in shipped_banks())
    }
    if as_json:
        answer({"effects": found, "banks": list(banks)}, as_json=True)
        return
    rows = {
        str(one["name"]): f"{one['lasts_ms']:.0f} ms, {', '.join(one['parts'])}"  # type: ignore[arg-type]
        for one in found
    }
    answer(rows, as_json=False, title="Effects")
    answer(banks, as_json=False, title="Effect banks, for boards of that size or larger")


def _size(bank: Bank) -> str:
    """Of the smallest board, about its centre, that has all areas."""
    corners = np.array([one for area in bank.areas for one in reach_mm(area.shape)])
    wide, long = 2.0 * np.abs(corners).max(axis=0)
    return f"{wide:g} × {long:g} mm"


@effects_app.command("show")
def effects_show(
    effect: EffectArgument,
    figure: FigureOption = None,
    aloud: Annotated[
        bool, typer.Option("--listen", help="Play it through this computer's speaker, too.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Show what an effect's or a bank's file says, and what of it a device cannot do."""
    check_figure(figure)
    if is_bank(effect):
        if aloud:
            raise ConflictError("--listen", "a bank", hint="listen to one of its effects")
        show_bank(effect, figure, as_json=as_json)
        return
    read = read_effect(effect, field="EFFECT")
    samples = read.effect.samples(SIGNAL_HZ)
    say_filtered(read.effect)
    if read.effect.lasts_s > LONG_S:
        say(f"it lasts {read.effect.lasts_s:.0f} s: .haptic and AHAP have seconds, .toml has ms")
    if figure is not None:
        from chladni.host.figures.effects import effect_figure  # noqa: PLC0415

        write_figure(effect_figure(read.effect), figure)
    answer(
        {
            "name": read.effect.name,
            "lasts_ms": 1e3 * read.effect.lasts_s,
            "parts": kinds(read.effect),
            "samples": len(samples),
            "left_out": read.left_out,
        },
        as_json=as_json,
        title=read.effect.name,
    )
    if aloud:
        listen(read.effect)


@effects_app.command("convert")
def effects_convert(
    effect: EffectArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="File to write (.ahap, .haptic, .wav).")
    ],
    as_json: JsonOption = False,
) -> None:
    """Write an effect as AHAP or .haptic, as far as these can say it, or as a sound (.wav)."""
    writer = WRITERS.get(output.suffix.lower())
    if writer is None:
        raise InputError("--output", str(output), f"a name that ends in {' or '.join(WRITERS)}")
    check_output(output, "--output", inputs=[effect])
    read = read_effect(effect, field="EFFECT")
    data, left_out = writer(read.effect)
    write_whole(output, data)
    answer(
        {"path": str(output), "bytes": len(data), "left_out": [*read.left_out, *left_out]},
        as_json=as_json,
        title="Converted",
    )
