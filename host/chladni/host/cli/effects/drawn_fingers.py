"""`chladni play --pairs` and `--places`: an effect at many drawn places all over a board."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods import SEED
from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.drives.scoring.spread import Spread
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import Effect
from chladni.host.cli.common.finger_remarks import say_waves
from chladni.host.cli.common.options import required
from chladni.host.cli.common.output import Place, answer, by_name, progress_bar, say
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.effects.presses import Press, bank_for, each_under, of_bank, of_effects
from chladni.host.cli.effects.remarks import say_bias, say_short_places
from chladni.host.cli.effects.setup import Setup, setup_of
from chladni.host.cli.effects.verdicts import over_other_effect_db
from chladni.host.emulation.felt_over_time import TOGETHER
from chladni.host.emulation.played_effect import PlayedEffect, check_can_play
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError, ConflictError, MissingError, StoppedError

FloatArray = NDArray[np.float64]

MOST_DRAWN = 1000
MOST_DRAWS = 1000
"""For each pair that is asked for: in one of them a bank's areas are too few or too small."""
FEW, MANY = 10, 60
"""Fewer have no tenth; of as many it is known to some 2 dB."""
Drawn = Sequence[Sequence[Press]]
Found = Sequence[Sequence[PlayedEffect]]
"""A finger that plays, or two, of each pair or place."""


def check_drawn(
    connection: Connection,
    effects: Sequence[str | None],
    given: Mapping[str, object],
    *,
    pairs: bool,
    together: bool,
) -> None:
    """Refuse what is of given fingers, what does not score, and two effects for one finger.

    Parameters
    ----------
    effects
        Of the finger that plays, and of the other one.
    given
        Values of options that are of no drawn fingers.
    """
    option, bank = "--pairs" if pairs else "--places", connection.emulated_bank is not None
    named = [own for own, value in given.items() if value]
    if named:
        raise ConflictError(named[0], option, hint=f"{option} chooses where fingers lie")
    others = {"--other-effect": effects[1] is not None, "--together": together}
    for own in [name for name, is_given in others.items() if is_given]:
        if not pairs:
            raise ConflictError(own, option, hint="only --pairs has another finger that plays")
        if bank != (own == "--together"):
            hint = "of a bank both play with --together, of effects with --other-effect"
            raise ConflictError(own, "--bank" if bank else "EFFECT", hint=hint)
    if effects[0] is not None and bank:
        raise ConflictError("EFFECT", "--bank", hint="one of them is what is played")
    if not bank:
        what = "a shipped effect (`chladni effects list`) or a file, to play, or --bank"
        required("EFFECT", effects[0], what)
    if not connection.emulator:
        hint = "only emulated pins are scored"
        if connection.port is None and connection.udp is None:
            raise MissingError("--emulator", f"the device that {option} plays on", hint=hint)
        raise ConflictError(option, "--port or --udp", hint=f"{hint}: --emulator")


def play_drawn(
    connection: Connection,
    effects: Sequence[Effect],
    count: int,
    hidden: str | None,
    *,
    pairs: bool,
    together: bool,
    apart: float | None,
    as_json: bool,
    **how: Any,
) -> None:
    """Tell what so many drawn `pairs` have, or one finger alone at so many places.

    The effects are of the first finger of each and maybe of the second, or, if there are none, of
    the bank's areas: the first finger presses one of them, `together` both, two areas where there
    are as many. Pairs are the first of those that `fingers` and `board score` draw, of a bank those
    in its areas. Of few people get each in place of shares of them. Fingers of a pair lie `apart`
    or more, m, or as far as the board has it. `how`: as of `play_effect`.
    """
    bank = None if effects else bank_for(connection)
    setup = setup_of(connection, (), hidden)
    say_waves(setup.board)
    unpacked = None if bank is None else unpack_bank(bank)
    in_two = together and unpacked is not None and len(unpacked.areas) > 1

    def presses_at(places: Sequence[Place]) -> list[Press]:
        if bank is None:
            return of_effects(effects, places)
        found = of_bank(bank, places, setup.board, together=together)
        if in_two and len({one.area for one in found}) == 1:
            raise ArgumentError("--pairs", found[0].area, "two areas, which --together is for")
        return found

    apart = setup.board.fingers_apart if apart is None else apart
    drawn = _drawn(setup, presses_at, count, apart if pairs else None)
    found = _played(setup, drawn, how if pairs else how | {"unknown": True})
    asked, count = count, len(found)
    drawn = drawn[:count]
    if bank is None:
        say_short_places([one for own in found for one in own], how["level_um"])
    say_bias(found[0], setup.board)
    names = [own.name for own in effects]
    known: dict[str, Any] = {"effect": names[0] if len(names) == 1 else None}
    known |= {"bank": None if unpacked is None else unpacked.name}
    known |= setup.rows(as_json=as_json)
    known |= {"pairs" if pairs else "places": count, "newtons": how["newtons"]}
    tell = _of_two if len(found[0]) > 1 else _of_one if pairs else _of_unknown
    rows = tell(drawn, found, names, as_json=as_json)
    rows = {"verdict": f"Over {count} {'pairs' if pairs else 'places'} {rows.pop('verdict')}"} | (
        known | rows | {"rested": _rested(found[0][0])}
    )
    answer(rows, as_json=as_json, title=setup.played_on)
    if pairs and names == ["click"]:
        bends = found[0][0].bias_um is not None and not how["rested"]
        touched = ", and have rested, which these have not" if bends else ""
        on = f" --hidden {hidden}" if hidden else ""
        on += f" --table {setup.file}" if setup.file else ""
        say(
            f"`chladni fingers {connection.emulated_board} --fingers 2 --sets {count} --apart "
            f"{apart / MM:g}{on}` reckons the shipped click of these pairs, at the median up to "
            "6 dB off what pins keep, at the worst tenth up to 7: both fingers of each count there"
            f"{touched}"
        )
    if count < asked:
        raise StoppedError(f"after {count} of {asked}, of which all is above")
    if FEW <= count < MANY:
        say(f"the worst tenth of {count} is {count // 10} of them: of more it may lie 5 dB lower")


def _of_one(drawn: Drawn, found: Found, _: Sequence[str], *, as_json: bool) -> dict[str, Any]:
    """The first finger of each pair plays."""
    played = [own for (own,) in found]
    unfelt = [(one.other_peak_um or 0.0) <= (one.just_felt_um or 0.0) for one in played]
    knows = played[0].just_felt_um is not None
    rest = f"; {sum(unfelt)} of {len(found)} feel nothing of it while they rest" if knows else ""
    levels = [one.isolation_db or 0.0 for one in played]
    return {
        "verdict": f"the other finger gets {levels_told(levels, 'less')}{rest}.",
        **_spreads({"peak_um": _peaks(played), "isolation_db": levels}, as_json=as_json),
        **_worst(drawn, levels, as_json=as_json),
        "unfelt": float(np.mean(unfelt)) if knows else None,
    }


def _of_two(drawn: Drawn, found: Found, effects: Sequence[str], *, as_json: bool) -> dict[str, Any]:
    """Both fingers of each pair play, of a bank what its area has."""
    levels = np.array([over_other_effect_db(own) for own in found])
    key = "over_other_effect_db"
    if not effects:
        every = levels.ravel().tolist()
        told = levels_told(every, "more of its own effect than of the other's")
        told += too_weak([one for own in found for one in own])
        peaks = _peaks([one for own in found for one in own])
        spreads = _spreads({"peak_um": peaks, key: every}, as_json=as_json)
        spreads |= _worst(drawn, levels.min(axis=1).tolist(), as_json=as_json)
        areas = _by_area(drawn, found, levels, as_json=as_json)
        return {"verdict": f"a finger gets {told}.", **spreads, **areas}
    sentences, rows = [], []
    for own, other in ((0, 1), (1, 0)):
        more = f"more of its {effects[own]} than of {'AB'[other]}'s {effects[other]}"
        told = levels_told(levels[:, own].tolist(), more) + too_weak([one[own] for one in found])
        sentences.append(f"{'AB'[own]} gets {told}")
        peaks = _peaks([one[own] for one in found])
        spreads = _spreads({"peak_um": peaks, key: levels[:, own].tolist()}, as_json=as_json)
        rows.append({"name": "AB"[own], "effect": effects[own]} | spreads)
    result: dict[str, Any] = {"verdict": f"{'; '.join(sentences)}."}
    result |= _worst(drawn, levels.min(axis=1).tolist(), as_json=as_json)
    return result | by_name("fingers", rows, as_json=as_json)


def too_weak(played: Sequence[PlayedEffect]) -> str:
    """At how many pairs an effect is too weak, where it is at any."""
    count = sum(one.peak_um < (one.just_felt_um or 0.0) for one in played)
    of = f", too weak for a resting finger to feel at {count} of {len(played)}"
    return of if count else ""


def _by_area(drawn: Drawn, found: Found, levels: FloatArray, *, as_json: bool) -> dict[str, Any]:
    """What presses of each area of a bank have."""
    rows: dict[str, dict[str, list[float]]] = {}
    for presses, played, own in zip(drawn, found, levels.tolist(), strict=True):
        for press, one, db in zip(presses, played, own, strict=True):
            row = rows.setdefault(str(press.area), {"peak_um": [], "over_other_effect_db": []})
            row["peak_um"].append(one.peak_um)
            row["over_other_effect_db"].append(db)
    areas = [
        {"name": name, "presses": len(own["peak_um"])} | _spreads(own, as_json=as_json)
        for name, own in sorted(rows.items())
    ]
    return by_name("areas", areas, as_json=as_json)


def _worst(drawn: Drawn, levels: Sequence[float], *, as_json: bool) -> dict[str, Any]:
    """Where fingers of the least level lie."""
    press = drawn[int(np.argmin(levels))][0]
    places = [press.at_mm, *([press.other_mm] if press.other_mm else [])]
    told = " and ".join("{:.1f}, {:.1f}".format(*place) for place in places)
    at = [list(place) for place in places] if as_json else f"{told} mm: {min(levels):.1f} dB"
    return {"worst_at_mm": at}


def _of_unknown(drawn: Drawn, found: Found, _: Sequence[str], *, as_json: bool) -> dict[str, Any]:
    """One finger plays, and the device knows of no other.

    Raises
    ------
    ArgumentError
        The board has no two places 20 mm apart.
    """
    played = [own for (own,) in found]
    known = [(one, own.second_finger_20mm_db) for one, own in zip(drawn, played, strict=True)]
    far = [(one, db) for one, db in known if db is not None]
    levels = [db for _, db in far]
    if not levels:
        raise ArgumentError("--places", len(found), "a board with places 20 mm apart")
    return {
        "verdict": (
            "another finger 20 mm away or farther, of which the device knows nothing, gets "
            f"{levels_told(levels, 'less')}."
        ),
        **_spreads({"peak_um": _peaks(played), "second_finger_20mm_db": levels}, as_json=as_json),
        **_worst([one for one, _ in far], levels, as_json=as_json),
    }


def _drawn(
    setup: Setup,
    presses_at: Callable[[Sequence[Place]], list[Press]],
    count: int,
    apart: float | None,
) -> list[list[Press]]:
    """Presses of so many drawn sets of fingers, those left out that press no area of a bank.

    Pairs whose fingers lie `apart` or more, m; None of one finger alone.

    Raises
    ------
    InputError
        The board has no room for two fingers, or a bank's areas are too few or too small.
    """
    rng, found, fingers = np.random.default_rng(SEED), [], 1 if apart is None else 2
    for _ in range(count * MOST_DRAWS):
        (places,) = finger_sets(setup.board, fingers, 1, apart or 0.0, rng) / MM
        try:
            found.append(presses_at([(x, y) for x, y in places.tolist()]))
        except ArgumentError:
            continue
        if len(found) == count:
            return found
    option = "--places" if apart is None else "--pairs"
    hint = "are its areas on the board, and apart?"
    raise ArgumentError(option, count, "a bank that many drawn fingers meet", hint=hint)


def _played(setup: Setup, drawn: Drawn, how: dict[str, Any]) -> list[list[PlayedEffect]]:
    """What fingers have, of as many as were played when Ctrl-C ended it: each takes seconds."""
    check_can_play(setup.table, setup.board, drawn[0][0].other_mm)
    plates, found = setup.plates(), []
    every = [one for presses in drawn for one in presses]
    under = each_under(plates, every, how["newtons"], unknown=bool(how.get("unknown")))
    how |= {"plates": plates}
    is_pairs = drawn[0][0].other_mm is not None
    batch = TOGETHER // len(drawn[0]) if is_pairs else 0
    with progress_bar("pairs" if is_pairs else "places", batch=batch) as progress:
        try:
            for presses in drawn:
                found.append([one.played(setup, how | {"under": next(under)}) for one in presses])
                progress(len(found), len(drawn))
        except KeyboardInterrupt:
            if not found:
                raise
    return found


def levels_told(levels: Sequence[float], what: str) -> str:
    """Decibels, in words: of less that is more, as more, each by its own sign."""
    spread = Spread.of(list(levels))
    few = len(levels) < FEW
    median, worst = spread.median, min(levels) if few else spread.p10
    tail = "at the worst" if few else "at the worst tenth"
    if what != "less":
        return f"{median:z.0f} dB {what} at the median, {worst:z.0f} {tail}"
    words = ["more" if f"{own:z.0f}".startswith("-") else "less" for own in (median, worst)]
    at_worst = f"{abs(worst):.0f}" if words[0] == words[1] else f"{abs(worst):.0f} {words[1]}"
    return f"{abs(median):.0f} dB {words[0]} at the median, {at_worst} {tail}"


def _peaks(found: Sequence[PlayedEffect]) -> list[float]:
    return [one.peak_um for one in found]


def _spreads(told: dict[str, list[float]], *, as_json: bool) -> dict[str, Any]:
    """Of many their shares; of few, for people, each."""
    return {
        key: own if len(own) < FEW and not as_json else asdict(Spread.of(own))
        for key, own in told.items()
    }


def _rested(one: PlayedEffect) -> bool | None:
    return one.rested if one.bias_um is not None else None
