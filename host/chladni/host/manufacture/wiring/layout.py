"""Where things stand on a wiring drawing."""

from __future__ import annotations

from chladni.host.manufacture.wiring.channels import Channel
from chladni.host.manufacture.wiring.symbols import PLAIN, Sheet
from chladni.sim.board.board import Board

# Columns, from the left.
BLOCK_X, BLOCK_WIDTH = 0.6, 4.8
PULL_UP_X, CHIP_X, CHIP_WIDTH = 7.6, 9.6, 5.2
CHIP_END = CHIP_X + CHIP_WIDTH
GATE_X, SWITCH_X, SWITCH_WIDTH = 21.0, 19.2, 3.6
BUS_X, CHANNEL_X, PLACE_X, NAME_X = 29.4, 30.0, 31.8, 35.6
# Rows, downwards from the supply's rail at 0.
CHIP_TOP, COIL_Y, GATE_Y, ROWS_Y, ROW = -3.6, -3.8, -5.7, -10.2, 1.5
FIRST_SIGN = 1.2
SERIAL_Y, PANEL_Y, BUS_PITCH, PIN_PITCH = -6.0, -12.0, 3.0, 1.2


def row_y(board: Board, channel: int) -> float:
    """Height of a channel's gate wire; that of a first bridge leaves room for its sign above."""
    if channel == 0:
        return GATE_Y - FIRST_SIGN * board.electronics.is_bridge
    return ROWS_Y - ROW * (channel - 1)


def gate_start(board: Board) -> float:
    """Where gate wires begin: at the ESP32, or in the open where the board file names no pins."""
    return CHIP_END if board.electronics.pwm_pins else CHIP_END + 1.2


def say_headings(sheet: Sheet) -> None:
    """Of the columns of channels, places and names."""
    for x, heading in ((CHANNEL_X, "channel"), (PLACE_X, "at, mm"), (NAME_X, "actuator")):
        sheet.text(x, COIL_Y + 0.7, heading, bold=True)


def say_actuator(sheet: Sheet, own: Channel, y: float) -> None:
    """A channel's number, place and name, in their columns."""
    sheet.text(CHANNEL_X, y, str(own.channel), size=PLAIN)
    sheet.text(PLACE_X, y, "{:.4g}, {:.4g}".format(*own.at_mm).replace("-", "−"), size=PLAIN)
    sheet.text(NAME_X, y, own.actuator, size=PLAIN)
