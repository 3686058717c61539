"""Figures of boards that stand and of boards that lie: where pictures go, and what is on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.transforms import TransformedPath
from numpy.typing import NDArray

from chladni.drives import score, solve
from chladni.drives.scoring.board_score import score_board
from chladni.drives.scoring.compare import compare
from chladni.host import figures
from chladni.host.figures.fields import explain_marks
from chladni.sim import target_field
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Pin, Spring
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import actuator_loads
from conftest import CommandLine
from wide import turned

PLACE = (10.0, 25.0)
PITCH = 35e-3


def of_field(board: Board, place: tuple[float, float]) -> Figure:
    field = target_field(board, place).values[0]
    return figures.field_figure(board, field, target_mm=place)


def of_solution(board: Board, place: tuple[float, float]) -> Figure:
    solution = solve(board, place)
    return figures.solution_figure(board, solution, score(solution, board))


def of_score(board: Board, place: tuple[float, float]) -> Figure:
    del place
    return figures.score_figure(board, score_board(board, pitch=PITCH, samples=0))


def of_modes(board: Board, place: tuple[float, float]) -> Figure:
    del place
    shapes = plate_model(board).modes(4, actuator_loads(board), board.x, board.y)
    return figures.modes_figure(board, shapes)


def of_methods(board: Board, place: tuple[float, float]) -> Figure:
    del place
    return figures.compare_figure(board, *compare(board, pitch=PITCH, methods=["nearest"]))


DRAWN: dict[str, tuple[Callable[[Board, tuple[float, float]], Figure], set[str], int]] = {
    "field": (of_field, {"actuator", "screw", "target", "maximum"}, 2),
    "solution": (
        of_solution,
        {"actuator", "screw", "target", "maximum", "loudest second finger"},
        2,
    ),
    "score": (of_score, {"actuator", "screw"}, 3),
    "modes": (of_modes, {"actuator", "screw"}, 4),
    "methods": (of_methods, {"actuator", "screw"}, 3),
}
"""How it is made, what its legend explains, how many pictures of the board it has."""


def boards(figure: Figure) -> list[Axes]:
    """Pictures of the board: what keeps its shape."""
    return [axes for axes in figure.axes if axes.get_aspect() == 1.0]


def at(line: Line2D) -> NDArray[np.float64]:
    """Where a mark is, mm."""
    return np.asarray(np.asarray(line.get_xydata(), dtype=np.float64)[0])


@pytest.mark.parametrize("is_wide", [False, True])
@pytest.mark.parametrize("kind", DRAWN)
def test_pictures_fill_their_room_and_are_explained(
    prototype: Board, kind: str, is_wide: bool
) -> None:
    """A board that lies is drawn as large as one that stands, and nothing lies over it."""
    make, words, count = DRAWN[kind]
    board = turned(prototype) if is_wide else prototype
    figure = make(board, PLACE[::-1] if is_wide else PLACE)
    figure.draw_without_rendering()  # lays it out
    pictures = boards(figure)
    assert len(pictures) == count
    legends = [*figure.legends, *(one for part in figure.subfigs for one in part.legends)]
    legends += [one for part in figure.subfigs for own in part.subfigs for one in own.legends]
    assert {text.get_text() for one in legends for text in one.get_texts()} == words
    boxes = [axes.get_position().transformed(axes.figure.transSubfigure) for axes in pictures]
    for one in legends:
        assert not any(one.get_window_extent().overlaps(box) for box in boxes)
    width, height = board.plate.size
    for box in boxes:
        assert box.width / box.height == pytest.approx(width / height, rel=0.02)
    for k, box in enumerate(boxes):
        for other in boxes[k + 1 :]:
            assert not box.overlaps(other)
    if kind in ("field", "solution", "score"):
        # Next to each other along their short sides, which leaves the long ones their length.
        corners = {round(box.x0 if is_wide else box.y0) for box in boxes}
        assert max(corners) - min(corners) <= 2.0
    # A third of the paper is boards: there were figures of which a tenth was.
    assert sum(box.width * box.height for box in boxes) > (0.2 if kind == "solution" else 0.3) * (
        figure.bbox.width * figure.bbox.height
    )


def test_the_maximum_is_marked_where_it_is(prototype: Board) -> None:
    solution = solve(prototype, PLACE)
    card = score(solution, prototype)
    made = boards(figures.solution_figure(prototype, solution, card))[1]
    marks = {str(line.get_marker()): at(line) for line in made.lines}
    assert marks["+"].tolist() == list(PLACE)
    off = np.hypot(*(marks["s"] - marks["+"]))
    assert off == pytest.approx(card.focal_error_mm, abs=1e-6)


def test_a_drive_from_a_file_has_its_target_and_unit(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    draw = figures.field_figure

    def kept(*arguments: Any, **options: Any) -> Figure:
        drawn.append(draw(*arguments, **options))
        return drawn[-1]

    monkeypatch.setattr("chladni.host.figures.fields.field_figure", kept)
    drive = tmp_path / "d.json"
    solved = chladni("solve", "prototype", "--target", "10,25", "--json").out
    for text, targets in ((solved, [[10.0, 25.0]]), (solved.replace('"target_mm"', '"x"'), [])):
        drive.write_text(text, encoding="utf-8")
        answer = chladni(
            "field",
            "prototype",
            "--drive",
            drive,
            "-o",
            tmp_path / "f.npz",
            "--figure",
            tmp_path / "f.png",
        )
        assert answer.code == 0, answer.err
        left = drawn[-1].axes[0]
        marks = [at(line).tolist() for line in left.lines if line.get_marker() == "+"]
        assert marks == targets
        assert "displacement / µm, gains in newtons" in [a.get_ylabel() for a in drawn[-1].axes]
    chladni(
        "field",
        "prototype",
        "--target",
        "10,25",
        "-o",
        tmp_path / "f.npz",
        "--figure",
        tmp_path / "f.png",
    )
    assert "displacement / µm per newton" in [axes.get_ylabel() for axes in drawn[-1].axes]


def test_solve_draws_with_and_without_a_trace(chladni: CommandLine, tmp_path: Path) -> None:
    arguments = ("solve", "paper", "--target", "10,25", "--figure", tmp_path / "s.png")
    assert chladni(*arguments).code == 0
    short = (tmp_path / "s.png").stat().st_size
    traced = ("--method", "anneal", "--steps", "20", "--trace", tmp_path / "t.npz")
    assert chladni(*arguments, *traced).code == 0
    assert (tmp_path / "s.png").stat().st_size != short


@pytest.mark.parametrize("kind", DRAWN)
def test_every_axis_with_numbers_says_what_they_are(prototype: Board, kind: str) -> None:
    """Or shares them: of modes the rows of pictures do, for each has the same board."""
    figure = DRAWN[kind][0](prototype, PLACE)
    figure.draw_without_rendering()
    shared = {"x": kind == "modes", "y": kind == "modes"}
    for axes in figure.axes:
        if not axes.axison:
            continue
        for axis, own in (("x", axes.xaxis), ("y", axes.yaxis)):
            has_numbers = any(text.get_text() for text in own.get_ticklabels())
            assert own.get_label().get_text() or shared[axis] or not has_numbers, axes.get_title()


def test_feet_and_coils_outlines_are_drawn(prototype: Board) -> None:
    strip = load_board("strip5")
    board = replace(strip, springs=(Spring((5e-3, 27e-3), 2e4),), pins=(Pin((-5e-3, -27e-3)),))
    figure = Figure()
    axes = figure.subplots()
    figures.draw_board(axes, board)
    marks = [at(line).tolist() for line in axes.lines if line.get_marker() == "^"]
    assert marks == [[5.0, 27.0], [-5.0, -27.0]]
    outlines = {(*one.center, one.radius) for one in axes.patches if isinstance(one, Circle)}
    assert outlines == {(0.0, 12.0 * k, 5.0) for k in range(-2, 3)}
    explain_marks(figure, board)
    assert "foot" in [text.get_text() for text in figure.legends[0].get_texts()]
    plain = Figure()
    explain_marks(plain, prototype)
    assert "foot" not in [text.get_text() for text in plain.legends[0].get_texts()]


def test_levels_have_0_db_in_the_middle_of_their_colours(prototype: Board) -> None:
    """And what fingers notice is marked on the scale, wherever the levels lie."""
    found = score_board(prototype, pitch=PITCH, samples=0)
    for shift in (0.0, 40.0, -found.maps.second_finger_20mm_db):
        maps = replace(found.maps, second_finger_20mm_db=found.maps.second_finger_20mm_db + shift)
        figure = figures.score_figure(prototype, replace(found, maps=maps))
        low, high = figure.axes[0].collections[0].get_clim()
        assert low is not None
        assert high is not None
        assert high == pytest.approx(-low)
        assert high > 2.3
        (bar,) = [axes for axes in figure.axes if axes.get_ylabel().startswith("dB")]
        assert [np.asarray(line.get_ydata())[0] for line in bar.lines] == [-2.3, 2.3]
        assert "lines on the scale: 2.3 dB" in figure.axes[0].get_title()
        # Distances that hardly differ look alike: colours begin at 0.
        assert figure.axes[1].collections[0].get_clim()[0] == 0.0


def test_what_lies_beyond_round_corners_is_not_drawn(prototype: Board) -> None:
    board = replace(prototype, plate=replace(prototype.plate, corner_radius=5e-3))
    figure = Figure()
    axes = figure.subplots()
    figures.draw_board(axes, board)
    field = np.ones((len(board.x), len(board.y)), dtype=np.complex128)
    field[0, 0] = 0.0  # as it is where there is no plate
    image = figures.draw_image(axes, board, field)
    values = image.get_array()
    assert values is not None
    assert values[0, 0] == values[0, 10] != 0.0
    clip = image.get_clip_path()
    assert isinstance(clip, TransformedPath)
    path, transform = clip.get_transformed_path_and_affine()
    half_x, half_y = np.divide(board.plate.size, 2e-3)
    for off, is_drawn in ((1.0, False), (2.0, True)):
        x, y = axes.transData.transform((half_x - off, half_y - off))
        assert path.contains_point((float(x), float(y)), transform) == is_drawn
