"""Slopes of what coils feel of each other, against differences of solved plates."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from calibration.small_board import small_board
from chladni.calibration.slopes import compliance_slopes
from chladni.calibration.unknowns import Unknowns, unknowns_of
from chladni.drives.scoring.tolerances import with_soft_screws
from chladni.sim.board.file import parse_board
from chladni.sim.board.parts import Mass, Screw, Spring
from chladni.sim.fields.induced import open_coils

HZ = 160.0
SOFT = """
name = "soft"
[plate]
size_mm = [28.0, 28.0]
thickness_mm = 0.1
material = "FR4"
edges = "free"
[foundation]
material = "soft-pu-foam"
thickness_mm = 1.5
loss_factor = 0.2
coil_cut_out_mm = 3.0
[magnet]
radius_mm = 3.0
height_mm = 4.0
remanence_t = 1.28
density_kg_m3 = 7500.0
stiffness_ratio = 1000.0
[winding]
turns = 250
wire_mm = 0.1
inner_mm = 3.0
outer_mm = 9.0
height_mm = 1.5
gap_mm = 1.0
[image]
points = [57, 57]
"""


def differences(unknowns: Unknowns, values: np.ndarray) -> Callable[[int], np.ndarray]:
    """Of compliances by one unknown, either way a little."""

    def compliance(at: np.ndarray) -> np.ndarray:
        return open_coils(unknowns.board_at(at), HZ, tolerance=1e-3).compliance

    def difference(row: int) -> np.ndarray:
        step = np.zeros(values.size)
        step[row] = 0.1 * unknowns.spread[row]
        both = compliance(values + step) - compliance(values - step)
        return np.asarray(both / (2.0 * step[row]))

    return difference


def test_slopes_are_differences_of_solved_plates() -> None:
    """By every unknown of the plate but forces."""
    springs = (Spring((-0.025, 0.028), 20e3), Spring((0.026, -0.027), 20e3, loss_factor=0.2))
    weight = (Mass((-0.003, -0.027), 2e-3),)
    board = dataclasses.replace(
        small_board(), screws=(Screw((0.02, 0.026)),), springs=springs, masses=weight, winding=None
    )
    board = with_soft_screws(board, 0.002)
    unknowns = unknowns_of(board)
    values = unknowns.mean.copy()
    difference = differences(unknowns, values)
    coils = open_coils(unknowns.board_at(values), HZ, tolerance=1e-3)
    screws = difference(unknowns.scales.index("screws"))
    off = ~np.eye(len(board.actuators), dtype=bool)
    first = unknowns.places.start
    feet = range(*unknowns.foot_values.indices(values.size))
    rows = [*range(len(unknowns.scales)), unknowns.patch_values.start + 7, *feet, first, first + 5]
    solved = {"screws": screws, "modulus": difference(unknowns.scales.index("modulus"))}
    expected = {row: difference(row)[off] for row in rows}
    for told in ({"screws": screws}, solved):
        slopes = compliance_slopes(unknowns, unknowns.board_at(values), coils, HZ, told)
        for row in rows:
            found = slopes[row][off]
            # Image points are 1 mm apart, and a field bends under a point load.
            assert np.linalg.norm(found - expected[row]) < 0.05 * np.linalg.norm(expected[row]), row


def test_bending_of_a_soft_sheet_is_told_apart_from_its_foam() -> None:
    """Stiff magnets under coils that nearly touch: `quiet16`, smaller.

    Magnets are heavy, turn, and pull each other, and holes go with them. What a rim's own bending
    adds where a magnet moves is left out, so moves are told to a half.
    """
    at = ((-5.1, -5.0), (5.1, -5.2), (-5.0, 5.0), (5.2, 5.1))
    coils = "".join(f"[[actuators]]\nat_mm = [{x}, {y}]\n" for x, y in at)
    unknowns = unknowns_of(parse_board(SOFT + coils, file="soft.toml"))
    values = unknowns.mean.copy()
    rows = {own: unknowns.scales.index(own) for own in ("sheet thickness", "modulus", "foam")}
    values[[rows["sheet thickness"], rows["modulus"]]] = -0.09, 0.26
    values[rows["foam"]] = -0.3
    difference = differences(unknowns, values)
    made = unknowns.board_at(values)
    felt = open_coils(made, HZ, tolerance=1e-3)
    solved = {"modulus": difference(rows["modulus"])}
    slopes = compliance_slopes(unknowns, made, felt, HZ, solved)
    off = ~np.eye(len(at), dtype=bool)
    places = unknowns.places.start
    for row, most in ((rows["sheet thickness"], 0.03), (rows["foam"], 0.03), (places, 0.55)):
        expected = difference(row)[off]
        assert np.linalg.norm(slopes[row][off] - expected) < most * np.linalg.norm(expected)
