"""What `chladni design` says beside its answer: how long a search is, and what to do next."""

from __future__ import annotations

from pathlib import Path

from chladni.design.evaluate import completed_board, document_of
from chladni.design.front import Design
from chladni.design.last_boards import boards_more
from chladni.design.spec import Spec
from chladni.design.starts import boards_asked, spread_numbers
from chladni.design.weights import FINGER_CLICK
from chladni.host.cli.common.board_reports import say_leftovers, say_of_coils, say_panel
from chladni.host.cli.common.finger_remarks import (
    say_long_panel,
    say_mirrored,
    say_tones,
    say_waves,
)
from chladni.host.cli.common.output import say
from chladni.host.cli.designing.answers import boards_worth
from chladni.sim.board.panel_layer import layered_plate
from chladni.sim.errors import InputError


def say_last(count: int, draws: int, seconds: float) -> None:
    """Before the last boards are compared, which may take long."""
    time = f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{seconds:.0f} s"
    boards = "the last board" if count == 1 else f"the last {count} boards"
    say(f"about {time} to compare {boards}, with {draws} random boards each")


def say_pace(spec: Spec, minutes: float | None, most: int, board_s: float) -> None:
    """How many boards a search comes to in its time, and how many are worth it."""
    asked, worth = boards_asked(spec), boards_worth(spec)
    told = f"a board takes {board_s:.2g} s"
    if minutes:
        told += f": this search looks at about {most} of {asked} boards in {minutes:g} min"
    elif minutes is None:
        told += f": {most} boards take about {most * board_s / 60.0:.2g} min"
    if most < worth and asked == spec.settings.evaluations:  # else no more boards can be
        told += f"; scores of a SPEC like this grow up to some {worth} (docs/design.md)"
    say(told)


def is_kept(kept: Path, others: list[int]) -> bool:
    """Whether there is something of this search, and not of the other one that it replaces."""
    return kept.exists() and kept.stat().st_mtime_ns not in others


def say_other(kept: Path, others: list[int]) -> None:
    """Before what an earlier search kept is lost; `others` gets the time of its last change."""
    others.append(kept.stat().st_mtime_ns)
    say(
        f"{kept} has boards of another SPEC, seed or version: the search begins again, and its own "
        "take their place. To keep them stop it now, and write to another name"
    )


def say_first(spec: Spec, seed: int, samples: int, stopped: Path | None = None) -> None:
    """How long a search is, and what is missing in any board of the SPEC.

    `stopped`: what is kept of the search that is to end here.
    """
    if stopped is not None and not stopped.exists():
        say(f"{stopped} is not there, so no search was stopped: this one begins, and ends at once")
    first = "layouts first, then " if spec.places_are_free else ""
    say(
        f"{first}{boards_asked(spec)} boards, and to compare the last few takes as long as "
        f"some {boards_more(spec, samples)} more"
    )
    places = [(0.0, 0.0)] if spec.places_are_free else None
    try:
        board = completed_board(document_of(spec, spread_numbers(spec, seed)[0], places))
    except InputError:
        return  # The search says what is wrong.
    say_leftovers(board)
    say_long_panel(board)
    if spec.finger_counts and not spec.variables:
        # Its magnets' mass apart, all boards of the search are this plate.
        say_waves(board)
    if layered := layered_plate(board):
        say_panel(layered, for_several=board.is_for_several)


def say_next(found: Design, spec: Spec, output: Path, front: Path | None = None) -> None:
    """What the board's panel does, which commands score it as the search did, and say more.

    `front`: where its boards were written.
    """
    layered = layered_plate(found.board) if spec.variables else None
    if spec.variables:
        say_of_coils(found.board)  # The first board's are told before the search.
    if layered:
        say_panel(layered, for_several=found.board.is_for_several)
    if front is None and len(found.front) > 1:
        say(f"the {len(found.front)} boards of the front are written with --front FOLDER")
    if weighed := spec.finger_counts:
        counts = f" --fingers {weighed[0]}" if len(weighed) == 1 else ""
        own = f"{output}{counts} --samples {found.draws} --seed {found.seed}"
        say(f"`chladni fingers {own}` scores it within tolerances, as here.")
        say_mirrored(found.board)
    if found.board.coil is not None:
        say_tones(str(output), found.board, clicks=FINGER_CLICK in spec.weights)
    foam = " and how much foam twice as stiff takes" if found.board.foundation else ""
    say(f"`chladni board score {output}` says more{foam}.")
