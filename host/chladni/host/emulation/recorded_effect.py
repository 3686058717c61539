"""The pins of an emulated device that plays an effect, from power-on until it is over."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.effects.bank.areas import LEAST_MM, Area, Bank, Circle, level_of
from chladni.effects.bank.layout import SIGNAL_HZ, UM_STEPS
from chladni.effects.bank.pack import pack_bank
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import Curve, Effect, Tone
from chladni.host.emulation._emulator import area_at
from chladni.host.emulation.emulator import (
    Emulator,
    Recording,
    TouchEvent,
    emulated_config,
    reported_um,
)
from chladni.host.protocol.link import SIGNAL_SAMPLES
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError, ChladniError, ConflictError
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]

REST_MS = 60.0
"""For which the other finger rests before: its report, and a switch's bias to settle."""
PRESSED_MS = 12.0
"""At most from a touch to the first duty: a panel's report, and drives of two fingers."""
TURN_MS = 10.0
"""Between two sendings of samples."""
AFTER_S = 0.1
NO_UM = "the device knows micrometres from responses: `chladni table build BOARD --for fingers`"


def recorded_effect(
    emulator: Emulator,
    samples: FloatArray,
    at_mm: tuple[float, float],
    other_mm: tuple[float, float] | None,
    levels: tuple[float, float | None] | None,
    *,
    other_plays: bool,
    rests_s: float,
) -> tuple[Recording, float, float]:
    """The pins from power-on until the effect is over; when the finger touched, and was seen, s.

    Parameters
    ----------
    samples
        At `SIGNAL_HZ`, which begin with the touch at `at_mm`, or as soon as it has rested.
    other_mm
        Of another finger, which has rested there for `REST_MS`.
    levels
        At which samples are sent, and micrometres; without both the device has the effect itself.
    other_plays
        The other finger has a signal of its own, too, of which no samples are sent; of a device's
        own effects it presses at the same moment.
    rests_s
        For which the finger that plays rests first, once a switch's bias is up.

    Raises
    ------
    ChladniError
        The device did not play to the end.
    """
    slot = 0
    touched_ms = REST_MS + 0.1
    if other_mm is not None:
        if not other_plays:
            emulator.core.set_voice(0, 0, 0)
        elif levels is not None:
            _set_signal(emulator, 0, *levels)
        presses_too = other_plays and levels is None
        emulator.touch(TouchEvent(touched_ms if presses_too else 1.0, other_mm, 7))
        slot = 1
    words: list[int] = []
    if levels is not None:
        words = [round(32767.0 * float(one)) for one in samples]
        words = [0] * round(rests_s * SIGNAL_HZ) + words
        _set_signal(emulator, slot, *levels)
    sent = emulator.core.push_signal(slot, words[:SIGNAL_SAMPLES])
    parts = [emulator.run(REST_MS)]
    begins = parts[0].duty_steps.shape[0] / parts[0].carrier_hz
    emulator.touch(TouchEvent(touched_ms, at_mm, 0))
    left_ms = PRESSED_MS + 1e3 * (rests_s + len(samples) / SIGNAL_HZ + AFTER_S)
    while left_ms > 0.0:
        parts.append(emulator.run(TURN_MS))
        sent += emulator.core.push_signal(slot, words[sent : sent + SIGNAL_SAMPLES])
        left_ms -= TURN_MS
    if emulator.core.state != "playing":
        raise ChladniError(
            f"the emulated device is {emulator.core.state} after the effect",
            hint="an effect may last as long as `max_on_s` of the board file",
        )
    first = parts[0]
    steps = np.concatenate([part.duty_steps for part in parts])
    seen, passed = [], len(first.duty_steps)
    for part in parts[1:]:
        seen += [(passed + one) / first.carrier_hz for one in part.panel_reports]
        passed += len(part.duty_steps)
    # The resting finger is reported meanwhile.
    reported = min(at for at in seen if 1e3 * at >= touched_ms)
    return Recording(steps, first.carrier_hz, first.pwm_bits), begins, reported


def as_reported(board: Board, at_mm: tuple[float, float]) -> tuple[float, float]:
    """The place that the panel reports: a border between areas may run through a pixel."""
    x, y = reported_um(emulated_config(board), at_mm)
    # A division: 45,050 µm are 45.05 mm, and a thousandth of them would have 16 digits.
    return x / 1e3, y / 1e3


def effect_of_bank(
    bank: bytes, at_mm: tuple[float, float], argument: str = "at"
) -> tuple[str, Effect, float]:
    """The area there, its effect for a press, or else what is held, and its level, 0 to 1.

    `argument`: what the place came as, for errors.

    Raises
    ------
    InputError
        There is no area, or it has no effect for a press.
    """
    known = unpack_bank(bank)
    area = _area_of(known, bank, at_mm, argument)
    occasion = _occasion(area, at_mm, argument)
    return area.name, known.effects[area.effects[occasion]], level_of(area.level_db)


def biases_of(
    board: Board,
    table: Table,
    bank: bytes | None,
    samples: FloatArray,
    at_mm: tuple[float, float],
    other_mm: tuple[float, float] | None,
) -> Recording | None:
    """The pins where two fingers press and both effects are silent: switches' biases are left.

    As of `recorded_effect`, with a `bank` that is `silent_at` the other finger; None without it,
    where no other presses, or with bridges, which have none.
    """
    if not bank or other_mm is None or board.electronics.is_bridge:
        return None
    seen = [as_reported(board, own) for own in (at_mm, other_mm)]
    emulator = Emulator(board, table, level=1.0, bank=silent_at(bank, *seen))
    recording, _, _ = recorded_effect(
        emulator, samples, at_mm, other_mm, None, other_plays=True, rests_s=0.0
    )
    return recording


def silent_at(bank: bytes, at_mm: tuple[float, float], kept_mm: tuple[float, float]) -> bytes:
    """A bank where a press at one place lasts as long as ever, and is silent.

    Its drive takes its share of what coils can do, and all that moves is of the other place.

    Parameters
    ----------
    kept_mm
        Where a press is as it was; all other areas are left out.

    Raises
    ------
    InputError
        As of `effect_of_bank`, of either place.
    """
    known = unpack_bank(bank)
    own, kept = _area_of(known, bank, at_mm), _area_of(known, bank, kept_mm)
    occasion = _occasion(own, at_mm)
    played = known.effects[own.effects[occasion]]
    effects = {name: known.effects[name] for name in kept.effects.values()}
    silent = next(name for name in "abcde" if name not in effects)
    nothing, any_hz = Curve.constant(0.0), Curve.constant(160.0)
    effects[silent] = replace(played, parts=(Tone(0.0, played.lasts_s, nothing, any_hz),))
    how: dict[str, Any] = {occasion: silent, "level_db": own.level_db, "level_um": own.level_um}
    spot = Area("a", Circle(at_mm, LEAST_MM), **how)
    return pack_bank(replace(known, effects=effects, areas=(spot, replace(kept, name="b"))))


def _area_of(known: Bank, bank: bytes, at_mm: tuple[float, float], argument: str = "at") -> Area:
    number = area_at(bank, *(round(1e3 * at) for at in at_mm))
    if number >= len(known.areas):
        names = ", ".join(own.name for own in known.areas)
        expected = f"a place in one of the areas of {known.name}: {names}"
        raise ArgumentError(argument, at_mm, expected)
    return known.areas[number]


def _occasion(area: Area, at_mm: tuple[float, float], argument: str = "at") -> str:
    """For which an effect plays while a finger comes down and stays."""
    if area.press is None and (area.hold is None or area.every_mm > 0.0):
        expected = f"a place where a press plays something, as {area.name} has not"
        raise ArgumentError(argument, at_mm, expected)
    return "hold" if area.press is None else "press"


def _set_signal(emulator: Emulator, slot: int, level: float, most_um: float | None) -> None:
    emulator.core.set_signal_voice(slot, round(32767.0 * level))
    if most_um is None or emulator.core.limit_signal(slot, round(UM_STEPS * most_um)):
        return
    raise ConflictError("level_um", "a table without responses", hint=NO_UM)
