"""Plates that several tests ask."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from chladni.sim.board.board import Board
from chladni.sim.plate.geometry import PlateGeometry, RimSupport
from chladni.sim.ritz.plate import RitzPlate

X, Y = np.linspace(-0.05, 0.05, 21), np.linspace(-0.07, 0.07, 29)


def free_plate(loss: float = 0.01) -> RitzPlate:
    rims = (RimSupport(0.03, 0.05, 2e-3), RimSupport(-0.03, -0.05, 2e-3))
    return RitzPlate(PlateGeometry(0.1, 0.14, 2.0, 0.2, 2.0, rims=rims), loss)


def changed(board: Board, **plate: Any) -> Board:
    return dataclasses.replace(board, plate=dataclasses.replace(board.plate, **plate))
