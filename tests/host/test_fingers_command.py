"""`chladni fingers`: what it answers, draws and refuses."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.scoring.board_score import score_board
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.host.cli.common.finger_remarks import of_fingers
from chladni.host.figures.boards import board_figure
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import Focus, SeveralFingers
from chladni.sim.board.quantity import MM
from chladni.tables.format import pack, read_table
from conftest import ROOT, CommandLine
from made_up import make_section

STRIP = ROOT / "tests" / "boards" / "strip5.toml"
FEW = ("--sets", "6", "--samples", "1")


def test_it_answers_with_the_keys_of_the_contract(chladni: CommandLine, tmp_path: Path) -> None:
    figure = tmp_path / "fingers.png"
    answer = chladni("fingers", STRIP, *FEW, "--fingers", "2", "--figure", figure, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert {"apart_mm", "counts", "seconds"} <= found.keys()
    (two,) = found["counts"]
    assert two["fingers"] == 2
    assert two["sets"] == 6
    for own in (two, two["perturbed"]):
        for key in ("isolation_db", "level_db", "finger_um"):
            assert own[key].keys() == {"median", "p10", "p90"}
        assert 0.0 <= own["unfelt_pressing"] <= own["unfelt"] <= 1.0
    assert two["perturbed"].keys() >= {"samples", "seed"}
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert answer.json["verdict"].startswith("Two fingers, 16 mm apart or more: each gets")


def test_a_board_says_how_far_apart_its_fingers_lie(chladni: CommandLine, tmp_path: Path) -> None:
    """The same pairs as with --apart, in every score; corner to corner at most."""
    board = tmp_path / "hands.toml"
    board.write_text(STRIP.read_text() + "\n[fingers]\napart_mm = 24.0\n")
    asked = (*FEW, "--fingers", "2", "--no-perturbed", "--json")
    own, given = chladni("fingers", board, *asked), chladni("fingers", STRIP, *asked, "--apart", 24)
    assert own.json["apart_mm"] == given.json["apart_mm"] == 24.0
    kept = [found.json["counts"][0]["isolation_db"]["median"] for found in (own, given)]
    assert kept[0] == pytest.approx(kept[1], abs=0.01)
    loaded = load_board(board)
    (two,) = score_fingers(loaded, (2,), sets=6, samples=0).counts
    apart = np.linalg.norm(two.places[:, 0] - two.places[:, 1], axis=1)
    assert apart.min() >= 24e-3
    most = 0.8 * np.hypot(*np.diff(loaded.active_area).ravel()) * 1e3
    for command in (("fingers", *asked), ("score", "--json"), ("show",)):
        board.write_text(re.sub("apart_mm = .*", f"apart_mm = {int(most) + 1}", board.read_text()))
        words = command[:1] if command[0] == "fingers" else ("board", command[0])
        refused = chladni(*words, board, *command[1:])
        assert refused.code == 2, command
        assert f"fingers.apart_mm: expected at most {int(most)}" in refused.err.replace("\n", " ")
    # One limit, by the board's own size, however far apart.
    refused = chladni("fingers", board, "--apart", 600)
    assert f"expected at most {int(most)}" in refused.err.replace("\n", " ")


def test_a_signal_too_weak_for_its_own_finger_is_told() -> None:
    (two,) = score_fingers(load_board(str(STRIP)), (2,), sets=6, samples=0).counts
    weak = np.sort(two.rows[:, 2])[3]
    assert ", and 25 % of all do not feel their own" in of_fingers(two, 16.0, weak)
    assert "their own" not in of_fingers(two, 16.0, two.rows[:, 2].min())
    assert "their own" not in of_fingers(two, 16.0, None)


def test_people_read_a_table(chladni: CommandLine) -> None:
    answer = chladni("fingers", STRIP, *FEW, "--fingers", "2", "--no-perturbed")
    assert answer.code == 0, answer.err
    words = " ".join(answer.out.replace("│", " ").split())
    assert "level, of the loudest" in words
    assert "% of fingers, while they rest, do not feel the others' signals" in words
    assert "own signal over" in answer.out
    assert "rows" not in answer.out


def test_a_board_as_built_has_rows_of_its_own(chladni: CommandLine) -> None:
    asked = ("fingers", STRIP, "--sets", "1", "--samples", "1", "--fingers", "2", "--no-perturbed")
    answer = chladni(*asked, "--built", "--json")
    assert answer.code == 0, answer.err
    built = answer.json["counts"][0]["built"]
    for key in ("nominal", "film", "stretched", "warm", "foam_twice", "together"):
        assert built[key]["isolation_db"].keys() == {"median", "p10", "p90"}
    refused = chladni(*asked, "--built", "--table", "t.chl")
    assert (refused.code, "--built does not go with --table" in refused.err) == (2, True)


def test_more_silence_is_less_level(chladni: CommandLine) -> None:
    """λ by hand: 1e-1 is louder, 1e-5 is stiller."""
    found = [
        json.loads(
            chladni(
                "fingers",
                STRIP,
                "--sets",
                "12",
                "--fingers",
                "2",
                "--no-perturbed",
                "--lambda",
                own,
                "--json",
            ).out
        )["counts"][0]
        for own in ("1e-1", "1e-5")
    ]
    assert found[0]["level_db"]["median"] > found[1]["level_db"]["median"]
    assert found[0]["isolation_db"]["median"] < found[1]["isolation_db"]["median"]


@pytest.mark.parametrize("board", [STRIP, "strip5"])
def test_an_emulated_device_plays_nearly_what_the_board_would(
    chladni: CommandLine, tmp_path: Path, board: str | Path
) -> None:
    """Switches and bridges: panel, table, solver, voices and diodes cost little."""
    table = tmp_path / "t.chl"
    assert chladni("table", "build", board, "--for", "fingers", "-o", table).code == 0
    exact, played = (
        json.loads(
            chladni(
                "fingers",
                board,
                "--sets",
                "30",
                "--fingers",
                "2",
                "--no-perturbed",
                *words,
                "--json",
            ).out
        )["counts"][0]
        for words in ((), ("--table", table))
    )
    # The build lets 2 dB go at the median of 200 pairs; these are the first thirty.
    lost = exact["isolation_db"]["median"] - played["isolation_db"]["median"]
    assert 0.0 < lost < 4.0
    assert played["level_db"]["median"] == pytest.approx(exact["level_db"]["median"], abs=1.5)
    assert played["unfelt"] > exact["unfelt"] - 0.1
    # A click is reckoned from what the table says of the plate.
    for key, most in (("click_db", 3.0), ("click_um", 0.5)):
        assert played[key]["median"] == pytest.approx(exact[key]["median"], abs=most)


def test_a_device_needs_a_table_of_the_board_with_responses(
    chladni: CommandLine, tmp_path: Path
) -> None:
    table, drives = tmp_path / "t.chl", tmp_path / "drives.chl"
    assert chladni("table", "build", STRIP, "--for", "fingers", "-o", table).code == 0
    known = read_table(table)
    section = make_section(np.tile([10.0, 0.0, 0.0, 0.0, 0.0], (known.regions.count, 1)))
    drives.write_bytes(pack(replace(known, responses=(), sections=(section,), bits=16)))
    two = tmp_path / "strip5.toml"
    panel = '\n[panel]\ncontroller = "ft6x36"\npixels = [320, 1370]\nsize_mm = [14.0, 60.0]\n'
    two.write_text(STRIP.read_text("utf-8") + panel, "utf-8")
    for words, named in (
        ((two, "--table", table, "--fingers", "3"), "--fingers: expected at most 2, which the"),
        (("prototype", "--table", table), "board_fingerprint"),
        ((STRIP, "--table", drives), "expected a section of responses"),
        ((STRIP, "--table", table, "--lambda", "1e-3"), "--lambda does not go with --table"),
    ):
        refused = chladni("fingers", *words, "--json")
        assert (refused.code, refused.out) == (2, "")
        assert named in refused.err
    few = ("--sets", "2", "--no-perturbed", "--json")
    scored = chladni("fingers", two, "--table", table, *few)
    assert scored.code == 0, scored.err
    assert [one["fingers"] for one in scored.json["counts"]] == [2]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--fingers", "6"), "--fingers: expected 2 to 5, got 6"),
        (("--fingers", "1"), "--fingers"),
        (("--apart", "500"), "apart"),
        (("--apart", "nan"), "--apart"),
        (("--lambda", "0"), "--lambda"),
        (("--sets", "0"), "--sets"),
        (("--press", "100"), "--press"),
        (("--figure", "x.gif"), "--figure"),
    ],
)
def test_bad_input_is_named(chladni: CommandLine, words: tuple[str, str], named: str) -> None:
    answer = chladni("fingers", STRIP, *words, "--json")
    assert answer.code == 2
    assert answer.out == ""
    assert named in answer.err


def test_two_fingers_of_ones_own_are_scored_and_drawn(chladni: CommandLine, tmp_path: Path) -> None:
    """The same as a set of the score: its places give its decibels."""
    board = load_board(str(STRIP))
    (two,) = score_fingers(board, (2,), sets=1, samples=0).counts
    one, other = (f"{x / MM!r},{y / MM!r}" for x, y in two.places[0].tolist())
    figure = tmp_path / "pair.png"
    found = chladni("fingers", STRIP, "--at", one, "--other", other, "--figure", figure, "--json")
    assert found.code == 0, found.err
    fingers = found.json["fingers"]
    assert [own["isolation_db"] for own in fingers] == pytest.approx(two.rows[:, 0], abs=1e-3)
    assert [own["finger_um"] for own in fingers] == pytest.approx(two.rows[:, 2], rel=1e-4)
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_fingers_that_no_coil_tells_apart_are_said_to_be(
    chladni: CommandLine, tmp_path: Path
) -> None:
    own = tmp_path / "middle.toml"
    places = "".join(f"[[actuators]]\nat_mm = [0, {y}]\n" for y in (-20, 0, 20))
    own.write_text(
        "[plate]\nsize_mm = [60, 64]\nthickness_mm = 0.4\nmaterial = 'FR4'\n[fingers]\n"
        "[foundation]\nstiffness_n_per_mm3 = 0.01\nloss_factor = 0.2\n" + places,
        encoding="utf-8",
    )
    found = chladni("fingers", own, "--at=-15,10", "--other", "15,10", "--json")
    assert found.code == 0, found.err
    assert [one["isolation_db"] for one in found.json["fingers"]] == pytest.approx([0.0, 0.0])
    assert "mirrored, feel the same" in " ".join(found.err.split())


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--at", "0,0"), "--other"),
        (("--other", "0,0"), "--at"),
        (("--at", "0,0", "--other", "0,3"), "5 mm or more"),
        (("--at", "0,0", "--other", "0,500"), "--other"),
        (("--at", "0,0", "--other", "0,20", "--fingers", "3"), "--fingers 3 does not go with --at"),
        (("--at", "0,0", "--other", "0,20", "--built"), "--built does not go with --at"),
    ],
)
def test_a_pair_that_cannot_be_scored_is_refused(
    chladni: CommandLine, words: tuple[str, ...], named: str
) -> None:
    answer = chladni("fingers", STRIP, *words)
    assert (answer.code, answer.out) == (2, "")
    assert named in answer.err


def test_a_pair_may_be_called_two_fingers_and_is_told_to_overlap(chladni: CommandLine) -> None:
    near, apart = (
        chladni("fingers", STRIP, "--at", "0,0", "--other", other, "--fingers", "2")
        for other in ("0,6", "0,12")
    )
    assert (near.code, apart.code) == (0, 0)
    assert "fingertips are 12 mm apart or more, and these are 6: they overlap" in near.err
    assert "overlap" not in apart.err
    assert "as drawn: two fingers" in apart.out


def test_a_finger_beside_the_panel_is_told_of(chladni: CommandLine, tmp_path: Path) -> None:
    board = tmp_path / "small.toml"
    panel = '\n[panel]\npixels = [140, 400]\nsize_mm = [14.0, 40.0]\nplace = "beside"\n'
    board.write_text(STRIP.read_text("utf-8") + panel, encoding="utf-8")
    done = chladni("fingers", board, "--at", "0,0", "--other", "0,21")
    assert done.code == 0
    assert "--other 0,21: the panel senses no finger there" in done.err
    assert "--at 0,0: the panel" not in done.err


def test_a_score_of_a_board_for_several_shows_pairs() -> None:
    """And where it is for one finger too, the maps of its focus."""
    board = load_board(str(STRIP))
    several = replace(board, focus=None, fingers=SeveralFingers())
    score = score_board(several, pitch=0.02, objective="focus", samples=0)
    (two,) = score_fingers(several, (2,), sets=5, samples=0).counts
    told = "It keeps two apart. It does not focus."
    drawn = board_figure(several, score, two, told)
    assert drawn.get_suptitle().endswith("It keeps two apart")
    titles = [axes.get_title() for axes in drawn.axes]
    middle = sorted(two.rows[:, 0])[4]
    assert titles[0].startswith("median")
    assert f"{middle:.0f} dB less" in titles[0]
    points = drawn.axes[2].collections[0]
    at = np.asarray(points.get_offsets())
    which = int(np.argmin(np.hypot(*(at - two.places[0, 1] / MM).T)))
    assert np.asarray(points.get_array())[which] == pytest.approx(two.rows[1, 0])
    for other in (replace(several, focus=Focus()), board):
        maps = board_figure(other, score, two, told)
        assert "above every second finger" in maps.get_suptitle()
