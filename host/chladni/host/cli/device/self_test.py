"""`chladni device self-test`: every coil in turn, or the first boot step by step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated

import typer

from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer, say
from chladni.host.cli.common.ranges import within
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.device.first_boot import walk
from chladni.host.device.checks.readiness import check_ready
from chladni.host.device.checks.self_test import SELF_TEST_S, faults_since, try_channel
from chladni.host.device.wires.link import LinkError
from chladni.host.protocol.config import DeviceConfig
from chladni.sim.errors import InputError
from chladni.tables.layout import MAX_ACTUATORS


@connecting
def self_test(
    connection: Connection,
    first_boot: Annotated[
        bool, typer.Option("--first-boot", help="Go through the first ten minutes, step by step.")
    ] = False,
    channel: Annotated[
        int | None,
        typer.Option(callback=within(0, MAX_ACTUATORS - 1), help="Only this one, counted from 0."),
    ] = None,
    seconds: Annotated[
        float,
        typer.Option(
            callback=within(SELF_TEST_S, 10.0, "s"),
            help="How long each plays: long enough to find it by hand.",
        ),
    ] = SELF_TEST_S,
    as_json: JsonOption = False,
) -> None:
    """Bring each actuator in turn up to half amplitude; report currents beside their limits."""
    if first_boot:
        with connection.device() as device:
            found = walk(device)
        answer({"steps": found}, as_json=as_json, title="First boot")
        return
    with connection.device() as device:
        channels, config = device.info()["channels"], device.config()
        if channel is not None and not 0 <= channel < channels:
            raise InputError("--channel", channel, f"0 to {channels - 1}")
        check_ready(device.info(), by_host=True)
        before = device.info()["faults"]
        tested = range(channels) if channel is None else [channel]
        rows = [try_channel(device, own, config, seconds) for own in _said(tested, config)]
        faults = faults_since(device, before)
    answer(
        {"channels": rows, "supply_limit_ma": config["supply_ma"], "faults": faults},
        as_json=as_json,
        title="Self-test",
    )
    failed = [str(row["channel"]) for row in rows if not row["ok"]]
    if failed:
        raise LinkError(
            f"channels that draw something else: {', '.join(failed)}",
            hint="look at each one's coil, driver and supply, or mend electronics.coil_ohm",
        )


def _said(channels: Iterable[int], config: DeviceConfig) -> Iterator[int]:
    """Channels, each announced before it plays."""
    for own in channels:
        say(f"channel {own}, GPIO {config['pwm_pins'][own]}, plays")
        yield own
