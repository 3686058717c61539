"""Fields less exact than was asked for are said to be; wrong ones are not handed out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.problem.problem import solved_board
from chladni.drives.solve import solve
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.board.parts import Image, Regions
from chladni.sim.errors import ToleranceError, check_estimate
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.fields.transfer import transfer_fields
from chladni.sim.ritz.basis.resolution import Resolution
from chladni.sim.ritz.plate import RitzPlate
from chladni.tables.build import build_table
from conftest import CommandLine


def with_basis(board: Board, resolution: Resolution) -> RitzPlate:
    return RitzPlate(plate_geometry(board), board.plate.loss_factor, resolution)


@pytest.fixture
def small(prototype: Board) -> Board:
    return replace(prototype, image=Image((24, 48)))


def test_an_unmet_tolerance_is_an_error_unless_it_is_allowed(small: Board) -> None:
    model = with_basis(small, Resolution(10, 14))
    fields = transfer_fields(small, model=model, tolerance=5e-3, allow_unmet=True)
    assert not fields.tolerance_met
    assert 5e-3 < fields.error_estimate < 0.05
    with pytest.raises(ToleranceError, match="move features") as caught:
        transfer_fields(small, model=model, tolerance=5e-3)
    assert caught.value.estimate == fields.error_estimate
    assert transfer_fields(small, tolerance=5e-3).tolerance_met


def test_a_field_that_is_no_field_is_never_handed_out(small: Board) -> None:
    """Four functions each way show nothing of nine features, and the estimate says so."""
    with pytest.raises(ToleranceError, match=r"above 0\.05"):
        transfer_fields(small, model=with_basis(small, Resolution(4, 4, 1, 1, 1)), allow_unmet=True)
    with pytest.raises(ToleranceError):
        check_estimate(0.051, 5e-3, allow_unmet=True)
    check_estimate(0.049, 5e-3, allow_unmet=True)


def test_commands_answer_whether_the_tolerance_is_met(chladni: CommandLine, tmp_path: Path) -> None:
    done = chladni("solve", "prototype", "--target", "10,25", "--json")
    assert done.json["tolerance_met"]
    assert 0.0 < done.json["error_estimate"] <= 5e-3
    assert done.err == ""
    out = tmp_path / "f.npz"
    done = chladni(
        "field", "paper", "--target", "10,25", "--tolerance", "1e-9", "-o", out, "--json"
    )
    assert done.code == 0
    assert done.json["tolerance_met"] == (done.json["error_estimate"] <= 1e-9)
    assert ("above the tolerance" in done.err) != done.json["tolerance_met"]


def test_what_a_solution_says_is_what_its_fields_say(prototype: Board) -> None:
    solved, found = solved_board(prototype), solve(prototype, (10.0, 25.0))
    assert found.error_estimate >= solved.fields.error_estimate
    assert found.tolerance_met


def test_a_frequency_asked_for_twice_is_stored_once(prototype: Board) -> None:
    board = replace(prototype, regions=Regions(pitch=40e-3))
    table, _ = build_table(board, frequencies_hz=(160.0, 120.0, 160.0))
    assert [section.frequency_hz for section in table.sections] == [160.0, 120.0]


def test_a_name_that_promises_another_format_is_refused(
    chladni: CommandLine, tmp_path: Path
) -> None:
    for arguments in (
        ("field", "prototype", "--target", "0,0", "-o", tmp_path / "x.csv"),
        ("modes", "prototype", "-o", tmp_path / "x.json"),
        ("compare", "prototype", "-o", tmp_path / "x.npz"),
    ):
        done = chladni(*arguments)
        assert done.code == 2
        assert "a name that ends in" in done.err
    assert not any(tmp_path.iterdir())


def test_a_byte_order_mark_is_no_fault(tmp_path: Path) -> None:
    """Editors on Windows write one."""
    text = shipped_boards()["paper"].read_text(encoding="utf-8")
    path = tmp_path / "bom.toml"
    path.write_text(text, encoding="utf-8-sig")
    board = load_board(path)
    assert board.name == "paper"
    assert np.isclose(board.plate.size[0], load_board("paper").plate.size[0])


def crowded(path: Path, screws: int) -> Path:
    """A board file of `prototype` with that many small screws in place of its own."""
    text = shipped_boards()["prototype"].read_text(encoding="utf-8")
    head, magnet = text[: text.index("[[screws]]")], text[text.index("[[actuators]]") :]
    places = [(-34.0 + 67.0 * (k % 16) / 15, -70.0 + 139.0 * (k // 16) / 15) for k in range(screws)]
    blocks = [f"[[screws]]\nat_mm = [{x:.3f}, {y:.3f}]\nradius_mm = 0.1\n" for x, y in places]
    path.write_text(head + "\n".join(blocks) + magnet, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ("field", "--target", "0,0", "-o", "x.npz"),
        ("modes",),
        ("solve", "--target", "0,0"),
        ("compare", "-o", "x.csv"),
        ("table", "build", "-o", "x.chl"),
        ("board", "show"),
    ],
)
def test_a_board_that_takes_too_much_memory_is_refused_before_the_work(
    chladni: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    board = crowded(tmp_path / "many.toml", 256)
    at = 2 if arguments[0] in ("table", "board") else 1
    done = chladni(*arguments[:at], board, *arguments[at:])
    assert done.code == 2
    assert "GB, more than 2: lower the number of screws (256)" in done.err
    assert done.err.rstrip().endswith("or go on with --large")
    assert "Traceback" not in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["many.toml"]


def test_work_that_takes_time_is_announced(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.sim.cost.ANNOUNCED_SECONDS", 0.01)
    done = chladni("field", "prototype", "--target", "0,0", "-o", tmp_path / "f.npz", "--json")
    assert done.code == 0
    assert "chladni: a plate of 899 functions: about " in done.err
    assert " GB" in done.err
    assert done.json["tolerance_met"]


def test_large_is_an_option_of_what_solves_a_plate(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.sim.cost.MOST_BYTES", 1e7)
    arguments = ("field", "prototype", "--target", "0,0", "-o", tmp_path / "f.npz")
    assert chladni(*arguments).code == 2
    assert chladni(*arguments, "--large").code == 0
    assert chladni(*arguments).code == 2  # allowed once, not for good
