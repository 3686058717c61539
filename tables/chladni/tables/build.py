"""Build a table: places, drives, phases and labels, integers of the width they need, bytes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import partial as partial_function
from pathlib import Path

import numpy as np

from chladni.drives.checkpoint import Checkpoint
from chladni.drives.methods import SEED, Options, Progress
from chladni.drives.objectives import default_objective
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.search_cost import for_objective
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.best_drives import needs_compensation
from chladni.drives.solve import check_request
from chladni.sim.board.board import Board, to_document
from chladni.sim.errors import ArgumentError, check_estimate
from chladni.sim.fields.transfer import TOLERANCE
from chladni.tables.felt_survey import Fingers, survey_of
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import check_fits, pack, table_bytes
from chladni.tables.layout import BITS, LARGEST_FILE, one_of_bits
from chladni.tables.one_frequency import LossesOfTable, OneFrequency, is_drive
from chladni.tables.report import TableReport, are_within, report
from chladni.tables.stored_regions import StoredRegions, stored_regions
from chladni.tables.table import Section, Table, limits_of


def build_table(
    board: Board,
    *,
    objective: str | None = None,
    seed: int = SEED,
    frequencies_hz: Sequence[float] = (),
    bits: int | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    partial: Path | None = None,
    scheduler: str | None = None,
    allow_unmet: bool = False,
) -> tuple[Table, TableReport]:
    """Solve every region of a board and pack the drives.

    Parameters
    ----------
    objective
        A key of `OBJECTIVES`; by default that of `default_objective`.
    frequencies_hz
        A section is made for each; by default one for the board's own.
    bits
        Of each integer: 8, 12 or 16. By default the narrowest that keeps to `LIMITS`, and the
        widest that a device's slot holds where none does.
    jobs
        Threads; all cores by default. The bytes do not depend on it.
    progress
        Called as progress(done regions, all regions).
    partial
        Checkpoint; with it, work that was interrupted goes on. It stays until the table is written
        and `remove_checkpoint` called.
    scheduler
        Address of a Dask scheduler, whose workers search the drives.
    allow_unmet
        Go on with fields that do not meet their tolerance.

    Raises
    ------
    ToleranceError
        The estimated error of a field is above 5 %, or above its tolerance unless that is allowed.
    InputError
        There are no such bits, or a device holds fewer regions, actuators or millimetres.
    """
    started = time.perf_counter()
    if bits is not None and bits not in BITS:
        raise ArgumentError("bits", bits, one_of_bits())
    # Each once: the device would never come to a second section of the same frequency.
    frequencies = tuple(dict.fromkeys(frequencies_hz)) or (board.drive.frequency_hz,)
    for frequency in frequencies:
        if not np.isfinite(frequency):
            raise ArgumentError("frequencies_hz", frequency, "a finite number of Hz")
    if objective is None:
        objective = default_objective(board)
    check_request("phasor", objective, seed, None, None)
    regions = stored_regions(board)
    widths = _widths_that_fit(board, regions, frequencies, objective, [bits] if bits else BITS)
    key = {
        "board": to_document(board),
        "objective": objective,
        "seed": seed,
        "frequencies_hz": frequencies,
    }
    is_own = partial_function(is_drive, actuators=len(board.actuators))
    with Checkpoint(partial, key, is_own) as kept, one_blas_thread():
        options = Options(objective, seed, progress=progress)
        solved = solved_board(for_objective(board, objective))
        check_estimate(solved.fields.error_estimate, TOLERANCE, allow_unmet=allow_unmet)
        make = partial_function(
            board_drives,
            solved,
            regions,
            frequencies,
            options,
            checkpoint=kept,
            jobs=jobs,
            scheduler=scheduler,
        )
        drives = make()
        seen = survey_of(drives[0])
        compensates = needs_compensation(board, seen.finger_load)
        if compensates:
            drives = make(with_finger=True)
            seen = survey_of(drives[0])
        for width in widths:
            table = table_of(board, regions, [one.section(width) for one in drives], width)
            losses = losses_of(table, drives, until_beyond=width != widths[-1])
            if are_within(losses):
                break
    seconds = time.perf_counter() - started
    felt = Fingers(
        **{one.name: getattr(seen, one.name) for one in fields(seen)}, compensated=compensates
    )
    return table, report(table, drives, losses, table_bytes(table), seconds, felt)


def board_drives(
    solved: SolvedBoard,
    regions: StoredRegions,
    frequencies_hz: Sequence[float],
    options: Options,
    *,
    checkpoint: Checkpoint | None = None,
    jobs: int | None = None,
    with_finger: bool = False,
    scheduler: str | None = None,
) -> list[OneFrequency]:
    """Find the drives of every region, one frequency after the other on the same plate.

    Drives `with_finger` make up for what the finger on its place changes.
    """
    found = []
    for number, frequency in enumerate(frequencies_hz):
        own = options
        if options.progress:
            span = number * regions.count, len(frequencies_hz) * regions.count
            own = replace(options, progress=partial_function(_tell, options.progress, *span))
        part = f"{frequency!r} Hz{', pressed' * with_finger}:"
        kept = checkpoint.part(part) if checkpoint else None
        one = solved.at_frequency(frequency)
        found.append(
            OneFrequency.solve(
                one, regions, own, kept, jobs, with_finger=with_finger, scheduler=scheduler
            )
        )
    return found


def table_of(board: Board, regions: StoredRegions, sections: Sequence[Section], bits: int) -> Table:
    """The table of a board with these sections, of integers of so many bits."""
    return Table(
        board_name=board.name,
        # Of `focus` if any is: it reads all that the others do.
        board_fingerprint=max(board.fingerprint(one.objective) for one in sections),
        grid=regions.grid,
        limits=limits_of(board),
        sections=tuple(sections),
        bits=bits,
        symmetry=regions.symmetry,
    )


def losses_of(
    table: Table, drives: Sequence[OneFrequency], *, until_beyond: bool = False
) -> list[LossesOfTable]:
    """What a table loses as the firmware plays it, per frequency."""
    reader = FirmwareReader(pack(table), table.actuators)
    return [one.losses(reader, until_beyond=until_beyond) for one in drives]


def _tell(progress: Progress, before: int, all_regions: int, done: int, _: int) -> None:
    progress(before + done, all_regions)


def _widths_that_fit(
    board: Board,
    regions: StoredRegions,
    frequencies_hz: Sequence[float],
    objective: str,
    widths: Sequence[int],
) -> list[int]:
    """Widths of which a table fits into a slot, known before any drive is.

    Raises
    ------
    InputError
        There is none.
    """
    count = regions.count
    blank = [
        Section(
            frequency,
            objective,
            board.drive.max_gain,
            np.zeros(count, np.uint8),
            np.zeros((1, 2), np.uint8),
            np.zeros((count, len(board.actuators), 2), np.int16),
        )
        for frequency in frequencies_hz
    ]
    tables = [table_of(board, regions, blank, width) for width in widths]
    check_fits(tables[0])
    return [table.bits for table in tables if table_bytes(table) <= LARGEST_FILE]
