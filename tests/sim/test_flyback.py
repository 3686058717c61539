"""A coil behind a diode: against a circuit simulator's table, a time-stepped one, and ngspice."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.host.protocol.config import config_of
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.coil.flyback import FlybackCircuit, circuit_of
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
            goal = own.supply_v if step < duty * steps else -own.diode_v
            following = max(0.0, goal / own.ohm + (current - goal / own.ohm) * decay)
            total += (current + following) / 2.0
            current = following
        del period
    return total / steps


@pytest.mark.parametrize("duty", [0.02, 0.07, 0.1, 0.5])
def test_the_mean_is_that_of_small_steps(duty: float) -> None:
    """After 40 periods of 0.44 time constants; a step is 2e-5 of one."""
    wanted = stepped(MEASURED, duty, 2_000)
    (found,) = MEASURED.mean_current(np.array([duty]))
    assert found == pytest.approx(wanted, rel=2e-3)


@pytest.mark.parametrize("duty", SPICE_MA)
def test_the_mean_is_the_circuit_simulator_s(duty: float) -> None:
    """Within 1.8 mA, 0.4 % of full current, or 8 %: a Schottky's drop grows with its current.

    From 5 to 200 mA it goes from 0.20 to 0.31 V, where one of 0.25 V stands for it.
    """
    (found,) = MEASURED.mean_current(np.array([duty])) * 1e3
    assert found == pytest.approx(SPICE_MA[duty], rel=0.08, abs=1.8)


def test_both_regimes_meet_where_the_current_no_longer_stops() -> None:
    edge = MEASURED.continuous_from()
    assert edge == pytest.approx(0.060, abs=0.002)
    below, above = MEASURED.mean_current(np.array([edge - 1e-9, edge + 1e-9]))
    assert below == pytest.approx(above, rel=1e-6)
    assert replace(MEASURED, diode_v=0.0).continuous_from() == 0.0
    # A coil without inductance has no current once the switch is off.
    bare = replace(MEASURED, henry=0.0)
    assert bare.continuous_from() == 1.0
    assert bare.mean_current(np.array([0.3]))[0] == pytest.approx(0.3 * 5.0 / 10.08)


def test_a_wave_above_the_edge_is_a_sine_and_one_below_is_not() -> None:
    edge = MEASURED.continuous_from()
    gain, second = MEASURED.wave(0.04, edge)
    assert gain == pytest.approx(1.0 + 0.25 / 5.0, rel=1e-9)
    assert second < 1e-9
    gain, second = MEASURED.wave(0.04, 0.01)
    assert gain < 0.7
    assert second > 0.2


@pytest.mark.skipif(shutil.which("ngspice") is None, reason="ngspice is not installed")
def test_ngspice_draws_the_same(tmp_path: Path) -> None:
    """A nearly constant drop in place of a diode: the closed form is exact but for the switch."""
    circuit = tmp_path / "coil.cir"
    for duty in (0.04, 0.3):
        circuit.write_text(
            f"""coil
Vs s 0 5
R1 s a 10.08
L1 a b 0.295m
S1 b 0 g 0 sw
.model sw SW(Ron=1m Roff=100Meg Vt=0.5)
Vg g 0 PULSE(0 1 0 1n 1n {duty * 12.8e-6:g} 12.8u)
D1 b c dd
Vd c s 0.245
.model dd D(IS=1e-9 N=0.01)
.tran 10n 1.6m 0.8m 10n
.meas tran mean AVG i(L1) from=0.8m to=1.6m
.end
""",
            "utf-8",
        )
        run = subprocess.run(
            ["ngspice", "-b", str(circuit)], capture_output=True, text=True, check=False
        )
        (line,) = [line for line in run.stdout.splitlines() if line.startswith("mean ")]
        found = float(line.split("=")[1].split()[0])
        assert MEASURED.mean_current(np.array([duty]))[0] == pytest.approx(found, rel=0.03)


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
    assert shown["second_harmonic_at_tenth"] < 1e-9
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
    assert "set electronics.least_duty to 0.06" in answer.err


def test_a_diode_that_drops_more_than_the_supply_is_named(
    chladni: CommandLine, tmp_path: Path
) -> None:
    text = (ROOT / "boards" / "prototype.toml").read_text("utf-8")
    path = tmp_path / "b.toml"
    path.write_text(text.replace("diode_v = 0.0", "diode_v = 4.9")
                    .replace("supply_v = 5.0", "supply_v = 3.0"), "utf-8")  # fmt: skip
    answer = chladni("board", "show", path)
    assert answer.code == 2
    assert "electronics.diode_v: expected less than supply_v" in answer.err


def test_a_floor_is_a_whole_number_of_steps(prototype: Board) -> None:
    board = replace(prototype, electronics=replace(prototype.electronics, least_duty=0.085))
    assert 0.085 <= least_duty(board) < 0.085 + 3.0 / 1024.0
    # The device gets it as its shortest pulse.
    assert config_of(board).values["min_on_ns"] == round(0.085 * 1024 / 80e6 * 1e9)
