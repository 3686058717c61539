"""Effects that a command sends to a device."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.files import ReadEffect
from chladni.host.cli.common.output import Place
from chladni.host.cli.common.terms import of_loudest
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.device.touch import check_on_board
from chladni.host.cli.effects.remarks import say_not_measured
from chladni.host.device.checks.info_rows import known_isolation
from chladni.host.device.checks.readiness import check_ready


def play_on_device(
    connection: Connection,
    reads: Sequence[ReadEffect],
    places: Sequence[Place],
    *,
    level: float,
    level_um: float | None,
    as_json: bool,
) -> dict[str, Any]:
    """Send effects to a device; what it says of them.

    Parameters
    ----------
    reads
        For the first finger, and maybe one for the second.
    places
        Of the first finger, and maybe of the second, which rests where it has no effect.
    level
        Of the loudest.
    """
    signals = [one.effect.samples(SIGNAL_HZ) for one in reads]
    with connection.device() as device:
        check_ready(device.info())
        check_on_board(device, list(zip(("--at", "--other"), places, strict=False)))
        try:
            if len(signals) > 1:
                played = device.fingers.play_together(
                    signals, places, level=level, most_um=level_um
                )
            else:
                if len(places) > 1:
                    device.fingers.set_voice(1, level=0.0)
                    device.fingers.touch(1, *places[1])
                played = [device.fingers.play(signals[0], places[0], level=level, most_um=level_um)]
        finally:
            device.lift()
            for finger in range(len(signals), len(places)):
                # One that rested has its own signal again from its next touch on.
                device.fingers.set_voice(finger)
    say_not_measured(level_um)
    rows = [
        of_loudest(
            {
                "effect": read.effect.name,
                "place_mm": list(own.place_mm),
                "samples": own.samples,
                "fewest_waiting": own.fewest_waiting,
                "isolation_db": own.isolation_db if as_json else known_isolation(own.isolation_db),
                "level_db": own.level_db,
                "left_out": read.left_out,
            }
        )
        for read, own in zip(reads, played, strict=True)
    ]
    if len(rows) == 1:
        return rows[0]
    if as_json:
        named = zip("AB", rows, strict=True)
        return {"fingers": [{"name": name} | own for name, own in named]}
    return dict(zip("AB", rows, strict=True))
