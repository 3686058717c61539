"""Fingers of a board as it is known, on the plate that there is: `fingers --hidden`."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from calibration.small_board import small_board
from chladni.calibration import Truth, hidden_plate
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from conftest import ROOT, CommandLine

SEED = 8
SETS = 6


@pytest.mark.parametrize("is_known", [False, True], ids=["as drawn", "as it is"])
def test_drives_meet_the_plate_as_calibrations_scores_have_it(is_known: bool) -> None:
    """Two ways to the same numbers; half of the coils are reversed, which one device knows."""
    board = small_board()
    hidden = hidden_plate(board, SEED)
    hidden.strengths[::2] *= -1.0
    truth = Truth.of(hidden, board, SETS)
    known = truth.perfectly_known() if is_known else board
    (two,) = score_fingers(known, (2,), sets=SETS, samples=0, on=hidden.on(known)).counts
    rows = truth.rows(known)
    # Fields are solved to 60 dB, once more or less: of an isolation of 40 a tenth, 0.9 dB.
    np.testing.assert_allclose(two.rows[:, 0], rows.fingers_2_db, atol=1.0)
    np.testing.assert_allclose(two.rows[:, 2], rows.fingers_um, rtol=0.02)


def test_the_command_names_the_plate_and_refuses_what_needs_another(
    chladni: CommandLine, tmp_path: Path
) -> None:
    few = ("--fingers", "2", "--sets", "2", "--json")
    drawn = chladni("fingers", "strip5", *few, "--no-perturbed").json
    on = chladni("fingers", "strip5", *few, "--hidden", "3").json
    assert drawn["hidden"] is None
    assert on["hidden"] == "3"
    assert on["counts"][0]["perturbed"] is None
    assert on["verdict"].startswith("On plate 3: Two fingers")
    kept = [own["counts"][0]["isolation_db"]["median"] for own in (drawn, on)]
    assert kept[1] < kept[0] - 3.0
    for more, named in (
        (("--built",), "--built does not go with --hidden"),
        (("--table", "t.chl", "--lambda", "0.1"), "--lambda does not go with --table"),
    ):
        refused = chladni("fingers", "strip5", *few, "--hidden", "3", *more)
        assert refused.code == 2
        assert named in refused.err
    text = (ROOT / "boards" / "phone5.toml").read_text("utf-8")
    twin = tmp_path / "twin.toml"
    twin.write_text(re.sub(r"at_mm = \[0.0, 0.0\]", "at_mm = [0.0, 5.1]", text), encoding="utf-8")
    for other in (twin, f"{twin}@3"):
        refused = chladni("fingers", "phone5", *few, "--hidden", other)
        assert refused.code == 2
        assert "a plate of phone5, each coil within 5 mm of its place" in refused.err
        assert " lies 5." in refused.err
    lost = chladni("fingers", "strip5", *few, "--hidden", tmp_path / "lost.toml")
    assert lost.code == 2
    assert "SEED, BOARD@SEED or FILE.toml" in lost.err


def test_a_pair_of_ones_own_has_what_the_score_has_of_it(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """Of the score's first pair, rows by finger."""
    board = load_board("strip5")
    plate = hidden_plate(board, 3)
    (two,) = score_fingers(board, (2,), sets=1, samples=0, on=plate.on(board)).counts
    one, other = (",".join(f"{at / MM:.6f}" for at in place) for place in two.places[0])
    picture = tmp_path / "pair.svg"
    asked = ("fingers", "strip5", f"--at={one}", f"--other={other}", "--hidden", "3")
    found = chladni(*asked, "--json", "--figure", picture).json
    assert found["verdict"].startswith("On plate 3: A plays: B gets ")
    kept, um = (
        [finger[key] for finger in found["fingers"]] for key in ("isolation_db", "finger_um")
    )
    np.testing.assert_allclose(kept, two.rows[:, 0], atol=0.01)
    np.testing.assert_allclose(um, two.rows[:, 2], rtol=1e-3)
    assert "strip5, as drawn, on plate 3: two fingers" in picture.read_text("utf-8")
