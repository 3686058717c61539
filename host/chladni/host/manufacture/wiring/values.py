"""What a board is wired with: electrical values, worked out from its board file.

Nothing here is measured. A number that is neither a board's nor a formula's is a constant with its
origin beside it; take what your own parts' data sheets say where they differ.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import CLOCK_HZ
from chladni.sim.board.gpio import CHIPS

LOGIC_V = 3.3
PIN_A = 0.04
"""Most that a GPIO of the ESP32 gives, by its data sheet (drive strength 3)."""
PULL_UP_OHM = 45e3
"""Of the chip's own pull-ups, typical by the data sheet, which gives no limits."""
STRONG_PULL_UP_OHM = 2.0 / 3.0 * PULL_UP_OHM
"""A third stronger than typical: a guess, for want of a limit."""
GATE_LOW_V, GATE_HIGH_V = 0.5, 1.5
"""Thresholds of logic-level MOSFETs that are specified at 2.5 V, lowest and highest of data sheets
(FS8205A: 0.5 V to 1.0 or 1.5 V, by maker)."""
GATE_WARM_V = 0.1
"""A threshold falls by about 2 mV/K; 50 K above 25 °C."""
LEAKY_PULL_DOWN_OHM = 10e3
"""Where no pin is pulled up: it holds 1 mV per 0.1 µA of a gate's leakage, and any value would."""
BRIDGE_INPUT_OHM = 100e3
"""From each input of a DRV8838 to ground, about (TI SLVSBA4, 7.3.3)."""
BYPASS_F = 100e-9
"""Ceramic, at each bridge's supply pins: the usual value, beside the bulk capacitor."""
MARGIN = 2.0
"""Of ratings of voltage and current: a stuck output, a cold coil, a ringing lead."""
DIODE_V = 0.5
"""Drop of a Schottky diode, by which a drain rises above the supply."""
ON_SHARE = 0.02
"""Of a coil's resistance that a switch may have: so much of the force is lost."""
CAPACITOR_MARGIN = 1.5
"""Of an electrolytic capacitor's voltage, as is usual."""
RIPPLE_SHARE, SAG_SHARE = 0.01, 0.05
"""Of the supply's voltage: what the carrier and what a jump of the drive may take from it."""
SUPPLY_RESPONSE_S = 50e-6
"""A supply takes about this long to follow a jump of its load; see its data sheet."""
RADIO_A = 0.5
"""What the ESP32 draws from 3.3 V for moments, its radio on."""
LINEAR_W = 1.0
"""What a linear regulator (SOT-223) loses without a heat sink."""
DROPOUT_V, BUCK_EFFICIENCY = 0.3, 0.85
FUSE_SHARE = 0.75
"""Of its rating that a fuse carries for ever, as makers of fuses advise."""
BUS_F, BUS_RISE_S, BUS_SINK_A, BUS_LOW_V = 100e-12, 300e-9, 3e-3, 0.4
"""I²C at 400 kHz (NXP UM10204): rise time, current and level of a low; 100 pF is a guess for a
panel's short cable."""

# Preferred numbers of a decade: IEC 60063 (E6, E3), IEC 60127 (fuses), and what is on sale.
E6 = (1.0, 1.5, 2.2, 3.3, 4.7, 6.8)
E3 = (1.0, 2.2, 4.7)
FUSES = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
SUPPLIES = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
AMPERES = (1.0, 2.0, 3.0, 5.0)
LEAST_A = 0.5
CAPACITOR_VOLTS = (6.3, 10.0, 16.0, 25.0, 35.0, 50.0, 63.0, 80.0, 100.0)
SWITCH_VOLTS = (20.0, 30.0, 40.0, 60.0, 80.0, 100.0)
"""A board file's supply of up to 48 V stays within both."""


@dataclass(frozen=True)
class Gate:
    """What stands before a MOSFET's gate; SI units.

    Attributes
    ----------
    series_ohm, pull_down_ohm
        From the pin to the gate, and from the gate to ground.
    reset_v
        What a typical pull-up leaves at the gate through reset; 0 where no pin is pulled up.
    on_v
        At the gate while the pin is high.
    input_f
        Largest input capacitance that the shortest pulse charges.
    """

    series_ohm: float
    pull_down_ohm: float
    reset_v: float
    on_v: float
    input_f: float


@dataclass(frozen=True)
class Values:
    """Electrical values of a board's wiring; SI units.

    Attributes
    ----------
    coil_a
        Current of one coil at a duty of 1: V/R, where R has a bridge's resistance in it.
    mean_a, crest_a
        Of all coils from the supply: the mean that the firmware keeps, and the crest of a wave.
    gate
        Of every channel.
    switch_v, switch_a
        Least voltage of the MOSFET and of the flyback diode, and least current of both, or of a
        bridge. A diode needs no more than twice the supply; the MOSFET bears a diode's drop
        besides.
    switch_ohm
        Largest on-resistance of the MOSFET, at 2.5 V.
    bulk_f, bulk_v, bulk_ripple_a
        Bulk capacitor: capacitance, voltage and the ripple current that it carries, RMS.
    regulator
        "linear", "buck" or "separate": where the ESP32's 3.3 V come from.
    logic_a
        What the ESP32 draws from the coils' supply.
    supply_a, fuse_a
        Ratings.
    bus_ohm
        Pull-ups of the panel's bus; None without a panel.
    """

    coil_a: float
    mean_a: float
    crest_a: float
    gate: Gate
    switch_v: float
    switch_a: float
    switch_ohm: float
    bulk_f: float
    bulk_v: float
    bulk_ripple_a: float
    regulator: str
    logic_a: float
    supply_a: float
    fuse_a: float
    bus_ohm: float | None


def preferred(least: float, series: Sequence[float], *, down: bool = False) -> float:
    """The next value of a series of preferred numbers at or above `least`, or below it.

    Parameters
    ----------
    series
        One decade, rising from 1.
    """
    decade = 10.0 ** math.floor(math.log10(least))
    # Rounded, since 4.7 · 1e-4 is not quite 4.7e-4.
    steps = [float(f"{s * decade * scale:.3g}") for scale in (0.1, 1.0, 10.0) for s in series]
    near = 1e-9 * least
    if down:
        return max(step for step in steps if step <= least + near)
    return min(step for step in steps if step >= least - near)


def _rated(least: float, ratings: Sequence[float]) -> float:
    return min(rating for rating in ratings if rating >= least)


def pulled_up_gates(board: Board) -> tuple[int, ...]:
    """GPIOs of a board's gates that are pulled up through reset, in the channels' order."""
    pulled_up = CHIPS[board.electronics.chip].pulled_up
    return tuple(pin for pin in board.electronics.pwm_pins if pin in pulled_up)


def pull_down_ohm(board: Board) -> float:
    """Gate pull-down, Ω.

    A pull-up R_u and the pull-down R_d divide the pin's 3.3 V: R_d/(R_d + R_u) · 3.3 V must stay
    below the lowest threshold of a warm MOSFET, 0.5 V − 0.1 V, also where the pull-up is a third
    stronger than typical: R_d ≤ R_u V/(3.3 V − V) = 30 kΩ · 0.4/2.9 = 4.1 kΩ. The usual 10 kΩ
    would leave 0.60 V of a typical pull-up, above the lowest threshold. It will do where no gate's
    pin is pulled up. A board that names no pins may come to have any.
    """
    if board.electronics.pwm_pins and not pulled_up_gates(board):
        return LEAKY_PULL_DOWN_OHM
    most_v = GATE_LOW_V - GATE_WARM_V
    return preferred(STRONG_PULL_UP_OHM * most_v / (LOGIC_V - most_v), E6, down=True)


def wiring_values(board: Board) -> Values:
    """Work out a board's electrical values from its file; the formulas stand beside each.

    Returns
    -------
    Values
        SI units, ratings rounded up to what is made.
    """
    own = board.electronics
    volts, coil_a = own.supply_v, own.full_current_a
    full_a = len(board.actuators) * coil_a
    # The firmware keeps the mean of what is delivered, duty² of a coil's full current. A switch's
    # duty swings from nothing to twice its bias, a bridge's about nothing: the crest of its square
    # is three times the mean at most, in waves with straight flanks. All pulses begin together.
    mean_a = min(full_a * own.max_duty**2, own.supply_limit_ma * 1e-3)
    crest_a = min(full_a * own.max_duty**2, 3.0 * mean_a)
    regulator, logic_a = _logic_supply(volts)
    # Pulses of height I and duty d without their mean have an RMS of I √(d(1 − d)), which bends
    # down in d, so that the mean duty bounds it for every wave; and that is its RMS at most.
    duty = min(0.5, math.sqrt(mean_a / full_a))
    return Values(
        coil_a=coil_a,
        mean_a=mean_a,
        crest_a=crest_a,
        gate=_gate(board),
        switch_v=_rated(MARGIN * (volts + DIODE_V), SWITCH_VOLTS),
        # Also the diode's, whose mean is I d(1 − d), at most I/4: the coil's own mean is I d.
        switch_a=preferred(max(MARGIN * coil_a, LEAST_A), AMPERES),
        switch_ohm=ON_SHARE * own.coil_ohm,
        bulk_f=_bulk_f(board, full_a=full_a, crest_a=crest_a),
        bulk_v=_rated(CAPACITOR_MARGIN * volts, CAPACITOR_VOLTS),
        bulk_ripple_a=full_a * math.sqrt(duty * (1.0 - duty)),
        regulator=regulator,
        logic_a=logic_a,
        supply_a=preferred(crest_a + logic_a, SUPPLIES),
        # RMS heats a fuse. A current between 0 and its crest has RMS² ≤ mean · crest.
        fuse_a=preferred((math.sqrt(mean_a * crest_a) + logic_a) / FUSE_SHARE, FUSES),
        bus_ohm=_bus_ohm() if board.panel else None,
    )


def _gate(board: Board) -> Gate:
    """The resistors of a gate, and what of a MOSFET's gate goes with them.

    A gate that is not charged yet is a short: the pin's current is 3.3 V/R_g. Charging through
    R_g towards V, a gate passes its threshold after R_g C ln(V/(V − V_th)), and the shortest pulse
    of a wave must last so long.
    """
    series_ohm = preferred(LOGIC_V / PIN_A, E6)
    down_ohm = pull_down_ohm(board)
    is_pulled_up = bool(pulled_up_gates(board)) or not board.electronics.pwm_pins
    on_v = LOGIC_V * down_ohm / (down_ohm + series_ohm)
    charging = series_ohm * math.log(on_v / (on_v - GATE_HIGH_V))
    return Gate(
        series_ohm=series_ohm,
        pull_down_ohm=down_ohm,
        reset_v=LOGIC_V * down_ohm / (down_ohm + PULL_UP_OHM) if is_pulled_up else 0.0,
        on_v=on_v,
        input_f=board.electronics.min_on_ns * 1e-9 / charging,
    )


def _bulk_f(board: Board, *, full_a: float, crest_a: float) -> float:
    """Bulk capacitance, F: the larger of two needs, rounded up.

    Pulses of height I and duty d take the charge I d(1 − d) T ≤ I T/4 beyond their mean in a
    carrier period T, all channels at once: C = I T/(4 · 1 % of V). A drive that jumps (square and
    ramp waves) takes its crest until the supply follows: C = I t/(5 % of V).
    """
    own = board.electronics
    period_s = 2.0**own.pwm_bits / CLOCK_HZ
    carrier_f = full_a * period_s / 4.0 / (RIPPLE_SHARE * own.supply_v)
    jump_f = crest_a * SUPPLY_RESPONSE_S / (SAG_SHARE * own.supply_v)
    return preferred(max(carrier_f, jump_f), E3)


def _logic_supply(volts: float) -> tuple[str, float]:
    """How the ESP32's 3.3 V are made of the coils' supply, and what that draws from it, A.

    A linear regulator passes the current on and loses (V − 3.3 V) · 0.5 A; above 1 W a buck
    converter is due, which draws 3.3 V · 0.5 A/(0.85 V). Below 3.6 V there is too little for
    either.
    """
    if volts < LOGIC_V + DROPOUT_V:
        return "separate", 0.0
    if (volts - LOGIC_V) * RADIO_A <= LINEAR_W:
        return "linear", RADIO_A
    return "buck", LOGIC_V * RADIO_A / (BUCK_EFFICIENCY * volts)


def _bus_ohm() -> float:
    """I²C pull-up, Ω: t_r/(0.8473 C) at most, (3.3 V − 0.4 V)/3 mA at least (UM10204, 7.1)."""
    most, least = BUS_RISE_S / (0.8473 * BUS_F), (LOGIC_V - BUS_LOW_V) / BUS_SINK_A
    value = preferred(most, E6, down=True)
    assert value >= least
    return value
