"""`solve` and `compare` on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chladni.drives.methods import METHODS
from chladni.drives.objectives import OBJECTIVES
from chladni.host.cli import compare as compare_command
from conftest import ROOT, CommandLine


@pytest.mark.parametrize("method", METHODS)
def test_solve_answers_with_every_method(chladni: CommandLine, method: str) -> None:
    answer = chladni(
        "solve", "prototype", "--target", "10,25", "--method", method, "--steps", 40, "--json"
    ).json
    assert answer["method"] == method
    assert len(answer["drive"]) == 5
    assert answer["baselines"]["silent"] < answer["ssim"] < 1.0
    assert answer["movable"] is True
    assert (answer["details"].get("condition") or 2.0) > 1.0


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_solve_answers_with_every_objective(chladni: CommandLine, objective: str) -> None:
    answer = chladni(
        "solve", "prototype", "--target", "10,25", "--objective", objective, "--json"
    ).json
    assert answer["objective"] == objective
    if objective == "contrast":
        assert answer["contrast_db"] == pytest.approx(answer["contrast_limit_db"], abs=1e-9)


def test_an_annealing_is_kept_drawn_and_resumed(chladni: CommandLine, tmp_path: Path) -> None:
    trace, figure = tmp_path / "t.npz", tmp_path / "t.png"
    first = ["solve", "prototype", "--target", "10,25", "--method", "anneal", "--trace", trace]
    assert chladni(*first, "--steps", 30).code == 0
    answer = chladni(*first, "--steps", 60, "--figure", figure, "--json").json
    with np.load(trace) as data:
        assert data["ssim"].shape == (61,)
        assert data["ssim"].max() == pytest.approx(answer["ssim"], abs=1e-6)
    assert figure.read_bytes().startswith(b"\x89PNG")
    other = chladni(*first, "--steps", 60, "--seed", 5)
    assert other.code == 2
    assert "seed 5" in other.err


def test_a_target_that_nothing_moves_is_announced(chladni: CommandLine) -> None:
    answer = chladni("solve", "prototype", "--target", "25.75,0", "--json")
    assert answer.code == 0
    assert answer.json["movable"] is False


def test_the_announcement_is_on_stderr(chladni: CommandLine) -> None:
    assert "moves 25.75,0 mm" in chladni("solve", "prototype", "--target", "25.75,0").err


def test_compare_prints_writes_and_draws(chladni: CommandLine, tmp_path: Path) -> None:
    out, figure = tmp_path / "c.csv", tmp_path / "c.png"
    options = ["--pitch", 40, "--methods", "phasor,nearest,anneal", "--steps", 20]
    answer = chladni("compare", "prototype", *options, "-o", out, "--figure", figure, "--json").json
    names = {(entry["method"], entry["objective"]) for entry in answer["methods"]}
    assert {("phasor", "ssim"), ("anneal", "ssim"), ("silent", "–")} <= names
    assert len(out.read_text(encoding="utf-8").splitlines()) == 1 + answer["targets"] * len(names)
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.csv", "c.png"]
    text = chladni("compare", "paper", "--pitch", 70, "--methods", "nearest").out
    for heading in compare_command.SHOWN.values():
        assert heading in text


def test_on_a_board_for_several_the_devices_own_drive_is_told_from_others(
    chladni: CommandLine, tmp_path: Path
) -> None:
    text = (ROOT / "boards" / "phone5.toml").read_text(encoding="utf-8")
    board = tmp_path / "coarse.toml"
    board.write_text(text.replace("[144, 294]", "[37, 75]"), encoding="utf-8")
    own = chladni("solve", board, "--target", "5,20", "--method", "time-reversal")
    other = chladni("solve", board, "--target", "5,20")
    played = [" ".join(one.out.split()) for one in (own, other)]
    assert played[0].startswith("The board is for several fingers, and this is the drive that its")
    assert "its device does not play this drive" in played[1]
