"""`chladni play --pairs`: what an effect keeps over many pairs of fingers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chladni.drives.methods import SEED
from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.host.cli.effects.drawn_fingers import levels_told, too_weak
from chladni.host.cli.effects.presses import Press
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.board.writing import board_file
from chladni.tables.format import pack
from chladni.tables.several_fingers import isolation
from chladni.tables.several_fingers.build import responses_table
from conftest import CommandLine


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Responses of `strip5`, some 7 mm apart."""
    path = tmp_path_factory.mktemp("tables") / "t.chl"
    path.write_bytes(pack(responses_table(load_board("strip5"), pitch=7e-3, bits=12)[0]))
    return path


def test_decibels_less_are_more_where_they_are_below_0() -> None:
    assert levels_told([12.0, 3.0, 8.0], "less") == "8 dB less at the median, 3 at the worst"
    assert levels_told([2.0, -3.0, -1.0], "less") == "1 dB more at the median, 3 at the worst"
    assert levels_told([9.0, 5.0, -2.0], "less") == "5 dB less at the median, 2 more at the worst"
    tenth = levels_told(np.linspace(-20.0, 10.0, 31).tolist(), "less")
    assert tenth == "5 dB more at the median, 17 at the worst tenth"


def test_pairs_have_what_each_of_them_has_alone(chladni: CommandLine, table: Path) -> None:
    """They are the first that a score of the board draws, and the first finger plays."""
    board = load_board("strip5")
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


def test_pairs_lie_as_far_apart_as_is_asked(chladni: CommandLine, table: Path) -> None:
    """And the score of the same pairs is named, of a click."""
    words = ("--emulator", "--board", "strip5", "--table", table)
    found = chladni("play", "click", *words, "--pairs", "1", "--apart", "40", "--json")
    assert found.code == 0, found.err
    drawn = finger_sets(load_board("strip5"), 2, 1, 40e-3, np.random.default_rng(SEED)) / MM
    assert np.allclose(found.json["worst_at_mm"], drawn[0])
    assert np.hypot(*np.subtract(*found.json["worst_at_mm"])) >= 40.0
    assert "`chladni fingers strip5 --fingers 2 --sets 1 --apart 40 --table " in found.err
    for more, named in (
        (("--at", "0,0", "--apart", "40"), "--pairs is required: how many pairs are drawn"),
        (
            ("--pairs", "1", "--apart", "100"),
            "got '100 mm'; its active area is",
        ),
        (("--pairs", "1", "--apart", "3"), "--apart: expected 16 to 1000 mm, got 3"),
    ):
        refused = chladni("play", "click", *words, *more)
        assert (refused.code, refused.out) == (2, "")
        assert named in " ".join(refused.err.split())


def _over_db(fingers: list[dict[str, Any]]) -> list[float]:
    return [one["over_other_effect_db"] for one in fingers]


def test_pairs_of_two_effects_have_what_each_has_alone(chladni: CommandLine, table: Path) -> None:
    words = ("--emulator", "--board", "strip5", "--table", table, "--other-effect", "tick")
    found = chladni("play", "click", *words, "--pairs", "2", "--json")
    assert found.code == 0, found.err
    alone = []
    for pair in finger_sets(load_board("strip5"), 2, 2, 16e-3, np.random.default_rng(SEED)) / MM:
        one, other = (f"{x!r},{y!r}" for x, y in pair.tolist())
        played = chladni("play", "click", *words, "--at", one, "--other", other, "--json")
        alone.append(played.json["fingers"])
    levels = np.transpose([_over_db(own) for own in alone])
    for own, middle, peak in zip(found.json["fingers"], levels.mean(axis=1), "AB", strict=True):
        assert own["name"] == peak
        assert own["over_other_effect_db"]["median"] == pytest.approx(middle, abs=1e-6)
    (a, b), worst = np.median(levels, axis=1), levels.min(axis=1)
    assert found.json["verdict"] == (
        f"Over 2 pairs A gets {a:.0f} dB more of its click than of B's tick at the median, "
        f"{worst[0]:.0f} at the worst; B gets {b:.0f} dB more of its tick than of A's click at the "
        f"median, {worst[1]:.0f} at the worst."
    )


@pytest.mark.parametrize(("just_felt", "told"), [(0.36, "at 1 of 2"), (0.2, ""), (None, "")])
def test_effects_that_no_finger_feels_are_counted(just_felt: float | None, told: str) -> None:
    played: Any = [SimpleNamespace(peak_um=um, just_felt_um=just_felt) for um in (0.28, 0.9)]
    assert too_weak(played).endswith(told)
    assert bool(too_weak(played)) == bool(told)


TWO_KEYS = """
name = "keys"
[[area]]
name = "upper"
rectangle_mm = [-6, 6, 6, 18]
press = "click"
[[area]]
name = "lower"
rectangle_mm = [-6, -18, 6, -6]
press = "tick"
"""


def pressed_together(table: Path, folder: Path, keys: str) -> tuple[str | Path, ...]:
    """Options of `play` for both fingers of pairs in a bank's areas."""
    bank = folder / "keys.toml"
    bank.write_text(keys)
    return ("--emulator", "--board", "strip5", "--table", table, "--bank", bank, "--together")


def test_pairs_of_a_bank_lie_in_its_areas(
    chladni: CommandLine, table: Path, tmp_path: Path
) -> None:
    """Those of all drawn pairs that do; both fingers' levels count alike."""
    words = pressed_together(table, tmp_path, TWO_KEYS)
    found = chladni("play", *words, "--pairs", "2", "--json")
    assert found.code == 0, found.err
    drawn = finger_sets(load_board("strip5"), 2, 400, 16e-3, np.random.default_rng(SEED)) / MM
    inside = np.abs(np.abs(drawn[..., 1]) - 12.0).max(axis=1) < 6.0
    over_db: list[float] = []
    pairs = drawn[inside & (np.abs(drawn[..., 0]).max(axis=1) < 6.0)][:2].tolist()
    for pair in pairs:
        one, other = ("{!r},{!r}".format(*place) for place in pair)
        played = chladni("play", *words, "--at", one, "--other", other, "--json")
        over_db += _over_db(played.json["fingers"])
    middle = np.median(over_db)
    assert found.json["over_other_effect_db"]["median"] == pytest.approx(middle, abs=1e-6)
    assert found.json["bank"] == "keys"
    assert sum(one["presses"] for one in found.json["areas"]) == 4
    assert {one["name"] for one in found.json["areas"]} == {"upper", "lower"}
    least = found.json["worst_at_mm"]
    assert any(np.allclose(least, one) or np.allclose(least[::-1], one) for one in pairs)
    assert "a finger gets" in found.json["verdict"]
    assert "more of its own effect than of the other's" in found.json["verdict"]


def test_fingers_that_press_together_lie_in_two_areas(
    chladni: CommandLine, table: Path, tmp_path: Path
) -> None:
    """Two hands have one each, though an area has room for both."""
    words = pressed_together(table, tmp_path, TWO_KEYS.replace("18", "36"))
    found = chladni("play", *words, "--pairs", "4", "--json")
    assert found.code == 0, found.err
    assert [one["presses"] for one in found.json["areas"]] == [4, 4]


def test_a_bank_beside_the_board_meets_no_pair(
    chladni: CommandLine, table: Path, tmp_path: Path
) -> None:
    words = pressed_together(table, tmp_path, TWO_KEYS.replace("6, 6, 6, 18", "6, 86, 6, 98"))
    answer = chladni("play", *words, "--pairs", "1")
    assert (answer.code, answer.out) == (2, "")
    assert "--pairs: expected a bank that many drawn fingers meet, got 1" in answer.err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("click", "--emulator", "--at", "0,0"), "--at does not go with --pairs"),
        (("click", "--emulator", "--figure", "a.png"), "--figure does not go with --pairs"),
        (("--emulator", "--bank", "slider", "--rested"), "--rested does not go with --bank"),
        (("click", "--emulator", "--together"), "--together does not go with EFFECT"),
        (
            ("--emulator", "--bank", "slider", "--other-effect", "tick"),
            "--other-effect does not go with --bank",
        ),
        (("--emulator",), "EFFECT is required: a shipped effect"),
        (("click", "--emulator", "--bank", "slider"), "EFFECT does not go with --bank"),
        (("click", "--port", "nowhere"), "--pairs does not go with --port or --udp"),
    ],
)
def test_what_is_of_one_pair_is_refused(
    chladni: CommandLine, words: tuple[str, ...], named: str
) -> None:
    answer = chladni("play", *words, "--pairs", "3")
    assert (answer.code, answer.out) == (2, "")
    assert named in answer.err


def test_ctrl_c_leaves_what_was_played(
    chladni: CommandLine, table: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    played: list[Any] = []
    plain = Press.played

    def stopped(self: Press, *given: Any) -> Any:
        if len(played) == 2:
            raise KeyboardInterrupt
        played.append(plain(self, *given))
        return played[-1]

    words = ("play", "click", "--emulator", "--board", "strip5", "--table", table)
    monkeypatch.setattr(Press, "played", stopped)
    found = chladni(*words, "--pairs", "3", "--json")
    assert (found.code, "after 2 of 3, of which all is above" in found.err) == (130, True)
    assert (found.json["pairs"], found.json["verdict"][:12]) == (2, "Over 2 pairs")
    assert found.json["peak_um"]["median"] == pytest.approx(np.mean([o.peak_um for o in played]))
    played[:] = [played[0]] * 2
    found = chladni(*words, "--pairs", "3")
    assert (found.code, found.out) == (130, "")


def test_a_board_beside_its_table_is_found(
    chladni: CommandLine, table: Path, tmp_path: Path
) -> None:
    own = replace(load_board("strip5"), name="mine")
    (tmp_path / "mine.toml").write_bytes(board_file(own))
    (tmp_path / "t.chl").write_bytes(pack(responses_table(own, pitch=7e-3, bits=12)[0]))
    words = ("play", "click", "--emulator", "--at", "5,2", "--json")
    found = chladni(*words, "--table", tmp_path / "t.chl")
    assert (found.code, found.json["board"]) == (0, "mine"), found.err
    # A shipped board's name does.
    assert chladni(*words, "--table", table).json["board"] == "strip5"
