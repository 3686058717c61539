"""What the search for a drive starts from: a board with its plate solved, and one target on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import RLock
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.field_space import FieldSpace
from chladni.drives.problem.search_cost import search_cost
from chladni.drives.problem.second_fingers import SecondFingers
from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.cost import begin, is_too_large
from chladni.sim.errors import InputError
from chladni.sim.fields.board_mirrors import BoardMirrors, board_mirrors
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.driven import driven_fields, with_coils
from chladni.sim.fields.static import static_fields
from chladni.sim.fields.transfer import TOLERANCE, TransferFields, disc_fields, target_fields
from chladni.sim.image import metrics
from chladni.sim.plate.response import PlateModel

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
BoolArray = NDArray[np.bool_]


TOGETHER = 16
"""Target fields found in one go: 17 MB of them on the shipped boards."""


_SOLVING = RLock()


@dataclass(frozen=True)
class SolvedPlate:
    """A board's plate and its actuators' fields, without the board: kept as long as that is.

    `static` holds what steady forces do, and `for_focus` the board on the foam that its drives are
    made for, once they were asked for.
    """

    model: PlateModel
    fields: TransferFields
    mirrors: BoardMirrors
    static: list[FloatArray | None] = field(default_factory=list)
    for_focus: list[SolvedBoard] = field(default_factory=list)

    @cached_property
    def space(self) -> FieldSpace:
        """Orthonormal fields for searches, made once."""
        with one_blas_thread():
            return FieldSpace(self.fields.values)

    @cached_property
    def second_fingers(self) -> SecondFingers:
        """Discs all over the board in which a second finger could lie, made once."""
        with one_blas_thread():
            return SecondFingers.of(self.fields)


@dataclass(frozen=True)
class SolvedBoard:
    """A board with its plate solved and its actuators' fields: shared by all targets."""

    board: Board
    plate: SolvedPlate

    @property
    def model(self) -> PlateModel:
        """The plate, to be asked for more fields."""
        return self.plate.model

    @property
    def fields(self) -> TransferFields:
        """The actuators' fields."""
        return self.plate.fields

    @property
    def space(self) -> FieldSpace:
        """Orthonormal fields for searches."""
        return self.plate.space

    @property
    def second_fingers(self) -> SecondFingers:
        """Discs in which a second finger could lie."""
        return self.plate.second_fingers

    @property
    def static(self) -> FloatArray | None:
        """Deflection per steady newton of each coil, m/N, found once; None on a board not held."""
        if not self.plate.static:
            with one_blas_thread():
                self.plate.static.append(static_fields(self.board, self.model))
        return self.plate.static[0]

    @property
    def for_focus(self) -> SolvedBoard:
        """The board on the foam that drives of `focus` are made for; often the board itself."""
        board = self.board
        ratio = board.focus.foam_ratio if board.focus else 1.0
        if ratio == 1.0 or board.focus is None or board.foundation is None:
            return self
        with _SOLVING:
            if not self.plate.for_focus:
                focus = replace(board.focus, foam_ratio=1.0)
                stiffer = replace(board, foundation=board.foundation.stiffer(ratio), focus=focus)
                self.plate.for_focus.append(SolvedBoard.of(stiffer))
        return self.plate.for_focus[0]

    @classmethod
    def of(cls, board: Board, tolerance: float = TOLERANCE) -> SolvedBoard:
        """Solve a board's plate, its actuators' fields to a relative L² error."""
        with one_blas_thread():
            model = plate_model(board)
            points = math.prod(board.image.points)
            plate = model.cost(board.drive.frequency_hz, tolerance, points)
            # A plate that is too large by itself says what of it to lower, once it is solved.
            if not is_too_large(plate):
                begin(search_cost(board, plate.bytes))
            fields = driven_fields(board, model=model, tolerance=tolerance, allow_unmet=True)
            return cls(board, SolvedPlate(model, fields, board_mirrors(board)))

    @property
    def mirrors(self) -> tuple[tuple[int, ...] | None, tuple[int, ...] | None]:
        """Permutations of the actuators under x → −x and y → −y, where the board has them."""
        return self.plate.mirrors.x, self.plate.mirrors.y

    def at_frequency(self, frequency_hz: float) -> SolvedBoard:
        """The same board driven at another frequency, as exact; its plate is kept."""
        if frequency_hz == self.board.drive.frequency_hz:
            return self
        drive = replace(self.board.drive, frequency_hz=frequency_hz)
        board = replace(self.board, drive=drive)
        with one_blas_thread():
            fields = driven_fields(
                board, model=self.model, tolerance=self.fields.tolerance, allow_unmet=True
            )
        return SolvedBoard(board, replace(self.plate, fields=fields, for_focus=[]))

    def problems(
        self,
        targets_mm: Sequence[tuple[float, float]],
        *,
        tolerance: float = TOLERANCE,
        with_finger: bool = False,
    ) -> Iterator[Problem]:
        """Many targets; their fields are found some at a time, which costs a third of one by one.

        Parameters
        ----------
        tolerance
            Relative L² error of the fields.
        with_finger
            Find at once what a finger at each target does.

        Raises
        ------
        InputError
            A target is off the board.
        """
        for group in self.groups(targets_mm):
            with one_blas_thread():
                found = target_fields(
                    self.board, group, tolerance=tolerance, model=self.model, allow_unmet=True
                )
                under = self.under_finger(group) if with_finger else [None] * len(group)
            for target, wanted, answer in zip(group, found.values, under, strict=True):
                yield Problem(self, target, wanted, found.error_estimate, answer)

    def under_finger(self, targets_mm: Sequence[tuple[float, float]]) -> ComplexArray:
        """Fields of one newton under a fingertip at each target, (targets, nx, ny), m/N.

        As exact as the actuators' fields: another tolerance would take matrices of its own.
        """
        answers = disc_fields(
            self.board,
            targets_mm,
            metrics.FINGERTIP_RADIUS,
            tolerance=self.fields.tolerance,
            model=self.model,
            allow_unmet=True,
        ).values
        return with_coils(self.board, self.fields, answers)

    def groups(
        self, targets_mm: Sequence[tuple[float, float]]
    ) -> Iterator[Sequence[tuple[float, float]]]:
        """Targets whose fields are found together."""
        for first in range(0, len(targets_mm), TOGETHER):
            yield targets_mm[first : first + TOGETHER]

    def problem(self, target_mm: tuple[float, float]) -> Problem:
        """A target on this board.

        Raises
        ------
        InputError
            The target is off the board.
        """
        return next(self.problems([target_mm]))


@dataclass(frozen=True)
class Problem:
    """One target: what its image should be.

    Attributes
    ----------
    target_mm
        Millimetres from the board's centre.
    wanted
        Field of a unit load there, complex128, shape (nx, ny), m/N.
    wanted_error
        Its estimated relative error.
    under_finger
        Field of one newton under a fingertip there, if it was found already.
    """

    solved: SolvedBoard
    target_mm: tuple[float, float]
    wanted: ComplexArray
    wanted_error: float = 0.0
    under_finger: ComplexArray | None = None

    def __post_init__(self) -> None:
        if self.wanted.shape != self.transfer.shape[1:]:
            shape = self.transfer.shape[1:]
            raise InputError("target field", self.wanted.shape, f"an image of {shape}")
        if not np.all(np.isfinite(self.wanted)):
            raise InputError("target field", "NaN or infinity", "finite numbers on every point")

    @property
    def board(self) -> Board:
        """The board the target is on."""
        return self.solved.board

    @property
    def error_estimate(self) -> float:
        """Of all the fields a drive is found with, the largest relative error."""
        return max(self.wanted_error, self.solved.fields.error_estimate)

    @property
    def place(self) -> tuple[float, float]:
        """The target in metres."""
        return self.target_mm[0] * MM, self.target_mm[1] * MM

    @property
    def transfer(self) -> ComplexArray:
        """The actuators' fields, shape (actuators, nx, ny), m/N."""
        return self.solved.fields.values

    @cached_property
    def disc(self) -> BoolArray:
        """Image points under a fingertip at the target."""
        board = self.board
        return metrics.disc_mask(board.x, board.y, self.place, metrics.FINGERTIP_RADIUS)

    @cached_property
    def image(self) -> FloatArray:
        """The normalised energy image that is wanted."""
        return metrics.image_of(self.wanted)

    @cached_property
    def contrast(self) -> tuple[float, ComplexArray]:
        """The contrast no drive exceeds, dB, and a drive that has it."""
        return metrics.best_contrast(self.transfer, self.disc)

    @cached_property
    def pressing(self) -> tuple[ComplexArray, complex]:
        """What one newton under a fingertip at the target does: its field, its mean there; m/N."""
        answer = self.under_finger
        if answer is None:
            with one_blas_thread():
                (answer,) = self.solved.under_finger([self.target_mm])
        return answer, complex(answer[self.disc].mean())

    @cached_property
    def at_target(self) -> ComplexArray:
        """What each actuator does at the image point nearest to the target, m/N."""
        i = int(np.argmin(np.abs(self.solved.fields.x - self.place[0])))
        j = int(np.argmin(np.abs(self.solved.fields.y - self.place[1])))
        return np.asarray(self.transfer[:, i, j])


_PLATES: WeakKeyDictionary[Board, SolvedPlate] = WeakKeyDictionary()
"""Plates of the boards in use. A plate does not hold its board, and goes when that goes."""


def solved_board(board: Board) -> SolvedBoard:
    """A board with its plate solved, once as long as the board is in use."""
    plate = _PLATES.get(board)
    if plate is None:
        plate = _PLATES[board] = SolvedBoard.of(board).plate
    return SolvedBoard(board, plate)
