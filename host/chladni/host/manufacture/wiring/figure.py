"""A wiring drawing, made from a board file: supply, ESP32, a driver a channel, panel, link."""

from __future__ import annotations

from matplotlib.figure import Figure

from chladni.host.manufacture.wiring.bridge import draw_bridge_rows, draw_full_bridge, sign_y
from chladni.host.manufacture.wiring.channels import channels
from chladni.host.manufacture.wiring.layout import (
    BLOCK_WIDTH,
    BLOCK_X,
    BUS_PITCH,
    BUS_X,
    CHANNEL_X,
    CHIP_END,
    CHIP_TOP,
    CHIP_WIDTH,
    CHIP_X,
    COIL_Y,
    GATE_X,
    GATE_Y,
    NAME_X,
    PANEL_Y,
    PIN_PITCH,
    PLACE_X,
    PULL_UP_X,
    ROW,
    ROWS_Y,
    SERIAL_Y,
    SWITCH_WIDTH,
    SWITCH_X,
    gate_start,
    row_y,
    say_actuator,
    say_headings,
)
from chladni.host.manufacture.wiring.part import Part
from chladni.host.manufacture.wiring.parts import engineering, parts_list
from chladni.host.manufacture.wiring.sensing import HEIGHT, draw_sensing, sensing_notes
from chladni.host.manufacture.wiring.symbols import PLAIN, THICK, Sheet
from chladni.host.manufacture.wiring.values import Values, wiring_values
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import NOT_WIRED, Panel
from chladni.sim.board.gpio import CHIPS

UNIT_IN = 0.3
"""Of the sheet, in inches; text is of a fixed size beside it."""
CHIP, LOGIC, SENSE = "#e6e0f0", "#fcefc9", "#dbe9f6"
POSITIVE, WARN = "#b03a00", "#c00000"


def wiring_figure(board: Board) -> Figure:
    """Draw how a board is wired.

    Channel 0's switch or bridge is drawn in full and the others as a row each. Lines of the panel
    that are not wired are left out, and a board file without pins gets none.
    """
    values = wiring_values(board)
    parts = {part.part: part for part in parts_list(board, values)}
    lowest = min(ROWS_Y - ROW * (len(board.actuators) - 1), _left_end(board)) - 0.6
    width, height = NAME_X + 6.0, 3.0 - lowest + 4.0
    figure = Figure(figsize=(width * UNIT_IN, height * UNIT_IN))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(-1.0, width - 1.0)
    axes.set_ylim(lowest - 4.0, 3.0)
    axes.set_axis_off()
    sheet = Sheet(axes)
    sheet.text(-0.4, 2.2, f"{board.name}: wiring", size=13.0, bold=True)
    _draw_supply(sheet, board, values, parts)
    _draw_chip(sheet, board, lowest)
    if board.electronics.is_bridge:
        draw_full_bridge(sheet, board, values)
        draw_bridge_rows(sheet, board)
    else:
        _draw_full_channel(sheet, board, values)
        _draw_rows(sheet, board)
    _draw_link(sheet, board)
    if board.panel:
        _draw_panel(sheet, board.panel, parts)
    if "earth wire" in parts:
        _draw_earthed_sheet(sheet, (board.plate.material or "metal").replace("-", " "))
    if board.sensing is not None:
        draw_sensing(sheet, board, _panel_end(board) - 2.2)
    sheet.lines(-0.4, lowest - 1.6, _notes(board))
    return figure


def _left_end(board: Board) -> float:
    """How far down the ESP32's left side goes."""
    return _panel_end(board) - (0.0 if board.sensing is None else HEIGHT + 0.4)


def _panel_end(board: Board) -> float:
    """The lowest wire of the panel, or of the link without one."""
    if board.panel is None:
        return SERIAL_Y - PIN_PITCH
    return PANEL_Y - BUS_PITCH - PIN_PITCH * len(_single_lines(board.panel))


def _single_lines(panel: Panel) -> list[tuple[str, int]]:
    """Names and GPIOs of the panel's wired lines that need no pull-up."""
    lines = (("INT", panel.interrupt_pin), ("RST", panel.reset_pin))
    return [(name, pin) for name, pin in lines if pin != NOT_WIRED]


def _draw_supply(sheet: Sheet, board: Board, values: Values, parts: dict[str, Part]) -> None:
    """Terminals, fuse, rail, bulk capacitor and the regulator of the ESP32's 3.3 V."""
    volts = f"{board.electronics.supply_v:g} V"
    sheet.fuse((2.6, 0.0))
    sheet.wire((0.0, 0.0), (2.0, 0.0), width=THICK, colour=POSITIVE)
    last = COIL_Y if len(board.actuators) == 1 else ROWS_Y - ROW * (len(board.actuators) - 2)
    # A bridge takes the supply itself; with switches it goes down to the coils.
    ends = (
        ((3.2, 0.0), (BUS_X, 0.0))
        if board.electronics.is_bridge
        else ((3.2, 0.0), (BUS_X, 0.0), (BUS_X, last))
    )
    sheet.wire(*ends, width=THICK, colour=POSITIVE)
    sheet.text(-0.4, 1.2, f"supply {parts['supply'].value}", size=PLAIN)
    sheet.text(-0.2, 0.0, "+", left=False, size=PLAIN)
    sheet.text(-0.2, -1.4, "−", left=False, size=PLAIN)
    sheet.wire((0.0, -1.4), (0.8, -1.4), (0.8, -2.0))
    sheet.ground(0.8, -2.0)
    sheet.text(2.6, 0.55, parts["fuse, slow"].value, middle=True)
    sheet.dot(5.0, 0.0, POSITIVE)
    sheet.wire((5.0, 0.0), (5.0, -0.4))
    sheet.capacitor(5.0, -1.2)
    sheet.ground(5.0, -2.0)
    sheet.lines(5.8, -0.95, (engineering(values.bulk_f, "F"), f"{values.bulk_v:g} V"))
    middle = CHIP_X + CHIP_WIDTH / 2.0
    sheet.box(CHIP_X, -2.3, CHIP_WIDTH, 1.4, fill=LOGIC)
    if values.regulator == "separate":
        kind = "a supply of its own"
    else:
        kind = f"{values.regulator}, 500 mA"
        sheet.dot(middle, 0.0, POSITIVE)
        sheet.wire((middle, 0.0), (middle, -0.9))
    sheet.text(middle, -1.35, "3.3 V for the ESP32", middle=True)
    sheet.text(middle, -1.85, kind, middle=True)
    sheet.wire((CHIP_END, -1.6), (CHIP_END + 0.6, -1.6), (CHIP_END + 0.6, -2.0))
    sheet.ground(CHIP_END + 0.6, -2.0)
    sheet.wire((middle, -2.3), (middle, CHIP_TOP))
    sheet.text(BUS_X, 0.5, volts, middle=True, colour=POSITIVE, size=PLAIN)


def _draw_chip(sheet: Sheet, board: Board, lowest: float) -> None:
    """The module with the GPIOs of its gates."""
    middle = CHIP_X + CHIP_WIDTH / 2.0
    sheet.box(CHIP_X, lowest, CHIP_WIDTH, CHIP_TOP - lowest, fill=CHIP)
    sheet.text(middle, CHIP_TOP - 0.4, "3V3", middle=True)
    sheet.text(middle, CHIP_TOP - 1.1, CHIPS[board.electronics.chip].module, middle=True, bold=True)
    sheet.text(middle, lowest + 0.4, "GND", middle=True)
    sheet.wire((middle, lowest), (middle, lowest - 0.4))
    sheet.ground(middle, lowest - 0.4)
    for own in channels(board):
        if own.gpio is not None:
            sheet.text(CHIP_END - 0.2, row_y(board, own.channel), f"GPIO {own.gpio}", left=False)
        if own.sign_gpio is not None:
            sheet.text(
                CHIP_END - 0.2, sign_y(board, own.channel), f"GPIO {own.sign_gpio}", left=False
            )
    if not board.electronics.pwm_pins:
        named = ("no GPIO: pwm_pins of", "the board file is empty")
        sheet.lines(CHIP_END + 0.4, COIL_Y + 0.2, named, colour=WARN)


def _draw_full_channel(sheet: Sheet, board: Board, values: Values) -> None:
    """Channel 0: gate resistor, pull-down, MOSFET, coil with its flyback diode."""
    own, gate = channels(board)[0], values.gate
    node = GATE_X - 0.8
    sheet.wire((gate_start(board), GATE_Y), (node - 2.6, GATE_Y))
    sheet.resistor((node - 1.6, GATE_Y), upright=False)
    sheet.text(node - 1.6, GATE_Y + 0.5, engineering(gate.series_ohm, "Ω"), middle=True)
    sheet.wire((node - 0.6, GATE_Y), (GATE_X, GATE_Y))
    sheet.dot(node, GATE_Y)
    sheet.wire((node, GATE_Y), (node, GATE_Y - 0.4))
    sheet.resistor((node, GATE_Y - 1.4), upright=True)
    sheet.text(node - 0.4, GATE_Y - 1.4, engineering(gate.pull_down_ohm, "Ω"), left=False)
    sheet.ground(node, GATE_Y - 2.4)
    drain_x, drain_y = sheet.mosfet(GATE_X, GATE_Y)
    sheet.wire((drain_x, GATE_Y - 0.9), (drain_x, GATE_Y - 2.4))
    sheet.ground(drain_x, GATE_Y - 2.4)
    sheet.lines(
        drain_x + 0.5,
        GATE_Y + 0.6,
        (
            "N-MOSFET, logic level",
            f"at least {values.switch_v:g} V, {values.switch_a:g} A",
            f"at most {engineering(values.switch_ohm, 'Ω')} at 2.5 V",
        ),
    )
    diode_y = COIL_Y + 1.4
    sheet.wire((drain_x, drain_y), (drain_x, diode_y))
    sheet.dot(drain_x, COIL_Y)
    sheet.coil(drain_x, BUS_X, COIL_Y)
    sheet.dot(BUS_X, COIL_Y, POSITIVE)
    sheet.diode(drain_x, BUS_X, diode_y)
    sheet.dot(BUS_X, diode_y, POSITIVE)
    middle = (drain_x + BUS_X) / 2.0
    sheet.text(
        middle,
        diode_y + 0.65,
        f"Schottky, at least {values.switch_v:g} V, {values.switch_a:g} A",
        middle=True,
    )
    sheet.text(middle, COIL_Y - 0.4, f"coil, {board.electronics.coil_ohm:g} Ω", middle=True)
    say_headings(sheet)
    say_actuator(sheet, own, COIL_Y)


def _draw_rows(sheet: Sheet, board: Board) -> None:
    """The other channels, a row each."""
    for own in channels(board)[1:]:
        y = row_y(board, own.channel)
        sheet.wire((gate_start(board), y), (SWITCH_X, y))
        sheet.box(SWITCH_X, y - 0.38, SWITCH_WIDTH, 0.76, fill="white")
        sheet.text(SWITCH_X + SWITCH_WIDTH / 2.0, y, "as channel 0", middle=True)
        sheet.wire((SWITCH_X + 0.5, y - 0.38), (SWITCH_X + 0.5, y - 0.6))
        sheet.ground(SWITCH_X + 0.5, y - 0.6)
        sheet.coil(SWITCH_X + SWITCH_WIDTH, BUS_X, y)
        sheet.dot(BUS_X, y, POSITIVE)
        say_actuator(sheet, own, y)


def _draw_link(sheet: Sheet, board: Board) -> None:
    """USB, by a bridge to UART0 or by the chip itself: either has its pins for ever."""
    pins = CHIPS[board.electronics.chip].link
    has_bridge = board.electronics.chip == "esp32"
    lines = ("RXD", "TXD") if has_bridge else ("D+", "D−")
    words = ("USB–serial", "bridge") if has_bridge else ("USB", "socket")
    end, low = BLOCK_X + BLOCK_WIDTH, SERIAL_Y - PIN_PITCH - 0.7
    sheet.text(BLOCK_X, SERIAL_Y + 1.1, "link, 3.3 V levels", bold=True)
    sheet.box(BLOCK_X, low, BLOCK_WIDTH, SERIAL_Y + 0.7 - low, fill=SENSE)
    sheet.lines(BLOCK_X + 0.3, SERIAL_Y - 0.1, words)
    sheet.wire((BLOCK_X - 0.6, low + 0.4), (BLOCK_X, low + 0.4), width=2.4)
    sheet.text(BLOCK_X + 0.3, low + 0.4, "USB")
    for k, (name, pin) in enumerate(zip(lines, pins, strict=True)):
        _draw_line(sheet, SERIAL_Y - PIN_PITCH * k, name, pin)
    sheet.wire((end - 0.6, low), (end - 0.6, low - 0.3))
    sheet.ground(end - 0.6, low - 0.3)


def _draw_line(sheet: Sheet, y: float, name: str, pin: str) -> None:
    """A wire from a block on the left to a pin of the ESP32."""
    end = BLOCK_X + BLOCK_WIDTH
    sheet.wire((end, y), (CHIP_X, y))
    sheet.text(end - 0.2, y, name, left=False)
    sheet.text(CHIP_X + 0.2, y, pin)


def _draw_panel(sheet: Sheet, panel: Panel, parts: dict[str, Part]) -> None:
    """The touch panel's bus with its pull-ups, and its other lines if they are wired."""
    bus = ((PANEL_Y, "SDA", panel.sda_pin), (PANEL_Y - BUS_PITCH, "SCL", panel.scl_pin))
    for y, name, pin in bus:
        _draw_line(sheet, y, name, f"GPIO {pin}")
        sheet.dot(PULL_UP_X, y)
        sheet.wire((PULL_UP_X, y), (PULL_UP_X, y + 0.1))
        sheet.resistor((PULL_UP_X, y + 1.0), upright=True)
        sheet.text(PULL_UP_X - 0.35, y + 1.0, parts["bus pull-up"].value, left=False)
        sheet.rail(PULL_UP_X, y + 2.0, "3.3 V")
    low = bus[-1][0]
    for name, pin in _single_lines(panel):
        low -= PIN_PITCH
        _draw_line(sheet, low, name, f"GPIO {pin}")
    low -= 0.7
    sheet.box(BLOCK_X, low, BLOCK_WIDTH, PANEL_Y + 0.8 - low, fill=SENSE)
    sheet.text(BLOCK_X + 1.6, PANEL_Y + 1.2, "touch panel", bold=True)
    sheet.lines(BLOCK_X + 0.3, PANEL_Y - 1.0, parts["touch panel"].value.split(", "))
    sheet.wire((BLOCK_X + 0.8, PANEL_Y + 0.8), (BLOCK_X + 0.8, PANEL_Y + 1.2))
    sheet.rail(BLOCK_X + 0.8, PANEL_Y + 1.2, "3.3 V")
    sheet.wire((BLOCK_X + 0.8, low), (BLOCK_X + 0.8, low - 0.3))
    sheet.ground(BLOCK_X + 0.8, low - 0.3)


def _draw_earthed_sheet(sheet: Sheet, metal: str) -> None:
    """A metal plate under a touch panel, with its wire to ground, above the coils' names."""
    sheet.box(PLACE_X, -2.1, 6.4, 1.1, fill="white")
    sheet.text(PLACE_X + 3.2, -1.55, f"sheet of {metal}", middle=True)
    sheet.wire((PLACE_X, -1.55), (CHANNEL_X + 0.6, -1.55), (CHANNEL_X + 0.6, -2.0))
    sheet.ground(CHANNEL_X + 0.6, -2.0)
    sheet.text(CHANNEL_X + 0.6, -1.2, "earth wire", middle=True)


def _notes(board: Board) -> list[str]:
    notes = [
        "All ground signs are one ground. The coils' current returns to the bulk capacitor, not "
        "through the ESP32.",
        "Values follow from the board file; a module without a development board needs its own "
        "capacitors at 3V3 and EN.",
    ]
    notes += sensing_notes(board)
    if board.electronics.is_bridge and board.sensing is None:
        notes.insert(
            0,
            "nSLEEP of all bridges is tied to 3.3 V. If a pin of your own drives it, that line is "
            "one more gate: pull it low.",
        )
    if len(board.actuators) > 1:
        first = (
            "Every other channel is wired as channel 0: PWM to EN with a pull-down, sign to PH, "
            "and a capacitor at the bridge's supply."
            if board.electronics.is_bridge
            else "Every other channel is switched as channel 0: gate resistor, pull-down, "
            "MOSFET, and a flyback diode across the coil."
        )
        notes.insert(0, first)
    if board.panel is None:
        notes.append("The board file has no [panel]: touches come over the link.")
        return notes
    if board.panel.interrupt_pin == NOT_WIRED:
        notes.append("The panel's interrupt line is not wired: the panel is polled.")
    if board.panel.reset_pin == NOT_WIRED:
        notes.append("Pull the panel's RST up to 3.3 V with 10 kΩ: no pin drives it.")
    return notes
