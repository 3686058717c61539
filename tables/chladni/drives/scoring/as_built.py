"""What a board keeps of its focus as it is built and touched.

Each row changes one thing and keeps the drives of the board as drawn: a finger that presses, coils
at their heat limit, foam that is stiffer than its data sheet. Drives know a film that is added to
the sheet. The last row has all of them at once, on boards within their tolerances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.pressing import pressed_at
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.best_drives import best_drives, mirrored
from chladni.drives.scoring.board_score import PITCH
from chladni.drives.scoring.kept_focus import FOAM_TWICE, KeptFocus, kept_of
from chladni.drives.scoring.progress_steps import StepCounter
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import (
    SAMPLES,
    Place,
    Survey,
    active_lattice,
    border_places,
    nearest_coils,
)
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, drawn_boards, with_foam
from chladni.drives.scoring.warm_coils import ROOM_C, Warm, board_rise_k, warm
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Panel
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError
from chladni.sim.fields.driven import driven_fields
from chladni.sim.fields.pressed_sheet import PressedSheet, PressingFingers, is_thin
from chladni.sim.image.finger import PRESS, pressing_stiffness

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

FILM = 0.125e-3
"""m of PET, a touch film of one layer."""
PRESSES = (0.3, 1.0, 3.0)
"""N: a light touch, a usual one, a firm one."""
LEAST_PRESS, MOST_PRESS = 0.05, 10.0
STIFFEST = 3.0
"""Of the boards with everything at once, drawn evenly in the logarithm from 1."""
PLACES_A_BOARD = 3


@dataclass(frozen=True)
class AsBuilt:
    """A board's focus as built, by the drives of the board as drawn, or of that under the film.

    Attributes
    ----------
    film
        Under a PET film of 0.125 mm, with drives that know it; None where a layer is there already.
    pressed
        By newtons.
    pressed_mm
        How far the sheet goes down under `newtons`; None where that is nothing to its thickness.
    warm, foam_twice
        Coils at their limit, whose gains the device evens out; foam of twice its static stiffness,
        None without foam.
    together
        Under the film, within tolerances, foam of 1 to 3 times, pressed by `newtons`, warm.
    board_w, board_k, magnet_k
        Heat of all coils of a drive without end, W; the board's rise above the air by it, and that
        of its warmest magnet, K.
    """

    places: int
    samples: int
    seed: int
    newtons: float
    nominal: KeptFocus
    nearest_coil: KeptFocus
    film: KeptFocus | None
    pressed: dict[str, KeptFocus]
    pressed_mm: Spread | None
    warm: KeptFocus
    foam_twice: KeptFocus | None
    together: KeptFocus
    board_w: Spread | None
    board_k: Spread | None
    magnet_k: Spread | None

    @property
    def warm_magnet_c(self) -> float | None:
        """Of the warmest magnet in a room, at the worst tenth of places, °C; None without coils."""
        return None if self.magnet_k is None else ROOM_C + self.magnet_k.p90


def score_as_built(
    board: Board,
    *,
    pitch: float = PITCH,
    objective: str = "focus",
    newtons: float = PRESS,
    samples: int = SAMPLES,
    seed: int = SEED,
    progress: Progress | None = None,
) -> AsBuilt:
    """Score a board as it is built and touched.

    Parameters
    ----------
    pitch
        Distance of places, m.
    newtons
        How hard a finger presses in the row of everything at once.
    samples
        Boards drawn, at least 1.
    progress
        Called with (done, all) of the steps.

    Raises
    ------
    ArgumentError
        No finger presses so hard, or so little.
    """
    check_press(newtons)
    lattice = active_lattice(board, pitch, samples=samples)
    places = lattice.places + border_places(board, pitch)
    own = _DrivenBoard(board, places, objective, seed)
    alone = Survey(board, places, nearest_coils(board, places))
    film = None if has_layer(board) else _DrivenBoard(with_film(board), places, objective, seed)
    most = film or own
    counter = StepCounter(progress, 2 + len(PRESSES) * len(own.presses.places) + samples)
    nominal = kept_of(own.survey.measure(own.values))
    nearest = kept_of(alone.measure(own.values))
    warm_rows = [own.survey.one(own.values, k, forces) for k, forces in enumerate(own.forces)]
    counter.step()
    foam = None
    if board.foundation is not None:
        stiffer = driven_fields(with_foam(board, FOAM_TWICE), allow_unmet=True).values
        foam = kept_of(own.survey.measure(stiffer))
    counter.step()
    return AsBuilt(
        places=len(places),
        samples=samples,
        seed=seed,
        newtons=newtons,
        nominal=nominal,
        nearest_coil=nearest,
        film=None if film is None else kept_of(film.survey.measure(film.values)),
        pressed={
            f"{press:g}": kept_of(own.presses.measure(own.survey, press, counter))
            for press in PRESSES
        },
        pressed_mm=own.presses.deflections_mm(newtons),
        warm=kept_of(np.array(warm_rows)),
        foam_twice=foam,
        together=kept_of(_together(most, newtons, samples, seed, counter)),
        **_heat(board, own.heat),
    )


class _DrivenBoard:
    """A board with the drives of its places, and how warm each makes it."""

    def __init__(self, board: Board, places: Sequence[Place], objective: str, seed: int) -> None:
        solved = solved_board(board)
        drives = best_drives(solved, places, objective, seed)
        self.board, self.values = board, solved.fields.values
        self.survey = Survey(board, places, drives)
        self.presses = _Presses(solved, places)
        self.heat = [warm(board, drive) for drive in drives]
        coils = np.ones(len(board.actuators))
        self.forces = [coils if found is None else found.forces for found in self.heat]


def _together(
    own: _DrivenBoard, newtons: float, samples: int, seed: int, counter: StepCounter
) -> FloatArray:
    """Rows of boards within tolerances, on stiffer foam, warm, some places of each pressed."""
    rows, rng = [], np.random.default_rng(seed)
    places = own.presses.places
    for drawn in drawn_boards(own.board, samples, seed):
        factor = drawn_foam(rng)
        with one_blas_thread():
            stiffer = with_foam(drawn.board, factor)
            found = driven_fields(stiffer, tolerance=DRAWN_TOLERANCE, allow_unmet=True).values
        for k in rng.choice(places, min(PLACES_A_BOARD, len(places)), replace=False):
            under = found + own.presses.change(k, newtons, factor)
            rows.append(own.survey.one(under, k, drawn.forces * own.forces[k]))
        counter.step()
    return np.array(rows)


def score_together(
    board: Board,
    *,
    pitch: float = PITCH,
    samples: int = SAMPLES,
    seed: int = SEED,
) -> KeptFocus:
    """What is left with everything at once, as in the last row of `score_as_built`."""
    places = active_lattice(board, pitch).places + border_places(board, pitch)
    own = _DrivenBoard(board if has_layer(board) else with_film(board), places, "focus", seed)
    return kept_of(_together(own, PRESS, samples, seed, StepCounter(None, samples)))


def drawn_foam(rng: np.random.Generator) -> float:
    """How many times as stiff as its data sheet says a board's foam is."""
    return float(np.exp(rng.uniform(0.0, np.log(STIFFEST))))


def check_press(newtons: float) -> None:
    """Refuse what no finger does.

    Raises
    ------
    ArgumentError
        A finger presses less, or more.
    """
    if not LEAST_PRESS <= newtons <= MOST_PRESS:
        raise ArgumentError("press", newtons, f"{LEAST_PRESS:g} to {MOST_PRESS:g} N")


def _heat(board: Board, heat: Sequence[Warm | None]) -> dict[str, Spread | None]:
    """What drives without end heat: all coils, the board by them, its warmest magnet."""
    known = [found for found in heat if found is not None]
    if not known:
        return {"board_w": None, "board_k": None, "magnet_k": None}
    boards = [board_rise_k(board, found) for found in known]
    magnets = [rise + found.magnet_k for rise, found in zip(boards, known, strict=True)]
    watts = [found.watts for found in known]
    return {
        "board_w": Spread.of(watts),
        "board_k": Spread.of(boards),
        "magnet_k": Spread.of(magnets),
    }


def has_layer(board: Board) -> bool:
    """Whether a touch panel's layer bends with the sheet already."""
    return board.panel is not None and board.panel.layer_thickness > 0.0


def with_film(board: Board) -> Board:
    """The board with a touch film on its sheet."""
    own = board.panel or Panel((16, 16), board.plate.size)
    return replace(board, panel=replace(own, place="on", film=FILM))


class _Presses:
    """A finger that presses at each place, by whatever way its board needs."""

    def __init__(self, solved: SolvedBoard, places: Sequence[Place]) -> None:
        self._solved, self._places = solved, places
        board = solved.board
        images = [mirrored(solved, place)[0] for place in places]
        self.places = [images.index(own) for own in dict.fromkeys(images)]
        """Places that are no others' images in the mirrors."""
        self._sheet = PressedSheet(board) if is_thin(board, MOST_PRESS) else None

    def change(self, k: int, newtons: float, foam_factor: float = 1.0) -> ComplexArray:
        """By what fields change under a finger at a place, (actuators, nx, ny), m/N."""
        solved, place = self._solved, self._places[k]
        board = solved.board
        stiffness = pressing_stiffness(newtons, board.drive.frequency_hz)
        if self._sheet is not None and is_thin(board, newtons):
            finger = PressingFingers((place,), newtons, stiffness)
            return self._sheet.change(finger, foam_factor=foam_factor)
        values = solved.fields.values
        answer = solved.under_finger([(place[0] / MM, place[1] / MM)])[0]
        return np.asarray(pressed_at(board, place, values, answer, stiffness) - values)

    def measure(self, survey: Survey, newtons: float, counter: StepCounter) -> FloatArray:
        """Rows of a press at all places that are their own."""

        def one(k: int) -> list[float]:
            row = survey.one(self._solved.fields.values + self.change(k, newtons), k)
            counter.step()
            return row

        with one_blas_thread():
            return np.array(list(in_threads(one, self.places)))

    def deflections_mm(self, newtons: float) -> Spread | None:
        """How far the sheet goes down."""
        board = self._solved.board
        if self._sheet is None or not is_thin(board, newtons):
            return None
        stiffness = pressing_stiffness(newtons, board.drive.frequency_hz)
        fingers = [PressingFingers((self._places[k],), newtons, stiffness) for k in self.places]
        return Spread.of([self._sheet.deflection(finger) / MM for finger in fingers])
