"""What a board is made for stands in its file, and every command takes it from there."""

from __future__ import annotations

from pathlib import Path

import pytest

from chladni.drives.objectives import default_objective
from chladni.host.studio.boards.catalogue import Catalogue
from chladni.host.studio.boards.prepared import LOUDEST, BoardChoice
from chladni.host.studio.messages.requests import Choose
from chladni.sim.board.file import load_board
from conftest import ROOT, CommandLine

SMALL = """name = "own"
[plate]
size_mm = [14.0, 40.0]
thickness_mm = 0.2
material = "FR4"
[foundation]
stiffness_n_per_mm3 = 0.03
loss_factor = 0.2
[[actuators]]
name = "a"
at_mm = [0.0, -10.0]
[[actuators]]
name = "b"
at_mm = [0.0, 10.0]
[drive]
frequency_hz = 160.0
max_gain = 10.0
[image]
points = [15, 41]
[regions]
pitch_mm = 10.0
[electronics]
pwm_pins = [2, 4]
pwm_bits = 10
ramp_ms = 4.0
touch_timeout_ms = 100.0
max_on_s = 10.0
"""
BLOCKS = [("", "ssim"), ("[focus]\n", "focus"), ("[fingers]\n", "focus")]


@pytest.mark.parametrize(("block", "objective"), BLOCKS)
def test_every_command_takes_the_objective_of_the_file(
    chladni: CommandLine, tmp_path: Path, block: str, objective: str
) -> None:
    board, table = tmp_path / "own.toml", tmp_path / "own.chl"
    board.write_text(SMALL + block, encoding="utf-8")
    solved = chladni("solve", board, "--target", "0,5", "--json")
    assert solved.json["objective"] == objective
    scored = chladni("board", "score", board, "--pitch", "10", "--no-perturbed", "--json")
    assert scored.json["objective"] == objective
    assert ("neither [focus] nor [fingers]" in scored.err) == (block == "")
    compared = chladni("compare", board, "--methods", "nearest,phasor", "--pitch", "14", "--json")
    assert compared.json["objective"] == objective
    methods = [(one["method"], one["objective"]) for one in compared.json["methods"]]
    assert methods[:2] == [("nearest", "ssim"), ("phasor", objective)]
    built = chladni("table", "build", board, "-o", table, "--for", "finger", "--json")
    assert built.json["objective"] == objective
    played = chladni(
        "emulate",
        table,
        "--board",
        board,
        "--touch",
        "0,5@5",
        "--ms",
        "200",
        "-o",
        tmp_path / "r.npz",
        "--json",
    )
    assert played.json["objective"] == objective
    loaded = load_board(board)
    catalogue = Catalogue(BoardChoice(loaded, default_objective(loaded)))
    chosen = catalogue.chosen(Choose(None, None, "phasor", None), loaded)
    # A device of a board for several has no drives for one, and plays the loudest.
    assert chosen.objective == (LOUDEST if loaded.is_for_several else objective)
    # Other methods have one objective, and are refused for no board.
    assert catalogue.chosen(Choose(None, None, "nearest", None), loaded).objective == "ssim"
    assert chladni("solve", board, "--target", "0,5", "--method", "nearest").code == 0


def test_a_table_for_another_objective_is_remarked_on(chladni: CommandLine, tmp_path: Path) -> None:
    board, table = tmp_path / "own.toml", tmp_path / "own.chl"
    board.write_text(SMALL + "[focus]\n", encoding="utf-8")
    score = ("table", "score", table, "--board", board, "--pitch", "20", "--no-perturbed")
    for objective, is_other in (("ssim", True), ("focus", False)):
        built = chladni("table", "build", board, "-o", table, "--objective", objective)
        assert built.code == 0, built.err
        assert ("best at ssim, and own is for focus" in chladni(*score).err) == is_other


def test_no_focus_names_the_objective_that_makes_one(chladni: CommandLine) -> None:
    """On `prototype` an SSIM of 0.95 leaves the maximum 18 mm away, which focus mends."""
    wrong = chladni("solve", "prototype", "--target", "18,32", "--json").json
    assert wrong["remark"].endswith("this is no focus. --objective focus makes one.")
    right = chladni("solve", "prototype", "--target", "18,32", "--objective", "focus", "--json")
    assert right.json["focal_error_mm"] < 12.0
    assert right.json["second_finger_db"] > 0.0
    none = chladni("solve", "prototype", "--target", "18,0", "--json").json
    assert none["remark"].endswith("No objective makes one of these coils here.")
    for objective in ("focus", "contrast", "balanced"):
        tried = chladni(
            "solve", "prototype", "--target", "18,0", "--objective", objective, "--json"
        )
        assert tried.json["focal_error_mm"] > 12.0 or tried.json["second_finger_db"] < 0.0


def test_the_template_asks_what_a_board_is_for() -> None:
    assert load_board(ROOT / "boards" / "template.toml").focus is not None
