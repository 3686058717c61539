"""Channels with a full bridge on the wiring drawing: PWM to enable, sign to phase."""

from __future__ import annotations

from chladni.host.manufacture.wiring.channels import Channel, channels
from chladni.host.manufacture.wiring.layout import (
    BUS_X,
    FIRST_SIGN,
    gate_start,
    row_y,
    say_actuator,
    say_headings,
)
from chladni.host.manufacture.wiring.parts import engineering
from chladni.host.manufacture.wiring.symbols import Sheet
from chladni.host.manufacture.wiring.values import BYPASS_F, Values
from chladni.sim.board.board import Board

BRIDGE = "#e3efe0"
SUPPLY = "#b03a00"
BRIDGE_X, BRIDGE_WIDTH, BRIDGE_TOP, BRIDGE_LOW = 19.2, 4.8, -4.5, -8.6
PULL_DOWN_X, LOGIC_X, BYPASS_X = 17.6, 20.4, 26.0
OTHER_SIGN = 0.6
"""How far a sign's wire is below its channel's PWM wire; the first one is above it."""
OUT_X, HALF_HEIGHT = 28.8, 0.65


def sign_y(board: Board, channel: int) -> float:
    """Height of the wire of a channel's sign."""
    return row_y(board, channel) + (FIRST_SIGN if channel == 0 else -OTHER_SIGN)


def draw_full_bridge(sheet: Sheet, board: Board, values: Values) -> None:
    """Channel 0: both lines, pull-down, bridge with its supplies, coil between its outputs."""
    right, gate, sign = BRIDGE_X + BRIDGE_WIDTH, row_y(board, 0), sign_y(board, 0)
    supply_x = right - 0.8
    sheet.box(BRIDGE_X, BRIDGE_LOW, BRIDGE_WIDTH, BRIDGE_TOP - BRIDGE_LOW, fill=BRIDGE)
    for name, y in (("PH", sign), ("EN", gate)):
        sheet.wire((gate_start(board), y), (BRIDGE_X, y))
        sheet.text(BRIDGE_X + 0.2, y, name)
    sheet.dot(PULL_DOWN_X, gate)
    sheet.wire((PULL_DOWN_X, gate), (PULL_DOWN_X, gate - 0.4))
    sheet.resistor((PULL_DOWN_X, gate - 1.4), upright=True)
    ohm = engineering(values.gate.pull_down_ohm, "Ω")
    sheet.text(PULL_DOWN_X - 0.4, gate - 1.4, ohm, left=False)
    sheet.ground(PULL_DOWN_X, gate - 2.4)
    sheet.wire((LOGIC_X, BRIDGE_TOP), (LOGIC_X, BRIDGE_TOP + 0.6))
    sheet.rail(LOGIC_X, BRIDGE_TOP + 0.6, "3.3 V")
    said = "VCC, nSLEEP" if board.sensing is None else "VCC"
    sheet.text(BRIDGE_X + 0.2, BRIDGE_TOP - 0.4, said)
    sheet.wire((supply_x, BRIDGE_TOP), (supply_x, 0.0))
    sheet.dot(supply_x, 0.0, SUPPLY)
    sheet.text(right - 0.4, BRIDGE_TOP - 0.4, "VM", left=False)
    sheet.dot(BYPASS_X, 0.0, SUPPLY)
    sheet.wire((BYPASS_X, 0.0), (BYPASS_X, -0.4))
    sheet.capacitor(BYPASS_X, -1.2, polarised=False)
    sheet.ground(BYPASS_X, -2.0)
    sheet.text(BYPASS_X + 0.8, -1.2, engineering(BYPASS_F, "F"))
    middle = BRIDGE_X + BRIDGE_WIDTH / 2.0
    sheet.text(middle, BRIDGE_LOW + 0.4, "GND", middle=True)
    sheet.wire((middle, BRIDGE_LOW), (middle, BRIDGE_LOW - 0.4))
    sheet.ground(middle, BRIDGE_LOW - 0.4)
    sheet.lines(
        right + 0.3,
        gate - 0.9,
        ("full bridge, PH/EN", f"at least {values.switch_a:g} A", "EN low: both outputs low"),
    )
    _draw_coil(sheet, right, sign, gate)
    for name, y in (("OUT1", sign), ("OUT2", gate)):
        sheet.text(right - 0.2, y, name, left=False)
    said = f"coil, {board.electronics.coil_ohm:g} Ω"
    sheet.text((right + OUT_X) / 2.0, (sign + gate) / 2.0, said, middle=True)
    say_headings(sheet)
    say_actuator(sheet, channels(board)[0], (sign + gate) / 2.0)


def draw_bridge_rows(sheet: Sheet, board: Board) -> None:
    """The other channels, a row each."""
    for own in channels(board)[1:]:
        _draw_row(sheet, board, own)


def _draw_row(sheet: Sheet, board: Board, own: Channel) -> None:
    gate, sign = row_y(board, own.channel), sign_y(board, own.channel)
    middle, right = (gate + sign) / 2.0, BRIDGE_X + BRIDGE_WIDTH
    sheet.box(BRIDGE_X, middle - HALF_HEIGHT, BRIDGE_WIDTH, 2.0 * HALF_HEIGHT, fill="white")
    for name, y in (("EN", gate), ("PH", sign)):
        sheet.wire((gate_start(board), y), (BRIDGE_X, y))
        sheet.text(BRIDGE_X + 0.2, y, name)
    sheet.text(BRIDGE_X + BRIDGE_WIDTH / 2.0 + 0.4, middle, "as channel 0", middle=True)
    _draw_coil(sheet, right, gate, sign)
    say_actuator(sheet, own, middle)


def _draw_coil(sheet: Sheet, left: float, upper: float, lower: float) -> None:
    """Between two outputs that stand over one another."""
    sheet.coil(left, OUT_X, upper)
    sheet.wire((OUT_X, upper), (OUT_X, lower), (left, lower))
    assert OUT_X < BUS_X
