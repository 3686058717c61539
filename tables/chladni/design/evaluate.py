"""One board of a design: made of its numbers, checked against limits, and scored."""

from __future__ import annotations

import itertools
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from chladni.design.keep_out import KeepOut, KeptFoot, kept_feet
from chladni.design.layouts.layouts import Place, closest
from chladni.design.pins import of_its_driver
from chladni.design.spec import Spec
from chladni.design.variables import Document, filled
from chladni.design.weights import (
    BUILT_TERMS,
    FINGER_CLICK,
    FINGER_LEVEL,
    OF_FINGERS,
)
from chladni.drives.scoring.as_built import score_together
from chladni.drives.scoring.board_score import BoardScore, score_board
from chladni.drives.scoring.several_fingers.fingers_score import SETS, score_fingers
from chladni.drives.scoring.small_amplitude import with_floor
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import FocusStatistics
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.board.file import board_from_document
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ChladniError, InputError
from chladni.sim.fields.board_plate import first_natural_hz

COARSE = 1e-3
"""m between image points while boards are compared: a finger covers 113."""
FINE = 0.5e-3
"""And in the file, unless the SPEC gives another."""
NO_NUMBER_DB = -40.0
"""dB that a number counts as which is not there, such as the µm of a board without a coil."""
UNFIT = -1000.0
"""Score of a board that a limit forbids, less a thousand times how far it is beyond."""
FINGER_SETS = 32
"""Sets of fingers on each drawn board, while boards are compared: with eight, the best of twelve
boards had 8 dB more by luck. Thirty-two take a sixteenth of the time more."""
Terms = Mapping[str, float]
LEAST_UM = 5.0
"""Under one finger, unless a SPEC says."""
TOO_WEAK = 3.0
"""dB of score for each dB that the finger gets less than it is to."""


@dataclass(frozen=True)
class Evaluation:
    """What a board is worth to a SPEC.

    Attributes
    ----------
    score, robust_score
        By the weights: on the nominal board, and on boards that are off by their tolerances, which
        is what a search goes by. Where a limit is broken, far below all others.
    broken
        Which limit, and by how much; None for a board that may be.
    terms
        The robust score's, before they are weighted.
    """

    score: float
    robust_score: float
    broken: str | None
    terms: Mapping[str, float]


def document_of(spec: Spec, numbers: Sequence[float], places: Sequence[Place] | None) -> Document:
    """A board file of a SPEC: a number for each variable, and places of its coils, mm."""
    document = filled(spec.document, spec.variables, numbers)
    if places is not None:
        document["actuators"] = [
            {"name": f"coil-{k}", "at_mm": list(place)} for k, place in enumerate(places, 1)
        ]
    electronics, coils = document.get("electronics"), document.get("actuators")
    if isinstance(electronics, dict) and isinstance(coils, list):
        is_open = any(own.where == ("electronics", "drive") for own in spec.variables)
        document["electronics"] = of_its_driver(electronics, len(coils), is_open=is_open)
    return document


def completed_board(document: Document, point: float | None = None) -> Board:
    """The board of a document whose image may be left open; `point` replaces it, m.

    Where the document has no `least_duty`, it is what the coils' diodes need.
    """
    points = document.get("image", {}).get("points")
    if points is None or point is not None:
        size = document.get("plate", {}).get("size_mm")
        if isinstance(size, list) and all(isinstance(side, int | float) for side in size):
            step = (point or FINE) / MM
            points = [min(max(round(side / step) + 1, 7), 5000) for side in size]
            document = document | {"image": {"points": points}}
    board = board_from_document(document)
    return board if "least_duty" in document.get("electronics", {}) else with_floor(board)


def evaluate(spec: Spec, document: Document, seed: int) -> Evaluation:
    """A board, compared with others of its SPEC."""
    try:
        board = completed_board(document, COARSE)
    except InputError as error:
        return _unfit(beyond(spec, document), str(error))
    over = beyond(spec, document, board)
    if over:
        return _unfit(over, "")
    try:
        focus = _focus(spec, board, spec.settings.samples, seed, as_tables=False)
        more = costly_terms(spec, board, spec.settings.samples, seed)
    except ChladniError as error:
        return _unfit({}, str(error))
    return _weighed(spec, board, focus, more)


def _focus(
    spec: Spec, board: Board, samples: int, seed: int, *, as_tables: bool
) -> BoardScore | None:
    """One finger's, but of boards for several: it takes as long as all else of them."""
    if spec.is_for_several:
        return None
    return score_board(
        board,
        pitch=spec.settings.pitch,
        samples=samples,
        seed=seed,
        tolerance=DRAWN_TOLERANCE,
        as_tables=as_tables,
        in_full=as_tables,
    )


def judged(spec: Spec, seed: int, task: tuple[str, Document]) -> dict[str, Any]:
    """What `evaluate` tells of a named board, and seconds that it took."""
    started = time.perf_counter()
    found = asdict(evaluate(spec, task[1], seed))
    return {"evaluation": found, "seconds": time.perf_counter() - started}


def evaluate_in_full(
    spec: Spec, seed: int, samples: int, document: Document
) -> tuple[Evaluation, BoardScore | None]:
    """A board scored as `board score` and `fingers` would at the same pitch, on its own image."""
    board = completed_board(document)
    focus = _focus(spec, board, samples, seed, as_tables=True)
    more = costly_terms(spec, board, samples, seed, sets=SETS)
    return _weighed(spec, board, focus, more), focus


def costly_terms(
    spec: Spec, board: Board, samples: int, seed: int, sets: int | None = None
) -> tuple[Terms, Terms]:
    """What is left of a board as built and with several fingers, where a SPEC weighs that.

    On the nominal board, and within tolerances; as built is always the latter. `sets`: of fingers,
    so many on each drawn board if left out.
    """
    built = _built_terms(spec, board, samples, seed)
    nominal, robust = _finger_terms(spec, board, samples, seed, sets or FINGER_SETS * samples)
    return {**built, **nominal}, {**built, **robust}


def _finger_terms(
    spec: Spec, board: Board, samples: int, seed: int, sets: int
) -> tuple[Terms, Terms]:
    if not spec.finger_counts:
        return {}, {}
    nominal, robust = (dict.fromkeys(OF_FINGERS, NO_NUMBER_DB) for _ in range(2))
    clicks = FINGER_CLICK in spec.weights
    score = score_fingers(
        board, spec.finger_counts, sets=sets, samples=samples, seed=seed, clicks=clicks
    )
    for own in score.counts:
        assert own.perturbed is not None
        for found, kept in ((nominal, own), (robust, own.perturbed)):
            found[f"fingers_{own.fingers}_db"] = kept.isolation_db.p10
            found[FINGER_LEVEL] = _micrometres_db(kept.finger_um.p10 if kept.finger_um else 0.0)
            found[FINGER_CLICK] = kept.click_db.p10 if kept.click_db else NO_NUMBER_DB
    return nominal, robust


def _built_terms(spec: Spec, board: Board, samples: int, seed: int) -> dict[str, float]:
    if not BUILT_TERMS & spec.weights.keys():
        return {}
    kept = score_together(board, pitch=spec.settings.pitch, samples=samples, seed=seed)
    level, um = kept.second_finger_20mm_db, kept.finger_um
    return {
        "built_20mm_db": level.p10 if level else NO_NUMBER_DB,
        "built_finger_db": _micrometres_db(um.p10 if um else 0.0),
    }


def _weighed(
    spec: Spec, board: Board, focus: BoardScore | None, more: tuple[Terms, Terms]
) -> Evaluation:
    """A board's score by the weights of a SPEC; `more` as of `costly_terms`."""
    nominal, robust = ({**_costs(board), **own} for own in more)
    if focus is not None:
        assert focus.perturbed is not None
        nominal |= terms_of(focus)
        robust |= terms_of(focus.perturbed)
    level, least = least_um(spec)
    floor = 20.0 * np.log10(max(least, 1e-12))

    def total(terms: Terms) -> float:
        lacking = max(floor - terms[level], 0.0) if board.coil is not None else 0.0
        found = sum(weight * terms[name] for name, weight in spec.weights.items())
        return found - TOO_WEAK * lacking

    return Evaluation(total(nominal), total(robust), None, robust)


def least_um(spec: Spec) -> tuple[str, float]:
    """The term of what a finger gets, and the least of it, µm, at the worst tenth.

    A board for several fingers does not play what one would get of a focus: of several, the least
    is what the SPEC says, if it does.
    """
    asked = spec.settings.finger_um
    if spec.is_for_several:
        return FINGER_LEVEL, asked or 0.0
    return "finger_db", LEAST_UM if asked is None else asked


def _costs(board: Board) -> Terms:
    """Terms that are of no finger, the larger the better."""
    return {
        "coils": -float(len(board.actuators)),
        "area_cm2": -float(np.prod(board.plate.size)) * 1e4,
        "mass_g": -mass_g(board),
    }


def terms_of(statistics: FocusStatistics) -> Terms:
    """What weights on one finger's focus are for, the larger the better."""

    def low(spread: Spread | None) -> float:
        return spread.p10 if spread else NO_NUMBER_DB

    um = statistics.finger_um.p10 if statistics.finger_um else 0.0
    return {
        "second_finger_db": low(statistics.second_finger_db),
        "second_finger_16mm_db": low(statistics.second_finger_16mm_db),
        "second_finger_20mm_db": low(statistics.second_finger_20mm_db),
        "second_finger_25mm_db": low(statistics.second_finger_25mm_db),
        "finger_db": _micrometres_db(um),
        "focal_error_mm": -statistics.focal_error_mm.p90,
    }


def _micrometres_db(um: float) -> float:
    return 20.0 * float(np.log10(um)) if um > 0.0 else NO_NUMBER_DB


def mass_g(board: Board) -> float:
    """Of the plate and its magnets."""
    plate = board.section.areal_mass * board.plate.area
    one = board.magnet.areal_mass * np.pi * board.magnet.radius**2 if board.magnet else 0.0
    return 1e3 * float(plate + len(board.actuators) * one)


def beyond(spec: Spec, document: Document, board: Board | None = None) -> dict[str, float]:
    """How far a board is beyond each limit, as a share of it; none for one that may be."""
    own, over = spec.settings, {}
    if spec.places_are_free:
        places = [tuple(MM * along for along in one["at_mm"]) for one in document["actuators"]]
        apart = closest(places)
        if apart < own.coil_spacing - 1e-9:
            over["coil_spacing_mm"] = 1.0 - apart / own.coil_spacing
        kept: dict[str, Sequence[KeepOut | KeptFoot]]
        kept = {"keep_out": spec.keep_out, "feet": kept_feet(document)}
        for name, areas in kept.items():
            inside = [one.depth(place) for one, place in itertools.product(areas, places)]
            if max(inside, default=0.0) > 1e-9:
                over[name] = max(inside) / own.coil_spacing
    if board is not None and own.mass_g is not None and mass_g(board) > own.mass_g:
        over["mass_g"] = mass_g(board) / own.mass_g - 1.0
    if board is not None and own.first_natural_hz is not None:
        first = first_natural_hz(board)
        if first < own.first_natural_hz:
            over["first_natural_hz"] = 1.0 - first / own.first_natural_hz
    return over


def _unfit(over: Mapping[str, float], why: str) -> Evaluation:
    text = ", ".join(f"{name} by {100.0 * share:.0f} %" for name, share in over.items())
    far = UNFIT * (1.0 + sum(over.values()))
    return Evaluation(far, far, text or why, {})
