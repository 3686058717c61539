"""Fields that a laboratory measured: their files, units and axes, and the board that has them."""

from __future__ import annotations

import dataclasses
import gc
from pathlib import Path

import numpy as np
import pytest

from calibration.small_board import small_board
from chladni.calibration import hidden_plate
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.laboratory.fields_at_places import FieldsAtPlaces
from chladni.calibration.laboratory.fields_fit import fit_fields
from chladni.calibration.laboratory.measured_fields import (
    PERS,
    RESPONSES,
    MeasuredFields,
    Per,
    Response,
)
from chladni.calibration.laboratory.measured_files import fields_csv, read_measured
from chladni.sim.board.board import Board
from chladni.sim.board.foundation import Patch
from chladni.sim.errors import InputError
from chladni.sim.fields.induced import open_coils
from chladni.sim.plate.response import PlateModel
from conftest import CommandLine

SEED = 4
"""Of a plate with a reversed coil."""
HZ = (80.0, 160.0, 320.0)
PLACES = [(x, y) for x in np.linspace(-26.0, 26.0, 7) for y in np.linspace(-28.0, 28.0, 8)]
HEADER = "coil,x_mm,y_mm,hz,real,imag"


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


@pytest.fixture(scope="module")
def hidden(board: Board) -> HiddenPlate:
    """With a coil that is reversed, and one that is dead."""
    plate = hidden_plate(board, SEED)
    strengths = plate.strengths.copy()
    strengths[2] = 0.0
    return dataclasses.replace(plate, strengths=strengths)


@pytest.fixture(scope="module")
def measured(board: Board, hidden: HiddenPlate) -> MeasuredFields:
    """Each value 2 % of the largest off."""
    return fields_of(board, hidden, noise=0.02)


def fields_of(board: Board, hidden: HiddenPlate, noise: float) -> MeasuredFields:
    """Displacement over force at 56 places, with noise as a share of each field's largest."""
    rng = np.random.default_rng(5)
    places = 1e-3 * np.array(PLACES)
    ix, iy = (
        [int(np.argmin(np.abs(axis - at))) for at in own]
        for axis, own in zip((board.x, board.y), places.T, strict=True)
    )
    rows = []
    for hz in HZ:
        fields = np.asarray(open_coils(hidden.board, hz, tolerance=1e-3).fields.values)
        for coil, field in enumerate(fields):
            values = hidden.strengths[coil] * field[ix, iy]
            off = noise * np.abs(field).max() * rng.standard_normal((2, values.size))
            rows.append((coil, hz, values + off[0] + 1j * off[1]))
    at = np.stack((board.x[ix], board.y[iy]), axis=1)
    count = len(at)
    return MeasuredFields(
        np.repeat([coil for coil, _, _ in rows], count),
        np.tile(at, (len(rows), 1)),
        np.repeat([hz for _, hz, _ in rows], count),
        np.concatenate([values for _, _, values in rows]),
    )


def test_the_board_that_has_these_fields_is_found(
    board: Board, hidden: HiddenPlate, measured: MeasuredFields
) -> None:
    found = fit_fields(board, measured)
    assert found.wiring.signs.tolist() == np.sign(hidden.strengths).tolist()
    alive = hidden.strengths != 0.0
    forces = np.array([abs(own.strength) for own in found.board.actuators])
    assert forces[alive] == pytest.approx(np.abs(hidden.strengths[alive]), abs=0.2)
    foam = next(own for own in found.parameters if own.name == "foam")
    assert hidden.board.foundation is not None
    patches = [patch.ratio for patch in hidden.board.foundation.patches]
    true = hidden.board.foundation.measured_ratio * float(np.exp(np.mean(np.log(patches))))
    assert foam.told
    assert foam.value == pytest.approx(true, rel=0.15)
    assert foam.low < true < foam.high
    # Noise is a share of each field's largest value, and most of what is left.
    assert found.left < 0.2


def test_foam_is_found_in_patches(board: Board, hidden: HiddenPlate) -> None:
    """Twice as stiff on the right as on the left, beside places and forces that are off."""
    own = hidden.board.foundation
    assert own is not None
    patches = tuple(Patch(one.at, 2.0 ** (0.5 * np.sign(one.at[0]))) for one in own.patches)
    uneven = dataclasses.replace(own, patches=patches)
    plate = dataclasses.replace(hidden.board, foundation=uneven)
    measured = fields_of(board, dataclasses.replace(hidden, board=plate), noise=1e-3)
    found = fit_fields(board, measured).board.foundation
    assert found is not None
    left, right = (
        np.mean([np.log(one.ratio) for one in found.patches if side * one.at[0] > 5e-3])
        for side in (-1.0, 1.0)
    )
    assert right - left == pytest.approx(np.log(2.0), abs=0.3)


@pytest.mark.parametrize("response", RESPONSES)
@pytest.mark.parametrize("per", PERS)
def test_every_unit_is_the_same_field(
    board: Board, measured: MeasuredFields, response: Response, per: Per
) -> None:
    """By hand: velocity is iω times displacement, a newton is BL amperes, an ampere Z volts."""
    assert board.coil is not None
    omega = 2.0 * np.pi * measured.hz
    values = measured.values * (1j * omega) ** ("displacement", "velocity", "acceleration").index(
        response
    )
    if per != "force":
        values = values * board.coil.force_factor
    if per == "voltage":
        values = values / (board.coil.resistance + 1j * omega * board.coil.inductance)
    told = dataclasses.replace(measured, values=values, response=response, per=per)
    assert told.compliance(board) == pytest.approx(measured.values)


def wrong(measured: MeasuredFields, how: str) -> MeasuredFields:
    places, coils = measured.places, measured.coils
    if how == "swapped":
        order = np.array([0, 4, 2, 3, 1, 5])
        return dataclasses.replace(measured, coils=order[coils])
    if how == "units":
        return dataclasses.replace(measured, values=1e3 * measured.values)
    turn = {
        "x": np.diag((-1.0, 1.0)),
        "y": np.diag((1.0, -1.0)),
        "axes": np.array([[0.0, 1.0], [1.0, 0.0]]),
    }[how]
    return dataclasses.replace(measured, places=places @ turn)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("x", "x mirrored"),
        ("y", "y mirrored"),
        ("axes", "x and y exchanged"),
        ("swapped", "coil-2 and coil-5 exchanged"),
        ("units", "times what small does.*millimetres"),
    ],
)
def test_what_is_wrong_is_told_from_the_data(
    board: Board, measured: MeasuredFields, how: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        fit_fields(board, wrong(measured, how))


def test_another_board_and_too_little_are_refused(board: Board, measured: MeasuredFields) -> None:
    few = measured.hz > 0.0
    few &= np.hypot(*measured.places.T) < 7e-3
    for fields, said in (
        (
            dataclasses.replace(measured, values=np.roll(measured.values, 31)),
            "unexplained|exchanged",
        ),
        (dataclasses.replace(measured, hz=measured.hz + 1e3), "some from 40 to 500 Hz"),
        (
            MeasuredFields(
                measured.coils[few], measured.places[few], measured.hz[few], measured.values[few]
            ),
            "4 or more of a coil",
        ),
    ):
        with pytest.raises(InputError, match=said):
            fit_fields(board, fields)


def test_csv_and_npz_are_read_alike(board: Board, measured: MeasuredFields, tmp_path: Path) -> None:
    table, arrays = tmp_path / "m.csv", tmp_path / "m.npz"
    table.write_bytes(fields_csv(measured))
    np.savez(
        arrays,
        coil=measured.coils + 1,
        x_mm=1e3 * measured.places[:, 0],
        y_mm=1e3 * measured.places[:, 1],
        hz=measured.hz,
        real=measured.values.real,
        imag=measured.values.imag,
    )
    for path in (table, arrays):
        found = read_measured(path, board, "velocity", "current")
        assert (found.response, found.per) == ("velocity", "current")
        assert np.array_equal(found.coils, measured.coils)
        assert found.places == pytest.approx(measured.places)
        assert found.values == pytest.approx(measured.values, rel=1e-7)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("m.txt", "", "ends in .csv, .npz, .uff, .unv"),
        ("m.csv", "a,b\n1,2", f"columns.*{HEADER}"),
        ("m.csv", f"{HEADER}\n1,0,0,160,x,0", "line 2.*numbers"),
        ("m.csv", f"{HEADER}\n1,0,0,160,1", "line 2.*6 numbers"),
        ("m.csv", f"{HEADER}\n", "rows: .*got '0'"),
        ("m.csv", f"{HEADER}\n7,0,0,160,1,0", "coil of row 1.*1 to 6, got 7"),
        ("m.csv", f"{HEADER}\n1,0,0,0,1,0", "frequency of row 1"),
        ("m.csv", f"{HEADER}\n1,0,0,160,nan,0", "value of row 1"),
        ("m.csv", f"{HEADER}\n1,0,99,160,1,0", "place of row 1.*in metres"),
        ("m.npz", "rubbish", "arrays of numbers"),
        ("m.uff", "rubbish", "datasets"),
    ],
)
def test_bad_files_are_named(board: Board, tmp_path: Path, name: str, text: str, said: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read_measured(path, board)
    with pytest.raises(InputError, match="one of: displacement, velocity, acceleration"):
        read_measured(path, board, "speed")


def test_the_command_writes_the_board(
    chladni: CommandLine, board: Board, measured: MeasuredFields, tmp_path: Path
) -> None:
    from chladni.sim.board.writing import board_file  # noqa: PLC0415

    drawn, table, output = tmp_path / "small.toml", tmp_path / "m.csv", tmp_path / "o.toml"
    drawn.write_bytes(board_file(board))
    velocities = measured.values * 2j * np.pi * measured.hz
    table.write_bytes(fields_csv(dataclasses.replace(measured, values=velocities)))
    done = chladni(
        "calibrate",
        "--board",
        drawn,
        "--measured",
        table,
        "--response",
        "velocity",
        "--sets",
        "2",
        "-o",
        output,
        "--json",
    )
    assert done.code == 0, done.err
    assert done.json["by"] == "a laboratory, m.csv"
    assert "is reversed: swap its wires" in done.json["verdict"]
    assert "is dead" in done.json["verdict"]
    refused = chladni("calibrate", "--board", drawn, "--measured", table, "-o", output)
    assert refused.code == 2
    assert "say which response it is, and per what" in refused.err


@pytest.mark.parametrize("sensor_kg", [0.0, 1.5e-3])
def test_solved_boards_that_a_fit_keeps_have_no_plate_models(
    board: Board, sensor_kg: float
) -> None:
    """Some forty are kept: with their models `strip5` took 2.1 GB, and takes 0.65."""

    def models() -> int:
        gc.collect()
        return sum(isinstance(own, PlateModel) for own in gc.get_objects())

    before = models()
    places = np.array([[0.0, 0.0], [5e-3, 4e-3]])
    kept = FieldsAtPlaces(board, np.array([160.0]), sensor_kg, places)
    kept.place_slopes(0, np.array([0, 1]), places)
    assert models() == before
