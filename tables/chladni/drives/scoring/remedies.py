"""What would make a board focus: another sheet or foam under the same coils, tried and scored."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from chladni.drives.scoring.board_score import score_board, usual_pitch
from chladni.drives.scoring.tolerances import with_foam
from chladni.sim.board.board import Board
from chladni.sim.errors import ChladniError

COARSE = 2.0
"""Pitch of places, in that of a score: medians, which are asked for, hardly change."""
THINNER, STIFFER = 0.5, 4.0
"""Times: two sizes of usual sheets and of usual foams."""


@dataclass(frozen=True)
class Remedy:
    """A change of a board, and what it comes to.

    Attributes
    ----------
    change
        In words.
    second_finger_20mm_db
        Level over any finger 20 mm away, the median of places.
    """

    change: str
    second_finger_20mm_db: float


def tried_remedies(
    board: Board, *, progress: Callable[[int, int], None] | None = None
) -> list[Remedy]:
    """Score a board with other sheets and foams; the best first.

    What cannot be solved, as a sheet that is thinner than any, is left out.
    """
    changes, found = list(_changes(board)), []
    for done, (words, changed) in enumerate(changes, 1):
        try:
            other = changed()
            score = score_board(other, pitch=COARSE * usual_pitch(other), samples=0)
        except ChladniError:
            continue
        finally:
            if progress is not None:
                progress(done, len(changes))
        if score.second_finger_20mm_db is not None:
            found.append(Remedy(words, score.second_finger_20mm_db.median))
    return sorted(found, key=lambda one: -one.second_finger_20mm_db)


def _changes(board: Board) -> Iterator[tuple[str, Callable[[], Board]]]:
    def thinner(own: Board) -> Board:
        return replace(own, plate=replace(own.plate, thickness=THINNER * own.plate.thickness))

    yield "a sheet half as thick", lambda: thinner(board)
    if board.foundation is None or not board.foundation.sheet_stiffness:
        return
    yield "foam four times as stiff", lambda: with_foam(board, STIFFER)
    yield "foam a quarter as stiff", lambda: with_foam(board, 1.0 / STIFFER)
    yield (
        "a sheet half as thick on foam a quarter as stiff",
        lambda: thinner(with_foam(board, 1.0 / STIFFER)),
    )
