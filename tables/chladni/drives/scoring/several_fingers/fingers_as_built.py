"""What a board keeps apart of several fingers as it is built and touched.

The same drawn sets of fingers throughout. Each row changes one thing and keeps the drives of the
board as drawn, as in drives/scoring/as_built.py; drives know a film that is added to the sheet. The
last row has all of them at once, on boards within their tolerances.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers import responses_at
from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.as_built import (
    check_press,
    drawn_foam,
    has_layer,
    with_film,
)
from chladni.drives.scoring.kept_focus import FOAM_TWICE
from chladni.drives.scoring.progress_steps import StepCounter
from chladni.drives.scoring.several_fingers.finger_sets import (
    FingerSet,
    finger_discs,
    finger_sets,
)
from chladni.drives.scoring.several_fingers.fingers_score import (
    SETS,
    CountScore,
    found_drives,
    solver_of,
)
from chladni.drives.scoring.several_fingers.kept_apart import KeptApart, kept_apart, rows_of
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, drawn_boards, with_foam
from chladni.drives.scoring.warm_coils import warm
from chladni.sim.board.board import Board
from chladni.sim.fields.pressed_sheet import PressedSheet, PressingFingers, is_thin
from chladni.sim.image.finger import PRESS, pressing_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class FingersAsBuilt:
    """One number of fingers on a board as built.

    Attributes
    ----------
    nominal
        As drawn: a bare sheet, small motion, cold coils, foam as its data sheet says.
    film
        Under a PET film of 0.125 mm, with drives that know it; None where a layer is there already.
    stretched
        A thin sheet on foam that goes down and stretches under all fingers; None where a press is
        little to the sheet's thickness.
    warm, foam_twice
        Coils as warm as the set's drives without end make them, whose gains the device evens out;
        foam of twice its static stiffness, None without foam.
    together
        All of them, foam of 1 to 3 times, on boards within tolerances.
    """

    fingers: int
    sets: int
    samples: int
    newtons: float
    nominal: KeptApart
    film: KeptApart | None
    stretched: KeptApart | None
    warm: KeptApart
    foam_twice: KeptApart | None
    together: KeptApart


def score_fingers_as_built(
    board: Board,
    count: int,
    *,
    apart: float | None = None,
    sets: int = SETS,
    regularisation: float | None = None,
    newtons: float = PRESS,
    samples: int = SAMPLES,
    seed: int = SEED,
    progress: Progress | None = None,
) -> FingersAsBuilt:
    """Score a board with several fingers on it as it is built and touched.

    Parameters
    ----------
    count, apart, sets, regularisation, seed
        As of `score_fingers`, for one number of fingers; the same sets are drawn.
    newtons
        How hard every finger presses; drives reckon with 1 N whatever it is.
    samples
        Boards drawn for the last row, at least 1, the sets shared out among them.
    progress
        Called with (done, all) of the sets.

    Raises
    ------
    ArgumentError
        No finger presses so hard, or the board has no room for the fingers.
    """
    check_press(newtons)
    apart = board.fingers_apart if apart is None else apart
    places = finger_sets(board, count, sets, apart, np.random.default_rng(seed))
    has_film = not has_layer(board)
    is_stretched = is_thin(board, newtons)
    stiffer = with_foam(board, FOAM_TWICE)
    has_foam = stiffer is not board
    steps = 4 + 2 * has_film + is_stretched + has_foam
    counter = StepCounter(progress, steps * sets)
    own = _DrivenSets(board, places, regularisation, newtons, counter)
    most = own
    if has_film:
        most = _DrivenSets(with_film(board), places, regularisation, newtons, counter)
    drawn = list(own.pressed(own.solved))
    return FingersAsBuilt(
        fingers=count,
        sets=sets,
        samples=samples,
        newtons=newtons,
        nominal=own.kept(drawn),
        film=most.kept(most.pressed(most.solved)) if has_film else None,
        stretched=own.kept(own.stretched(own.solved)) if is_stretched else None,
        warm=own.kept(drawn, own.forces),
        foam_twice=own.kept(own.pressed(_solved(stiffer))) if has_foam else None,
        together=most.kept_together(samples, seed),
    )


def on_stiffer_foam(board: Board, score: CountScore) -> KeptApart | None:
    """What scored sets keep by the same drives on foam twice as stiff; None of a board on none."""
    stiffer = with_foam(board, FOAM_TWICE)
    if stiffer is board:
        return None
    coils = np.ones(len(board.actuators))
    stiffness = pressing_stiffness(PRESS, board.drive.frequency_hz)
    with one_blas_thread():
        sets = FingerSet.of_all(_solved(stiffer), score.places, stiffness)
        rows = [
            rows_of(board, own, drives, coils)
            for own, drives in zip(sets, score.drives, strict=True)
        ]
    return kept_apart(board, np.concatenate(rows))


def _solved(board: Board) -> SolvedBoard:
    return SolvedBoard.of(board, DRAWN_TOLERANCE)


class _DrivenSets:
    """Sets of fingers on a board, and the drives that know the board as it is drawn."""

    def __init__(
        self,
        board: Board,
        places: FloatArray,
        regularisation: float | None,
        newtons: float,
        counter: StepCounter,
    ) -> None:
        self.board, self.solved, self._places = board, solved_board(board), places
        self._counter, self._newtons = counter, newtons
        self._stiffness = pressing_stiffness(newtons, board.drive.frequency_hz)
        with one_blas_thread():
            solve = solver_of(board, responses_at(self.solved), regularisation)
        self.drives = found_drives(solve, places, counter)
        self.forces = [self._warm(own) for own in self.drives]
        self._sheet = PressedSheet(board) if is_thin(board, newtons) else None

    def _warm(self, drives: ComplexArray) -> FloatArray:
        """Forces of coils that all drives of a set warm together."""
        found = warm(self.board, np.abs(drives).sum(axis=0).astype(np.complex128))
        return np.ones(drives.shape[1]) if found is None else found.forces

    def pressed(self, solved: SolvedBoard, mine: slice = slice(None)) -> Iterator[FingerSet]:
        """The sets on a plate that all fingers' pulp and bone load, and none bends."""
        return FingerSet.of_all(solved, self._places[mine], self._stiffness)

    def stretched(
        self, solved: SolvedBoard, mine: slice = slice(None), foam_factor: float = 1.0
    ) -> Iterator[FingerSet]:
        """The sets on a sheet that they bend, whose fields without them are those of `solved`."""
        sheet = self._sheet
        assert sheet is not None
        free = solved.fields.values

        def one(places: FloatArray) -> FingerSet:
            at = tuple((x, y) for x, y in places.tolist())
            fingers = PressingFingers(at, self._newtons, self._stiffness)
            under = free + sheet.change(fingers, foam_factor=foam_factor)
            discs = [under[:, mask].T for mask in finger_discs(self.board, places)]
            return FingerSet(places, discs)

        with one_blas_thread():
            yield from in_threads(one, list(self._places[mine]))

    def kept(
        self, sets: Iterable[FingerSet], forces: Sequence[FloatArray] | None = None
    ) -> KeptApart:
        """What all sets come to, by forces of their coils over cold ones as drawn."""
        coils = np.ones(len(self.board.actuators))
        by = [coils] * len(self.drives) if forces is None else forces
        rows = []
        for own, drives, force in zip(sets, self.drives, by, strict=True):
            rows.append(rows_of(self.board, own, drives, force))
            self._counter.step()
        return kept_apart(self.board, np.concatenate(rows))

    def kept_together(self, samples: int, seed: int) -> KeptApart:
        """Each set on one of the boards within tolerances, on stiffer foam, warm, bent."""
        rows, rng = [], np.random.default_rng(seed)
        for number, drawn in enumerate(drawn_boards(self.board, samples, seed)):
            factor = drawn_foam(rng)
            mine = slice(number, None, samples)
            with one_blas_thread():
                solved = _solved(with_foam(drawn.board, factor))
            sets = (
                self.pressed(solved, mine)
                if self._sheet is None
                else self.stretched(solved, mine, factor)
            )
            for own, drives, forces in zip(sets, self.drives[mine], self.forces[mine], strict=True):
                rows.append(rows_of(self.board, own, drives, drawn.forces * forces))
                self._counter.step()
        return kept_apart(self.board, np.concatenate(rows))
