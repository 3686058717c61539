"""Clicks over time on a plate under two fingers, by the real gains that a device finds; no pins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers import responses_at
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.several_fingers.fingers_score import solver_of
from chladni.effects import shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.flatten import flattened
from chladni.host.emulation.felt_over_time import RATE_HZ, FingerPlate, rms
from chladni.host.emulation.over_frequency import over_frequency
from chladni.sim.board.board import Board

RINGS_S = 0.04


def clicks_over_time(board: Board, sets: NDArray[np.float64]) -> list[float]:
    """The loudest of a click under its finger over the loudest under the other, dB."""
    solved, own_hz = over_frequency(board), board.drive.frequency_hz
    solve = solver_of(board, responses_at(solved_board(board)), None, real=True)
    click = shipped_effects()["click"].samples(SIGNAL_HZ)
    times = np.arange(round((len(click) / SIGNAL_HZ + RINGS_S) * RATE_HZ)) / RATE_HZ
    found = []
    for places in sets:
        plate = FingerPlate.of(solved, places, 1.0)
        for own, drive in enumerate(solve(places).real):
            flat = flattened(click, SIGNAL_HZ, plate.hz, plate.level(own, own_hz), own_hz)
            wave = np.interp(times, np.arange(len(flat)) / SIGNAL_HZ, flat, right=0.0)
            felt = [rms(plate.felt_um(np.outer(wave, drive), one)).max() for one in (own, 1 - own)]
            found.append(float(20.0 * np.log10(felt[0] / felt[1])))
    return found
