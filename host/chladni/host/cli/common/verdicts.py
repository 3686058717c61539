"""What a score comes to, in a few words: does it focus, does a finger feel it, what would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from chladni.drives.scoring.board_score import BoardScore
from chladni.drives.scoring.remedies import Remedy
from chladni.drives.scoring.scorecard import Scorecard
from chladni.drives.scoring.several_fingers.fingers_score import CountScore
from chladni.drives.scoring.several_fingers.kept_apart import KeptApart
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import FocusStatistics
from chladni.sim.board.fingers import LEAST_APART
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.quantity import MM
from chladni.sim.image.finger import NOTICED_DB, sensation_db
from chladni.sim.image.metrics import SECOND_FINGER_DISTANCE

if TYPE_CHECKING:
    from chladni.drives.scoring.kept_focus import KeptFocus

WIDE_MM = 14.0
"""Coils farther apart than 12 mm, about a fingertip, leave places between them (docs/focus.md)."""
MOST_COILS = max(own.channels for own in CHIPS.values())
SAME_DB = 0.05
"""What is written with one digit is the same below."""


def of_places(
    score: FocusStatistics,
    *,
    frequency_hz: float,
    built: FocusStatistics | None = None,
    known_as: str = "as drawn",
    click: Spread | None = None,
) -> str:
    """Whether drives all over a board focus, and whether a finger feels them.

    Parameters
    ----------
    built
        Of boards within tolerances.
    known_as
        How the board's values are known, in words.
    click
        What a click in place of a tone leaves 20 mm away, if it was reckoned.
    """
    apart, kept = next(
        (
            (distance, spread)
            for distance, spread in (
                (20, score.second_finger_20mm_db),
                (16, score.second_finger_16mm_db),
                (12, score.second_finger_db),
            )
            if spread is not None
        ),
        (0, None),
    )
    if kept is None:
        return "The board has no room for a second finger. " + _felt(score, frequency_hz)
    at = f"another finger {apart} mm away"
    if kept.p10 >= NOTICED_DB:
        off = None if built is None or apart != 20 else built.second_finger_20mm_db
        alone, within = "", ""
        if off is not None and off.p10 < NOTICED_DB:
            alone, within = f" {known_as} alone", f", and {less_of(off.p10)} within tolerances"
        if click is not None and click.p10 < NOTICED_DB:
            alone += " while no finger presses"
        told = f"It focuses{alone}: {at} gets at least {kept.p10:.1f} dB less at nine of ten places"
        told += _of_pressed_click(click) + within
    elif kept.median >= NOTICED_DB:
        told = (
            f"It focuses at some places: {at} gets {kept.median:.1f} dB less at the median, and "
            f"{less_of(kept.p10)} at the worst tenth"
            f"{_of_pressed_click(click)}"
        )
    else:
        told = f"It does not focus: {at} gets {less_of(kept.median)} at the median"
    return f"{told}; fingers notice {NOTICED_DB:g} dB. {_felt(score, frequency_hz)}".rstrip()


def _of_pressed_click(click: Spread | None) -> str:
    """At the worst tenth, in brackets."""
    return "" if click is None else f" (of a click pressed with 1 N {less_of(click.p10)})"


def less_of(db: float) -> str:
    """Decibels in words."""
    return f"{db:.1f} dB less" if db >= 0.0 else f"{-db:.1f} dB more"


def _felt(score: FocusStatistics, frequency_hz: float) -> str:
    if score.finger_um is None:
        return ""
    return _level(score.finger_um.median, frequency_hz, "The finger itself moves by")


def _level(um: float, frequency_hz: float, words: str) -> str:
    """Micrometres, and how far they are above what is just felt."""
    db = sensation_db(um, frequency_hz)
    if db is None:
        return f"{words} {um:.2g} µm."
    return f"{words} {um:.2g} µm, " + (
        f"{db:.0f} dB above what is just felt." if db >= 0.0 else "which is not felt."
    )


def of_built(together: KeptFocus) -> str:
    """What is left of a focus as the board is built and used, after its own verdict."""
    away, moved = together.second_finger_20mm_db, together.finger_um
    if away is None:
        return ""
    level = f", and the finger moves by {moved.p10:.2g} µm" if moved else ""
    return (
        " As it is built and used, all at once (film, a finger that presses, warm, any foam "
        f"stiffer, tolerances), another finger 20 mm away gets {less_of(away.p10)} at the worst "
        f"tenth{level}."
    )


def of_board(
    score: BoardScore,
    two: CountScore | None,
    *,
    frequency_hz: float,
    known_as: str = "as drawn",
    for_fingers: bool = False,
    has_fingers: bool = True,
    apart: float = LEAST_APART,
    foam_twice: KeptApart | None = None,
    tried: Sequence[Remedy] = (),
) -> str:
    """The same of a board's best drives; what keeps two fingers apart, and what would help.

    Parameters
    ----------
    two
        Of two fingers that press; None where there is no room for them.
    known_as
        How the board's values are known, in words.
    for_fingers
        Whether the board is for several: then that comes first, and no remedy for one focus.
    has_fingers
        Whether its tables have what several need.
    apart
        How far from each other the two lie at least, m; told where it is not a hand's.
    foam_twice
        The same two on foam twice as stiff; None on no foam, or on foam that was measured.
    tried
        What could help, the best first.
    """
    built = None if for_fingers else score.perturbed
    click = score.click_20mm_db
    focus = of_places(score, frequency_hz=frequency_hz, built=built, known_as=known_as, click=click)
    known = score.second_finger_20mm_db
    several = ""
    if two is not None:
        kept = two.isolation_db
        condition = "" if has_fingers else ", once its file has [fingers],"
        if apart != LEAST_APART:
            condition = f", {apart / MM:g} mm from each other or more,"
        several = (
            f"It keeps two pressing fingers{condition} {kept.median:z.0f} dB apart at the median, "
            f"{kept.p10:z.0f} at the worst tenth{of_click(two.click_db)}, {known_as}"
            f"{_within_tolerances(two)}."
            f"{_each(two, frequency_hz) if for_fingers else ''}"
        )
    several += _on_stiffer_foam(two, foam_twice, None if for_fingers else score.foam_twice)
    several = several.strip()
    if for_fingers and several:
        return several
    if known is None or known.median >= NOTICED_DB:
        return " ".join(filter(None, (focus, _between_coils(score), several)))
    return " ".join(filter(None, (focus, several, _remedy(score, tried))))


def _within_tolerances(two: CountScore) -> str:
    if two.perturbed is None:
        return ""
    kept = two.perturbed.isolation_db
    click = of_click(two.perturbed.click_db)
    return f", {kept.median:z.0f} / {kept.p10:z.0f} dB{click} within tolerances"


def of_click(kept: Spread | None) -> str:
    """What a click keeps in place of a tone, in brackets."""
    if kept is None:
        return ""
    return f" (a click, as reckoned, {kept.median:z.0f} and {kept.p10:z.0f})"


def _each(two: CountScore, frequency_hz: float) -> str:
    """What each of them gets of its own, and whether that is felt."""
    um = two.finger_um
    if um is None:
        return ""
    db = sensation_db(um.p10, frequency_hz)
    unfelt = ", which a resting finger does not feel" if db is not None and db < 0.0 else ""
    told = f" Each gets {um.median:.2g} µm of its own, {um.p10:.2g} at the worst tenth{unfelt}"
    click = two.click_um
    return told + (f"; of a click alone {click.median:.2g} and {click.p10:.2g}." if click else ".")


def _on_stiffer_foam(
    two: CountScore | None, foam: KeptApart | None, alone: KeptFocus | None
) -> str:
    """What is kept of that where the foam differs most from its data sheet."""
    kept = []
    if alone is not None and alone.second_finger_20mm_db is not None:
        away, um = alone.second_finger_20mm_db, alone.finger_um
        level = f" and {um.median:.2g} µm" if um else ""
        kept += [f"20 mm from one finger {away.median:z.0f} and {away.p10:z.0f} dB{level}"]
    if two is not None and foam is not None:
        told = f"two fingers {foam.isolation_db.median:z.0f} and {foam.isolation_db.p10:z.0f} dB"
        if two.finger_um is not None and foam.finger_um is not None:
            told += (
                f", and {foam.finger_um.median:.2g} µm each instead of {two.finger_um.median:.2g}"
            )
        kept += [told]
    if not kept:
        return ""
    often = " Foam is often twice as stiff as its data sheet says"
    until = "until `chladni calibrate` finds the board's own drives"
    return f"{often}: that leaves {', '.join(kept)}, {until}."


def _remedy(score: BoardScore, tried: Sequence[Remedy]) -> str:
    """What makes a board focus, of what was tried; else how far off it is, and coils nearer."""
    best, own = (tried[0] if tried else None), score.second_finger_20mm_db
    if best is not None and best.second_finger_20mm_db >= NOTICED_DB:
        kept = less_of(best.second_finger_20mm_db)
        return f"Tried on it: {best.change} leaves another finger {kept} there."
    told = ""
    if best is not None and own is not None:
        helps = best.second_finger_20mm_db > own.median + SAME_DB
        told = (
            f"Tried on it: {best.change} helps most, {less_of(best.second_finger_20mm_db)}, which "
            "does not do. "
            if helps
            else "No other sheet or foam helps, as tried. "
        )
    spacing = score.coil_spacing_mm
    if spacing is None or spacing > WIDE_MM:
        coils = "one coil" if spacing is None else f"coils {spacing:.0f} mm apart"
        if score.room_for > MOST_COILS:
            return told + (
                f"Coils about 12 mm apart would be {score.room_for} on this board, and a chip "
                f"drives {MOST_COILS}: take a smaller board, or one for several fingers "
                "(docs/fingers.md), whose coils may be as far apart."
            )
        told += (
            f"Instead of {coils} take coils about 12 mm apart, more of them or a board as much "
            "smaller; `chladni design` finds the sheet and the foam for them."
        )
    return told.rstrip()


def _between_coils(score: BoardScore) -> str:
    """What would help where a board focuses at some places alone, between which coils lie apart."""
    kept, spacing = score.second_finger_20mm_db, score.coil_spacing_mm
    is_wide = spacing is not None and spacing > WIDE_MM and score.room_for <= MOST_COILS
    if kept is None or kept.p10 >= NOTICED_DB or not is_wide:
        return ""
    return (
        f"Coils {spacing:.0f} mm apart leave places between them: about 12 mm apart they would be "
        f"{score.room_for} on this board."
    )


def of_place(
    card: Scorecard, *, frequency_hz: float, for_fingers: bool = False, is_played: bool = True
) -> str:
    """Whether one drive focuses, and whether a finger feels it.

    Parameters
    ----------
    for_fingers
        The board is for several, and this is of one alone.
    is_played
        Whether its device plays this drive.
    """
    if not card.movable:
        return "No drive of these coils moves this place."
    off, near, far = card.focal_error_mm, card.second_finger_db, card.second_finger_20mm_db
    apart, less = (12, near) if far is None else (20, far)
    is_near = off <= SECOND_FINGER_DISTANCE * 1e3
    if not is_near or less <= 0.0:
        does = "does not focus"
    else:
        does = "focuses" if less >= NOTICED_DB else "hardly focuses"
    if for_fingers and does != "focuses":
        does = "need not focus"
    told = f"It {does}: another finger {apart} mm away gets {less_of(less)}"
    if far is not None and far - near >= SAME_DB:
        told += f", one 12 mm away {less_of(near)}"
    told += f"; the maximum lies {off:.1f} mm from the finger"
    um = card.felt.finger_um if card.felt is not None else None
    level = _level(um, frequency_hz, "The finger itself moves by") if um is not None else ""
    told += f"; fingers notice {NOTICED_DB:g} dB."
    if not for_fingers:
        return f"{told} {level}".rstrip()
    # What the board is made for comes first.
    return " ".join(filter(None, (SEVERAL if is_played else NOT_PLAYED, level, told)))


SEVERAL = (
    "The board is for several fingers, and this is the drive that its device plays under one "
    "alone. `chladni fingers` says how far apart it keeps several."
)
NOT_PLAYED = (
    "The board is for several fingers, and its device does not play this drive: under one alone "
    "it plays the loudest for its power (`--method time-reversal`). `chladni fingers` says how "
    "far apart it keeps several."
)


def of_methods(entries: Sequence[Mapping[str, Any]], best: Mapping[str, Any]) -> str:
    """What the best of several methods comes to, at the median of its targets."""
    name = best["method"] + (f" at {best['objective']}" if best["method"] == "phasor" else "")
    told = f"Of {len(entries)} methods {name} is the one for this board"
    less = best["second_finger_db"]
    if less is None:
        return f"{told}."
    start = "it focuses" if less >= NOTICED_DB else "it does not focus"
    return (
        f"{told}: {start}, another finger 12 mm away gets {less_of(less)} at the median; fingers "
        f"notice {NOTICED_DB:g} dB."
    )
