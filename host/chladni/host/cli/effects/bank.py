"""`chladni effects build` and `flash`: a bank of effects and areas, and its way onto a device."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.effects.bank.areas import Area, Bank
from chladni.effects.bank.bank_file import BANK_SUFFIX, ReadBank, bank_bytes, read_bank
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.bank.pack import pack_bank
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import kinds
from chladni.effects.flatten import flattened_effect
from chladni.host.cli.common.finger_remarks import say_waves
from chladni.host.cli.common.options import JsonOption, required
from chladni.host.cli.common.output import answer, check_output, progress_bar, say, write_figure
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.effects.remarks import say_beyond_panel, say_filtered, say_out_of_reach
from chladni.host.emulation.covered_areas import covered_areas
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError
from chladni.sim.files import write_whole

ERASED_BY = "`esptool --port PORT erase-region 0x214000 0x20000`"
"""Both slots of the partition `effects`, of the partition table that all chips have."""
BankArgument = Annotated[
    str, typer.Argument(metavar="BANK", help="Name of a shipped one, or a file: .toml or .che.")
]


def build(
    bank: Annotated[
        str, typer.Argument(metavar="AREAS", help="Name of a shipped bank, or a .toml of your own.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Bank to write (.che).")],
    board: Annotated[
        str | None, typer.Option(help="Check that the areas lie on this board.")
    ] = None,
    flatten: Annotated[
        bool,
        typer.Option("--flatten", help="Take that board's level over frequency out of effects."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Build an effect bank: what plays where, as a device keeps it."""
    check_output(output, "--output", (BANK_SUFFIX,), [bank])
    read = read_bank(bank, "AREAS")
    loaded = None if board is None else load_board(board)
    if loaded is not None:
        try:
            read.bank.check_on(*(1e3 * size for size in loaded.plate.size))
        except InputError as error:
            raise error.in_file(bank) from None
        say_beyond_panel(read.bank, loaded)
        say_waves(loaded)
    for effect in read.bank.effects.values():
        say_filtered(effect)
    if flatten:
        read = _flattened(read, required("--board", loaded, "whose level is taken out"))
    try:
        data = pack_bank(read.bank)
    except InputError as error:
        raise error.in_file(bank) from None
    write_whole(output, data)
    for hidden in covered_areas(read.bank):
        say(f"area {hidden}: areas before it have all its places, so nothing of it plays")
    for name, lines in read.left_out.items():
        for line in lines:
            say(f"{name}, left out: {line}")
    answer(
        {
            "path": str(output),
            "bytes": len(data),
            "effects": list(read.bank.effects),
            "areas": [area.name for area in read.bank.areas],
            "left_out": read.left_out,
        },
        as_json=as_json,
        title=f"Effect bank {read.bank.name}",
    )


def _flattened(read: ReadBank, board: Board) -> ReadBank:
    """Effects that the board's places play as they are meant."""
    from chladni.host.emulation.felt_over_time import common_level  # noqa: PLC0415

    with progress_bar("plate") as progress:
        hz, level = common_level(board, progress=progress)
    own_hz = board.drive.frequency_hz
    effects, left_out = {}, dict(read.left_out)
    for name, effect in read.bank.effects.items():
        effects[name], stays = flattened_effect(effect, SIGNAL_HZ, hz, level, own_hz)
        left_out[name] = [*left_out.get(name, []), *stays]
    bank = replace(read.bank, effects=effects)
    return ReadBank(bank, {name: lines for name, lines in left_out.items() if lines})


@connecting
def flash(connection: Connection, bank: BankArgument, as_json: JsonOption = False) -> None:
    """Write an effect bank to a device; the old one stays until the new one is whole.

    From then on fingers play its areas, not the table's tone. docs/effects.md says how to erase it.
    """
    data = bank_bytes(bank, "BANK")
    written = unpack_bank(data)
    with connection.device() as device, progress_bar("flash") as progress:
        done = device.effects.flash(data, progress)
        say_out_of_reach(written, device.config(), device.reach_mm())
    done.check_verified()
    rows = asdict(done)
    if not as_json:
        rows["the table's tone"] = f"plays again after {ERASED_BY}"
    answer(rows, as_json=as_json, title=f"{written.name} plays")


def show_bank(name: str, figure: Path | None, *, as_json: bool) -> None:
    """A bank's effects and areas: as they were built, or as they would be."""
    data = bank_bytes(name, "EFFECT")
    bank = unpack_bank(data)
    if figure is not None:
        from chladni.host.figures.areas import areas_figure  # noqa: PLC0415

        write_figure(areas_figure(bank), figure)
    if as_json:
        answer(_described(bank, len(data)), as_json=True)
        return
    rows = {name: ", ".join(kinds(effect)) for name, effect in bank.effects.items()}
    rows |= {f"area {area.name}": _played(area) for area in bank.areas}
    answer(rows, as_json=False, title=f"Effect bank {bank.name}, {len(data):,} bytes")


def _described(bank: Bank, size: int) -> dict[str, Any]:
    return {
        "name": bank.name,
        "bytes": size,
        "hysteresis_mm": bank.hysteresis_mm,
        "effects": [
            {"name": name, "lasts_ms": 1e3 * effect.lasts_s, "parts": kinds(effect)}
            for name, effect in bank.effects.items()
        ],
        "areas": [
            {
                "name": area.name,
                "shape": type(area.shape).__name__.lower(),
                "level_db": area.level_db,
                "level_um": area.level_um,
                "every_mm": area.every_mm,
                "along": area.along,
            }
            | area.effects
            for area in bank.areas
        ],
    }


def _played(area: Area) -> str:
    told = [f"{occasion}: {name}" for occasion, name in area.effects.items()]
    if area.every_mm > 0.0:
        told.append(f"every {area.every_mm:g} mm along {area.along}")
    if area.level_db < 0.0:
        told.append(f"{area.level_db:g} dB")
    if area.level_um is not None:
        told.append(f"{area.level_um:g} µm")
    return ", ".join(told) or "nothing"
