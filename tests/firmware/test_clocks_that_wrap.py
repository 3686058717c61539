"""Clocks of 32 bits that wrap: a device that crosses one does what it would have done without.

Microseconds wrap after 71.6 minutes, samples after 61 hours, milliseconds after 49.7 days.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.effects import Area, Bank, shipped_effects
from chladni.effects.bank.pack import pack_bank
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, Hardware, TouchEvent
from chladni.tables.table import Limits, Table
from made_up import device_of
from plate_of_bumps import responses_table

WRAP = 2**32
SAMPLES_A_SECOND = 80e6 / 2**10 / 4.0
LIMITS = Limits(4000, 60_000, 400_000)
BANK = pack_bank(
    Bank(
        "b",
        {name: shipped_effects()[name] for name in ("click", "texture")},
        (Area("all", press="click", hold="texture", release="click"),),
    )
)
BANKS = [pack_bank(Bank(name, {"click": shipped_effects()["click"]}, ())) for name in "xyz"]
LASTS_S = 9.0


@dataclass(frozen=True)
class Course:
    """What a device did, without the times that its own clocks give."""

    duties: NDArray[np.int16]
    faults: list[tuple[str, int, int]]
    heat: list[float]
    erases: int
    updates: list[str]
    events: list[tuple[str, str | None, int]]


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def written(device: Device, bank: bytes) -> str:
    try:
        device.effects.flash(bank)
    except LinkError as error:
        return str(error)
    return "written"


def course(table: Table, **first: Any) -> Course:
    """Nine seconds of all that counts time: each second begins with something else."""
    rises = (900,) * 5 + (0,) * 11
    own = device_of(table, full_rise_dk=rises, attack_ms=30, decay_ms=50, link_baud=921_600)
    emulator = Emulator(own, table, level=0.9, hardware=Hardware(**first), bank=BANK)
    device = Device(EmulatorWire(emulator))
    begun_ms = device.link.request("info").fields["uptime_ms"]
    emulator.core.take_duties()

    def finger(at_ms: float, place: tuple[float, float] | None, number: int = 0) -> None:
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + at_ms, place, number))

    def until(second: float) -> None:
        emulator.core.run_us(round(1e6 * second) - emulator.core.now_us)

    until(1.0)
    finger(10.0, (-18.0, 30.0))
    finger(60.0, (17.0, -25.0), 1)
    finger(250.0, None, 1)
    finger(300.0, None)
    until(2.0)
    finger(10.0, (5.0, 5.0))  # longer than a touch may last
    finger(800.0, None)
    until(3.0)
    device.touch(10.0, 10.0)  # a host that falls silent
    device.link.holds_touch = False
    until(4.5)
    device.stream(np.full((600, 5), 0.3))
    until(5.5)
    device.live([0.8, 0.2j, 0.0, 0.1, 0.4], 130.0)
    until(6.0)
    events = device.effects.events()
    updates = [written(device, BANKS[k % 3]) for k in range(7)]
    until(8.0)
    emulator.core.hang_main_loop(True)
    until(8.3)
    emulator.core.hang_main_loop(False)
    finger(10.0, (0.0, 0.0))
    until(LASTS_S)
    faults = [(cause, detail, (at - begun_ms) % WRAP) for cause, detail, at in emulator.core.faults]
    events += device.effects.events()
    told = [(one.what, one.area, round(1e3 * one.at_s - begun_ms) % WRAP) for one in events]
    return Course(
        emulator.core.take_duties(),
        faults,
        list(emulator.core.coil_rise_k),
        device.info()["erases"],
        updates,
        told,
    )


@pytest.fixture(scope="module")
def unshifted(table: Table) -> Course:
    return course(table)


def test_the_course_has_what_counts_time(unshifted: Course) -> None:
    causes = {cause for cause, *_ in unshifted.faults}
    assert {"touch too long", "host silent", "stream underrun"} <= causes
    assert unshifted.updates[0] == "written"
    assert "flash was written 5 times" in unshifted.updates[-1]
    assert max(unshifted.heat) > 0.1
    assert {"pressed", "released"} <= {what for what, *_ in unshifted.events}
    assert np.abs(unshifted.duties).max() > 200


@pytest.mark.parametrize("after_s", [1.04, 2.35, 3.6, 4.55, 5.6, 6.5, 8.15])
@pytest.mark.parametrize("clock", ["first_us", "first_ms", "first_samples"])
def test_a_wrap_changes_nothing(
    table: Table, unshifted: Course, clock: str, after_s: float
) -> None:
    """In a touch of two fingers, before a limit, and within each other thing that counts time."""
    a_second = {"first_us": 1e6, "first_ms": 1e3, "first_samples": SAMPLES_A_SECOND}[clock]
    begins: dict[str, Any] = {clock: WRAP - round(after_s * a_second)}
    found = course(table, **begins)
    np.testing.assert_array_equal(found.duties, unshifted.duties)
    assert found.faults == unshifted.faults
    assert found.heat == unshifted.heat
    assert (found.erases, found.updates) == (unshifted.erases, unshifted.updates)
    assert found.events == unshifted.events
