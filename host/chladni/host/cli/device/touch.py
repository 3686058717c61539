"""`chladni device touch`, `device touches`: fingers that a host holds, and those that are down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import combinations
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer, parse_place, say
from chladni.host.cli.common.ranges import LEAST_APART_MM, within
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.device.checks.info_rows import finger_rows
from chladni.host.device.checks.readiness import check_ready
from chladni.host.device.device import Device
from chladni.host.device.device_effects import AreaEvent
from chladni.host.device.finger_requests import MOST_FINGERS
from chladni.host.device.wires.link import LinkError
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError
from chladni.sim.fields.transfer import check_target

FARTHEST_MM = 1000.0
"""More than any board."""
AREAS_SINCE_MINOR = 6
"""Of the link: older devices are not asked."""
MOVED_MM = 0.0015
"""More than a place is rounded by on its way to the device."""
Place = tuple[float, float]


@connecting
def touch(
    connection: Connection,
    places: Annotated[
        list[str], typer.Argument(metavar="X,Y...", help="Place in mm, of one to five fingers.")
    ],
    seconds: Annotated[
        float,
        typer.Option(
            callback=within(0.0, 60.0, "s", above=True), help="How long the fingers stay."
        ),
    ] = 1.0,
    as_json: JsonOption = False,
) -> None:
    """Play places for a while, as fingers would."""
    asked = [_parsed(place) for place in places]
    if len(asked) > MOST_FINGERS:
        raise InputError("X,Y", f"{len(asked)} places", f"at most {MOST_FINGERS} fingers")
    for one, other in combinations(asked, 2):
        if math.dist(one, other) < LEAST_APART_MM:
            expected = f"fingers that lie {LEAST_APART_MM:g} mm apart or more"
            raise InputError("X,Y", "{:g},{:g}".format(*other), expected)
    if connection.emulator and connection.emulated_table is None:
        # It refuses below, and could not say that a place is wrong: it knows its board by a table.
        board = load_board(connection.emulated_board)
        for own in asked:
            check_target(board, own, "X,Y")
    with connection.device() as device:
        check_on_board(device, [("X,Y", own) for own in asked])
        check_ready(device.info(), is_emulated=connection.emulator)
        held = _hold(device, asked)
        device.link.wait(seconds)
        state = device.info()["state"]
        fingers = device.fingers.all() if len(asked) > 1 else []
        areas, has_bank = _areas(device, len(asked)), _has_bank(device)
        faults = device.faults()
        # Where it is interrupted, the device that is closed lifts.
        played_s = device.lift()
    if state != "playing":
        why = f", {faults[-1]['cause']}" if faults else ""
        raise LinkError(
            f"the device stopped after {played_s:.2f} s: {state}{why}",
            hint="`chladni device info` shows its faults",
        )
    rest = {"seconds": seconds, "played_s": played_s, "state": state, "areas": areas}
    if as_json:
        _answer_json(asked, held, fingers, **rest)
        return
    _answer(asked, held, finger_rows(fingers, has_bank=has_bank), **rest)


def _has_bank(device: Device) -> bool:
    return device.version.fields["minor"] >= AREAS_SINCE_MINOR and device.effects.has_bank()


def _areas(device: Device, count: int) -> list[str | None]:
    """Of the effect bank, in which the fingers are."""
    if device.version.fields["minor"] < AREAS_SINCE_MINOR:
        return [None] * count
    found = [device.effects.area_of(finger) for finger in range(count)]
    return [None if one is None else one.name for one in found]


@connecting
def touches(
    connection: Connection,
    watch: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            callback=within(0.0, 3600.0, "s", above=True),
            help="Go on, and tell what fingers do on the effect bank's areas.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the fingers that are down, how far their signals are kept apart, and in which areas."""
    with connection.device() as device:
        found = device.fingers.all()
        knows_areas = device.version.fields["minor"] >= AREAS_SINCE_MINOR
        events = device.effects.events() if knows_areas else []
        for one in found if knows_areas else ():
            area = device.effects.area_of(one["finger"])
            one["area"] = None if area is None else area.name
            one["along"] = None if area is None else area.along(tuple(one["place_mm"]))
        has_bank = _has_bank(device)
        if watch is not None and not as_json:
            for event in device.effects.watch(watch):
                say(_told(event))
        elif watch is not None:
            events += list(device.effects.watch(watch))
    if as_json:
        answer({"fingers": found, "events": [asdict(one) for one in events]}, as_json=True)
        return
    answer(
        finger_rows(found, has_bank=has_bank) or {"down": "none"}, as_json=False, title="Fingers"
    )


def _told(event: AreaEvent) -> str:
    x, y = event.place_mm
    return (
        f"{event.at_s:8.3f} s  finger {event.finger} {event.what} {event.area or 'no area'} "
        f"at {x:g}, {y:g} mm"
    )


def _parsed(place: str) -> Place:
    x, y = parse_place(place, "X,Y")
    if max(abs(x), abs(y)) > FARTHEST_MM:
        raise InputError("X,Y", place, f"within {FARTHEST_MM:g} mm of the board's centre")
    return x, y


def check_on_board(device: Device, asked: Sequence[tuple[str, Place]]) -> None:
    """Refuse places, by what gave them, that would play as others, before anything plays.

    Of an older device, which does not say where its board is, the answer tells it.
    """
    reach = device.reach_mm()
    if reach is None:
        return
    left, bottom, right, top = reach
    for name, (x, y) in asked:
        if min(x - left, right - x, y - bottom, top - y) < -MOVED_MM:
            # A device's ends are a micrometre short; people measure hundredths of a millimetre.
            ends = [round(end, 2) for end in (left, right, bottom, top)]
            expected = "a place on the board, {:g} to {:g} and {:g} to {:g} mm".format(*ends)
            raise InputError(name, f"{x:g},{y:g}", expected)


def _hold(device: Device, asked: list[Place]) -> list[Place]:
    """One alone by the request that devices of any table know."""
    if len(asked) == 1:
        return [device.touch(*asked[0])]
    return [device.fingers.touch(finger, *place) for finger, place in enumerate(asked)]


def _moved(held: Place, asked: Place) -> bool:
    return max(abs(a - b) for a, b in zip(held, asked, strict=True)) > MOVED_MM


def _answer_json(
    asked: list[Place], held: list[Place], fingers: list[dict[str, Any]], **rest: Any
) -> None:
    """Of the first, as ever, and all of them."""
    moved = _moved(held[0], asked[0])
    first = {"place_mm": list(held[0]), "asked_mm": list(asked[0]), "moved": moved}
    answer(first | rest | {"fingers": fingers}, as_json=True)


def _answer(asked: list[Place], held: list[Place], rows: dict[str, str], **rest: Any) -> None:
    texts = []
    for own, wanted in zip(held, asked, strict=True):
        off = "; {:g}, {:g} lies off the board".format(*wanted) * _moved(own, wanted)
        texts.append("{:g}, {:g} mm".format(*own) + off)
    result = {"place": "; ".join(texts), "played for": f"{rest['played_s']:.2f} s"}
    if any(rest["areas"]):
        result["area"] = ", ".join(one or "none" for one in rest["areas"])
    answer(result | rows, as_json=False, title="Touch")
