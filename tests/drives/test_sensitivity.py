"""What tolerances do: against closed forms where stiffness alone decides."""

from __future__ import annotations

import dataclasses
import re
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.scoring.sensitivity import (
    MODULUS,
    PLACES,
    THICKNESS,
    Influence,
    sensitivity,
    variants_of,
)
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.drives.scoring.several_fingers.fingers_sensitivity import fingers_sensitivity
from chladni.drives.scoring.tolerances import FORCE
from chladni.host.cli.common.tolerance_verdicts import of_tolerances
from chladni.host.figures.boards import sensitivity_figure
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.board.foundation import Foundation
from chladni.sim.board.parts import Image, Spring
from conftest import CommandLine


@pytest.mark.soak
def test_far_below_its_modes_a_board_is_as_soft_as_its_bending_stiffness(prototype: Board) -> None:
    """At 5 Hz fields go as 1/D = 1/(E h³): images stay, and loss and magnets' mass do nothing."""
    drive = dataclasses.replace(prototype.drive, frequency_hz=5.0)
    board = dataclasses.replace(prototype, drive=drive, image=Image((31, 61)))
    found = {one.name: one for one in sensitivity(board)}
    # (5/560)² of inertia is left, 8e-5 or 0.001 dB.
    assert found["thickness"].level_db == pytest.approx(-60.0 * np.log10(1.0 - THICKNESS), abs=0.01)
    modulus = found["Young's modulus"].level_db
    assert modulus == pytest.approx(-20.0 * np.log10(1.0 - MODULUS), abs=0.01)
    for name in ("thickness", "Young's modulus", "sheet's loss factor", "magnets' mass"):
        assert found[name].ssim == pytest.approx(0.0, abs=1e-3)
    for name in ("sheet's loss factor", "magnets' mass"):
        assert found[name].level_db < 0.01
    assert found["coils' forces"].level_db > 0.0
    assert found["screws"].level_db > found["thickness"].level_db


def test_foam_that_carries_a_board_decides_its_level(prototype: Board) -> None:
    """A plate that is stiff beside its foam goes down as a whole: as 1/k."""
    stiff = dataclasses.replace(prototype.plate, youngs_modulus=1e12)
    drive = dataclasses.replace(prototype.drive, frequency_hz=2.0)
    board = dataclasses.replace(
        prototype,
        plate=stiff,
        screws=(),
        drive=drive,
        image=Image((31, 61)),
        foundation=Foundation(1e5),
    )
    found = {one.name: one for one in sensitivity(board)}
    assert found["foam's stiffness"].level_db == pytest.approx(-20.0 * np.log10(0.8), abs=0.1)
    assert found["thickness"].level_db < 0.2
    assert "screws" not in found


def test_feet_that_carry_a_board_decide_its_level(prototype: Board) -> None:
    """A plate that is stiff beside its feet goes down as a whole: as 1/k, 12 dB at a quarter."""
    stiff = dataclasses.replace(prototype.plate, youngs_modulus=1.5e12)
    drive = dataclasses.replace(prototype.drive, frequency_hz=1.0)
    feet = tuple(Spring((x, y), 4e3) for x in (-0.03, 0.03) for y in (-0.06, 0.06))
    board = dataclasses.replace(
        prototype, plate=stiff, screws=(), springs=feet, drive=drive, image=Image((31, 61))
    )
    found = {one.name: one for one in sensitivity(board)}
    assert found["feet's stiffness"].level_db == pytest.approx(20.0 * np.log10(4.0), abs=0.1)
    assert found["thickness"].level_db < 0.2
    without = dataclasses.replace(prototype, image=board.image)
    assert "feet's stiffness" not in {one.name for one in sensitivity(without)}


def test_forces_change_no_more_than_their_own_share(prototype: Board) -> None:
    """All coils off by at most 5 %: the sum of what pushes the same way by no more than that."""
    board = dataclasses.replace(prototype, image=Image((31, 61)))
    (forces,) = [one for one in sensitivity(board) if one.name == "coils' forces"]
    # Coils against each other would add up to more; here one coil does most of each place.
    assert forces.level_db < 2.0 * 20.0 * np.log10(1.0 + FORCE)


def test_the_command_sorts_and_draws(chladni: CommandLine, tmp_path: Path) -> None:
    figure = tmp_path / "s.png"
    answer = chladni("board", "sensitivity", "paper", "--figure", figure, "--json")
    assert answer.code == 0
    rows = answer.json["parameters"]
    assert {"name", "tolerance", "level_db", "ssim", "second_finger_db"} == rows[0].keys()
    levels = [row["level_db"] for row in rows]
    assert levels == sorted(levels, reverse=True)
    assert figure.stat().st_size > 10_000
    verdict = answer.json["verdict"]
    assert verdict.startswith(f"Measure {rows[0]['name']} first: within tolerance (±10 %)")
    # Coils do not tell it (docs/calibrate.md).
    assert "Callipers tell it" in verdict
    assert "finds" not in verdict
    refused = chladni("board", "sensitivity", "paper", "--figure", tmp_path / "s.txt")
    assert refused.code == 2


def test_a_board_for_fingers_is_rated_by_what_two_of_them_get(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """All coils weaker or stronger by up to 5 %: a level by no more than all at once, twice."""
    copy = tmp_path / "own.toml"
    text = shipped_boards()["phone5"].read_text(encoding="utf-8")
    copy.write_text(re.sub("points = .*", "points = [36, 73]", text), encoding="utf-8")
    answer = chladni("board", "sensitivity", copy, "--figure", tmp_path / "s.png", "--json")
    rows = answer.json["parameters"]
    assert rows[0].keys() == {"name", "tolerance", "level_db", "isolation_db"}
    lost = [row["isolation_db"] for row in rows]
    assert lost == sorted(lost)
    assert lost[0] < -1.0
    (forces,) = [row for row in rows if row["name"] == "coils' forces"]
    assert 0.0 < forces["level_db"] < 4.0 * 20.0 * np.log10(1.0 + FORCE)
    verdict = answer.json["verdict"]
    assert verdict.startswith("Measure foam first, if its stiffness is a data sheet's")
    assert f"`chladni calibrate --board {copy}` finds it. Then {rows[0]['name']}: " in verdict
    assert "two fingers' isolation at the worst tenth falls by up to" in verdict


def test_the_figure_of_tolerances_says_what_to_measure_first() -> None:
    influences = [Influence("screws", "rigid to nylon", 8.0, ssim=-0.1, second_finger_db=-1.0)]
    verdict = of_tolerances(influences, "own.toml")
    title = sensitivity_figure("own", influences, verdict).get_suptitle()
    assert "Measure screws first: within tolerance (rigid to nylon)" in title
    assert verdict.endswith("`chladni calibrate --board own.toml` finds them.")
    assert "calibrate" not in of_tolerances(influences, None)  # it was measured


def test_isolation_lost_is_of_the_worst_tenth_as_fingers_has_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The same pairs on a plate a tenth thicker or thinner: `kept_apart` of its rows by itself."""
    board = dataclasses.replace(load_board("strip5"), image=Image((8, 31)))
    # No other parameter is looked at here.
    monkeypatch.setattr(
        "chladni.drives.scoring.several_fingers.fingers_sensitivity.variants_of",
        lambda own, rng: [one for one in variants_of(own, rng) if one.name == "thickness"],
    )
    (found,) = fingers_sensitivity(board)
    (plain,) = score_fingers(board, [2], sets=PLACES, samples=0).counts
    known = cycle(plain.drives)  # the same for each end
    ends = []
    for factor in (1.0 - THICKNESS, 1.0 + THICKNESS):
        plate = dataclasses.replace(board.plate, thickness=factor * board.plate.thickness)
        off = dataclasses.replace(board, plate=plate)
        (own,) = score_fingers(off, [2], sets=PLACES, samples=0, solve=lambda _: next(known)).counts
        ends.append(own.isolation_db.p10)
    assert found.isolation_db == pytest.approx(min(ends) - plain.isolation_db.p10, abs=0.3)
