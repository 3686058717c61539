"""The device's states against their table: every way there is, at random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from chladni.host.emulation import _emulator
from chladni.host.emulation.emulator import Emulator
from chladni.tables.table import Table
from conftest import ROOT
from made_up import device_of, make_table

STEPS = 20_000
QUIET_MS = 40
"""Longer than the table's ramp: outputs of a state that is silent are off by then."""
SILENT = {"idle", "updating", "fault", "restarting"}
TRANSITIONS = {(state, event): after for state, event, after in _emulator.transitions()}


@pytest.fixture(scope="module")
def table() -> Table:
    return make_table(np.array([[10.0, -5.0j, 3.0, 1.0j, 2.0]]))


def may_lead_to(state: str) -> set[str]:
    """What a millisecond leads to: one event, and what may follow at once where it ends in idle."""
    reached = {state} | {after for (before, _), after in TRANSITIONS.items() if before == state}
    return reached | ({"fault", "playing"} if "idle" in reached else set())


def test_a_random_walk_stays_within_the_table(table: Table) -> None:
    """An event leads where the table says, or nowhere; and silent states are silent."""
    emulator = Emulator(device_of(table), table, level=1.0)
    core, rng = emulator.core, np.random.default_rng(11)
    asked: dict[str, Callable[[], object]] = {
        "stream begins": core.stream_begin,
        "stream ends": core.stream_end,
        "update begins": core.update_begin,
        "update ends": core.update_end,
    }
    others: list[Callable[[], object]] = [
        lambda: core.command("touch 0 0"),
        lambda: core.command("lift"),
        lambda: core.finger_down(core.now_us, 0.0, 0.0),
        lambda: core.finger_up(core.now_us),
        lambda: core.delay_next_sample(2_000.0),
        lambda: core.stream_push(np.full((64, 5), 30_000, np.uint16)),
    ]
    seen, silent_ms = set(), 0
    for _ in range(STEPS):
        before = core.state
        seen.add(before)
        if rng.random() < 0.3:
            event = str(rng.choice(list(asked)))
            asked[event]()
            wanted = TRANSITIONS.get((before, event))
            # An update ends once outputs are off, and a fault that has nothing to do with the
            # table keeps a stream off.
            waits = before == core.state and (event == "update ends" or before == "fault")
            # A fault that still stands shows as soon as the device would be idle.
            shows = wanted == "idle" and core.state == "fault"
            assert waits or shows or core.state == (wanted or before), (before, event)
        elif rng.random() < 0.3:
            others[rng.integers(len(others))]()
        before = core.state
        duties = emulator.run(1.0).duty_steps
        assert core.state in may_lead_to(before), (before, core.state)
        silent_ms = silent_ms + 1 if core.state in SILENT and before in SILENT else 0
        assert silent_ms < QUIET_MS or not duties.any(), core.state
    assert seen >= {"idle", "playing", "streaming", "updating", "fault"}


def test_nothing_leads_out_of_a_restart(table: Table) -> None:
    emulator = Emulator(device_of(table), table, level=1.0)
    for (state, event), after in TRANSITIONS.items():
        if state == "restarting":
            assert after == "restarting", event
    assert {state for state, event in TRANSITIONS if event == "restart asked"} == {
        "idle",
        "playing",
        "streaming",
        "updating",
        "fault",
        "lifted",
        "restarting",
    }
    assert emulator.core.state == "idle"


def test_the_states_are_those_of_the_documentation() -> None:
    """docs/device.md shows the very table the firmware is compiled with."""
    text = (ROOT / "docs" / "device.md").read_text(encoding="utf-8")
    rows = [
        tuple(cell.strip() for cell in line.strip("| \n").split("|"))
        for line in text.split("## States")[1].split("\n## ")[0].splitlines()
        if line.startswith("|")
    ]
    header, body = rows[0], rows[2:]
    documented = {
        (row[0], event, cell)
        for row in body
        for event, cell in zip(header[1:], row[1:], strict=True)
        if cell != "–"
    }
    assert documented == set(_emulator.transitions())
