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
from chladni.host.device.checks.readiness import check_ready
from chladni.host.device.device import Device
from chladni.host.device.device_fingers import FloatArray
from chladni.host.device.link import LinkError
from chladni.host.device.stream_sources import PlayedSignal
from chladni.host.protocol.link import SIGNAL_SAMPLES

RESTS_S = 0.1
"""For which two fingers rest before their effects: drives of both, and a switch's bias, are up."""
AFTER_S = 0.05
"""For which they stay behind them, so that the last of it rings on."""
STUCK_S = 0.5
"""After which a device that takes no samples has ended a touch; those that wait last 0.05 s."""
TURN_S = 0.005
"""Between two sendings of samples, unless the wire is slower: 115,200 baud just carries two."""


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
                played = play_together(device, signals, places, level, level_um)
            else:
                if len(places) > 1:
                    device.fingers.set_voice(1, level=0.0)
                    device.fingers.touch(1, *places[1])
                played = [device.fingers.play(signals[0], places[0], level=level, most_um=level_um)]
        finally:
            device.lift()
            for finger in range(len(places)):
                # From its next touch on it has its own signal again.
                device.fingers.set_voice(finger)
    say_not_measured()
    rows = [
        of_loudest(
            {
                "effect": read.effect.name,
                "place_mm": list(own.place_mm),
                "samples": own.samples,
                "fewest_waiting": own.fewest_waiting,
                "isolation_db": own.isolation_db,
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


def play_together(
    device: Device,
    signals: Sequence[FloatArray],
    places: Sequence[Place],
    level: float,
    level_um: float | None,
) -> list[PlayedSignal]:
    """A signal for each of several fingers, all of which rest before."""
    held = []
    for finger, place in enumerate(places):
        device.fingers.set_signal(finger, level)
        if level_um is not None:
            device.fingers.limit_signal(finger, level_um)
        held.append(device.fingers.touch(finger, *place))
    device.link.wait(RESTS_S)
    now_s = device.wire.now_s
    sent, filled = [0] * len(signals), [0] * len(signals)
    taken_s = now_s()
    begun, fewest = [now_s()] * len(signals), [SIGNAL_SAMPLES] * len(signals)
    while any(own < len(samples) for own, samples in zip(sent, signals, strict=True)):
        turn = now_s()
        for finger, samples in enumerate(signals):
            # A wire is slow: no more than there may be room for.
            left = max(0, filled[finger] - int((now_s() - begun[finger]) * SIGNAL_HZ))
            begun[finger] = now_s()
            room = samples[sent[finger] :][: SIGNAL_SAMPLES - left]
            taken, filled[finger] = device.fingers.send(finger, room)
            if 0 < sent[finger] < len(samples):
                fewest[finger] = min(fewest[finger], filled[finger] - taken)
            sent[finger] += taken
            taken_s = now_s() if taken else taken_s
        if now_s() - taken_s > STUCK_S:
            break  # it plays nothing any more
        if now_s() - turn < TURN_S:
            device.link.wait(TURN_S)
    device.link.wait(max(filled) / SIGNAL_HZ + AFTER_S)
    down = {one["finger"]: one for one in device.fingers.all()}
    if len(down) < len(held):
        hint = "`chladni device info` shows its state and faults"
        raise LinkError("the device ended a touch", hint=hint)
    return [
        PlayedSignal(
            at,
            sent[finger],
            min(fewest[finger], sent[finger]),
            down[finger]["isolation_db"],
            down[finger]["level_db"],
        )
        for finger, at in enumerate(held)
    ]
