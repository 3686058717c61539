"""A drive that the host repeats, on a device that goes quiet as soon as any may."""

from __future__ import annotations

from dataclasses import replace

from chladni.host.device.device import Device
from chladni.host.device.live_drive import play_for
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.sim.board.board import Board
from chladni.tables.layout import MIN_TOUCH_TIMEOUT_US
from chladni.tables.report import TableReport
from chladni.tables.table import Table


def test_a_live_drive_does_not_pause_on_a_table_with_the_shortest_timeout(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    table = coarse_table[0]
    table = replace(table, limits=replace(table.limits, touch_timeout_us=MIN_TOUCH_TIMEOUT_US))
    with Device(EmulatorWire(Emulator(coarse_board, table))) as device:
        play_for(device, [complex(0.2)] * table.actuators, 160.0, "sine", 0.3)
        info = device.info()
    assert (info["state"], info["faults"]) == ("streaming", 0)
