"""A search and a score are counted before they begin, with the plate that they are on."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from chladni.drives.problem.problem import solved_board
from chladni.drives.problem.search_cost import LARGE, field_cost, for_focus, search_cost
from chladni.drives.solve import solve
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Image
from chladni.sim.board.writing import board_file
from chladni.sim.cost import Cost, begin
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.image.energy import compose
from chladni.sim.image.metrics import FingertipDiscs
from chladni.tables.format import pack, read_table
from conftest import CommandLine, shipped_board


def with_points(board: Board, x: int, y: int) -> Board:
    return replace(board, image=Image((x, y)))


def written(board: Board, folder: Path) -> Path:
    path = folder / "own.toml"
    path.write_bytes(board_file(board))
    return path


@pytest.mark.parametrize(
    "command",
    [
        ("solve", "BOARD", "--target", "10,25", "--objective", "ssim"),
        ("compare", "BOARD", "--methods", "phasor"),
        ("board", "score", "BOARD"),
        ("board", "sensitivity", "BOARD"),
        ("table", "build", "BOARD", "-o", "OUT"),
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_an_image_of_eight_million_points_is_refused(
    chladni: CommandLine, prototype: Board, tmp_path: Path, command: tuple[str, ...]
) -> None:
    """5.5 GB and 73 s without a word before."""
    out = tmp_path / "t.chl"
    names = {
        "BOARD": str(written(with_points(prototype, 2001, 4001), tmp_path)),
        "OUT": str(out),
    }
    done = chladni(*(names.get(word, word) for word in command))
    assert done.code == 2
    assert "a search on 8,006,001 image points takes about 9.8 GB, more than 2" in done.err
    assert "lower image.points, or go on with --large" in done.err
    assert not out.exists()


def test_usual_images_are_neither_refused_nor_announced(prototype: Board) -> None:
    cost = search_cost(prototype, plate_model(prototype).cost(160.0, 1e-4, 65_693).bytes)
    assert cost.bytes < 0.5e9
    assert cost.seconds == 0.0
    large = search_cost(with_points(prototype, 401, 801), 0.0)
    assert large.seconds > 1.0


def test_a_field_is_counted_too(chladni: CommandLine, prototype: Board, tmp_path: Path) -> None:
    """2.8 GB without a word before; arrays of 8 million points, counted by numpy, are less."""
    path = written(with_points(prototype, 4901, 4901), tmp_path)
    done = chladni("field", path, "--target", "10,25", "-o", tmp_path / "f.npz")
    assert done.code == 2
    assert "a field on 24,019,801 image points takes about 2.8 GB, more than 2" in done.err
    least = 16 + 8 + 16 + 8  # a response and its image, and both as they are written
    counted = field_cost(with_points(prototype, 401, 801)).bytes / (401 * 801)
    assert least < counted < 3 * least
    # An image that is usual is written in less than a second; 2 million points were 3.5 s.
    assert field_cost(prototype).seconds < 0.5
    assert 2.0 < field_cost(with_points(prototype, 1001, 2001)).seconds < 7.0


def test_what_takes_memory_is_announced_without_a_time_that_no_one_knows(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level("INFO", "chladni")
    begin(Cost("a survey", 0.6e9, 0.0, "samples"))
    begin(Cost("another", 0.4e9, 0.5, "samples"))
    begin(Cost("a field", 0.1e9, 12.0, "image.points"))
    assert caplog.messages == ["a survey: about 0.6 GB", "a field: about 12 s and 0.1 GB"]


def test_a_board_is_scored_for_a_focus_on_less(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(with_points(shipped_board("strip5"), 501, 2001), tmp_path)
    asked: list[Board] = []

    def scored(board: Board, **_: object) -> None:
        asked.append(board)
        raise InputError("stop", 1, "no score")

    monkeypatch.setattr("chladni.host.cli.board_score.score_board", scored)
    done = chladni("board", "score", path)
    assert "a finger needs no image of 501 × 2001 points: 29 × 121 are used" in done.err
    assert asked[0].image.points == (29, 121)


def test_tables_for_fingers_come_of_less_and_play_on_less(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """And still know the board that has the larger image: it would take 4.1 GB."""
    board = shipped_board("strip5")
    few = replace(board, regions=replace(board.regions, pitch=14e-3))
    path = written(with_points(few, 501, 2001), tmp_path)
    table = str(tmp_path / "t.chl")
    assert chladni("table", "build", path, "-o", table).code == 0
    (tmp_path / "usual").mkdir()
    usual = str(tmp_path / "usual" / "t.chl")
    assert chladni("table", "build", written(few, tmp_path / "usual"), "-o", usual).code == 0
    made = [replace(read_table(Path(one)), board_fingerprint=0) for one in (table, usual)]
    assert pack(made[0]) == pack(made[1])
    played = ("--touch", "0,0@20", "--ms", "200", "-o", str(tmp_path / "pins.npz"))
    for command in (
        ("emulate", table, "--board", path, *played),
        ("fingers", path, "--fingers", "2", "--sets", "2", "--samples", "0"),
    ):
        done = chladni(*command)
        assert done.code == 0
        assert "a finger needs no image of 501 × 2001 points: 29 × 121 are used" in done.err


def test_a_focus_needs_no_larger_image(prototype: Board) -> None:
    assert for_focus(prototype) is prototype
    large = with_points(prototype, 1001, 2001)
    less = for_focus(large)
    assert math.prod(less.image.points) < LARGE < math.prod(large.image.points)
    # A wide board whose usual image is as large has no smaller one.
    usual = replace(prototype, image=Image((401, 401)))
    assert math.prod(for_focus(usual).image.points) <= 401 * 401


def test_a_focus_on_less_of_an_image_is_the_same_focus() -> None:
    """Of nine times the points: means over fingertips are of the same plate, within 0.1 dB."""
    strip = shipped_board("strip5")
    fine = with_points(strip, 3 * 29 - 2, 3 * 121 - 2)
    fields, discs = solved_board(fine).fields, FingertipDiscs(fine.x, fine.y)
    levels = []
    for board in (strip, fine):
        field = compose(fields.values, solve(board, (0.0, 6.0), objective="focus").drive)
        levels.append(discs.second_finger_db(field, (0.0, 6e-3), [0.02])[0])
    assert levels[0] == pytest.approx(levels[1], abs=0.1)


@pytest.mark.soak
def test_the_estimate_is_within_a_factor_of_two_of_the_peak(
    prototype: Board, tmp_path: Path
) -> None:
    """Of the largest process that this one has waited for, in which nothing else runs."""
    board = with_points(prototype, 401, 801)
    path, points = written(board, tmp_path), 401 * 801
    command = [sys.executable, "-m", "chladni.host.cli.app", "solve", path, "--target", "10,25",
               "--objective", "ssim"]  # fmt: skip
    script = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, "
        "stdout=subprocess.DEVNULL); "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, command)],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    taken = 1024.0 * float(done.stdout)
    counted = search_cost(board, plate_model(board).cost(160.0, 1e-4, points).bytes).bytes
    assert 0.5 * taken < counted < 2.0 * taken
