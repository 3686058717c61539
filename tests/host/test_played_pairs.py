"""`chladni play --pairs`: what an effect keeps over many pairs of fingers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.methods import SEED
from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.tables.format import pack
from chladni.tables.several_fingers import isolation
from chladni.tables.several_fingers.build import responses_table
from conftest import CommandLine


def test_pairs_have_what_each_of_them_has_alone(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are the first that a score of the board draws, and the first finger plays."""
    monkeypatch.setattr(isolation, "SETS", 4)
    board, table = load_board("strip5"), tmp_path / "t.chl"
    table.write_bytes(pack(responses_table(board, pitch=7e-3, bits=12)[0]))
    words = ("--emulator", "--board", "strip5", "--table", table, "--json")
    found = chladni("play", "click", *words, "--pairs", "2")
    assert found.code == 0, found.err
    alone = []
    for pair in finger_sets(board, 2, 2, 16e-3, np.random.default_rng(SEED)) / MM:
        one, other = (f"{x!r},{y!r}" for x, y in pair.tolist())
        alone.append(chladni("play", "click", *words, "--at", one, "--other", other).json)
    for key in ("isolation_db", "peak_um"):
        middle = np.mean([own[key] for own in alone])
        assert found.json[key]["median"] == pytest.approx(middle, abs=1e-6)
    felt = [own["other_peak_um"] > own["just_felt_um"] for own in alone]
    assert found.json["unfelt"] == 1.0 - np.mean(felt)
    worst = min(own["isolation_db"] for own in alone)
    assert found.json["verdict"].startswith("Over 2 pairs")
    assert f"at the median, {worst:.0f} at the worst;" in found.json["verdict"]


def test_without_a_table_it_is_told_what_plays_and_each_of_few_pairs(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(isolation, "SETS", 4)
    played = chladni("play", "click", "--emulator", "--board", "strip5", "--pairs", "2")
    assert played.code == 0, played.err
    told = played.err.split("without --table: ")[1]
    assert re.match(r"plays responses at places [\d.]+ × [\d.]+ mm apart, made for strip5", told)
    assert re.search(r"peak +│ [\d.]+, [\d.]+ µm", played.out)
    assert "80 %" not in played.out
    assert "Played on strip5 as drawn (emulated)" in played.out
    assert re.search(r"board +│ strip5, as drawn", played.out)
    # Bridges have no bias that could stand.
    assert "rested" not in played.out


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("click", "--emulator", "--at", "0,0"), "--at does not go with --pairs"),
        (("click", "--emulator", "--figure", "a.png"), "--figure does not go with --pairs"),
        (("--emulator", "--bank", "slider"), "--bank does not go with --pairs"),
        (("--emulator",), "EFFECT is required: a shipped effect"),
        (("click", "--emulator", "--bank", "slider"), "--bank does not go with --pairs"),
        (("click", "--port", "nowhere"), "--pairs does not go with --port or --udp"),
    ],
)
def test_what_is_of_one_pair_is_refused(
    chladni: CommandLine, words: tuple[str, ...], named: str
) -> None:
    answer = chladni("play", *words, "--pairs", "3")
    assert (answer.code, answer.out) == (2, "")
    assert named in answer.err
