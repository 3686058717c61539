"""What `chladni design` found, in its answer and on top of each board file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from chladni.design.evaluate import TOO_WEAK, least_um
from chladni.design.front import Design, Entry
from chladni.design.spec import Spec
from chladni.design.starts import boards_asked
from chladni.design.weights import FINGER_CLICK, FINGER_LEVEL, FINGER_TERMS
from chladni.effects.low_pass import EDGE_HZ
from chladni.host.cli.common.finger_remarks import of_waves
from chladni.host.cli.common.verdicts import less_of
from chladni.host.manufacture.board_parts import feet_of, foam_of, sheet_of
from chladni.sim.board.board import Board
from chladni.sim.board.file import MOST_BYTES
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import first_natural_hz
from chladni.sim.files import read_whole
from chladni.sim.image.finger import NOTICED_DB, threshold_um

WORTH, WORTH_OPEN = 60, 200
"""As measured in docs/design.md."""
MOST_NAMED = 4
"""Values of a list that are told one by one."""
ANSWERS = "Answers"
"""Begins the file of a search that is complete."""


def about(found: Design, spec: str, asked: Spec) -> list[str]:
    """What stands on top of the best board's file."""
    boards = f"the best of {found.evaluations} boards, seed {found.seed}"
    first = f"{ANSWERS} {Path(spec).name}: {boards}."
    most = asked.settings.evaluations
    more = [f"({most} were asked for, and a round that has begun is finished.)"]
    less = lacking(found, asked)
    return [
        first,
        *more * (found.evaluations > most),
        *about_entry(found.best),
        *[less] * bool(less),
    ]


def is_answer(output: Path) -> bool:
    """Whether a file is there that a complete search wrote."""
    try:
        return read_whole(output, "--output", MOST_BYTES).startswith(f"# {ANSWERS} ".encode())
    except InputError:
        return False  # none, or no board's


def boards_worth(spec: Spec) -> int:
    """Boards up to which scores grow: of coils' places alone, or with sheet or foam open."""
    return WORTH_OPEN if spec.variables else WORTH


def is_ended(found: Design, spec: Spec, minutes: float | None) -> bool:
    """Whether its time ended a search, so that the same command may go on."""
    return minutes is not None and found.evaluations < boards_asked(spec)


def extent(found: Design, spec: Spec, samples: int, minutes: float | None, kept: Path) -> str:
    """How far the search went, where its time ended it."""
    asked, drawn = boards_asked(spec), found.draws
    said = ""
    if is_ended(found, spec, minutes):
        worth = boards_worth(spec)
        is_long = found.evaluations >= min(worth, asked)
        gain = "may gain" if is_long else f"gains: scores grow up to some {worth} boards"
        said = f"Time was up after {found.evaluations} of {asked} boards: a longer search {gain}."
        said += f" The same command goes on from {kept}.{_never_tried(found)}"
    if drawn < samples:
        few = f"The last few had {drawn} random boards each in place of {samples}"
        said += f" {few}: the worst tenth may be some dB less."
    if found.left_out:
        were = "was" if found.left_out == 1 else "were"
        said += f" Time was up before {found.left_out} of the last few {were} compared."
    return said.strip()


def _in_words(value: Any) -> str:
    """A value of a list, which may be a block of its own."""
    return " ".join(map(str, value.values())) if isinstance(value, dict) else str(value)


def _never_tried(found: Design) -> str:
    """Values of the SPEC's lists that no board had."""
    lists = []
    for key, values in found.never_tried.items():
        named = ", ".join(_in_words(one) for one in values[:MOST_NAMED])
        more = len(values) - MOST_NAMED
        lists.append(f"{key} {named}{f' and {more} more' if more > 0 else ''}")
    return f" It never tried {'; '.join(lists)}." if lists else ""


def lacking(found: Design, spec: Spec) -> str:
    """What the best board's score lost where its finger gets less than the SPEC asks for."""
    level, asked = least_um(spec)
    several = level == FINGER_LEVEL
    um = found.best.summary.get("fingers_um" if several else "finger_um")
    if um is None or um >= asked:
        return ""
    lost = TOO_WEAK * 20.0 * math.log10(asked / um)
    who = "Each of two fingers" if several else "A finger"
    return (
        f"{who} gets {um:.2g} µm at the worst tenth, and design.finger_um asks for {asked:g}: "
        f"that took {lost:.1f} dB off the score, {TOO_WEAK:g} for each dB less."
    )


def median(found: Design) -> str:
    """What the middle of all places has of one finger; the search goes by the worst tenth."""
    kept = found.full.perturbed if found.full else None
    db = kept.second_finger_20mm_db if kept else None
    um = kept.finger_um if kept else None
    if db is None:
        return ""
    level = "" if um is None else f" and {um.median:.2g} µm"
    click = found.full.click_20mm_db if found.full else None
    told = f"The median for one finger is {db.median:z.0f} dB 20 mm away{level}"
    if click is None:
        return f"{told}."
    return (
        f"{told}; of a click pressed with 1 N it is {click.median:z.0f}, the worst tenth "
        f"{click.p10:z.0f}, as drawn."
    )


def about_entry(entry: Entry) -> list[str]:
    """What stands on top of any board's file: its scores."""
    own = entry.summary
    scores = (
        f"Score {entry.evaluation.score:.2f} as drawn, {entry.evaluation.robust_score:.2f} within "
        "tolerances, by [design.weights]. Within tolerances nine of ten places have"
    )
    several = [
        f"{FINGER_TERMS[name]} fingers {own[name]:z.1f} dB" for name in FINGER_TERMS if name in own
    ]
    if several:
        each = f", at {own['fingers_um']:.1f} µm or more each" if "fingers_um" in own else ""
        clicks = f" A click keeps {own[FINGER_CLICK]:z.1f} dB." if FINGER_CLICK in own else ""
        return [scores, f"{', '.join(several)} apart{each}.{clicks}"]
    um, db = own["finger_um"], own["second_finger_20mm_db"]
    apart = f"at least {db:.1f} dB below" if db >= 0.0 else f"up to {-db:.1f} dB above"
    return [
        scores,
        f"a second finger 20 mm away {apart} the finger"
        + (f", and {um:.1f} µm under it." if um is not None else "."),
    ]


def parts_told(board: Board) -> dict[str, Any]:
    """What a board is made of, and for several fingers the mode below which effects are apart."""
    told: dict[str, Any] = {"sheet": sheet_of(board.plate)}
    if board.foundation:
        told["foam"] = foam_of(board.foundation)
    if board.springs:
        told["feet"] = feet_of(board.springs)
    if board.is_for_several:
        told["first_natural_hz"] = round(first_natural_hz(board), 1)
    return told


def result(
    found: Design, spec: Spec, entries: list[dict[str, Any]], output: Path, extent: str
) -> dict[str, Any]:
    """The answer; `extent` says how far the search went."""
    verdict = of_design(
        found.best.summary,
        for_fingers={
            count: found.best.evaluation.terms[f"fingers_{count}_db"]
            for count in spec.finger_counts
        },
    )
    board = found.board
    waves = of_waves(board)
    remarks = (
        verdict,
        extent,
        "" if spec.finger_counts else median(found),
        lacking(found, spec),
        _unfelt(found),
        waves and f"T{waves[1:]}, and {_asks(spec)}.",
    )
    return {
        "verdict": " ".join(one for one in remarks if one),
        "path": str(output),
        "score": found.best.evaluation.score,
        "robust_score": found.best.evaluation.robust_score,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "seed": found.seed,
        **parts_told(board),
        "actuators": [
            {"name": one.name, "at_mm": [round(1e3 * along, 6) for along in one.at]}
            for one in board.actuators
        ],
        "front": entries,
    }


def _unfelt(found: Design) -> str:
    """Where several fingers get less than a resting one feels."""
    um = found.best.summary.get("fingers_um")
    least = threshold_um(found.board.drive.frequency_hz)
    if um is None or least is None or um >= least:
        return ""
    return (
        f"A resting finger feels {least:.2g} µm, and so nothing at the worst tenth: `[design] "
        f"finger_um = {2.0 * least:.1g}` asks for more."
    )


def _asks(spec: Spec) -> str:
    """What a SPEC may say so that effects are kept apart."""
    limit = f"`[design] first_natural_hz = {EDGE_HZ:g}` asks for that"
    if not spec.finger_counts or FINGER_CLICK in spec.weights:
        return limit
    return f"{limit}; `[design.weights] {FINGER_CLICK} = 1.0` weighs what clicks keep"


def of_design(found: Mapping[str, Any], *, for_fingers: Mapping[int, float]) -> str:
    """What the best board of a search comes to at the worst tenth, within tolerances.

    Parameters
    ----------
    found
        Its summary.
    for_fingers
        Isolation by number of fingers, where a search weighed it.
    """
    um, each_um = found.get("finger_um"), found.get("fingers_um")
    if for_fingers:
        told = ", ".join(
            f"{number} fingers {db:z.0f} dB apart" for number, db in for_fingers.items()
        )
        each = "" if each_um is None else f", at {each_um:.2g} µm or more each"
        clicks = found.get("fingers_click_db")
        more = "" if clicks is None else f" A click keeps {clicks:z.0f} dB there."
        alone = found.get("second_finger_20mm_db")  # where the search weighed it, too
        more += "" if alone is None else of_one_alone(alone)
        return f"Within tolerances it keeps {told} at nine of ten places{each}.{more}"
    felt = "" if um is None else f" The finger itself moves by {um:.2g} µm or more."
    db = found["second_finger_20mm_db"]
    start = "It focuses" if db >= NOTICED_DB else "It does not focus at its worst places"
    at = f"within tolerances another finger 20 mm away gets {less_of(db)}"
    return f"{start}: {at} at the worst tenth; fingers notice {NOTICED_DB:g} dB.{felt}"


def of_one_alone(db: float) -> str:
    """What one finger alone leaves of a board for several, and whether that is a focus."""
    noticed = "" if db >= NOTICED_DB else f", which is no focus: fingers notice {NOTICED_DB:g} dB"
    return f" Of one finger alone another one 20 mm away gets {less_of(db)} there{noticed}."
