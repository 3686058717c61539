"""Build responses into a table: the smallest that keeps two fingers as far apart as exact ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.drives.methods import Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.search_cost import for_focus
from chladni.drives.scoring.several_fingers.fingers_score import SETS
from chladni.drives.scoring.several_fingers.kept_apart import kept_apart
from chladni.drives.scoring.spread import Spread
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError, check_estimate
from chladni.sim.fields.transfer import TOLERANCE
from chladni.tables.format import check_fits, table_bytes
from chladni.tables.layout import BITS, LARGEST_FILE, RESPONSES, one_of_bits
from chladni.tables.responses import TableResponses
from chladni.tables.several_fingers.isolation import LIMIT_DB, LITTLE_DB, DrawnPairs, lost_db
from chladni.tables.several_fingers.section import reckoned_finger, section_of
from chladni.tables.stored_regions import StoredRegions, stored_regions
from chladni.tables.table import ResponsesSection, Table, limits_of

LADDER = (8e-3, 7e-3, 6e-3, 5e-3, 4e-3, 3e-3, 2.5e-3, 2e-3)
"""m. A fingertip's ring of points is 10 mm wide, so coarser ones tell none of them apart."""
WIDTHS = tuple(width for width in BITS if width >= 12)
"""Of which one is chosen. Eight bits on closer points may keep the isolation of tones within its
limit, and take a fifth of a click's micrometres: 18.6 on `strip5`, 22.7 with twelve."""

SMALL_BYTES = 4096
"""Up to which a table may grow for half a decibel less: `quiet16` would double, to 10,000."""
NO_MORE_DB = 0.05
"""By which a larger table must lose less to be worth its bytes."""


@dataclass(frozen=True)
class FrequencyIsolation:
    """How far two fingers are kept apart, dB: with the table's responses, and with exact ones.

    And what each gets of its own signal with the table's, µm; None without a coil.
    """

    frequency_hz: float
    isolation_db: Spread
    exact_isolation_db: Spread
    finger_um: Spread | None


@dataclass(frozen=True)
class ResponsesReport:
    """What the responses of a table came to.

    Attributes
    ----------
    pitch_mm
        Between stored responses, along x and y.
    bytes
        Of the whole table.
    isolation_lost_db
        By rounding and interpolation, at the median or the 10th percentile, whichever is more, of
        the worst frequency.
    is_within_limits
        Whether that is at most 1 dB.
    error_estimate
        Largest relative error of the coils' fields.
    """

    pitch_mm: tuple[float, float]
    bits: int
    bytes: int
    stored_regions: int
    isolation_lost_db: float
    is_within_limits: bool
    error_estimate: float
    frequencies: list[FrequencyIsolation]


def responses_table(
    board: Board,
    *,
    frequencies_hz: Sequence[float] = (),
    pitch: float | None = None,
    bits: int | None = None,
    progress: Progress | None = None,
    allow_unmet: bool = False,
) -> tuple[Table, ResponsesReport]:
    """Build a table of responses alone.

    Parameters
    ----------
    frequencies_hz
        A section is made for each; by default those of the board's `[fingers]`, or its drive's.
    pitch
        Between stored responses, m; by default that of `[fingers]`, or of the smallest table that
        loses at most 0.5 dB of isolation, or 1 dB from 4 KB on.
    bits
        Of each integer; by default as the pitch.
    progress
        Called as progress(done, all) with pairs of fingers.
    allow_unmet
        Go on with fields that do not meet their tolerance.

    Raises
    ------
    InputError
        There are no such bits, no room for two fingers, or too many regions for a device.
    ToleranceError
        As of `build_table`.
    """
    if bits is not None and bits not in BITS:
        raise ArgumentError("bits", bits, one_of_bits())
    known = board.fingers.pitch if board.fingers and pitch is None else pitch
    pitches = [known] if known else [own for own in LADDER if own <= min(board.plate.size)]
    empty = [
        _blank(board, stored_regions(board, own), width)
        for own in pitches or [min(board.plate.size)]
        for width in ([bits] if bits else WIDTHS)
    ]
    return _smallest(board, empty, frequencies_hz, progress, allow_unmet)


def with_responses(
    table: Table,
    board: Board,
    *,
    frequencies_hz: Sequence[float] = (),
    bits: int | None = None,
    progress: Progress | None = None,
    allow_unmet: bool = False,
) -> tuple[Table, ResponsesReport]:
    """Add responses to a board's table of drives, in its regions; parameters of `responses_table`.

    Integers get wider where the drives' own width loses too much of the responses, unless `bits`
    are given.
    """
    widths = WIDTHS if bits is None else (bits,)
    wider = [replace(table, bits=width) for width in widths if width >= table.bits]
    return _smallest(board, wider, frequencies_hz, progress, allow_unmet)


def _blank(board: Board, regions: StoredRegions, bits: int) -> Table:
    """A table of these regions with nothing in it."""
    return Table(
        board_name=board.name,
        board_fingerprint=board.fingerprint(RESPONSES),
        grid=regions.grid,
        limits=limits_of(board),
        sections=(),
        bits=bits,
        symmetry=regions.symmetry,
    )


def _smallest(
    board: Board,
    empty: Sequence[Table],
    frequencies_hz: Sequence[float],
    progress: Progress | None,
    allow_unmet: bool,
) -> tuple[Table, ResponsesReport]:
    """Fill tables, smallest first, until one loses little; else the smallest that loses least."""
    asked = board.fingers.frequencies_hz if board.fingers and not frequencies_hz else frequencies_hz
    frequencies = tuple(dict.fromkeys(asked)) or (board.drive.frequency_hz,)
    candidates = _that_fit(board, empty, frequencies)
    done = 0

    def tell() -> None:
        nonlocal done
        done += 1
        if progress:
            progress(done, SETS * len(frequencies))

    solved = solved_board(for_focus(board))
    check_estimate(solved.fields.error_estimate, TOLERANCE, allow_unmet=allow_unmet)
    at_frequencies = [solved.at_frequency(frequency) for frequency in frequencies]
    pairs = [DrawnPairs.of(one, tell) for one in at_frequencies]
    fingers = [reckoned_finger(board, frequency) for frequency in frequencies]
    made = []
    for own in candidates:
        filled = replace(
            own,
            responses=tuple(
                section_of(one.known, finger, own.regions, own.bits)
                for one, finger in zip(pairs, fingers, strict=True)
            ),
        )
        found = _report(filled, pairs, at_frequencies)
        allowed = LITTLE_DB if found.bytes <= SMALL_BYTES else LIMIT_DB
        if found.isolation_lost_db <= allowed:
            return filled, found
        made.append((filled, found))
    least = min(found.isolation_lost_db for _, found in made)
    return next(own for own in made if own[1].isolation_lost_db <= least + NO_MORE_DB)


def _that_fit(board: Board, empty: Sequence[Table], frequencies_hz: Sequence[float]) -> list[Table]:
    """Tables that a device's slot holds with so many responses, the smallest first.

    Raises
    ------
    InputError
        There is none.
    """
    count = len(board.actuators)

    def with_zeros(own: Table) -> Table:
        blank = ResponsesSection(
            frequencies_hz[0],
            1,
            1,
            np.zeros((count, count), dtype=np.complex128),
            np.zeros((own.regions.count, count + 1, 2), dtype=np.int16),
        )
        sections = [replace(blank, frequency_hz=frequency) for frequency in frequencies_hz]
        return replace(own, responses=tuple(sections))

    sizes = [table_bytes(with_zeros(own)) for own in empty]
    order = sorted(range(len(empty)), key=lambda k: sizes[k])
    check_fits(with_zeros(empty[order[0]]))
    return [empty[k] for k in order if sizes[k] <= LARGEST_FILE]


def _report(
    table: Table, pairs: Sequence[DrawnPairs], at_frequencies: Sequence[SolvedBoard]
) -> ResponsesReport:
    found = []
    lost = []
    for one, section in zip(pairs, table.responses, strict=True):
        rows = one.rows(TableResponses(table.regions, section))
        lost.append(lost_db(one.exact, rows[:, 0]))
        kept, exact = kept_apart(one.board, rows), Spread.of(one.exact.tolist())
        own = FrequencyIsolation(section.frequency_hz, kept.isolation_db, exact, kept.finger_um)
        found.append(own)
    return ResponsesReport(
        pitch_mm=table.grid.pitch_mm,
        bits=table.bits,
        bytes=table_bytes(table),
        stored_regions=table.regions.count,
        isolation_lost_db=max(lost),
        is_within_limits=max(lost) <= LIMIT_DB,
        error_estimate=max(one.fields.error_estimate for one in at_frequencies),
        frequencies=found,
    )
