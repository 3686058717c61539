"""`chladni play`: an effect under a finger, on a device or on an emulated one that is scored."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from chladni.drives.scoring.as_built import LEAST_PRESS, MOST_PRESS
from chladni.effects.bank.areas import LEAST_UM, MOST_UM
from chladni.effects.files import ReadEffect, read_effect
from chladni.host.cli.common.options import (
    FigureOption,
    JsonOption,
    check_figure,
    check_one_of,
    required,
)
from chladni.host.cli.common.output import Place, answer, parse_place, say
from chladni.host.cli.common.ranges import check_apart, within
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.effects.drawn_fingers import MOST_DRAWN, check_drawn, play_drawn
from chladni.host.cli.effects.emulated import play_emulated, play_emulated_bank
from chladni.host.cli.effects.on_device import play_on_device
from chladni.host.cli.effects.remarks import say_filtered
from chladni.sim.board.fingers import LEAST_APART
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ConflictError, InputError, MissingError
from chladni.sim.image.finger import PRESS


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("play")(play)


@connecting
def play(
    connection: Connection,
    effect: Annotated[
        str | None,
        typer.Argument(
            metavar="[EFFECT]",
            help="Its name, or a .haptic, .ahap, .hjif, .wav or .toml; unless --bank has it.",
        ),
    ] = None,
    at: Annotated[str | None, typer.Option("--at", metavar="X,Y", help="Where, mm.")] = None,
    other: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Y", help="Another finger, which rests there; mm."),
    ] = None,
    other_effect: Annotated[
        str | None,
        typer.Option(
            metavar="EFFECT",
            help="What that finger plays at the same time. --level-db is of the loudest for each "
            "place, which differ in µm: --level-um makes both alike.",
        ),
    ] = None,
    together: Annotated[
        bool,
        typer.Option(
            "--together",
            help="With --bank: the finger at --other presses at the same moment, and has its own "
            "area's effect.",
        ),
    ] = False,
    level_db: Annotated[
        float,
        typer.Option(callback=within(-60.0, 0.0, "dB"), help="Below the loudest for that place."),
    ] = 0.0,
    level_um: Annotated[
        float | None,
        typer.Option(
            callback=within(LEAST_UM, MOST_UM, "µm"),
            help="As many µm for an amplitude of 1, where the place allows them.",
        ),
    ] = None,
    press: Annotated[
        float,
        typer.Option(
            callback=within(LEAST_PRESS, MOST_PRESS, "N"),
            help="How hard emulated fingers press, N.",
        ),
    ] = PRESS,
    hidden: Annotated[
        str | None,
        typer.Option(
            metavar="[BOARD@]SEED",
            help="Emulated fingers are on the plate of `calibrate --board BOARD --hidden SEED`, "
            "or of a FILE.toml.",
        ),
    ] = None,
    rested: Annotated[
        bool,
        typer.Option(
            "--rested",
            help="The emulated finger has rested: a switch's bias stands. With --other-effect both "
            "always have.",
        ),
    ] = False,
    pairs: Annotated[
        int | None,
        typer.Option(
            callback=within(1, MOST_DRAWN),
            help="In place of --at: so many drawn pairs on an emulated device, and what they keep; "
            "without a figure. --other-effect has the other finger play, too; with --bank the "
            "fingers lie in its areas.",
        ),
    ] = None,
    drawn: Annotated[
        int | None,
        typer.Option(
            "--places",
            callback=within(1, MOST_DRAWN),
            help="In place of --at: one finger at so many drawn places, and what another one has "
            "20 mm away or farther that no panel reports.",
        ),
    ] = None,
    apart: Annotated[
        float | None,
        typer.Option(
            callback=within(LEAST_APART / MM, 1000.0, "mm"),
            help="Between fingers of drawn pairs, mm; the board's fingers.apart_mm if left out.",
        ),
    ] = None,
    figure: FigureOption = None,
    as_json: JsonOption = False,
) -> None:
    """Play an effect under a finger; an emulated device says what fingers have of it.

    A real device says what it reckons by its table: no µm, for it does not measure its plate.
    """
    _check_level(connection, level_db, level_um)
    how: dict[str, Any] = {"level": float(10.0 ** (level_db / 20.0)), "level_um": level_um}
    of_emulated: dict[str, Any] = {"newtons": press, "rested": rested, "as_json": as_json}
    if pairs is not None or drawn is not None:
        given: dict[str, object] = {"--at": at, "--other": other, "--figure": figure}
        given |= {} if pairs is None else {"--places": drawn}
        of_bank = connection.emulated_bank is not None
        if of_bank and rested:
            raise ConflictError("--rested", "--bank", hint="its fingers press at that moment")
        given |= {} if pairs is not None else {"--apart": apart}
        kind = {"pairs": pairs is not None, "together": together}
        check_drawn(connection, (effect, other_effect), given, **kind)
        effects = [] if of_bank else [_read(effect).effect]
        if other_effect is not None:
            effects.append(_read(other_effect, "--other-effect").effect)
        play_drawn(
            *(connection, effects, pairs or drawn or 1, hidden),
            apart=None if apart is None else apart * MM,
            **(kind | how | of_emulated),
        )
        return
    if apart is not None:
        raise MissingError("--pairs", "how many pairs are drawn, that far --apart")
    places = _places(at, other)
    check_figure(figure)
    check_one_of(
        "what to play", EFFECT=effect is not None, bank=connection.emulated_bank is not None
    )
    _check_emulated(connection, effect, rested, hidden)
    if other_effect is not None:
        _check_other_effect(connection, places)
    if together:
        _check_together(effect, places)
    if effect is None:
        of_emulated.pop("rested")
        play_emulated_bank(connection, places, hidden, figure, together=together, **of_emulated)
        return
    reads = [_read(effect)]
    if other_effect is not None:
        reads.append(_read(other_effect, "--other-effect"))
    if connection.emulator:
        play_emulated(connection, reads, places, hidden, figure, **how, **of_emulated)
        return
    if figure is not None:
        raise ConflictError("--figure", "--port or --udp", hint="only emulated pins are scored")
    rows = play_on_device(connection, reads, places, **how, as_json=as_json)
    answer(rows, as_json=as_json, title="Played")


def _places(at: str | None, other: list[str] | None) -> list[Place]:
    """Of the finger that plays, and of another one."""
    place = parse_place(required("--at", at, "X,Y, where the finger presses, mm"), "--at")
    if not other:
        return [place]
    if len(other) > 1:
        raise InputError("--other", other, "one other finger")
    beside = parse_place(other[0], "--other")
    check_apart(place, beside, "--other", other[0])
    return [place, beside]


def _read(effect: str | None, field: str = "EFFECT") -> ReadEffect:
    read = read_effect(str(effect), field=field)
    for one in read.left_out:
        say(f"left out: {one}")
    say_filtered(read.effect)
    return read


def _check_level(connection: Connection, level_db: float, level_um: float | None) -> None:
    if level_um is not None and level_db < 0.0:
        raise ConflictError("--level-um", "--level-db", hint="one of them is the level")
    if connection.emulated_bank is not None and (level_db < 0.0 or level_um is not None):
        option = "--level-db" if level_um is None else "--level-um"
        raise ConflictError(option, "--bank", hint="its areas have levels of their own")


def _check_other_effect(connection: Connection, places: list[Place]) -> None:
    """It needs a finger, and no bank that has its effect already."""
    if len(places) == 1:
        raise MissingError("--other", "X,Y, where the finger of --other-effect presses, mm")
    if connection.emulated_bank is not None:
        hint = (
            "with --bank the finger at --other rests, or with --together it has its own area's "
            "effect; for others give EFFECT and --other-effect without --bank"
        )
        raise ConflictError("--other-effect", "--bank", hint=hint)


def _check_together(effect: str | None, places: list[Place]) -> None:
    """It is of a bank, and of two fingers."""
    if effect is not None:
        hint = "it is for --bank; --other-effect gives the other finger an effect without one"
        raise ConflictError("--together", "EFFECT", hint=hint)
    if len(places) == 1:
        raise MissingError("--other", "X,Y, where the finger presses that --together means, mm")


def _check_emulated(
    connection: Connection, effect: str | None, rested: bool, hidden: str | None
) -> None:
    """Refuse what only an emulated device has."""
    if rested and (effect is None or not connection.emulator):
        own = "--bank" if effect is None else "--port or --udp"
        hint = "it is for an effect that is sent to --emulator"
        if effect is None:
            hint = "a bank's press comes with its touch; EFFECT plays where a finger has rested"
        raise ConflictError("--rested", own, hint=hint)
    if effect is None and not connection.emulator:
        hint = (
            "`chladni effects flash` gives a device its bank, and `chladni device touch` plays it"
        )
        raise ConflictError("--bank", "--port or --udp", hint=hint)
    if hidden is not None and not connection.emulator:
        raise ConflictError("--hidden", "--port or --udp", hint="a real device has its own plate")
