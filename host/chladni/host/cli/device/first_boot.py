"""`chladni device self-test --first-boot`: docs/first-boot.md step by step, with the device."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import typer

from chladni.host.device.checks.readiness import check_ready
from chladni.host.device.device import Device
from chladni.host.device.live_drive import play_for
from chladni.sim.errors import ChladniError

CARRIER_GAIN = 0.2
"""Of full amplitude: pulses that a scope shows, and a tenth of the heat."""
PLAY_S = 1.0


@dataclass(frozen=True)
class Step:
    """What to look at, the question, and the advice if the answer is no."""

    title: str
    look: str
    advice: str
    act: Callable[[Device], str] | None = None


def walk(device: Device) -> list[dict[str, Any]]:
    """Go through the steps; what was found at each.

    Raises
    ------
    ChladniError
        Something is not as it should be; says what to look at.
    """
    found = []
    for number, step in enumerate(
        _steps(device.info()["channels"], has_bridges=device.config().has_bridges), 1
    ):
        sys.stderr.write(f"\n{number}. {step.title}\n")
        if step.act is not None:
            sys.stderr.write(f"   {step.act(device)}\n")
        is_so = typer.confirm(f"   {step.look}", default=None, err=True)
        device.stop()
        found.append({"step": step.title, "ok": is_so})
        if not is_so:
            raise ChladniError(f"step {number}, {step.title}", hint=step.advice)
    return found


def _steps(channels: int, *, has_bridges: bool) -> Iterator[Step]:
    driver = "bridge, its nSLEEP and its VM" if has_bridges else "diode"
    yield Step(
        "Supply, no coil connected",
        "Is there 3.3 V at the module, and are less than 150 mA drawn?",
        "look for a short, a wrong regulator, a supply that gives way",
    )
    yield Step(
        "Gates at rest",
        "Is every gate at 0 V, also while EN is held and while GPIO 0 is held low at reset?",
        "fit a pull-down of 3.3 kΩ on the gate that is not",
    )
    yield Step(
        "The link",
        "Is that the state you expect?",
        "`chladni device log` and docs/first-boot.md say what each fault is",
        _state,
    )
    yield Step(
        "The configuration",
        "Are those the board's pins, channel by channel?",
        "chladni device config set --from BOARD",
        _pins,
    )
    gate = "enable pin" if has_bridges else "gate"
    sign = ", and its phase pin turn with it" if has_bridges else ""
    for channel in range(channels):
        yield Step(
            f"Carrier of channel {channel}",
            f"Does {gate} {channel}, and no other, show pulses whose width swings at 160 Hz{sign}?",
            f"another {gate}: pwm_pins are in another order; none: the pin is not wired",
            _carrier(channel, channels),
        )
    yield Step(
        "One coil, on a supply limited to 0.3 A",
        "Connect the coil of channel 0. Does it move now, and stop at once?",
        f"no motion: the coil or its {driver}; no stop: the {gate}'s pull-down",
        _carrier(0, channels),
    )


def _state(device: Device) -> str:
    info = device.info()
    faults = ", ".join(fault["cause"] for fault in device.faults()) or "no faults"
    said = [line for line in device.log.splitlines() if "carrier" in line or "start" in line]
    free = f"{info['stack_free']} bytes of stack never used" if info["stack_free"] else ""
    return "; ".join(part for part in (f"state {info['state']}", faults, free, *said) if part)


def _pins(device: Device) -> str:
    """What keeps the device from playing ends the walk; a table it does not need."""
    check_ready(device.info(), by_host=True)
    config = device.config()
    names = ["pwm_pins", "sign_pins"] if config.has_bridges else ["pwm_pins"]
    rows = (config[name][: config["channels"]] for name in names)
    return "; signs ".join("GPIO " + ", ".join(map(str, row)) for row in rows)


def _carrier(channel: int, channels: int) -> Callable[[Device], str]:
    def play(device: Device) -> str:
        gains = [0j] * channels
        gains[channel] = complex(CARRIER_GAIN)
        play_for(device, gains, 160.0, "sine", PLAY_S)
        return f"channel {channel} played for {PLAY_S:g} s at a fifth of its amplitude"

    return play
