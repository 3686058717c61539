"""What a table that was built is for, and what it keeps of its board's isolation."""

from __future__ import annotations

from chladni.host.cli.common.verdicts import less_of
from chladni.sim.image.finger import NOTICED_DB
from chladni.tables.several_fingers.build import FrequencyIsolation, ResponsesReport

MUCH_DB = 1.0
"""Of isolation that a table loses: from here on its remedy is told."""


def of_table(
    objective: str,
    misled: int,
    places: int,
    *,
    second_finger_db: float | None = None,
    for_fingers: bool = False,
) -> str:
    """What a table of drives is for, and whether drives of `focus` do so.

    Parameters
    ----------
    misled, places
        At how many of the places that were looked at the maximum is elsewhere.
    second_finger_db
        What another finger 20 mm away gets less than the finger, at their median, if known.
    for_fingers
        Whether the table has responses too: then drives that do not focus only cost level.
    """
    if objective == "focus":
        told = "Its drives are those that focus best."
        if second_finger_db is not None and second_finger_db < NOTICED_DB:
            told += (
                f" They do not focus: another finger 20 mm away gets {less_of(second_finger_db)} "
                f"at the median of {places} places. {FOR_BOTH if for_fingers else FOR_ONE}"
            )
    elif misled:
        told = f"At {misled} of {places} places its maximum is more than 12 mm from the finger."
    else:
        told = f"Its drives are best at {objective}."
    return f"{told} `chladni table score` says what fingers feel of it, at all places."


FOR_BOTH = "They are quieter for trying: `--for fingers` gives one finger alone the loudest drive."
FOR_ONE = (
    "`chladni board score` says what would help; `--for fingers` makes a table that keeps several "
    "fingers apart, and gives one alone the loudest drive."
)

FINE_BITS = 12
"""More lose no less of two fingers' isolation."""


def of_responses(report: ResponsesReport, *, with_drives: bool) -> str:
    """What a table of responses keeps of the board's isolation, at its worst frequency.

    `with_drives`: the responses lie at the places of a table's drives.
    """

    def lost(one: FrequencyIsolation) -> float:
        return one.exact_isolation_db.p10 - one.isolation_db.p10

    one = max(report.frequencies, key=lost)
    kept, exact = one.isolation_db, one.exact_isolation_db
    at = "" if len(report.frequencies) == 1 else f" at {one.frequency_hz:g} Hz"
    block, less = "regions" if with_drives else "fingers", ""
    if lost(one) >= MUCH_DB:
        # A table that would be large takes integers of fewer bits by itself.
        how = f"A smaller [{block}] pitch_mm than {_pitch(report)}"
        how = how if report.bits >= FINE_BITS else f"`--bits {FINE_BITS}`"
        less = f" {how} loses less, in a larger table."
    um = one.finger_um
    each = (
        ""
        if um is None
        else f" Each gets {um.median:.2g} µm of its own, {um.p10:.2g} at the worst tenth."
    )
    taken = ""
    if (exact.median, exact.p10) != (kept.median, kept.p10):
        taken = f"; rounding and {_pitch(report)} mm between places make the difference"
    return (
        f"It keeps two pressing fingers {kept.median:z.1f} dB apart{at} at the median, "
        f"{kept.p10:z.1f} at the worst tenth.{each} The board itself has {exact.median:z.1f} and "
        f"{exact.p10:z.1f} (`chladni board score`){taken}.{less}"
    )


def _pitch(report: ResponsesReport) -> str:
    return " × ".join(f"{along:.2g}" for along in dict.fromkeys(report.pitch_mm))
