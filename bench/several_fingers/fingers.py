"""What decides how far fingers are kept apart: points, couplings, λ. Prints a table a board.

    python bench/several_fingers/fingers.py [BOARD ...]

Two fingers, 16 mm apart or more, both pressing with 1 N, on the board as drawn. The exact coupling
has the field of every finger's push, which no chip holds.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers import Responses, drives_for, responses_at, silence
from chladni.drives.fingers.responses import interpolated
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.image.finger import pressing_stiffness

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
Drives = Callable[[FloatArray], ComplexArray]

GLASS = "quiet16-glass"
"""`quiet16` with 0.55 mm of glass in place of its sheet, where silence everywhere ends."""
BOARDS = ("prototype", "strip5", "phone5", "phone8", "phone15", "quiet16", GLASS)
SETS, SEED = 100, 1
NEAR_MM = (12.0, 14.0, 16.0, 20.0)


@contextmanager
def ring(radius: float, points: int) -> Iterator[None]:
    """Another ring of points for the time being."""
    before = silence.RING_RADIUS, silence.RING_POINTS, silence.CENTRE_WEIGHT
    silence.RING_RADIUS, silence.RING_POINTS = radius, points
    silence.CENTRE_WEIGHT = max(0.0, 1.0 - 0.5 * (silence.FINGERTIP_RADIUS / radius) ** 2)
    try:
        yield
    finally:
        silence.RING_RADIUS, silence.RING_POINTS, silence.CENTRE_WEIGHT = before


def nystrom(solved: SolvedBoard, known: Responses) -> Responses:
    """The same with M = C⁻¹, what coils do at coils."""
    at_coils = known.at(np.array([own.at for own in solved.board.actuators]))
    return replace(known, coupling=np.linalg.inv((at_coils + at_coils.T) / 2.0))


def without_phase(known: Responses) -> Responses:
    """The same as real numbers, once the phase that all have in common is taken out."""
    turn = np.exp(-0.5j * np.angle((known.values**2).sum()))
    return replace(
        known,
        values=(known.values * turn).real + 0j,
        own=known.own.real + 0j,
        coupling=(known.coupling / turn**2).real + 0j,
    )


class Exact:
    """Drives from the field of every finger's push."""

    def __init__(self, solved: SolvedBoard, known: Responses, stiffness: complex) -> None:
        self.solved, self.known, self.stiffness = solved, known, stiffness

    def __call__(self, places: FloatArray) -> ComplexArray:
        """The drives of a set."""
        board, count = self.solved.board, len(places)
        fields = self.solved.under_finger([(x / MM, y / MM) for x, y in places.tolist()])
        points = (places[:, None] + silence.ring_offsets()).reshape(-1, 2)
        push = interpolated(board.x, board.y, fields, points).reshape(count, count, -1)
        free = self.known.at(points).reshape(count, push.shape[2], -1)
        weights = silence.disc_weights()
        means = np.einsum("p,fpa->fa", weights, free)
        pairs = np.einsum("p,jfp->fj", weights, push)
        back = self.stiffness * np.linalg.solve(np.eye(count) + self.stiffness * pairs, means)
        loaded = free - np.einsum("jfp,ja->fpa", push, back)
        return drives_for(_Points(places, loaded), places.tolist()).drives


class _Points:
    """A plate of which only some fingers' points are known."""

    def __init__(self, places: FloatArray, loaded: ComplexArray) -> None:
        self._loaded = loaded
        self.coupling = np.zeros((loaded.shape[2],) * 2, np.complex128)

    def at(self, places: FloatArray) -> ComplexArray:
        return self._loaded.reshape(len(places), -1)

    def own_at(self, places: FloatArray) -> ComplexArray:
        return np.zeros(len(places), np.complex128)


def under_glass(board: Board) -> Board:
    """The board with a glass for its sheet."""
    plate = replace(
        board.plate, thickness=0.55e-3, youngs_modulus=70e9, poissons_ratio=0.23, density=2500.0
    )
    return replace(board, panel=None, plate=plate)


def pairs_at(board: Board, apart: float, rng: np.random.Generator) -> FloatArray:
    """Pairs of fingers so far apart, m, in any direction that the active area leaves."""
    low, high = np.transpose(board.active_area)
    found = []
    while len(found) < SETS:
        middle, angle = rng.uniform(low, high), rng.uniform(0.0, 2.0 * np.pi)
        half = 0.5 * apart * np.array([np.cos(angle), np.sin(angle)])
        pair = np.array([middle - half, middle + half])
        if np.all((low <= pair) & (pair <= high)):
            found.append(pair)
    return np.array(found)


def main() -> None:
    """All boards, or those that are named."""
    print("| board | drives | isolation, dB: median, worst tenth | ms a set |")
    print("|---|---|---|---|")
    for name in sys.argv[1:] or BOARDS:
        board = under_glass(load_board("quiet16")) if name == GLASS else load_board(name)
        solved = solved_board(board)
        stiffness = pressing_stiffness(1.0, board.drive.frequency_hz)
        known = responses_at(solved)
        sets = finger_sets(board, 2, SETS, board.fingers_apart, np.random.default_rng(SEED))
        pressed = list(FingerSet.of_all(solved, sets, stiffness))

        def of(plate: Responses, share: float = 1e-3, spring: complex = stiffness) -> Drives:
            return lambda places: (
                drives_for(plate, places.tolist(), stiffness=spring, regularisation=share).drives
            )

        def row(what: str, drives: Drives, own: list[FingerSet] = pressed, of: str = name) -> None:
            started = time.perf_counter()
            found = [drives(fingers.places) for fingers in own]
            taken = (time.perf_counter() - started) / len(own)
            isolation = np.concatenate(
                [one.isolation_db(drive) for one, drive in zip(own, found, strict=True)]
            )
            middle, tail = np.percentile(isolation, (50.0, 10.0))
            print(f"| `{of}` | {what} | {middle:.1f}, {tail:.1f} | {1e3 * taken:.2f} |", flush=True)

        row("fitted coupling, λ = 1e-3", of(known))
        for share in (1e-2, 1e-4, 1e-5):
            row(f"fitted coupling, λ = {share:g}", of(known, share))
        row("no coupling: a free plate", of(known, spring=0.0))
        row("M = C⁻¹ (Nyström)", of(nystrom(solved, known)))
        row("real numbers alone", of(without_phase(known), spring=complex(stiffness.real)))
        row("exact coupling", Exact(solved, known, stiffness))
        for apart in NEAR_MM:
            pairs = pairs_at(board, apart * MM, np.random.default_rng(SEED))
            row(f"{apart:g} mm apart", of(known), list(FingerSet.of_all(solved, pairs, stiffness)))
        for radius, points in ((4e-3, 4), (5e-3, 8)):
            with ring(radius, points):
                row(f"ring of {points} at {radius * 1e3:g} mm", of(known))


if __name__ == "__main__":
    main()
