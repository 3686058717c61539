"""Every region of the prototype, from its table through the emulated pins to the plate."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.drives.problem.problem import solved_board
from chladni.host.emulation.demodulate import Play, drive_phasors
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.sim.board.board import Board
from chladni.sim.fields.transfer import target_field
from chladni.sim.image import metrics
from chladni.sim.image.energy import compose
from chladni.tables.build import build_table
from soaking import IS_SOAKING, seed

WAVES = 16
EVERY = 5 if IS_SOAKING else 7
SETTLE_MS, PLAY_MS = 30.0, 30.0 + WAVES / 160.0 * 1e3


@pytest.mark.sweep
def test_the_pins_field_is_the_solvers_in_every_region(prototype: Board) -> None:
    """SSIM against each target within 0.001 of what the table's own drive has."""
    table, report = build_table(prototype)
    assert report.bytes <= 1800
    section = table.section()
    solved = solved_board(prototype)
    emulator = Emulator(prototype, table)
    differences = []
    # A prime step visits every column and row.
    for region in range(seed(3) % EVERY, table.grid.count, EVERY):
        place = table.grid.centre_mm(region)
        now_ms = emulator.core.now_us / 1e3
        emulator.touch(TouchEvent(now_ms + 0.5, place))
        recording = emulator.run(PLAY_MS)
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 0.5, None))
        emulator.run(30.0)
        play = Play(int(SETTLE_MS * 1e-3 * recording.carrier_hz), len(recording.duty_steps))
        played = drive_phasors(recording, play, section.frequency_hz, level=0.8)
        promised = table.drives(section)[region]
        wanted = np.abs(target_field(prototype, place, model=solved.model).values[0])
        own, table_s = (
            metrics.ssim(np.abs(compose(solved.fields.values, drive)), wanted)
            for drive in (played, promised)
        )
        differences.append(abs(own - table_s))
    assert len(differences) >= 406 // EVERY
    assert max(differences) < 0.001
