"""Large thin sheets with many magnets, as `design` makes them: edges far away change nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.fields.transfer import TransferFields, transfer_fields
from chladni.sim.ritz.basis.resolution import Resolution, area_points

WINDOW = 18e-3
"""m; round the coils. The sheets' edges are 20 decay lengths of 2.6 mm beyond it."""


def pad(side: float, count: int, pitch: float) -> Board:
    """Parts of quiet16 on a sheet of another size."""
    board = load_board("quiet16")
    line = (np.arange(count) - (count - 1) / 2.0) * pitch
    actuators = tuple(
        replace(board.actuators[0], name=f"{k}", at=(float(x), float(y)))
        for k, (x, y) in enumerate((x, y) for x in line for y in line)
    )
    plate = replace(board.plate, size=(side, side))
    electronics = replace(board.electronics, pwm_pins=())
    return replace(board, plate=plate, actuators=actuators, electronics=electronics, panel=None)


def near_the_coils(board: Board, fields: TransferFields) -> NDArray[np.complex128]:
    line = np.linspace(-WINDOW, WINDOW, 60)
    x, y = np.meshgrid(line, line, indexing="ij")
    rows = [(at - axis[0]) / (axis[1] - axis[0]) for at, axis in ((x, board.x), (y, board.y))]
    return np.stack(
        [
            sum(
                unit * map_coordinates(part, rows, order=3)
                for unit, part in ((1.0, own.real), (1j, own.imag))
            )
            for own in fields.values
        ]
    )


def check_sides(sides: tuple[float, ...], count: int, allowed: float) -> None:
    found = []
    for side in sides:
        board = pad(side, count, 10e-3)
        fields = transfer_fields(board, tolerance=1e-3, allow_unmet=True)
        assert fields.error_estimate <= 1e-3
        found.append(near_the_coils(board, fields))
    for own in found[1:]:
        assert np.linalg.norm(own - found[0]) < allowed * np.linalg.norm(found[0])


def test_coils_far_from_the_edges_do_not_feel_them() -> None:
    """Two sheets of other sizes have the same fields, each to 1e-3, read to 2e-3 off an image."""
    check_sides((0.11, 0.12), 2, 4e-3)


@pytest.mark.soak
def test_sixteen_coils_far_from_the_edges_do_not_feel_them() -> None:
    check_sides((0.12, 0.135, 0.15), 4, 4e-3)


@pytest.mark.soak
def test_a_stricter_tolerance_gives_no_worse_fields() -> None:
    for board in (pad(0.15, 4, 36e-3), pad(0.12, 4, 10e-3)):
        loose, strict = (
            transfer_fields(board, tolerance=tolerance, allow_unmet=True).error_estimate
            for tolerance in (1e-3, 1e-4)
        )
        assert strict <= loose <= 1e-3


def test_small_discs_on_a_large_sheet_have_more_points() -> None:
    """A disc of 3 mm has four Gauss points across it at least; with three, 1 % was left."""
    few = Resolution(40, 40)
    across = []
    for side in (0.1, 0.15, 0.2):
        points, _ = area_points(plate_geometry(pad(side, 2, 10e-3)), few)
        nodes = np.polynomial.legendre.leggauss(points)[0] * side / 2.0
        across.append(int(np.sum(np.abs(nodes) < 3e-3)))
    assert min(across) >= 4
