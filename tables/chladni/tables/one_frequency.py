"""One frequency's drives: solved, their phases and labels found, and measured as integers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from functools import partial as partial_function

import numpy as np
from numpy.typing import NDArray

from chladni.drives.batch import Target, on_workers, over_targets
from chladni.drives.checkpoint import Checkpoint, Part, Result
from chladni.drives.methods import Options
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.field_space import Level
from chladni.drives.problem.pressing import pressed_problem
from chladni.drives.problem.problem import Problem, SolvedBoard
from chladni.drives.solve import tie_break
from chladni.drives.workers import Workers
from chladni.sim.image.metrics import image_of
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.halfway_points import (
    OWN_TOLERANCE,
    Field,
    HalfwayFields,
    halfway_places,
    measured_indices,
    own_places,
    target_of,
)
from chladni.tables.lookup import mixing
from chladni.tables.phase_synchronisation import Synchronised, in_phase_at_targets, synchronise
from chladni.tables.quantisation_loss import Losses, MeasuredPoint, losses
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import Section, quantise

ComplexArray = NDArray[np.complex128]
Image = NDArray[np.float32]
LossesOfTable = tuple[Losses, Losses]
"""At regions, and between them."""

LARGEST = 1.0 + 1e-9
"""Of a drive's parts, in units of the largest gain, with what rounding adds."""
HALFWAY_STEP = 2
"""Half-way between regions, SSIM is compared on every second image point each way."""


@dataclass(frozen=True)
class OneFrequency:
    """One frequency's drives, and the points at which their losses are measured.

    Attributes
    ----------
    measured
        Which of the stored regions are measured, ascending.
    error_estimate
        Largest relative error of the fields that drives were found with.
    at_regions, halfway
        Those points, and points between regions.
    """

    solved: SolvedBoard
    regions: StoredRegions
    objective: str
    synchronised: Synchronised
    measured: NDArray[np.intp]
    error_estimate: float
    at_regions: list[MeasuredPoint]
    halfway: list[MeasuredPoint]
    jobs: int | None

    @classmethod
    def solve(
        cls,
        solved: SolvedBoard,
        regions: StoredRegions,
        options: Options,
        checkpoint: Part | None,
        jobs: int | None,
        *,
        with_finger: bool = False,
        scheduler: str | None = None,
    ) -> OneFrequency:
        """Find every region's drive, and phases and labels over the whole board.

        Drives `with_finger` make up for what the finger on its place changes. With a `scheduler` a
        Dask cluster's workers find them.
        """
        grid = regions.grid
        targets = [grid.centre_mm(int(region)) for region in regions.numbers]
        centres = dict(zip(regions.centres, targets, strict=True))
        measured = measured_indices(len(targets))
        places = halfway_places(regions)
        own = {place: target_of(grid, place) for place in own_places(solved.board, regions, places)}
        # Of which the fields between regions are found.
        sources = own if len(own) == len(places) else centres | own
        kept = _TargetFields(solved, {targets[k] for k in measured.tolist()}, set(sources.values()))
        drives = _solve(
            solved,
            targets,
            list(own.values()),
            kept,
            options,
            checkpoint or Checkpoint(None, {}),
            jobs,
            with_finger=with_finger,
            scheduler=scheduler,
        )
        level = solved.space.nearest_level(HALFWAY_STEP)
        known = {place: kept.fields[target] for place, target in sources.items()}
        fields = HalfwayFields(known, regions)
        together = in_phase_at_targets if options.objective == "focus" else synchronise
        return cls(
            solved,
            regions,
            options.objective,
            together(solved.space, regions, np.array(drives)),
            measured,
            kept.error_estimate,
            [
                MeasuredPoint(_um(targets[k]), solved.space.levels[-1], kept.images[targets[k]])
                for k in measured.tolist()
            ],
            [
                MeasuredPoint(_um(grid.halfway_mm(*place)), level, _image_of(fields.at(place)))
                for place in places
            ],
            jobs,
        )

    def section(self, bits: int) -> Section:
        """A section of these drives as integers of so many bits."""
        return Section(
            frequency_hz=self.solved.board.drive.frequency_hz,
            objective=self.objective,
            full_scale_gain=self.solved.board.drive.max_gain,
            labels=self.synchronised.labels,
            crossings=self.synchronised.crossings,
            iq=quantise(self.synchronised.drives, 1.0, bits),
        )

    def losses(self, reader: FirmwareReader, *, until_beyond: bool = False) -> LossesOfTable:
        """What the firmware plays loses at regions and between them.

        Against the unrounded drives interpolated alike.

        Parameters
        ----------
        until_beyond
            Stop at the first point that loses more than the limits.
        """
        between = self._losses(self.halfway, reader, until_beyond)
        if until_beyond and not between.are_within:
            return between, between
        return self._losses(self.at_regions, reader, until_beyond), between

    @cached_property
    def weights(self) -> NDArray[np.intp]:
        """How many of the board's regions each measured one stands for."""
        return np.bincount(self.regions.everywhere.stored)[self.measured]

    def _losses(
        self, points: Sequence[MeasuredPoint], reader: FirmwareReader, until_beyond: bool
    ) -> Losses:
        x_um, y_um = np.array([point.place_um for point in points], np.int64).reshape(-1, 2).T
        actuators = self.synchronised.drives.shape[1]
        mixed = mixing(self.regions, self.synchronised, actuators, x_um, y_um)
        got = reader.drives(self.solved.board.drive.frequency_hz, x_um, y_um)
        exact = mixed.of_drives(self.synchronised.drives)
        return losses(
            self.solved,
            points,
            exact,
            got,
            objective=self.objective,
            until_beyond=until_beyond,
            jobs=self.jobs,
        )


class _TargetFields:
    """What is kept of problems once they are solved: images of some, fields half-way of others."""

    def __init__(self, solved: SolvedBoard, images_of: set[Target], fields_of: set[Target]) -> None:
        self._level: Level = solved.space.nearest_level(HALFWAY_STEP)
        self._images_of, self._fields_of = images_of, fields_of
        self.images: dict[Target, Image] = {}
        self.fields: dict[Target, Field] = {}
        self.error_estimate = solved.fields.error_estimate

    def keep(self, problem: Problem) -> None:
        """What is needed of a problem."""
        target, level = problem.target_mm, self._level
        self.error_estimate = max(self.error_estimate, problem.wanted_error)
        if target in self._fields_of:
            field = problem.wanted[np.ix_(level.index_x, level.index_y)]
            self.fields[target] = field.astype(np.complex64)
        if target in self._images_of:
            self.images[target] = problem.image.astype(np.float32)

    def lacks(self, target: Target) -> bool:
        """Whether something is needed of a target that was not kept yet."""
        lacks_field = target in self._fields_of and target not in self.fields
        return lacks_field or (target in self._images_of and target not in self.images)


def _image_of(field: Field) -> Image:
    return image_of(field.astype(np.complex128)).astype(np.float32)


def _um(place_mm: tuple[float, float]) -> tuple[int, int]:
    return round(place_mm[0] * 1000.0), round(place_mm[1] * 1000.0)


def _solve(
    solved: SolvedBoard,
    targets: Sequence[Target],
    others: Sequence[Target],
    kept: _TargetFields,
    options: Options,
    checkpoint: Checkpoint | Part,
    jobs: int | None,
    *,
    with_finger: bool,
    scheduler: str | None,
) -> list[ComplexArray]:
    """Every target's drive in units of the largest gain; fields go into `kept`."""
    if scheduler is not None:
        own = partial_function(_drive_of, replace(options, progress=None), with_finger)
        with Workers(scheduler=scheduler) as workers:
            on_workers(
                workers,
                solved.board,
                targets,
                own,
                checkpoint,
                with_finger=with_finger,
                progress=options.progress,
            )
    searched = set(targets)

    def work(problem: Problem) -> Result:
        kept.keep(problem)
        if problem.target_mm not in searched:
            return {}
        return _drive_of(options, with_finger, problem)

    # Making the others' fields takes the time in which the last drives are searched.
    besides = solved.problems(others, tolerance=OWN_TOLERANCE)
    finished = over_targets(
        solved,
        targets,
        work,
        jobs=jobs,
        checkpoint=checkpoint,
        besides=besides,
        with_finger=with_finger,
    )
    drives = []
    for result in finished:
        drives.append(np.array([complex(*parts) for parts in result["drive"]]))
        if options.progress:
            options.progress(len(drives), len(targets))
    # What an earlier run had finished came without its field. By whole groups again, for the bits.
    for group in solved.groups(targets):
        if any(kept.lacks(target) for target in group):
            for problem in solved.problems(group):
                kept.keep(problem)
    return drives


def _drive_of(options: Options, with_finger: bool, problem: Problem) -> Result:
    problem = pressed_problem(problem) if with_finger else problem
    drive = tie_break(problem, OBJECTIVES[options.objective](problem, options).drive)
    largest = np.abs(drive).max()
    drive = drive / largest if largest > 0.0 else drive
    return {"drive": [[float(c.real), float(c.imag)] for c in drive]}


def is_drive(result: Result, actuators: int) -> bool:
    """Whether a checkpoint's result is one of `_drive_of`: a gain of at most 1 per actuator."""
    drive = result.get("drive")
    return (
        result.keys() == {"drive"}
        and isinstance(drive, list)
        and len(drive) == actuators
        and all(isinstance(parts, list) and len(parts) == 2 for parts in drive)
        and all(type(part) is float and abs(part) <= LARGEST for parts in drive for part in parts)
    )
