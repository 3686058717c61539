"""A table of several frequencies: which one plays, and when it may change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.host.emulation.demodulate import Play, drive_phasors
from chladni.host.emulation.emulator import EmulatorError, TouchEvent
from chladni.tables.table import Table
from made_up import (
    emulate,
    make_section,
    make_table,
    periods,
    powered,
)


@pytest.fixture
def table() -> Table:
    return make_table(np.array([[10.0, -5.0j, 1.0 + 1.0j, 0.1, 0.0]]))


def test_the_device_plays_the_frequency_it_is_asked_for(table: Table) -> None:
    """Another section's drives at another rate, from the next touch on."""
    other = make_section(np.array([[2.0, 3.0j, 10.0, -4.0, 1.0]]), frequency_hz=210.0)
    both = replace(table, sections=(table.section(), other))
    for frequency, section in ((None, both.sections[0]), (210.0, other), (160.0, both.sections[0])):
        recording = emulate(both, [TouchEvent(5.0, (0.0, 0.0))], 300.0, frequency_hz=frequency)
        play = Play(periods(recording, 30.0), recording.duty_steps.shape[0])
        played = 10.0 * drive_phasors(recording, play, section.frequency_hz, level=0.8)
        entry = both.drives(section)[0]
        played *= np.exp(-1j * np.angle(np.vdot(entry, played)))
        assert np.abs(played - entry).max() < 0.01 * 10.0
    with pytest.raises(EmulatorError, match="no drives for that frequency"):
        powered(both, frequency_hz=100.0)


def test_a_frequency_is_only_changed_between_touches(table: Table) -> None:
    other = make_section(np.array([[2.0, 3.0j, 10.0, -4.0, 1.0]]), frequency_hz=210.0)
    emulator = powered(replace(table, sections=(table.section(), other)))
    emulator.touch(TouchEvent(5.0, (0.0, 0.0)))
    emulator.run(30.0)
    emulator.core.command("frequency 210000")
    assert emulator.core.printed[-1] == "lift the finger first"
    for line in ("frequency", "frequency x", "frequency 210000 1", "frequency -5"):
        emulator.core.command(line)
        assert emulator.core.printed[-1].startswith("expected:")
    emulator.touch(TouchEvent(31.0, None))
    emulator.run(30.0)
    emulator.core.command("frequency 210000")
    assert emulator.core.printed[-1] == "ok"
