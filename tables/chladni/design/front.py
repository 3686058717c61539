"""Boards of which none is better in every goal: fingers apart, micrometres, coils and size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chladni.design.evaluate import NO_NUMBER_DB, Evaluation, completed_board
from chladni.design.variables import Document
from chladni.design.weights import FINGER_CLICK, FINGER_LEVEL, FINGER_TERMS
from chladni.drives.scoring.board_score import BoardScore
from chladni.sim.board.board import Board

OF_ONE = {"second_finger_20mm_db": 0.25, "finger_db": 0.5}
OF_SEVERAL = dict.fromkeys((*FINGER_TERMS, FINGER_CLICK), 0.25) | {FINGER_LEVEL: 0.5}
OF_ANY = {"coils": 0.0, "area_cm2": 0.0}
"""Terms that count, and by how much one board must be better to stand beside another: smaller
differences no one would build two boards for. Where a SPEC weighs several fingers, they count in
place of one alone."""


def goals_of(terms: Mapping[str, float]) -> dict[str, float]:
    """The goals of a board with these terms; all boards of a search have the same ones."""
    return (OF_SEVERAL if FINGER_LEVEL in terms else OF_ONE) | OF_ANY


@dataclass(frozen=True)
class Entry:
    """A board of the front."""

    document: Document
    evaluation: Evaluation

    @property
    def goals(self) -> tuple[float, ...]:
        """The larger the better."""
        terms = self.evaluation.terms
        return tuple(terms.get(name, NO_NUMBER_DB) for name in goals_of(terms))

    @property
    def summary(self) -> dict[str, Any]:
        """For people: numbers on boards that are off by their tolerances, 10th percentiles.

        Of several fingers and of one alone, where the SPEC weighs them.
        """
        terms = self.evaluation.terms
        several = {
            name: terms[name]
            for name in (*FINGER_TERMS, FINGER_CLICK)
            if terms.get(name, NO_NUMBER_DB) > NO_NUMBER_DB
        }
        each_db = terms.get(FINGER_LEVEL, NO_NUMBER_DB)
        if several and each_db > NO_NUMBER_DB:
            several["fingers_um"] = float(10.0 ** (each_db / 20.0))
        return several | {
            "coils": round(-terms["coils"]),
            "area_cm2": round(-terms["area_cm2"], 3),
            **_alone(terms),
            "mass_g": -terms["mass_g"],
            "robust_score": self.evaluation.robust_score,
            "score": self.evaluation.score,
        }


def _alone(terms: Mapping[str, float]) -> dict[str, float | None]:
    """Of one finger alone, where the SPEC weighs its focus."""
    if "finger_db" not in terms:
        return {}
    db = terms["finger_db"]
    return {
        "second_finger_20mm_db": terms["second_finger_20mm_db"],
        "finger_um": float(10.0 ** (db / 20.0)) if db > NO_NUMBER_DB else None,
    }


def shown_goals(summaries: Sequence[Mapping[str, Any]]) -> tuple[int, str, str]:
    """By what people compare boards: for how many fingers, how far apart these are, micrometres.

    The latter two as keys of the boards' summaries: of clicks, if those were weighed.
    """
    for name, count in FINGER_TERMS.items():
        if summaries and all(name in one for one in summaries):
            has_clicks = all(FINGER_CLICK in one for one in summaries)
            return count, FINGER_CLICK if has_clicks else name, "fingers_um"
    return 1, "second_finger_20mm_db", "finger_um"


def front_of(entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """Entries that no other one matches in all goals, the best score first."""
    ranked = sorted(entries, key=lambda one: -one.evaluation.robust_score)
    slack = np.array(list(goals_of(ranked[0].evaluation.terms).values())) if ranked else 0.0
    kept: list[Entry] = []
    for entry in ranked:
        own = np.array(entry.goals)
        if not any(np.all(np.array(other.goals) + slack >= own) for other in kept):
            # One that comes later can still be better in all goals than one with a better score.
            kept = [other for other in kept if not np.all(own >= np.array(other.goals))]
            kept.append(entry)
    return tuple(kept)


@dataclass(frozen=True)
class Design:
    """What a search found.

    Attributes
    ----------
    best
        The best board; its scores are of all draws.
    full
        All numbers of its focus, where the SPEC weighs one.
    evaluations
        Boards that were looked at, those in the checkpoint included.
    front
        Boards of which none is better in all goals, the best score first.
    draws
        Random boards of each of those, by which the best is told.
    left_out
        Of the last few boards, those for which there was no time.
    never_tried
        Values of the SPEC's lists that no board that was looked at has, by their keys.
    """

    best: Entry
    full: BoardScore | None
    evaluations: int
    front: tuple[Entry, ...]
    seconds: float
    seed: int
    draws: int
    left_out: int = 0
    never_tried: dict[str, tuple[Any, ...]] = field(default_factory=dict)

    @property
    def board(self) -> Board:
        """The best board."""
        return completed_board(self.best.document)
