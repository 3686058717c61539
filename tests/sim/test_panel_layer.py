"""A touch panel's layer on a plate: against sums over layers that are made another way."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Panel
from chladni.sim.board.file import load_board
from chladni.sim.board.panel_layer import Layer, section_of
from chladni.sim.board.parts import Plate
from chladni.sim.fields.board_plate import plate_model
from conftest import ROOT, CommandLine

FR4 = Layer(0.1e-3, 22e9, 0.15, 1900.0, 0.02)
PET = Layer(0.125e-3, 4.5e9, 0.38, 1390.0, 0.02)
GLASS = Layer(0.55e-3, 70e9, 0.23, 2500.0, 0.002)


def still(layer: Layer, **changes: float) -> Layer:
    """Without loss, whose square is part of a complex stiffness's real part."""
    return replace(layer, loss_factor=0.0, **changes)


def with_panel(board: Board, **changes: object) -> Board:
    panel = board.panel or Panel(pixels=(480, 480), size=(50e-3, 50e-3))
    return replace(board, panel=replace(panel, **({"place": "on"} | changes)))  # type: ignore[arg-type]


def test_layers_of_one_material_are_one_plate() -> None:
    thin, thick = replace(FR4, thickness=0.3e-3), replace(FR4, thickness=0.7e-3)
    found = section_of([thin, thick])
    plate = Plate((0.1, 0.1), 1e-3, 22e9, 0.15, 1900.0, 0.02)
    assert found.bending_stiffness == pytest.approx(plate.bending_stiffness, rel=1e-12)
    assert found.areal_mass == pytest.approx(plate.areal_mass, rel=1e-12)
    assert (found.poissons_ratio, found.loss_factor) == pytest.approx((0.15, 0.02), rel=1e-12)


def test_without_poisson_s_ratio_it_is_the_composite_beam_of_textbooks() -> None:
    """Transformed section: Σ E (I + A d²) about the centroid of E A; a sandwich likewise."""
    layers = [still(one, poissons_ratio=0.0) for one in (FR4, PET, GLASS, FR4)]
    tops = np.cumsum([one.thickness for one in layers])
    middles = tops - [one.thickness / 2.0 for one in layers]
    stretch = np.array([one.youngs_modulus * one.thickness for one in layers])
    axis = (stretch * middles).sum() / stretch.sum()
    own = np.array([one.youngs_modulus * one.thickness**3 / 12.0 for one in layers])
    wanted = (own + stretch * (middles - axis) ** 2).sum()
    assert section_of(layers).bending_stiffness == pytest.approx(wanted, rel=1e-12)


def laminate(layers: list[Layer]) -> NDArray[np.float64]:
    """D − B A⁻¹ B with whole 2 × 2 matrices, by integration over fine slices."""
    a, b, d = np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 2))
    bottom = 0.0
    for layer in layers:
        nu = layer.poissons_ratio
        own = layer.youngs_modulus / (1.0 - nu**2) * np.array([[1.0, nu], [nu, 1.0]])
        edges = np.linspace(bottom, bottom + layer.thickness, 2001)
        z, dz = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)
        a += own * dz.sum()
        b += own * (z * dz).sum()
        d += own * (z**2 * dz).sum()
        bottom += layer.thickness
    return np.asarray(d - b @ np.linalg.solve(a, b))


@pytest.mark.parametrize("layers", [[FR4, PET], [FR4, GLASS], [PET, FR4, GLASS, PET]])
def test_unlike_poisson_s_ratios_meet_as_whole_matrices_do(layers: list[Layer]) -> None:
    """Slices err by 1/2000² of a layer's own share."""
    layers = [still(one) for one in layers]
    wanted, found = laminate(layers), section_of(layers)
    assert found.bending_stiffness == pytest.approx(wanted[0, 0], rel=1e-6)
    assert found.poissons_ratio == pytest.approx(wanted[0, 1] / wanted[0, 0], rel=1e-6)
    turned = section_of(layers[::-1])
    assert turned.bending_stiffness == pytest.approx(found.bending_stiffness, rel=1e-9)


def test_a_layer_loses_its_share_of_the_bending_energy() -> None:
    """To first order in η: d ln D / d ln E of each layer, by differences of real stiffness."""
    layers, losses = [FR4, GLASS], np.array([0.02, 0.002])
    free = [still(one) for one in layers]
    shares = []
    for k in range(2):
        stiffness = []
        for sign in (1.0, -1.0):
            one = replace(free[k], youngs_modulus=free[k].youngs_modulus * (1 + sign * 1e-5))
            stiffness.append(section_of([*free[:k], one, *free[k + 1 :]]).bending_stiffness)
        shares.append((stiffness[0] - stiffness[1]) / 2e-5 / section_of(free).bending_stiffness)
    assert sum(shares) == pytest.approx(1.0, rel=1e-6)
    assert section_of(layers).loss_factor == pytest.approx(float(losses @ shares), rel=1e-3)


def test_a_film_on_quiet16_is_five_times_its_stiffness() -> None:
    bare = load_board("quiet16")
    film = with_panel(bare, film=0.125e-3)
    ratio = film.section.bending_stiffness / bare.section.bending_stiffness
    assert ratio == pytest.approx(4.9, abs=0.1)
    assert film.section.areal_mass == pytest.approx(0.19 + 1390.0 * 0.125e-3)
    # Other drives: a table for the bare board does not fit.
    assert film.fingerprint() != bare.fingerprint()
    assert with_panel(bare, place="beside").fingerprint() == bare.fingerprint()


def test_the_plate_bends_as_its_layers_do(prototype: Board) -> None:
    """Frequencies go as √(D/m): a layer of the plate's own material thickens it."""
    bare = replace(
        prototype, screws=(), magnet=None, image=replace(prototype.image, points=(11, 21))
    )
    half = replace(bare, plate=replace(bare.plate, thickness=0.5e-3))
    material = {
        "youngs_modulus": 22e9,
        "poissons_ratio": 0.15,
        "density": 1900.0,
        "loss_factor": 0.02,
        "material": "FR4",
    }
    both = with_panel(half, film=0.5e-3, **material)
    wanted, found = (plate_model(one).natural_frequencies(5) for one in (bare, both))
    # The first three are the free plate's rigid motions.
    assert found[3:] == pytest.approx(wanted[3:], rel=1e-9)


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ('place = "over"', "panel.place: expected one of: 'on', 'in', 'beside'"),
        ('place = "on"', "panel.film_mm"),
        ('place = "in"\nfilm_mm = 0.1', "panel.place: expected 'on' where a layer is glued"),
        ("film_mm = 0.1\nglass_mm = 0.1", "panel.glass_mm: expected nothing beside film_mm"),
        ("glass_mm = 1.1", "such a glass is the plate, and the sheet its film"),
        ('film_mm = 0.1\nside = "both"', "a panel is on one side"),
        ('film_mm = 0.1\nmaterial = "rubber"', "panel.material: expected one of: 'FR4'"),
        ("film_mm = -1", "panel.film_mm"),
    ],
)
def test_a_layer_that_is_none_is_named(
    chladni: CommandLine, tmp_path: Path, lines: str, told: str
) -> None:
    text = (ROOT / "boards" / "prototype.toml").read_text("utf-8")
    kept = "\n".join(line for line in text.splitlines() if not line.startswith("place ="))
    path = tmp_path / "b.toml"
    path.write_text(kept.replace("[panel]", f"[panel]\n{lines}", 1), "utf-8")
    answer = chladni("board", "show", path)
    assert answer.code == 2
    assert told in answer.err


def test_show_says_what_a_panel_does(chladni: CommandLine, tmp_path: Path) -> None:
    text = (ROOT / "boards" / "quiet16.toml").read_text("utf-8")
    path = tmp_path / "b.toml"
    line = next(line for line in text.splitlines() if line.startswith("place ="))
    path.write_text(text.replace(line, "film_mm = 0.125"), "utf-8")
    shown = chladni("board", "show", path, "--json")
    assert shown.json["panel"]["stiffness_ratio"] == pytest.approx(4.9, abs=0.1)
    assert [shown.json["panel"][f"senses_{axis}_mm"] for axis in "xy"] == 2 * [[-25.0, 25.0]]
    assert shown.json["sheet"] == "FR4, 50 × 50 × 0.1 mm"
    assert "4.9 times as stiff" in shown.err
    assert "or place 'in' or 'beside'" in shown.err
    path.write_text(text.replace(line, ""), "utf-8")
    assert "say film_mm" in chladni("board", "show", path).err
    assert "panel" not in chladni("board", "show", "quiet16").err
