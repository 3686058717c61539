"""An effect under each of two fingers at once, and effects under many pairs of fingers."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.effects import shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.cli.effects.presses import of_effects
from chladni.host.cli.effects.setup import Setup
from chladni.host.emulation import over_frequency as solving
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.emulation.felt_over_time import forces_of
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.played_effect import play_effect
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.tables.format import pack
from chladni.tables.several_fingers.build_for import build_for
from chladni.tables.table import Table
from conftest import CommandLine, made_once
from wired_boards import SWITCHED

HERE, THERE = (0.0, 15.0), (0.0, -12.0)


@pytest.fixture(scope="module")
def board() -> Board:
    return load_board("strip5")


@pytest.fixture(scope="module")
def table(board: Board, tmp_path_factory: pytest.TempPathFactory) -> Table:
    return made_once(tmp_path_factory, "strip5-responses", lambda: build_for(board, "fingers")[0])


def test_effects_of_two_fingers_add_up_on_the_pins(table: Table, board: Board) -> None:
    """With drives of both, what coils get of both effects is the sum of what they get of each."""
    signals = [shipped_effects()[name].samples(SIGNAL_HZ) for name in ("click", "thud")]

    def newtons(plays: Sequence[bool]) -> NDArray[np.float64]:
        emulator = Emulator(board, table, level=1.0)
        for slot, place in enumerate((HERE, THERE)):
            emulator.core.set_signal_voice(slot, 32767)
            emulator.touch(TouchEvent(1.0, place, slot))
        emulator.run(40.0)
        for slot, is_playing in enumerate(plays):
            words = [round(32767.0 * float(one)) for one in signals[slot]]
            emulator.core.push_signal(slot, words if is_playing else [])
        return forces_of(board, emulator.run(60.0))

    both, click, thud = newtons((True, True)), newtons((True, False)), newtons((False, True))
    least = min(np.abs(click).max(), np.abs(thud).max())
    assert least > 0.5 * np.abs(both).max()
    # Duties are rounded, and the smallest are lost to a bridge.
    assert np.abs(both - click - thud).max() < 0.02 * least


def test_the_command_plays_an_effect_under_each_finger(
    chladni: CommandLine, table: Table, tmp_path: Path
) -> None:
    path, figure = tmp_path / "t.chl", tmp_path / "pair.svg"
    path.write_bytes(pack(table))
    where = ("--board", "strip5", "--table", path, "--emulator")
    places = ("--at", "0,15", "--other", "0,-12")
    answer = chladni(
        "play", "click", *places, "--other-effect", "thud", *where, "--figure", figure, "--json"
    )
    found = answer.json
    assert [one["name"] for one in found["fingers"]] == ["A", "B"]
    assert [one["effect"] for one in found["fingers"]] == ["click", "thud"]
    assert [one["at_mm"] for one in found["fingers"]] == [[0.0, 15.0], [0.0, -12.0]]
    for one in found["fingers"]:
        assert one["peak_um"] > 10.0
        assert one["isolation_db"] > 25.0
        assert one["other_peak_um"] < 0.1 * one["peak_um"]
    assert re.fullmatch(
        r"A gets 2\d µm of its click, 3\d dB more than it gets of B's thud, which .* feel.*\. "
        r"B gets 2\d µm of its thud, 3\d dB more than it gets of A's click, which .* feel.*\.",
        found["verdict"],
    )
    drawn = figure.read_text("utf-8")
    assert "click at 0, 15 mm" in drawn
    assert "thud at 0, -12 mm" in drawn
    assert "strip5 as drawn, table t.chl; each effect on its own time axis" in drawn
    for name, one in zip("AB", found["fingers"], strict=True):
        assert f"{name}: {one['effect']} at " in drawn
        assert f" mm, {one['peak_um']:.2g} µm at most;" in drawn
        # One figure for each finger, in the sentence, the title and the rows.
        others = next(other for other in found["fingers"] if other is not one)
        over_db = 20.0 * math.log10(one["peak_um"] / others["other_peak_um"])
        assert one["over_other_effect_db"] == pytest.approx(over_db, abs=0.01)
        more = f"{over_db:.0f} dB more than"
        assert f"{more} {name} gets of {others['name']}'s {others['effect']}" in drawn
        assert f"{more} it gets of {others['name']}'s {others['effect']}" in found["verdict"]
        assert f">{others['name']} gets of {name}'s {one['effect']}" in drawn
    for words, said in (
        (
            ("--at", "0,15", "--other-effect", "thud"),
            "--other is required: X,Y",
        ),
        ((*places, "--other-effect", "thus"), "--other-effect: expected click"),
    ):
        refused = chladni("play", "click", *words, *where)
        assert (refused.code, said in " ".join(refused.err.split())) == (2, True), refused.err


def test_fingertips_that_overlap_are_remarked_on(
    chladni: CommandLine, table: Table, tmp_path: Path
) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(pack(table))
    where = ("--board", "strip5", "--table", path, "--emulator", "--at", "0,0")
    for other, is_told in (("0,7", True), ("0,13", False)):
        # Another board's file is refused once the fingers were looked at.
        answer = chladni("play", "click", *where, "--other", other, "--hidden", "two")
        assert ("fingertips are 12 mm apart or more, and" in answer.err) == is_told


def test_drives_of_two_effects_share_the_coils(table: Table, board: Board) -> None:
    """Both at full level may take more than coils have: each gets less than beside a rest."""
    alone, beside = (
        play_effect(
            table,
            board,
            shipped_effects()["click"],
            HERE,
            other_mm=THERE,
            other_plays=plays,
        )
        for plays in (False, True)
    )
    assert 0.5 * alone.peak_um < beside.peak_um < 0.98 * alone.peak_um


def test_fingers_with_an_effect_each_have_rested_where_switches_have_a_bias(
    table: Table, board: Board
) -> None:
    """As on a real device: the bias of both stands, and each click is found and told from it."""
    switched = replace(board, electronics=load_board(SWITCHED / "strip5.toml").electronics)
    plates, click = Plates.of(board), shipped_effects()["click"]
    bridged, touched, rested = (
        play_effect(
            table,
            own,
            click,
            HERE,
            other_mm=THERE,
            other_plays=True,
            rested=is_rested,
            plates=plates,
        )
        for own, is_rested in ((board, False), (switched, False), (switched, True))
    )
    assert touched.isolation_db == rested.isolation_db
    assert touched.isolation_db is not None
    assert touched.isolation_db > 25.0
    # A switch has half of a bridge's swing, and less of the supply.
    assert 0.3 * bridged.peak_um < touched.peak_um < 0.7 * bridged.peak_um
    assert touched.bias_um is not None
    assert touched.bias_um < 0.1 * touched.peak_um
    assert 0.0 < touched.first_ms < 5.0
    assert touched.envelope_error_db is not None
    assert touched.envelope_error_db < 1.0
    assert (bridged.rested, touched.rested) == (False, True)


def test_a_board_and_its_hidden_plate_are_one_progress(
    board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solving, "GRID_HZ", (80.0, 120.0, 160.0, 200.0))
    told: list[tuple[int, int]] = []
    count = len(board.actuators)
    hidden = HiddenPlate(board, np.ones(count), np.ones(count), 0, "its twin")
    found = Plates.of(board, hidden, lambda done, of_all: told.append((done, of_all)))
    assert found.below is not None
    every = len(found.known) + len(found.below)
    assert told[:2] == [(0, 8), (1, 8)]
    assert [done for done, _ in told] == list(range(every + 1))
    assert told[-1] == (every, every)


def test_pairs_are_on_a_plate_that_the_device_does_not_know(table: Table, board: Board) -> None:
    """On the board itself with coils half as strong."""
    count = len(board.actuators)
    weak = HiddenPlate(board, np.full(count, 0.5), np.ones(count), 0, "weak")
    (press, _) = of_effects([shipped_effects()[name] for name in ("click", "tick")], [HERE, THERE])
    known, hidden = (
        press.played(setup, {"plates": setup.plates()})
        for setup in (Setup(table, board, plate, None, None) for plate in (None, weak))
    )
    assert hidden.peak_um == pytest.approx(0.5 * known.peak_um, rel=1e-6)
