"""An effect that a command sends to a device."""

from __future__ import annotations

from typing import Any

from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.files import ReadEffect
from chladni.host.cli.common.output import Place
from chladni.host.cli.common.terms import of_loudest
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.device.touch import check_on_board
from chladni.host.cli.effects.remarks import say_not_measured
from chladni.host.device.checks.readiness import check_ready


def play_on_device(
    connection: Connection,
    read: ReadEffect,
    place: Place,
    beside: Place | None,
    levels: tuple[float, float | None],
) -> dict[str, Any]:
    """Send an effect to a device; what it says of it.

    Parameters
    ----------
    place, beside
        Of the finger that plays, and of one that rests.
    levels
        Of the loudest, and in µm.
    """
    samples = read.effect.samples(SIGNAL_HZ)
    with connection.device() as device:
        check_ready(device.info())
        check_on_board(device, [("--at", place)])
        if beside is not None:
            check_on_board(device, [("--other", beside)])
            device.fingers.set_voice(1, level=0.0)
            device.fingers.touch(1, *beside)
        try:
            played = device.fingers.play(samples, place, level=levels[0], most_um=levels[1])
        finally:
            device.lift()
            if beside is not None:
                # From its next touch on it has its own signal again.
                device.fingers.set_voice(1)
    say_not_measured()
    return of_loudest(
        {
            "effect": read.effect.name,
            "place_mm": list(played.place_mm),
            "samples": played.samples,
            "fewest_waiting": played.fewest_waiting,
            "isolation_db": played.isolation_db,
            "level_db": played.level_db,
            "left_out": read.left_out,
        }
    )
