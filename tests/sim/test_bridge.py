"""A coil in a bridge: its current by small steps, and the most that a drive may be given."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.felt import felt
from chladni.drives.scoring.warm_coils import warm
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.writing import board_file
from chladni.sim.coil.bridge import BridgeCircuit
from chladni.sim.coil.circuit import circuit_of, current_wave
from chladni.sim.coil.full_drive import full_drive, least_duty
from conftest import CommandLine, shipped_board
from wired_boards import SWITCHED, limits_used, with_bridges

CIRCUIT = BridgeCircuit(10.36, 5.0, 40e-9, 78_125.0)
DRIVE = np.array([1.0, 0.4j, -0.7, 0.0, 0.2])


def stepped(duty: float, henry: float, steps: int = 1_280) -> float:
    """The mean current after 60 periods: each state's own decay, 10 ns at a time."""
    dt, on = 1.0 / CIRCUIT.carrier_hz / steps, abs(duty) * steps - 4.0
    decay = np.exp(-dt * CIRCUIT.ohm / henry)
    current, total = 0.0, 0.0
    for _ in range(60):
        total = 0.0
        for step in range(steps):
            goal = np.sign(duty) * CIRCUIT.supply_v / CIRCUIT.ohm if step < on else 0.0
            following = goal + (current - goal) * decay
            total += (current + following) / 2.0
            current = following
    return total / steps


@pytest.mark.parametrize("henry", [0.1e-3, 0.6e-3])
@pytest.mark.parametrize("duty", [-0.9, -0.0625, 0.0025, 0.25])
def test_the_mean_current_is_that_of_small_steps(duty: float, henry: float) -> None:
    """0.04 % for the steps of a pulse's ends; what is shorter than the loss moves nothing."""
    (found,) = CIRCUIT.mean_current(np.array([duty]))
    assert found == pytest.approx(stepped(duty, henry), abs=2e-4 * CIRCUIT.current_per_duty)
    assert found == pytest.approx(
        np.sign(duty) * max(abs(duty) - 0.003125, 0.0) * 5.0 / 10.36, abs=1e-12
    )


def test_a_pulse_without_an_end_loses_nothing() -> None:
    assert CIRCUIT.mean_current(np.array([-1.0, 1.0])) == pytest.approx([-5.0 / 10.36, 5.0 / 10.36])


def test_a_bridge_has_no_second_harmonic_and_a_third_of_what_it_loses() -> None:
    """A dead zone of δ each way takes 4δ/πa of a sine and leaves a third of that as harmonic."""
    wave = current_wave(CIRCUIT, 0.1, 0.0)
    lost = 4.0 * 0.003125 / (np.pi * 0.1)
    assert wave.gain == pytest.approx(1.0 - lost, abs=1e-3)
    assert wave.third == pytest.approx(lost / 3.0, rel=0.1)
    assert wave.second < 1e-12
    perfect = current_wave(dataclasses.replace(CIRCUIT, lost_s=0.0), 0.1, 0.0)
    assert perfect.third < 1e-12


@pytest.mark.parametrize(
    ("limits", "limited_by"),
    [
        ({}, "duty"),
        ({"max_duty": 0.5}, "duty"),
        ({"supply_limit_ma": 150.0}, "supply"),
        ({"coil_limit_k": 15.0}, "heat"),
        ({"coil_limit_k": 15.0, "bridge_ohm": 2.0}, "heat"),
    ],
)
def test_full_drive_keeps_every_limit_of_a_bridge_and_uses_one_up(
    prototype: Board, limits: dict[str, Any], limited_by: str
) -> None:
    """Over whole waves of the duty: what the supply delivers in pulses, what heats the winding."""
    board = with_bridges(prototype, **({"coil_k_per_w": 30.0} | limits))
    own = board.electronics
    full = full_drive(board, DRIVE, 160.0)
    assert full is not None
    assert full.limited_by == limited_by
    amplitude = full.duties
    duty = amplitude[:, None] * np.sin(2.0 * np.pi * np.arange(1000) / 1000.0)
    used = limits_used(own, duty, own.coil_ohm + own.bridge_ohm, crests=2)
    # The amplitude leaves three steps of 1024 of the duty.
    assert used[limited_by] == pytest.approx(1.0, abs=0.01)
    assert max(used.values()) < 1.0 + 1e-9
    assert full.duties.max() <= 1.0 - 3.0 / 1024.0
    assert not full.bias.any()
    assert not full.bias_newtons.any()
    inductive = 2.0 * np.pi * 160.0 * 0.6e-3
    assert full.amperes == pytest.approx(
        full.duties.max() * own.supply_v / np.hypot(15.0 + own.bridge_ohm, inductive), rel=1e-4
    )


@pytest.mark.parametrize(
    ("limits", "more_db"),
    [
        # √(1.5/0.5) = 4.77 dB, and 2 = 6.02 dB; a switch's rest and diode aside, and less what the
        # bridge's own 0.28 Ω of 15.28 Ω take: 0.16 dB of force; of heat at the winding none.
        ({"coil_limit_k": 10.0}, 4.77),
        ({}, 6.02 - 0.16),
    ],
)
def test_a_bridge_moves_so_much_more(
    prototype: Board, limits: dict[str, Any], more_db: float
) -> None:
    cool = {"coil_k_per_w": 30.0} | limits
    switch = dataclasses.replace(
        prototype, electronics=dataclasses.replace(prototype.electronics, min_on_ns=0.0, **cool)
    )
    one, other = (
        full_drive(own, DRIVE, 160.0) for own in (switch, with_bridges(prototype, **cool))
    )
    assert one is not None
    assert other is not None
    assert other.limited_by == one.limited_by
    # Steps of rounding: a rest of 2 of 1024 under a switch's wave, 3 steps of half a scale.
    assert 20.0 * np.log10(other.newtons / one.newtons) == pytest.approx(more_db, abs=0.1)


def test_the_lowest_duty_of_a_bridge_is_none(prototype: Board) -> None:
    assert least_duty(with_bridges(prototype)) == 0.0
    assert least_duty(prototype) > 0.0


def test_a_board_s_circuit_is_its_drivers(prototype: Board) -> None:
    circuit = circuit_of(with_bridges(prototype, lost_ns=62.5, bridge_ohm=0.5))
    assert isinstance(circuit, BridgeCircuit)
    assert (circuit.ohm, circuit.supply_v, circuit.carrier_hz) == (15.5, 5.0, 78_125.0)
    assert circuit.lost_s == pytest.approx(62.5e-9)


def test_warm_coils_heat_by_their_own_share() -> None:
    """A mean square of a²/2, of which the bridge's resistance takes its part."""
    board = with_bridges(load_board(SWITCHED / "strip5.toml"), bridge_ohm=1.0)
    found, full = warm(board, DRIVE), full_drive(board, DRIVE, 160.0)
    assert found is not None
    assert full is not None
    own = board.electronics
    current = full.duties * own.supply_v / (own.coil_ohm + 1.0) / np.sqrt(2.0)
    cold = current**2 * own.coil_ohm
    assert found.rise_k * (1.0 + 3.93e-3 * found.rise_k) == pytest.approx(own.coil_k_per_w * cold)
    assert full.limited_by == "heat"
    assert own.coil_k_per_w * cold.max() == pytest.approx(own.coil_limit_k)


def test_no_bias_holds_a_finger_down() -> None:
    switch = load_board(SWITCHED / "strip5.toml")
    drive = np.ones(len(switch.actuators), complex)
    rows = []
    for board in (switch, with_bridges(switch)):
        (problem,) = solved_board(board).problems([(0.0, 0.0)])
        rows.append(felt(problem, drive))
    assert rows[0].static_um is not None
    assert rows[0].static_um > 0.0
    assert rows[1].static_um is None


def test_tables_of_focus_know_a_bridge_from_a_switch_and_others_do_not() -> None:
    board = load_board(SWITCHED / "strip5.toml")
    plain = dataclasses.replace(
        board, electronics=dataclasses.replace(board.electronics, least_duty=0.0, min_on_ns=0.0)
    )
    bridged, wider = with_bridges(plain), with_bridges(plain, bridge_ohm=0.5)
    prints = [own.fingerprint("focus") for own in (plain, bridged, wider)]
    assert len(set(prints)) == 3
    assert len({own.fingerprint("ssim") for own in (plain, bridged, wider)}) == 1
    assert with_bridges(plain, lost_ns=10.0).fingerprint() == bridged.fingerprint()


def test_board_show_tells_of_a_bridge_and_of_no_diode(chladni: CommandLine, tmp_path: Any) -> None:
    path = tmp_path / "b.toml"
    path.write_bytes(board_file(with_bridges(load_board(SWITCHED / "strip5.toml"))))
    answer = chladni("board", "show", path, "--json")
    told = answer.json["coil_current"]
    assert told.keys() == {
        "lost_duty",
        "given_back_duty",
        "level_db_at_tenth",
        "third_harmonic_at_tenth",
    }
    assert told["lost_duty"] == pytest.approx(0.003125)
    # Three of the 3.2 steps come back. The rest takes 4δ/πa of a sine and leaves a third of that.
    assert told["given_back_duty"] == 3 / 1024
    left = 4.0 * (0.003125 - 3 / 1024) / (np.pi * 0.1)
    assert told["level_db_at_tenth"] == pytest.approx(20.0 * np.log10(1.0 - left), abs=0.02)
    assert told["third_harmonic_at_tenth"] == pytest.approx(left / 3.0, rel=0.1)
    text = chladni("board", "show", path)
    assert "diode" not in text.err + text.out
    assert "bridge" in text.out


@pytest.mark.parametrize("name", ["strip5", "quiet5"])
def test_shipped_strips_move_half_as_much_again_as_with_switches(name: str) -> None:
    """At least 4.5 dB more under a finger, by the same heat in the loudest coil."""
    solved = solved_board(shipped_board(name))
    (problem,) = solved.problems([(0.0, 6.0)])
    switched = load_board(SWITCHED / f"{name}.toml")
    assert solved.board.electronics.is_bridge
    assert not switched.electronics.is_bridge
    drive = np.array([0.1, -0.3, 0.5j, 1.0, -0.4])
    one, other = (full_drive(own, drive, 160.0) for own in (switched, solved.board))
    assert one is not None
    assert other is not None
    assert one.limited_by == other.limited_by == "heat"
    assert 20.0 * np.log10(other.newtons / one.newtons) > 4.5
    assert felt(problem, drive).finger_um == pytest.approx(
        felt(problem, drive).um_per_newton * other.newtons
    )
