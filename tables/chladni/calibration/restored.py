"""What calibration brings back: drives of a board as it is known, on the plate that there is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.coils_known import with_coils_known
from chladni.calibration.hidden import HiddenPlate
from chladni.drives.fingers import responses_at
from chladni.drives.methods import SEED
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.best_drives import best_drives
from chladni.drives.scoring.board_score import PITCH
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.several_fingers.fingers_score import solver_of
from chladni.drives.scoring.several_fingers.kept_apart import most_newtons
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import Survey, active_lattice
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Isolation
from chladni.sim.coil.full_drive import strengths
from chladni.sim.image import metrics
from chladni.sim.image.finger import PRESS, pressing_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AT_20_MM = 3
"""Column of a survey's rows."""
SETS = 60
"""Of two fingers: the worst tenth is then known to 3 dB."""
COARSER = 2.0
"""Times the pitch of places for one finger where that is not what a board is for."""


@dataclass(frozen=True)
class Restored:
    """What fingers get of drives that were found for a board as it is known.

    Attributes
    ----------
    second_finger_20mm_db
        Of drives of `focus`, from 20 mm on; None on a board that is smaller.
    fingers_2_db
        Isolation of two fingers that press with 1 N.
    level_db
        What those fingers get of their own, over what they would by the board as it is known.
    fingers_um
        The same in µm, with both signals on at the coils' limits; None without a coil.
    """

    second_finger_20mm_db: Spread | None
    fingers_2_db: Spread
    level_db: Spread
    fingers_um: Spread | None = None

    def isolation(self, drawn: Board) -> Isolation:
        """What a board's file keeps of it: that of one finger where focus is what it is for."""
        away = self.second_finger_20mm_db if drawn.focus is not None else None
        return Isolation(self.fingers_2_db.median, away.median if away else None)


def gained(before: Isolation, after: Isolation) -> str:
    """What calibration brings, in words."""
    said = (
        f"two fingers {before.fingers_2_db:.0f} dB apart before, {after.fingers_2_db:.0f} dB after"
    )
    own, then = before.second_finger_20mm_db, after.second_finger_20mm_db
    if own is not None and then is not None:
        said = f"from 20 mm on {own:.0f} dB quieter before, {then:.0f} dB after, {said}"
    return said


@dataclass(frozen=True)
class RestoredRows:
    """The same for every place and every finger, to be pooled over boards.

    Attributes
    ----------
    second_finger_20mm_db
        Shape (places,); empty on a board that is smaller.
    fingers_2_db, level_db, fingers_um
        Shape (fingers,); µm are NaN without a coil.
    """

    second_finger_20mm_db: FloatArray
    fingers_2_db: FloatArray
    level_db: FloatArray
    fingers_um: FloatArray

    def spreads(self) -> Restored:
        """Their medians and tails."""
        away = self.second_finger_20mm_db
        return Restored(
            Spread.of(away.tolist()) if away.size else None,
            Spread.of(self.fingers_2_db.tolist()),
            Spread.of(self.level_db.tolist()),
            Spread.of(um.tolist()) if np.isfinite(um := self.fingers_um).all() else None,
        )


class Truth:
    """A plate, solved once, on which drives of several boards are scored.

    Parameters
    ----------
    plate, forces
        As it is: a board, and its coils' forces per newton they are driven with, (actuators,).
    drawn
        The board as it is drawn: its active area, its limits.
    sets
        Of two fingers.
    pitch
        Of places for one finger, m; `COARSER` where the board has no `[focus]`.
    """

    def __init__(
        self,
        plate: Board,
        forces: FloatArray,
        drawn: Board,
        *,
        sets: int = SETS,
        pitch: float = PITCH,
    ) -> None:
        self._plate, self._forces, self._drawn = plate, forces, drawn
        self._solved = SolvedBoard.of(plate, DRAWN_TOLERANCE)
        self._lattice = active_lattice(drawn, pitch if drawn.focus else COARSER * pitch)
        rng = np.random.default_rng(SEED)
        self._sets = finger_sets(drawn, 2, sets, drawn.fingers_apart, rng)
        stiffness = pressing_stiffness(PRESS, drawn.drive.frequency_hz)
        with one_blas_thread():
            self._fingers = list(FingerSet.of_all(self._solved, self._sets, stiffness))
        self._stiffness = stiffness

    @classmethod
    def of(cls, hidden: HiddenPlate, drawn: Board, sets: int = SETS) -> Truth:
        """Of a hidden plate."""
        return cls(hidden.board, hidden.forces * strengths(drawn), drawn, sets=sets)

    @classmethod
    def found(cls, measured: Board, drawn: Board, sets: int = SETS) -> Truth:
        """Of a plate that no one knows better than by what was measured."""
        forces = [0.0 if own.is_dead else own.strength for own in measured.actuators]
        return cls(measured, np.array(forces), drawn, sets=sets)

    def score(self, known: Board) -> Restored:
        """Find drives for a board as it is known, and play them on the plate that there is.

        Of two fingers they are found as a device with that board's table finds them.
        """
        return self.rows(known).spreads()

    def rows(self, known: Board) -> RestoredRows:
        """The same by place and finger."""
        solved = SolvedBoard.of(known)
        return RestoredRows(self._one_finger(solved), *self._two_fingers(solved))

    def perfectly_known(self) -> Board:
        """The plate as a board file would have it."""
        return with_coils_known(self._plate, self._forces)

    def _played(self, known: Board) -> FloatArray:
        """Force of each coil over what the drive means, as the device makes up for what it knows.

        A coil that is known to be dead is not played at all.
        """
        return np.asarray(self._forces / strengths(known))

    def _one_finger(self, solved: SolvedBoard) -> FloatArray:
        places = self._lattice.places
        drives = best_drives(solved, places, "focus", SEED)
        survey = Survey(self._drawn, places, drives)
        values = self._played(solved.board)[:, None, None] * self._solved.fields.values
        away = survey.measure(values)[:, AT_20_MM]
        # 300 dB means that there is no disc so far away.
        return np.asarray(away[away < -metrics.FLOOR_DB])

    def _two_fingers(self, solved: SolvedBoard) -> tuple[FloatArray, FloatArray, FloatArray]:
        forces = self._played(solved.board)
        isolation, level, moved_um = [], [], []
        with one_blas_thread():
            solve = solver_of(solved.board, responses_at(solved), None)
            meant = FingerSet.of_all(solved, self._sets, self._stiffness)
            for places, fingers, own in zip(self._sets, self._fingers, meant, strict=True):
                drives = solve(places)
                isolation += fingers.isolation_db(drives * forces).tolist()
                got, said = (
                    np.abs(np.diag(part.means(played)))
                    for part, played in ((fingers, drives * forces), (own, drives))
                )
                level += (20.0 * np.log10(got / said)).tolist()
                newtons = most_newtons(solved.board, drives)
                moved_um += (got * (np.nan if newtons is None else newtons / MICROMETRE)).tolist()
        return np.array(isolation), np.array(level), np.array(moved_um)
