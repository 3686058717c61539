"""Readings of coils that were stopped, or were not asked for in time, and go on."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calibration.small_board import small_board
from chladni.calibration import fit_board, hidden_plate
from chladni.calibration.device_readings import REFERENCE, without_reference
from chladni.calibration.fit import BoardFit
from chladni.calibration.flux import motion_of
from chladni.calibration.readings_file import load_readings
from chladni.calibration.sensing import CoilReadings
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.measuring import coil_readings
from chladni.host.measuring.begun import Begun, begun_file, load_begun
from chladni.host.measuring.coil_readings import read_coils
from chladni.sim.board.board import Board
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError
from conftest import CommandLine

AWAY_S = 1.0
"""After 0.8 s without a request a device stops listening."""
SEED = 4
"""Of a plate with a reversed coil."""


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


def device_on(board: Board) -> Device:
    return Device(EmulatorWire(emulator_on(board, hidden_plate(board, SEED))))


@pytest.fixture(scope="module")
def whole(board: Board) -> CoilReadings:
    with device_on(board) as device:
        return read_coils(device, board)


def check_same(board: Board, found: BoardFit, whole: CoilReadings) -> None:
    """The fit leaves noise alone, and finds what that of one session finds."""
    own = fit_board(board, whole)
    assert found.left < 1.5
    assert found.wiring.signs.tolist() == own.wiring.signs.tolist()
    # As far as forces are told on one of these plates: 1 to 3 %.
    assert found.strengths == pytest.approx(own.strengths, abs=0.03)
    told, expected = (next(p for p in one.parameters if p.name == "foam") for one in (found, own))
    assert told.value == pytest.approx(expected.value, rel=0.05)


def test_a_reading_goes_on_where_it_was_stopped(
    board: Board, whole: CoilReadings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a device that was switched off between, which counts its sessions from 1 again."""
    path, count = tmp_path / "r.json", len(board.actuators)

    def stop(done: int, _: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    def keep(found: Begun) -> None:
        path.write_bytes(begun_file(found, board))

    with pytest.raises(KeyboardInterrupt), device_on(board) as device:
        read_coils(device, board, stop, keep=keep)
    begun = load_begun(path, board)
    assert begun.coils == 3
    assert {one.session for one in begun.heard} == {-1}
    asked: list[int] = []
    sense = coil_readings.sense

    def counted(device: Device, **given: int) -> Any:
        asked.append(given["playing"])
        return sense(device, **given)

    monkeypatch.setattr(coil_readings, "sense", counted)
    with device_on(board) as device:
        readings = read_coils(device, board, begun=begun)
    # All that is missing, and the first coil for the reference of this session.
    assert set(asked) == {0, *range(3, count)}
    assert len(np.unique(readings.sessions)) == len(np.unique(readings.high.sessions)) == 2
    assert whole.seconds < readings.seconds < 1.4 * whole.seconds
    check_same(board, fit_board(board, readings), whole)


def test_a_host_that_was_away_for_a_moment_reads_one_coil_more(
    board: Board, whole: CoilReadings
) -> None:
    done: list[int] = []
    with device_on(board) as device:

        def rest(coil: int, _: int) -> None:
            if coil == 2:
                device.link.wait(AWAY_S)
            done.append(coil)

        readings = read_coils(device, board, rest)
    assert done == list(range(1, len(board.actuators) + 1))
    assert len(np.unique(readings.sessions)) == 2
    check_same(board, fit_board(board, readings), whole)


def test_sessions_without_a_reference_are_known(board: Board) -> None:
    with device_on(board) as device:
        heard = coil_readings.sense(
            device, playing=0, multiple=4, level_q15=20_000, settle_ms=10, readings=2
        )
    assert heard is not None
    assert without_reference(heard) == []
    others = [own for own in heard if own.listening != REFERENCE]
    assert without_reference(others) == [(0, 4)]
    later = [dataclasses.replace(own, playing=1, session=9) for own in others]
    assert without_reference(heard + later) == [(1, 4)]


def test_what_was_begun_is_of_one_board_and_whole(board: Board, tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    assert load_begun(path, board) == Begun()
    path.write_bytes(begun_file(Begun(seconds=2.0), board))
    assert load_begun(path, board).seconds == 2.0
    with pytest.raises(InputError, match="readings that were begun"):
        load_readings(path, board)
    thick = dataclasses.replace(board, plate=dataclasses.replace(board.plate, thickness=0.5e-3))
    with pytest.raises(InputError, match="readings of small that were begun"):
        load_begun(path, thick)
    found = json.loads(path.read_text())
    wrongs: list[dict[str, Any]] = [{"heard": [{}]}, {"levels": [[1]]}, {"seconds": "x"}]
    for wrong in wrongs:
        path.write_text(json.dumps(found | wrong))
        with pytest.raises(InputError, match="remove it, and all coils are read"):
            load_begun(path, board)


def test_calibrate_goes_on(
    chladni: CommandLine, board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn, kept, output = (tmp_path / own for own in ("small.toml", "r.json", "o.toml"))
    drawn.write_bytes(board_file(board))
    plate = ("--board", drawn, "--emulator", "--hidden", str(SEED))
    words = ("calibrate", *plate, "-o", output, "--readings", kept, "--sets", "6", "--json")
    sense = coil_readings.sense

    def stopped(device: Device, **given: int) -> Any:
        if given["playing"] == 2:
            raise KeyboardInterrupt
        return sense(device, **given)

    monkeypatch.setattr(coil_readings, "sense", stopped)
    assert chladni(*words).code == 130
    assert not output.exists()
    monkeypatch.setattr(coil_readings, "sense", sense)
    done = chladni(*words)
    assert done.code == 0, done.err
    assert f"goes on from {kept}: 2 of 6 coils are read" in done.err
    assert json.loads(kept.read_text())["kind"] == "chladni coil readings"
    before, after = (done.json[key]["fingers_2_db"]["median"] for key in ("before", "after"))
    assert after > before + 6.0


def test_the_carrier_is_seen_at_a_moment_of_each_session(board: Board, whole: CoilReadings) -> None:
    """One number of all pairs that were read in one, whatever the sum of both patterns is."""
    signs = np.ones(len(board.actuators))
    one = motion_of(board, whole, signs).carrier
    sessions = np.tile(np.arange(len(signs)) >= 3, (len(whole.frequencies_hz), 1)).astype(float)
    high = dataclasses.replace(whole.high, sessions=sessions[0])
    two = motion_of(board, dataclasses.replace(whole, sessions=sessions, high=high), signs).carrier
    assert len(two) == 2 * len(one)
    assert two.sum(axis=0) == pytest.approx(one.sum(axis=0))
    for pattern in two:
        played = np.any(pattern != 0.0, axis=(0, 1))
        assert not played[:3].any() or not played[3:].any()
