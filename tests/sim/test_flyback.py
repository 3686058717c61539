"""A coil behind a diode: against a circuit simulator's table and small steps (see tests/spice)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.host.protocol.board_config import config_of
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.writing import board_file
from chladni.sim.coil.circuit import circuit_of, current_wave
from chladni.sim.coil.flyback import FlybackCircuit
from chladni.sim.coil.full_drive import least_duty
from conftest import ROOT, CommandLine

MEASURED = FlybackCircuit(10.08, 0.295e-3, 5.0, 0.25, 78_125.0)
SPICE_MA = {0.01: 0.56, 0.03: 2.3, 0.05: 6.1, 0.085: 20.5, 0.12: 37.1, 0.2: 77.0, 0.4: 179.7}
"""Simulated with a switch of 60 mΩ and a Schottky diode of 3 µA, 1.05 and 50 mΩ."""


def stepped(own: FlybackCircuit, duty: float, steps: int = 20_000) -> float:
    """The mean after the start has died away, by small steps of each state's own decay."""
    dt = 1.0 / own.carrier_hz / steps
    decay = np.exp(-dt * own.ohm / own.henry)
    current, total = 0.0, 0.0
    for period in range(40):
        total = 0.0
        for step in range(steps):
            drop = float(own.drop(np.array(current)))
            goal = own.supply_v if step < duty * steps else -drop
            following = max(0.0, goal / own.ohm + (current - goal / own.ohm) * decay)
            total += (current + following) / 2.0
            current = following
        del period
    return total / steps


@pytest.mark.parametrize("duty", [0.02, 0.07, 0.1, 0.5])
def test_the_mean_is_that_of_small_steps(duty: float) -> None:
    """After 40 periods of 0.44 time constants; a step is 4e-4 of one.

    The drop of the diode's mean current stands for that of every current. Where the current all but
    stops, a mean of logarithms is 0.3 below the logarithm of the mean: 8 mV, 0.8 mA of a diode that
    conducts for ever, and a sixth of that is left of it.
    """
    wanted = stepped(MEASURED, duty, 1_000)
    (found,) = MEASURED.mean_current(np.array([duty]))
    assert found == pytest.approx(wanted, rel=2e-3, abs=1.5e-4)


@pytest.mark.parametrize("duty", SPICE_MA)
def test_the_mean_is_the_circuit_simulator_s(duty: float) -> None:
    """Within 0.5 mA, a tenth of a percent of full current, or 0.5 %, the switch's 60 mΩ of 10 Ω."""
    (found,) = MEASURED.mean_current(np.array([duty])) * 1e3
    assert found == pytest.approx(SPICE_MA[duty], rel=0.005, abs=0.5)


def test_a_drop_is_that_of_a_schottky_diode() -> None:
    """Of 3 µA, 1.05 kT/e and 50 mΩ, by Shockley's law; none at any current where none is given."""
    ampere = np.array([1e-4, 5e-3, 0.2])
    wanted = 1.05 * 0.025865 * np.log1p(ampere / 3e-6) + 0.05 * ampere
    assert MEASURED.drop(ampere) == pytest.approx(wanted, abs=3e-3)
    assert not replace(MEASURED, diode_v=0.0).drop(ampere).any()


def test_both_regimes_meet_where_the_current_no_longer_stops() -> None:
    edge = MEASURED.continuous_from()
    # The drop at 6 mA is 0.21 V: 1 − ln((5 + 0.21)/(0.21 + 5 e^−0.437))/0.437.
    assert edge == pytest.approx(0.049, abs=0.002)
    below, above = MEASURED.mean_current(np.array([edge - 1e-6, edge + 1e-6]))
    assert below == pytest.approx(above, rel=1e-3)
    assert replace(MEASURED, diode_v=0.0).continuous_from() == 0.0
    # A coil without inductance has no current once the switch is off.
    bare = replace(MEASURED, henry=0.0)
    assert bare.continuous_from() == 1.0
    assert bare.mean_current(np.array([0.3]))[0] == pytest.approx(0.3 * 5.0 / 10.08)


def test_a_wave_above_the_edge_is_nearly_a_sine_and_one_below_is_not() -> None:
    """A drop that grows with the current leaves 1 %; one that is the same at any current nothing.

    From 4 to 12 % of duty 0.22 V grow to 0.27 V, of 0.4 V of amplitude.
    """
    wave = current_wave(MEASURED, 0.04, 0.09 + 0.04)
    assert wave.second == pytest.approx(0.008, abs=0.002)
    assert wave.gain == pytest.approx(0.96, abs=0.02)
    wave = current_wave(MEASURED, 0.04, 0.05)
    assert wave.gain < 0.7
    assert wave.second > 0.2
    ideal = current_wave(replace(MEASURED, diode_v=0.0), 0.3, 0.4)
    assert ideal.gain == pytest.approx(1.0)
    assert ideal.second < 1e-12


def test_a_board_says_from_where_on_its_coils_play_in_proportion(
    chladni: CommandLine, tmp_path: Path
) -> None:
    shown = chladni("board", "show", "quiet16", "--json").json["coil_current"]
    board = load_board("quiet16")
    own = circuit_of(board)
    assert own is not None
    assert shown["continuous_from_duty"] == pytest.approx(own.continuous_from())
    assert shown["least_duty"] == pytest.approx(least_duty(board))
    assert least_duty(board) >= own.continuous_from()
    assert shown["second_harmonic_at_tenth"] == pytest.approx(0.009, abs=0.002)
    assert abs(shown["level_db_at_tenth"]) < 1.0
    text = (ROOT / "boards" / "quiet16.toml").read_text("utf-8")
    path = tmp_path / "b.toml"
    kept = [line for line in text.splitlines() if not line.startswith("least_duty")]
    path.write_text("\n".join(kept), "utf-8")
    answer = chladni("board", "show", path, "--json")
    bent = answer.json["coil_current"]
    assert bent["least_duty"] < bent["continuous_from_duty"]
    assert bent["second_harmonic_at_tenth"] > 0.2
    assert bent["level_db_at_tenth"] < -3.0
    assert "set electronics.least_duty to 0.05" in answer.err


def test_no_floor_is_advised_for_a_coil_whose_current_stops_in_every_period(
    chladni: CommandLine, tmp_path: Path
) -> None:
    pad = load_board("pad16")
    assert pad.coil is not None
    path = tmp_path / "b.toml"
    bare = replace(pad, winding=None, coil=replace(pad.coil, inductance=0.0))
    path.write_bytes(board_file(bare))
    told = " ".join(chladni("board", "show", path).err.split())
    assert "set electronics.least_duty" not in told
    assert "no electronics.least_duty up to 0.5 helps; is coil.inductance_mh given?" in told


def test_a_diode_that_drops_more_than_the_supply_is_named(
    chladni: CommandLine, tmp_path: Path
) -> None:
    text = (ROOT / "boards" / "prototype.toml").read_text("utf-8")
    path = tmp_path / "b.toml"
    path.write_text(
        text.replace("diode_v = 0.0", "diode_v = 4.9").replace("supply_v = 5.0", "supply_v = 3.0"),
        "utf-8",
    )
    answer = chladni("board", "show", path)
    assert answer.code == 2
    assert "electronics.diode_v: expected less than supply_v" in answer.err


def test_a_floor_is_a_whole_number_of_steps(prototype: Board) -> None:
    board = replace(prototype, electronics=replace(prototype.electronics, least_duty=0.085))
    assert 0.085 <= least_duty(board) < 0.085 + 3.0 / 1024.0
    # The device gets it as its shortest pulse.
    assert config_of(board).values["min_on_ns"] == round(0.085 * 1024 / 80e6 * 1e9)
