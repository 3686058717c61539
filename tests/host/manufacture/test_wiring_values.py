"""The parts of a board's wiring, against hand calculations and circuits solved apart."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from chladni.host.manufacture.wiring.part import Part
from chladni.host.manufacture.wiring.parts import engineering, parts_list
from chladni.host.manufacture.wiring.values import pull_down_ohm, wiring_values
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import PANEL_KINDS, PanelKind
from chladni.sim.board.file import load_board
from wired_boards import SWITCHED, board_with, with_bridges


def part_of(board: Board, name: str) -> Part:
    (own,) = (part for part in parts_list(board) if part.part == name)
    return own


def test_values_of_prototype_are_those_of_a_hand_calculation(prototype: Board) -> None:
    """5 V, 15 Ω, five coils, 1 A, 78,125 Hz, 100 ns, GPIO 15 pulled up."""
    own = wiring_values(prototype)
    assert own.coil_a == pytest.approx(0.33333, abs=1e-4)
    assert own.mean_a == pytest.approx(1.0)  # the limit; 5 · 0.333 A would be more
    assert own.crest_a == pytest.approx(1.66667, abs=1e-4)
    assert own.gate.series_ohm == 100.0  # 3.3 V/40 mA = 82.5 Ω
    assert own.gate.pull_down_ohm == 3300.0
    assert own.gate.reset_v == pytest.approx(0.2255, abs=1e-4)  # 3.3 · 3.3/48.3
    assert own.gate.on_v == pytest.approx(3.2029, abs=1e-4)  # 3.3 · 3.3/3.4
    assert (own.switch_v, own.switch_a) == (20.0, 1.0)  # from 11 V and 0.67 A
    assert own.switch_ohm == pytest.approx(0.3)
    # Carrier: 1.667 A · 12.8 µs/4/50 mV = 107 µF. Jump: 1.667 A · 50 µs/0.25 V = 333 µF.
    assert (own.bulk_f, own.bulk_v) == (470e-6, 10.0)  # from 333 µF and 7.5 V
    assert own.bulk_ripple_a == pytest.approx(0.8333, abs=1e-4)  # 1.667 A · √(1/4)
    assert (own.regulator, own.logic_a) == ("linear", 0.5)  # 1.7 V · 0.5 A = 0.85 W
    assert own.supply_a == 2.5  # from 1.667 + 0.5
    assert own.fuse_a == 2.5  # from (√1.667 + 0.5)/0.75 = 2.388
    assert own.bus_ohm == 3300.0  # 300 ns/84.73 pF = 3541 Ω


def test_values_of_a_stronger_board_are_those_of_a_hand_calculation(prototype: Board) -> None:
    """12 V, 5 Ω, two coils on GPIO 2 and 4, 3 A, 12 bits (19,531 Hz)."""
    board = board_with(prototype, 2, supply_v=12.0, coil_ohm=5.0, supply_limit_ma=3000.0)
    board = replace(board, panel=None, electronics=replace(board.electronics, pwm_bits=12))
    own = wiring_values(board)
    assert (own.coil_a, own.mean_a, own.crest_a) == pytest.approx((2.4, 3.0, 4.8))
    assert (own.gate.pull_down_ohm, own.gate.reset_v) == (10e3, 0.0)
    assert (own.switch_v, own.switch_a) == (30.0, 5.0)  # from 25 V and 4.8 A
    assert own.switch_ohm == pytest.approx(0.1)
    # Carrier: 4.8 A · 51.2 µs/4/0.12 V = 512 µF. Jump: 4.8 A · 50 µs/0.6 V = 400 µF.
    assert (own.bulk_f, own.bulk_v) == (1e-3, 25.0)  # from 512 µF and 18 V
    assert own.bulk_ripple_a == pytest.approx(2.4)
    assert own.regulator == "buck"  # 8.7 V · 0.5 A = 4.35 W
    assert own.logic_a == pytest.approx(0.16176, abs=1e-4)  # 1.65 W/0.85/12 V
    assert own.supply_a == 5.0  # from 4.96
    assert own.fuse_a == 6.3  # from (√14.4 + 0.162)/0.75 = 5.28
    assert own.bus_ohm is None


def test_a_quiet_board_with_many_coils_needs_no_more_than_its_limit(prototype: Board) -> None:
    """Sixteen coils could draw 5.3 A; the mean of 1 A allows for a crest of 3 A."""
    own = wiring_values(board_with(prototype, 16))
    assert (own.mean_a, own.crest_a) == pytest.approx((1.0, 3.0))
    assert own.supply_a == 4.0
    # 5.333 · √(0.433 · 0.567), 0.433 being √0.1875
    assert own.bulk_ripple_a == pytest.approx(2.6426, abs=1e-3)
    half = wiring_values(board_with(prototype, 2, max_duty=0.5))
    assert (half.mean_a, half.crest_a) == pytest.approx((0.1667, 0.1667), abs=1e-3)


def test_a_supply_below_a_regulators_drop_leaves_the_chip_its_own(prototype: Board) -> None:
    board = board_with(prototype, 2, supply_v=3.0)
    own = wiring_values(board)
    assert (own.regulator, own.logic_a) == ("separate", 0.0)
    assert "of its own" in part_of(board, "3.3 V regulator").value


@pytest.mark.parametrize(
    ("pins", "ohm"),
    [((2, 4), 10e3), ((2, 5), 3300.0), ((14, 4), 3300.0), ((15, 4), 3300.0), ((), 3300.0)],
)
def test_the_pull_down_is_the_largest_that_holds_a_gate_low(
    prototype: Board, pins: tuple[int, ...], ohm: float
) -> None:
    board = board_with(prototype, 2)
    board = replace(board, electronics=replace(board.electronics, pwm_pins=pins))
    assert pull_down_ohm(board) == ohm


def test_ten_kilohms_would_not_do_beside_a_pull_up() -> None:
    """A divider's nodal equation, solved apart: (3.3 − v)/R_u = v/R_d, against 0.4 V when warm."""

    def at_gate(up: float, down: float) -> float:
        return float(np.linalg.solve([[1 / up + 1 / down]], [3.3 / up])[0])

    assert at_gate(45e3, 10e3) == pytest.approx(0.6, abs=1e-9)  # above 0.5 V
    assert at_gate(30e3, 4700.0) > 0.4 > at_gate(30e3, 3300.0)


def test_the_largest_gate_is_on_within_the_shortest_pulse(prototype: Board) -> None:
    """The charging of R and C, stepped through: 1.5 V after min_on_ns, within the step's error."""
    gate = wiring_values(prototype).gate
    volts, steps = 0.0, 100_000
    for _ in range(steps):
        current = (3.3 - volts) / gate.series_ohm - volts / gate.pull_down_ohm
        volts += current * 100e-9 / steps / gate.input_f
    # The pull-down takes part in the charging here, which the formula leaves out: 3 % of the time.
    assert volts == pytest.approx(1.5, rel=0.03)


def test_a_ripple_of_pulses_is_below_what_the_capacitor_is_for(prototype: Board) -> None:
    """Pulses of five coils drawn through the capacitor alone, at every duty."""
    own = wiring_values(prototype)
    time = np.linspace(0.0, 12.8e-6, 4001)
    for duty in np.linspace(0.02, 0.98, 49):
        current = np.where(time < duty * 12.8e-6, 5.0 * own.coil_a, 0.0)
        charge = np.cumsum(current - current.mean()) * (time[1] - time[0])
        assert np.ptp(charge) / own.bulk_f < 0.01 * 5.0
        assert current.std() < own.bulk_ripple_a * 1.001


def test_every_board_that_may_be_has_parts(prototype: Board) -> None:
    extremes = itertools.product((0.5, 48.0), (0.5, 1e4), (1.0, 20000.0), (0.0, 5000.0))
    for volts, ohm, limit, on in extremes:
        board = board_with(
            prototype, 16, supply_v=volts, coil_ohm=ohm, supply_limit_ma=limit, min_on_ns=on
        )
        own = wiring_values(board)
        assert own.switch_v >= 2.0 * volts
        assert own.switch_a >= 2.0 * volts / ohm
        assert own.supply_a >= own.crest_a + own.logic_a
        assert own.fuse_a > own.mean_a + own.logic_a
        assert len(parts_list(board)) == 14
        assert ("no time" in part_of(board, "N-MOSFET, logic level").why) == (on == 0.0)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(3300.0, "Ω", "3.3 kΩ"), (100.0, "Ω", "100 Ω"), (470e-6, "F", "470 µF"), (1e-3, "F", "1 mF"),
     (1.583e-9, "F", "1.58 nF"), (78125.0, "Hz", "78.1 kHz"), (0.0, "A", "0 A"),
     (1.0 / 3.0, "A", "333 mA"), (2e7, "Hz", "20 MHz")],
)  # fmt: skip
def test_values_are_written_as_engineers_write_them(value: float, unit: str, text: str) -> None:
    assert engineering(value, unit) == text


def test_parts_are_counted_by_channel(prototype: Board) -> None:
    counts = {part.part: part.count for part in parts_list(board_with(prototype, 7))}
    for part in (
        "coil",
        "N-MOSFET, logic level",
        "flyback diode, Schottky",
        "gate resistor",
        "gate pull-down",
    ):
        assert counts[part] == 7
    assert counts["supply"] == counts["ESP32 module"] == 1
    assert counts["bus pull-up"] == 2


@pytest.mark.parametrize("controller", PANEL_KINDS)
def test_the_panel_is_named_as_its_maker_does(prototype: Board, controller: PanelKind) -> None:
    assert prototype.panel is not None
    board = replace(prototype, panel=replace(prototype.panel, controller=controller))
    named = {"find": "FT6x36 or GT911", "ft6x36": "FT6x36", "gt911": "GT911"}
    assert part_of(board, "touch panel").value == f"{named[controller]}, 71.5 × 146.7 mm"


def test_a_module_with_psram_is_ruled_out_where_its_pins_are_gates(prototype: Board) -> None:
    assert "GPIO 16 and 17" in part_of(prototype, "ESP32 module").why
    assert "any" in part_of(board_with(prototype, 2), "ESP32 module").why


def test_the_coil_of_the_page_has_the_resistance_it_says(prototype: Board) -> None:
    """150 turns of 0.1 mm copper on 15 mm: 7.07 m over 0.00785 mm²."""
    ohm = 1.68e-8 * 150 * math.pi * 15e-3 / (math.pi / 4 * (0.1e-3) ** 2)
    assert ohm == pytest.approx(15.12, abs=0.01)
    assert ohm == pytest.approx(prototype.electronics.coil_ohm, rel=0.01)


def test_bridges_are_bought_by_name_where_they_bear_it(prototype: Board) -> None:
    """Ratings of the data sheets: 1.8 A and 11 V, 1.5 A and 11 V; twice a coil's current counts."""
    both = part_of(with_bridges(prototype), "full bridge, PH/EN")
    assert both.count == 5
    assert "DRV8838 or half a DRV8835, its MODE high" in both.value
    assert "SLVSBA4: 1.8 A, up to 11 V, 280 mΩ" in both.why
    assert "SLVSB18: 1.5 A, up to 11 V, 305 mΩ" in both.why
    assert "no IN/IN kind (DRV8833)" in both.why
    for changes in ({"supply_v": 12.0}, {"coil_ohm": 4.0}):
        board = with_bridges(replace(prototype, coil=None), **changes)
        none = part_of(board, "full bridge, PH/EN")
        assert "none is known here" in none.value
        assert "SLVS" not in none.why


def test_parts_of_a_bridge_board_have_no_switches(prototype: Board) -> None:
    names = {part.part for part in parts_list(with_bridges(prototype))}
    switch = {"N-MOSFET, logic level", "flyback diode, Schottky", "gate resistor", "gate pull-down"}
    assert not names & switch
    assert {"coil", "EN pull-down", "bridge capacitor, ceramic"} <= names


def test_enable_is_pulled_low_as_a_gate_is(prototype: Board) -> None:
    """A bridge's 100 kΩ against 45 kΩ leave 2.28 V, which is high to any logic."""
    wired = with_bridges(prototype, pwm_pins=(2, 4, 15, 16, 17), sign_pins=(18, 19, 23, 25, 26))
    part = part_of(wired, "EN pull-down")
    assert part.value == "3.3 kΩ"
    assert "100 kΩ would leave 2.3 V" in part.why
    plain = with_bridges(prototype, pwm_pins=(2, 4, 13, 16, 17), sign_pins=(18, 19, 23, 25, 26))
    assert part_of(plain, "EN pull-down").value == "10 kΩ"
    # A sign on a pin that is pulled up moves nothing, and needs none.
    signs = with_bridges(prototype, pwm_pins=(2, 4, 13, 16, 17), sign_pins=(5, 14, 15, 18, 19))
    assert part_of(signs, "EN pull-down").value == "10 kΩ"


def test_a_bridge_draws_less_by_its_own_resistance() -> None:
    """5 V over 13.10 Ω and 0.28 Ω, five coils: 1.869 A at the crest; a switch's 1.908 A."""
    board = load_board(SWITCHED / "strip5.toml")
    one, other = wiring_values(board), wiring_values(with_bridges(board))
    assert one.coil_a == pytest.approx(5.0 / board.electronics.coil_ohm)
    assert other.coil_a == pytest.approx(5.0 / (board.electronics.coil_ohm + 0.28))
    assert other.crest_a == pytest.approx(5.0 * other.coil_a)


def test_a_sign_on_a_pin_of_the_psram_rules_it_out(prototype: Board) -> None:
    board = with_bridges(prototype, pwm_pins=(2, 4, 13, 32, 33), sign_pins=(16, 18, 19, 23, 25))
    assert "GPIO 16 must be free" in part_of(board, "ESP32 module").why
