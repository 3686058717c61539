"""The parts list of a board: what, how many, which value, and what the value follows from."""

from __future__ import annotations

import math
from dataclasses import dataclass

from chladni.host.manufacture.wiring.part import Part
from chladni.host.manufacture.wiring.sensing_parts import sensing_parts
from chladni.host.manufacture.wiring.values import (
    BRIDGE_INPUT_OHM,
    BYPASS_F,
    LOGIC_V,
    PULL_UP_OHM,
    RADIO_A,
    Values,
    pulled_up_gates,
    wiring_values,
)
from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import METALS, metal_of
from chladni.sim.board.electronics import CLOCK_HZ, NOT_WIRED
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.quantity import MM


def engineering(value: float, unit: str) -> str:
    """A value in steps of a thousand, to three digits: 3300 Ω is 3.3 kΩ."""
    power = max(-4, min(2, math.floor(math.log10(abs(value)) / 3.0 + 1e-9))) if value else 0
    return f"{float(f'{value / 1000.0**power:.3g}'):g} {'pnµm kM'[power + 4].strip()}{unit}"


LINK_PARTS = {
    "esp32": Part("USB–serial bridge", 1, "3.3 V levels", "the link; development boards carry one"),
    "esp32s3": Part("USB socket", 1, "USB 2.0", "the link: the chip's own USB"),
}
"""What brings the link to a host, by chip."""


@dataclass(frozen=True)
class BridgePart:
    """A bridge of the phase/enable kind that can be bought, and its data sheet."""

    name: str
    ampere: float
    volts: float
    ohm: float
    sheet: str
    can_sleep: bool


BRIDGE_PARTS = (
    BridgePart("DRV8838", 1.8, 11.0, 0.28, "TI SLVSBA4", can_sleep=True),
    BridgePart("half a DRV8835, its MODE high", 1.5, 11.0, 0.305, "TI SLVSB18", can_sleep=False),
)
"""Most current and supply, the typical resistance of high and low side together, and whether one
bridge can be put to sleep by itself."""


def parts_list(board: Board, values: Values | None = None) -> tuple[Part, ...]:
    """What has to be bought for a board, magnets, plate and screws aside.

    Parameters
    ----------
    values
        Of this very board, where they are known already.
    """
    own = values or wiring_values(board)
    return (
        *_supply_parts(board, own),
        *_channel_parts(board, own),
        *_panel_parts(board, own),
        *sensing_parts(board),
    )


def _supply_parts(board: Board, own: Values) -> tuple[Part, ...]:
    settings = board.electronics
    volts, from_coils = f"{settings.supply_v:g} V", engineering(own.logic_a, "A")
    chip = CHIPS[settings.chip]
    taken = sorted({*settings.pwm_pins, *settings.sign_pins} & set(chip.not_beside_psram))
    free = (
        f"GPIO {' and '.join(map(str, taken))} must be free: no PSRAM" if taken else "any will do"
    )
    carrier_hz = CLOCK_HZ / 2**settings.pwm_bits
    made = {
        "linear": f"at least 500 mA, linear: ({volts} − 3.3 V) · 0.5 A is below 1 W",
        "buck": f"at least 500 mA, a buck converter: a linear one would lose "
        f"{engineering((settings.supply_v - LOGIC_V) * RADIO_A, 'W')}",
        "separate": f"a supply of its own, at least 500 mA: {volts} is too little for a regulator",
    }[own.regulator]
    regulator, _, why = made.partition(": ")
    # All coils at full duty may take no more than the limit: then no wave has a higher crest.
    coils = f"{engineering(own.crest_a, 'A')} with all coils at full duty"
    if own.crest_a > own.mean_a:
        coils = (
            f"{engineering(own.crest_a, 'A')} in the crest of a wave, "
            f"{engineering(own.mean_a, 'A')} mean"
        )
    is_late = own.fuse_a > own.supply_a
    return (
        Part("supply", 1, f"{volts}, {own.supply_a:g} A",
             f"{coils}, and {from_coils} for the ESP32"),
        Part("fuse, slow", 1, f"{own.fuse_a:g} A",
             f"√(mean · crest) of the coils' current and {from_coils}, over 0.75"
             + "; for a battery or a larger supply, this one limits itself before" * is_late),
        Part("bulk capacitor", 1,
             f"{engineering(own.bulk_f, 'F')}, {own.bulk_v:g} V, "
             f"{engineering(own.bulk_ripple_a, 'A')} of ripple",
             f"1 % of {volts} for pulses at {engineering(carrier_hz, 'Hz')}, 5 % "
             "for a jump of the drive until the supply follows, 50 µs"),
        Part("3.3 V regulator", 1, regulator, why),
        Part("ESP32 module", 1, chip.module, free),
        LINK_PARTS[settings.chip],
    )  # fmt: skip


def _channel_parts(board: Board, own: Values) -> tuple[Part, ...]:
    settings, count = board.electronics, len(board.actuators)
    is_known = board.coil is not None or board.winding is not None
    origin = "the board file's" if is_known else "assumed: the board file has no coil"
    coil = Part(
        "coil",
        count,
        f"{settings.coil_ohm:g} Ω{_wound(board)}",
        f"{origin}; {engineering(own.coil_a, 'A')} at full duty",
        mass_g=board.winding.round.mass / 1e-3 if board.winding else None,
    )
    driver = _bridge_parts if settings.is_bridge else _switch_parts
    return (coil, *driver(board, own))


def _bridge_parts(board: Board, own: Values) -> tuple[Part, ...]:
    settings, count, gate = board.electronics, len(board.actuators), own.gate
    able = [
        part
        for part in BRIDGE_PARTS
        if part.ampere >= own.switch_a
        and part.volts >= settings.supply_v
        and (part.can_sleep or board.sensing is None)
    ]
    named = " or ".join(part.name for part in able) or "none is known here that bears it"
    sheets = "; ".join(
        f"{part.sheet}: {part.ampere:g} A, up to {part.volts:g} V, {engineering(part.ohm, 'Ω')}"
        for part in able
    )
    open_v = LOGIC_V * BRIDGE_INPUT_OHM / (BRIDGE_INPUT_OHM + PULL_UP_OHM)
    down = (
        f"the bridge's own {engineering(BRIDGE_INPUT_OHM, 'Ω')} would leave {open_v:.1f} V of a "
        f"pin that is pulled up through reset, this {gate.reset_v:.2f} V"
        if gate.reset_v
        else "no EN's GPIO is pulled up through reset: beside the bridge's own pull-down"
    )
    return (
        Part("full bridge, PH/EN", count,
             f"{settings.supply_v:g} V, at least {own.switch_a:g} A: {named}",
             f"twice {engineering(own.coil_a, 'A')}; EN low must pull both outputs low, so no "
             f"IN/IN kind (DRV8833); logic from 3.3 V{'; ' * bool(sheets)}{sheets}"),
        Part("EN pull-down", count, engineering(gate.pull_down_ohm, "Ω"), down),
        Part("bridge capacitor, ceramic", count, engineering(BYPASS_F, "F"),
             f"at each bridge's {settings.supply_v:g} V, beside the bulk capacitor"),
    )  # fmt: skip


def _switch_parts(board: Board, own: Values) -> tuple[Part, ...]:
    settings, count, gate = board.electronics, len(board.actuators), own.gate
    pulled_up = pulled_up_gates(board)
    if pulled_up:
        which = f"GPIO {', '.join(map(str, pulled_up))} pulled up through reset"
    else:
        which = "any pin may be pulled up through reset"
    down = f"{which}: {gate.reset_v:.2f} V at the gate (typical), 0.5 V may switch it"
    if not gate.reset_v:
        down = "no gate's GPIO is pulled up through reset: it only drains what leaks"
    switch = f"at least {own.switch_v:g} V, {own.switch_a:g} A"
    on = (
        f" and {engineering(gate.input_f, 'F')}",
        f"on within {settings.min_on_ns:g} ns (min_on_ns)",
    )
    if not gate.input_f:
        on = ("", "a min_on_ns of 0 leaves no time for its gate")
    return (
        Part("N-MOSFET, logic level", count,
             f"{switch}; at most {engineering(own.switch_ohm, 'Ω')} at 2.5 V{on[0]}",
             f"twice {settings.supply_v:g} V and a diode's drop, twice "
             f"{engineering(own.coil_a, 'A')}, 2 % of the coil, {on[1]}"),
        Part("flyback diode, Schottky", count, switch,
             "as the MOSFET; it carries the coil's current in every carrier period"),
        Part("gate resistor", count, engineering(gate.series_ohm, "Ω"),
             "a pin gives at most 40 mA: 3.3 V/40 mA = 83 Ω"),
        Part("gate pull-down", count, engineering(gate.pull_down_ohm, "Ω"), down),
    )  # fmt: skip


def _wound(board: Board) -> str:
    """How a coil is wound, if the board file says it."""
    own = board.winding
    if own is None:
        return ""
    inner, outer, height, wire = (
        f"{side / MM:g}" for side in (own.inner, own.outer, own.height, own.wire)
    )
    turns = f"{own.turns} turns of {wire} mm copper"
    return f", {turns}, ⌀{inner} to ⌀{outer} × {height} mm"


def _panel_parts(board: Board, own: Values) -> tuple[Part, ...]:
    panel = board.panel
    if panel is None or own.bus_ohm is None:
        return ()
    size = " × ".join(f"{side * 1e3:g}" for side in panel.size)
    kinds = {"find": "FT6x36 or GT911", "ft6x36": "FT6x36", "gt911": "GT911"}
    where = ", in the sheet" if panel.place == "in" else ""
    metal = metal_of(board.plate)
    if_it_is = "" if metal in METALS else ", if that is a metal"
    why = "a conductor that floats moves charge"
    earth = Part("earth wire", 1, f"from the sheet to GND{if_it_is}", why)
    return (
        Part("touch panel", 1, f"{kinds[panel.controller]}, {size} mm{where}", "the board file's"),
        *[earth] * bool(metal),
        Part(
            "bus pull-up",
            2,
            engineering(own.bus_ohm, "Ω"),
            "I²C at 400 kHz: 300 ns/(0.85 · 100 pF) = 3.5 kΩ at most, 0.97 kΩ at least",
        ),
        *[Part("reset pull-up", 1, "10 kΩ", "no pin drives the panel's RST")]
        * (panel.reset_pin == NOT_WIRED),
    )
