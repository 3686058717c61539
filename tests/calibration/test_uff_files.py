"""Files of UFF 58 as instruments write them: nodes, kinds, units, ends of line, and torn ones."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import pyuff

from calibration.small_board import small_board
from chladni.calibration.laboratory.measured_fields import MeasuredFields
from chladni.calibration.laboratory.measured_files import read_measured
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError

PLACES_MM = [(-17.0, -20.0), (-4.0, 4.0), (9.0, 12.0), (22.0, -8.0)]
HZ = (80.0, 160.0, 320.0)


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


@pytest.fixture(scope="module")
def measured(board: Board) -> MeasuredFields:
    """Random values: what a file carries is asked for, not what a plate does."""
    coils = len(board.actuators)
    rows = coils * len(PLACES_MM) * len(HZ)
    parts = np.random.default_rng(3).standard_normal((2, rows))
    return MeasuredFields(
        np.repeat(np.arange(coils), len(PLACES_MM) * len(HZ)),
        1e-3 * np.tile(np.repeat(PLACES_MM, len(HZ), axis=0), (coils, 1)),
        np.tile(HZ, coils * len(PLACES_MM)),
        1e-6 * (parts[0] + 1j * parts[1]),
    )


def write_uff(path: Path, fields: MeasuredFields, board: Board, **others: int) -> None:
    """Nodes 1 and up are places, 1001 and up coils; one response per coil and place."""
    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    places, number = np.unique(fields.places, axis=0, return_inverse=True)
    nodes = np.concatenate((places, [own.at for own in board.actuators]))
    numbers = [*range(1, len(places) + 1), *range(1001, 1001 + len(board.actuators))]
    zeros = dict.fromkeys(("def_cs", "disp_cs", "color", "z"), np.zeros(len(nodes)))
    nodes_set = {"type": 15, "node_nums": numbers, "x": nodes[:, 0], "y": nodes[:, 1]} | zeros
    file.write_sets(nodes_set, "overwrite")
    texts = dict.fromkeys(("id1", "id2", "id3", "id4", "id5"), "")
    names = dict.fromkeys(("rsp_ent_name", "ref_ent_name"), "NONE")
    kinds = {"ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13, "ord_data_type": 5}
    usual: dict[str, object] = {
        "type": 58,
        "func_type": 4,
        "binary": 0,
        "ver_num": 0,
        "load_case_id": 0,
    }
    usual |= texts | names | kinds | {"abscissa_spec_data_type": 18, "rsp_dir": 3, "ref_dir": 3}
    for coil in range(len(board.actuators)):
        for place in range(len(places)):
            at = (fields.coils == coil) & (number.ravel() == place)
            values, hz = fields.values[at], fields.hz[at]
            own: dict[str, object] = {"rsp_node": place + 1, "ref_node": 1001 + coil, "x": hz}
            own |= {"data": values * (2j * np.pi * hz) ** 2}
            file.write_sets(usual | own | others, "add")


def test_uff_is_read_with_its_nodes_and_its_kind(
    board: Board, measured: MeasuredFields, tmp_path: Path
) -> None:
    path = tmp_path / "m.uff"
    write_uff(path, measured, board)
    found = read_measured(path, board)
    assert (found.response, found.per) == ("acceleration", "force")
    order, wanted = (
        np.lexsort((own.hz, own.places[:, 1], own.places[:, 0], own.coils))
        for own in (found, measured)
    )
    assert found.compliance(board)[order] == pytest.approx(measured.values[wanted], rel=1e-4)
    assert found.places[order] == pytest.approx(measured.places[wanted], abs=1e-7)
    write_uff(path, measured, board, ref_dir=-3)
    assert read_measured(path, board).values == pytest.approx(-found.values)
    units = {"type": 164, "units_code": 9, "units_description": "User", "temp_mode": 1}
    units |= {"force": 1.0, "temp": 1.0, "temp_offset": 1.0}
    pyuff.UFF(str(path)).write_sets(units | {"length": 1.0}, "add")
    assert read_measured(path, board).values == pytest.approx(-found.values)
    pyuff.UFF(str(path)).write_sets(units | {"length": 1000.0}, "add")
    with pytest.raises(InputError, match="units: expected 1, SI"):
        read_measured(path, board)
    for others, said in (
        ({"rsp_dir": 1}, "across the board"),
        ({"func_type": 2}, "58 of function 4.*got '15, 58 of function 2'"),
        ({"ref_node": 3}, "driven at the place of a coil"),
    ):
        write_uff(path, measured, board, **others)
        with pytest.raises(InputError, match=said):
            read_measured(path, board)


@pytest.mark.parametrize("end", [b"", b"\n", b"\r\n", b"\r", b"\n\n"])
def test_ends_of_line_after_binary_values_change_none(
    board: Board, measured: MeasuredFields, tmp_path: Path, end: bytes
) -> None:
    """The data of 58b end without one; some instruments write CR and LF there."""
    path = tmp_path / "m.uff"
    write_uff(path, measured, board, binary=1)
    wanted = read_measured(path, board)
    assert wanted.compliance(board) == pytest.approx(read_ascii(tmp_path, measured, board))
    nodes, *sets = path.read_bytes().split(b"    -1\n    -1\n")
    assert len(sets) == len(board.actuators) * len(PLACES_MM)
    last = sets.pop().removesuffix(b"    -1\n")
    path.write_bytes(b"    -1\n    -1\n".join([nodes, *(own + end for own in [*sets, last])]))
    with path.open("ab") as file:
        file.write(b"    -1\n")
    found = read_measured(path, board)
    assert np.array_equal(found.values, wanted.values)
    assert np.array_equal(found.places, wanted.places)


def read_ascii(folder: Path, fields: MeasuredFields, board: Board) -> np.ndarray:
    path = folder / "ascii.uff"
    write_uff(path, fields, board)
    return read_measured(path, board).compliance(board)


@pytest.mark.parametrize("binary", [0, 1])
def test_a_file_cut_within_a_set_is_refused(
    board: Board, measured: MeasuredFields, tmp_path: Path, binary: int
) -> None:
    path = tmp_path / "m.uff"
    write_uff(path, measured, board, binary=binary)
    whole = path.read_bytes()
    sets = len(board.actuators) * len(PLACES_MM) + 1
    opens = [at.start() for at in re.finditer(b"    -1\n    +(?:15|58)", whole)]
    assert len(opens) == sets
    cuts = np.random.default_rng(7).integers(0, len(whole) - 8, 40).tolist()
    for end in (*cuts, *(at + 7 for at in opens[1:]), opens[-1] + 6):
        # Between two sets nothing tells that there were more.
        if any(at <= end < at + 6 for at in opens):
            continue
        path.write_bytes(whole[:end])
        with pytest.raises(InputError, match=r"cut short|datasets: expected"):
            read_measured(path, board)


@pytest.mark.parametrize("after", [b"\x1a", b"\0" * 512, b"\n\n", b"# checked\n"])
def test_what_follows_the_last_set_is_no_part_of_it(
    board: Board, measured: MeasuredFields, tmp_path: Path, after: bytes
) -> None:
    path = tmp_path / "m.uff"
    write_uff(path, measured, board)
    wanted = read_measured(path, board).values
    path.write_bytes(path.read_bytes() + after)
    assert np.array_equal(read_measured(path, board).values, wanted)
