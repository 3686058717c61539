"""One frequency's drives: solved, arranged, and compressed as often as limits are tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import Board
from chladni.tables.batch import Target, over_targets
from chladni.tables.branches import arrange
from chladni.tables.checkpoint import Checkpoint, Result
from chladni.tables.coding import FULL_SCALE
from chladni.tables.compress import LOUDEST, LossLimits, compress, field_errors_db
from chladni.tables.entry import Entry, Wanted
from chladni.tables.folding import Folding
from chladni.tables.format import pack
from chladni.tables.halfway import OWN_TOLERANCE, Halfway, own_places
from chladni.tables.lookup import lookup
from chladni.tables.meetings import Uncoded
from chladni.tables.methods import Options
from chladni.tables.methods.phasor import phasor
from chladni.tables.objectives import OBJECTIVES
from chladni.tables.played import FirmwareReader
from chladni.tables.regions import RegionGrid
from chladni.tables.rivals import smoothest
from chladni.tables.scene import Problem, Scene, scene_of
from chladni.tables.solve import tie_break
from chladni.tables.table import Limits, Section, Table, dequantise, quantise
from chladni.tables.threads import in_threads

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

FIRST_ORDER = 0.685
"""Share of the SSIM limit for drives that were not meant to be best at it: an error of theirs costs
SSIM in first order, and more so between regions."""
TIGHTEN = 0.85
TIGHTENINGS = 6
"""Where points between regions lose too much, all limits are multiplied by this, so often."""


@dataclass(frozen=True)
class Work:
    """One frequency's drives, solved and arranged; compressed as often as limits are tried."""

    board: Board
    scene: Scene
    objective: str
    uncoded: Uncoded
    jobs: int | None

    @classmethod
    def begin(
        cls, board: Board, grid: RegionGrid, folding: Folding, options: Options,
        partial: Path | None, jobs: int | None,
    ) -> Work:  # fmt: skip
        """Solve and arrange."""
        scene = scene_of(board)
        targets = [grid.centre_mm(int(region)) for region in folding.stored(grid)]
        others = own_places(board, grid, folding)
        key = {
            "board": f"{board.fingerprint():#018x}", "objective": options.objective,
            "seed": options.seed, "version": version("chladni"),
        }  # fmt: skip
        with Checkpoint(partial, key) as checkpoint:
            solved, wanted = _solve(
                scene, targets, list(others.values()), options, checkpoint, jobs
            )
            columns, _ = folding.shape(grid)
            drives = smoothest(scene, solved, columns, options.objective, jobs=jobs)
        arranged = arrange(scene.space, grid, folding, np.array(drives))
        entries = [
            replace(region, drive=drive)
            for drive, region in zip(arranged.drives, solved, strict=True)
        ]
        own = {place: wanted[at] for place, at in others.items()}
        halfway = Halfway(scene, entries, own, grid, folding)
        uncoded = Uncoded(grid, folding, entries, arranged, halfway)
        return cls(board, scene, options.objective, uncoded, jobs)

    def section(self, limits: LossLimits) -> Section:
        """The smallest section within limits, points between regions included."""
        if OBJECTIVES[self.objective].ssim == 0.0:
            limits = replace(limits, ssim=FIRST_ORDER * limits.ssim)
        for _ in range(TIGHTENINGS):
            iq = compress(self.scene, self.uncoded, limits, jobs=self.jobs)
            section = self.with_drives(iq)
            if self.between_db(self.reader(section)) <= limits.field_db:
                break
            limits = limits.times(TIGHTEN)
        return section

    def with_drives(self, iq: NDArray[np.int16]) -> Section:
        """A section of these regions with given integers."""
        return Section(
            frequency_hz=self.board.drive.frequency_hz,
            objective=self.objective,
            full_scale_gain=self.board.drive.max_gain,
            labels=self.uncoded.arranged.labels,
            crossings=self.uncoded.arranged.crossings,
            iq=iq,
        )

    def reader(self, section: Section) -> FirmwareReader:
        """A section as the firmware reads it."""
        return FirmwareReader(pack(self._table(section)), len(self.board.actuators))

    def between_db(self, reader: FirmwareReader) -> float:
        """The worst field error half-way between stored regions and their neighbours."""
        got = reader.drives(*self._between_um)
        return float(field_errors_db(self.scene, self._between_drives, got).max(initial=0.0))

    def between_ssim(self, reader: FirmwareReader) -> FloatArray:
        """SSIM lost there, on every `FINE_STEP`-th image point, against the same drives."""
        space = self.scene.space

        def lost(case: tuple[tuple[int, int], ComplexArray, ComplexArray]) -> float:
            place, best, got = case
            _, wanted = self.uncoded.halfway.objectives(*place)
            return space.value(wanted, best) - space.value(wanted, got)

        cases = zip(
            _between(self.uncoded), self._between_drives, reader.drives(*self._between_um),
            strict=True,
        )  # fmt: skip
        return np.array(list(in_threads(lost, cases, jobs=self.jobs)))

    @cached_property
    def _between_drives(self) -> ComplexArray:
        """The unquantised drives half-way between regions, interpolated as the device does."""
        places = [axis.astype(np.int64) for axis in self._between_um]
        section = self.with_drives(
            quantise(self.uncoded.arranged.drives * (LOUDEST / FULL_SCALE), 1.0)
        )
        return dequantise(lookup(self._table(section), section, *places), 1.0)

    @cached_property
    def _between_um(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        places = [self.uncoded.grid.halfway_mm(i, j) for i, j in _between(self.uncoded)]
        x_um, y_um = np.rint(np.array(places) * 1000.0).astype(np.int32).T
        return np.ascontiguousarray(x_um), np.ascontiguousarray(y_um)

    def _table(self, section: Section) -> Table:
        return table_of(self.board, self.uncoded.grid, self.uncoded.folding, [section])


def table_of(
    board: Board, grid: RegionGrid, folding: Folding, sections: Sequence[Section]
) -> Table:
    """A board's table of given sections."""
    electronics = board.electronics
    return Table(
        board_name=board.name,
        board_fingerprint=board.fingerprint(),
        grid=grid,
        limits=Limits(
            ramp_us=round(electronics.ramp_ms * 1000.0),
            touch_timeout_us=round(electronics.touch_timeout_ms * 1000.0),
            max_on_us=round(electronics.max_on_s * 1e6),
        ),
        sections=tuple(sections),
        folding=folding,
    )


def _between(uncoded: Uncoded) -> list[tuple[int, int]]:
    """Points half-way from stored regions to the next in x, in y and in both, in half cells."""
    grid, folding = uncoded.grid, uncoded.folding
    centres = [(2 * (int(k) % grid.columns), 2 * (int(k) // grid.columns))
               for k in folding.stored(grid)]  # fmt: skip
    return [(i + right, j + up) for right, up in ((1, 0), (0, 1), (1, 1)) for i, j in centres]


def _solve(
    scene: Scene, targets: Sequence[Target], others: Sequence[Target], options: Options,
    checkpoint: Checkpoint, jobs: int | None,
) -> tuple[list[Entry], dict[Target, Wanted]]:  # fmt: skip
    """Every target's drive and what it is meant to do, and what each place wants, others' too."""
    wanted: dict[Target, Wanted] = {}
    solved = set(targets)

    def work(problem: Problem) -> Result:
        wanted[problem.target_mm] = Wanted.of(problem)
        return _best_drive(problem, options) if problem.target_mm in solved else {}

    # Making the others' fields takes the time in which the last drives are searched.
    besides = scene.problems(others, tolerance=OWN_TOLERANCE)
    finished = over_targets(scene, targets, work, jobs=jobs, checkpoint=checkpoint, besides=besides)
    results = []
    for result in finished:
        results.append(result)
        if options.progress:
            options.progress(len(results), len(targets))
    # What an earlier run had finished came without its image. By whole groups again, for the bits.
    for group in scene.groups(targets):
        if any(target not in wanted for target in group):
            wanted |= {problem.target_mm: Wanted.of(problem) for problem in scene.problems(group)}
    entries = [
        Entry(np.array([complex(*parts) for parts in result["drive"]]), wanted[at], result["ssim"])
        for result, at in zip(results, targets, strict=True)
    ]
    return entries, wanted


def _best_drive(problem: Problem, options: Options) -> Result:
    """A drive in units of the largest gain, and its SSIM."""
    drive = tie_break(problem, phasor(problem, options).drive)
    largest = np.abs(drive).max()
    drive = drive / largest if largest > 0.0 else drive
    space = problem.scene.space
    ssim = space.objective(space.levels[-1], problem.image)
    return {
        "drive": [[float(c.real), float(c.imag)] for c in drive],
        "ssim": space.value(ssim, drive),
    }
