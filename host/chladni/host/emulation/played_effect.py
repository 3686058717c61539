"""An effect under one finger, played by an emulated device, and what each finger has of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.effect import Effect, Noise
from chladni.effects.flatten import flattened
from chladni.host.emulation.emulator import Emulator, Recording
from chladni.host.emulation.felt_over_time import (
    LATEST_S,
    RATE_HZ,
    FingerPlate,
    aligned,
    envelope_error_db,
    fingers_on,
    forces_of,
    loudest_away,
    places_away,
    rms,
)
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.recorded_effect import biases_of, recorded_effect
from chladni.host.protocol.config import BIAS_RAMP_MS
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ChladniError, InputError, MissingError
from chladni.sim.image.finger import PRESS, threshold_um
from chladni.sim.image.metrics import decibel
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]

RESTED_S = 0.1
"""For which a finger rests before its effect, once a switch's bias is up."""


@dataclass(frozen=True)
class PlayedEffect:
    """What an effect came to, over time.

    Attributes
    ----------
    t_s
        From the touch on, or from the effect's beginning under a finger that rested, shape
        (times,).
    asked
        The effect as it is played, once and at its level, from when coils get it, above 40 Hz.
    own_um
        Mean displacement under its finger, above 40 Hz, µm.
    other_um
        RMS over the other finger's disc, above 40 Hz, µm; None without one.
    peak_um
        The largest of `own_um` while the effect plays.
    other_peak_um
        The largest of `other_um`; None without another.
    just_felt_um
        Of which a resting finger just feels, at the board's own frequency.
    bias_um
        The largest before and after, as a switch's bias comes and goes; None with bridges.
    bias_duty
        Largest duty that a switch's bias stands at while a finger rests; None with bridges.
    first_ms
        From the panel's first report of the finger to the first duty, or as long after the effect's
        first sample.
    rise_ms
        From the first duty to 90 % of the peak; a switch's bias comes up in it.
    envelope_error_db
        95th percentile over 200 times at which the effect is within 20 dB of its largest; None
        of a bank's noise, which the device draws itself: `asked` is another one.
    isolation_db
        Largest RMS over the own disc while the effect plays, over the largest over the other's at
        any time, a switch's bias too, above 40 Hz. Not where both press at once: the other finger
        has a bias of its own then.
    rested
        The finger had rested when its effect began.
    second_finger_20mm_um, second_finger_20mm_db, second_finger_20mm_at_mm
        Largest RMS under another finger 20 mm away or farther that does not press and of which the
        device knows nothing, at any time, above 40 Hz, the own disc's over it, and where that is;
        None where it was not asked for, or the board has no place so far away.
    far_um
        RMS over time there.
    """

    t_s: FloatArray
    asked: FloatArray
    own_um: FloatArray
    other_um: FloatArray | None
    peak_um: float
    other_peak_um: float | None
    just_felt_um: float | None
    bias_um: float | None
    bias_duty: float | None
    first_ms: float
    rise_ms: float
    envelope_error_db: float | None
    isolation_db: float | None
    rested: bool
    second_finger_20mm_um: float | None = None
    second_finger_20mm_db: float | None = None
    second_finger_20mm_at_mm: tuple[float, float] | None = None
    far_um: FloatArray | None = None


def play_effect(
    table: Table,
    board: Board,
    effect: Effect,
    at_mm: tuple[float, float],
    *,
    other_mm: tuple[float, float] | None = None,
    other_plays: bool = False,
    level: float = 1.0,
    level_um: float | None = None,
    newtons: float = PRESS,
    rested: bool = False,
    unknown: bool = False,
    bank: bytes | None = None,
    plates: Plates | None = None,
    under: tuple[FingerPlate, FingerPlate] | None = None,
) -> PlayedEffect:
    """Put a finger down on an emulated device, which plays an effect under it.

    Parameters
    ----------
    table
        Of the board. Another finger needs responses.
    at_mm
        Middle of the fingertip, mm.
    other_mm
        Of another, which rests there before and is silent.
    other_plays
        The other one has a signal of its own at the same level. Its drive takes its share of what
        coils can do. No samples are sent for it, so that all that moves is this effect's. With a
        `bank` that is `silent_at` its place, both press at once.
    level
        Of the loudest that the place allows, 0 to 1.
    level_um
        As far as the device, which knows it from the table's responses, may move the finger.
    newtons
        How hard each presses.
    rested
        The finger that plays has rested, too: a switch's bias stands when its effect begins. What
        moved a finger before does not count. Otherwise the effect begins with its touch. Beside one
        that plays, fingers on a board with switches have always rested.
    unknown
        Find what another finger would have of it of which the device knows nothing.
    bank
        In the device's flash, and `effect` is what it has there (`effect_of_bank`): no host sends
        anything, and the place's own level is not taken out.
    plates
        The board, and the plate that fingers are on; by default the board's own. Host and device
        know the board alone.
    under
        Both plates with these fingers, if they are at hand (`fingers_on`).

    Raises
    ------
    InputError
        The panel does not reach there, the board has no coil, or another finger is asked of a
        table without responses.
    ChladniError
        The device did not play.
    """
    check_can_play(table, board, other_mm)
    rests_s = 0.0 if bank else _rests_s(board, rested=rested, other_plays=other_plays)
    places = np.array([at_mm] if other_mm is None else [at_mm, other_mm]) * MM
    away = places_away(board, at_mm) if unknown else None
    plates = plates or Plates.of(board)
    known, plate = under or next(fingers_on(plates, [(places, away)], newtons))
    asked_samples, own_hz = effect.samples(SIGNAL_HZ), board.drive.frequency_hz
    flat = flattened(asked_samples, SIGNAL_HZ, known.hz, known.level(0, own_hz), own_hz)
    emulator = Emulator(board, table, level=1.0, bank=bank or b"")
    bias_s = _bias_s(board, beside_another=other_mm is not None)
    sends = None if bank else (level, level_um)
    recording, begins, reported = recorded_effect(
        emulator, flat, at_mm, other_mm, sends, other_plays=other_plays, rests_s=rests_s
    )
    if rests_s > 0.0:
        begins = reported = reported + bias_s + rests_s
        bias_s = 0.0
    forces = _newtons(board, plates.hidden, recording)
    first = round(begins * RATE_HZ)
    first_s = _begins_s(forces[first:], rested=rests_s > 0.0)
    disc = plate.felt_um(forces, 0)[:, first:]
    own = disc.mean(axis=0)
    biases = biases_of(board, table, bank, flat, at_mm, other_mm if other_plays else None)
    passed_on = forces - (0.0 if biases is None else _newtons(board, plates.hidden, biases))
    other = None if other_mm is None else rms(plate.felt_um(passed_on, 1)[:, first:])
    other_um = None if other is None else float(other.max())
    latest_s, sent = first_s + bias_s + LATEST_S, asked_samples if bank else flat
    asked, playing = aligned(level * asked_samples, sent, forces[first:], latest_s)
    peak, risen, around = _sizes(own, playing)
    own_rms = rms(disc)[playing]
    return PlayedEffect(
        t_s=np.arange(len(own)) / RATE_HZ,
        asked=asked,
        own_um=own,
        other_um=other,
        peak_um=peak,
        other_peak_um=other_um,
        just_felt_um=threshold_um(own_hz),
        bias_um=None if board.electronics.is_bridge else around,
        bias_duty=_bias_duty(board, recording, begins + first_s + bias_s),
        first_ms=1e3 * (begins + first_s - reported),
        rise_ms=1e3 * (risen - first_s),
        envelope_error_db=_envelope_error_db(effect, bank, asked, own),
        isolation_db=_over_db(own_rms, other_um),
        rested=rests_s > 0.0,
        **({} if away is None else _far_finger(loudest_away(plate, forces, away, first), own_rms)),
    )


def _sizes(own: FloatArray, playing: slice) -> tuple[float, float, float]:
    """The peak while it plays, when 90 % of it are reached, s, and the most before and after."""
    sizes = np.abs(own)
    peak = float(sizes[playing].max())
    risen = (playing.start + float(np.flatnonzero(sizes[playing] >= 0.9 * peak)[0])) / RATE_HZ
    return peak, risen, float(np.delete(sizes, playing).max(initial=0.0))


def _far_finger(loudest: tuple[FloatArray, FloatArray], own_rms: FloatArray) -> dict[str, Any]:
    """The place of a finger of which the device knows nothing, m, and its RMS over time, µm."""
    place, far = loudest
    most = float(far.max())
    return {
        "second_finger_20mm_um": most,
        "second_finger_20mm_db": _over_db(own_rms, most),
        "second_finger_20mm_at_mm": (
            round(float(place[0] / MM), 3),
            round(float(place[1] / MM), 3),
        ),
        "far_um": far,
    }


def _envelope_error_db(
    effect: Effect, bank: bytes | None, asked: FloatArray, own: FloatArray
) -> float | None:
    if bank is not None and any(isinstance(part, Noise) for part in effect.parts):
        return None
    return envelope_error_db(asked, own)


def check_can_play(table: Table, board: Board, other_mm: tuple[float, float] | None) -> None:
    """Raise `InputError` as `play_effect`, before the plate is solved."""
    if board.coil is None:
        raise MissingError("coil", "a block [coil]", hint="there is no force without one")
    if other_mm is not None and not table.responses:
        hint = (
            "`chladni table build --for both` makes both; without another finger it is told what "
            "one gets 20 mm away of which the device does not know"
        )
        raise InputError("table", "only drives", "a section of responses", hint=hint)


def _begins_s(forces: FloatArray, *, rested: bool) -> float:
    """When coils begin to push otherwise than at first.

    Raises
    ------
    ChladniError
        They do not.
    """
    off = np.abs(forces - forces[0]).max(axis=1)
    # A bias that stands still settles, by less than a hundredth of what comes.
    active = np.flatnonzero(off > (1e-2 * off.max() if rested else 1e-9))
    if not len(active):
        raise ChladniError("the emulated device played nothing", hint="is the effect silent?")
    return float(active[0]) / RATE_HZ


def _rests_s(board: Board, *, rested: bool, other_plays: bool) -> float:
    """For which a finger rests before its effect.

    `DeviceFingers.play_together` has all fingers rest. Only a bias tells rest from touch.
    """
    rests = not board.electronics.is_bridge if other_plays else rested
    return RESTED_S if rests else 0.0


def _newtons(board: Board, hidden: HiddenPlate | None, recording: Recording) -> FloatArray:
    """Of each coil, on the plate that there is."""
    if hidden is None:
        return forces_of(board, recording)
    return forces_of(hidden.board, recording) * hidden.forces


def _over_db(own: FloatArray, other_um: float | None) -> float | None:
    return None if other_um is None else decibel(float(own.max() / other_um) ** 2)


def _bias_s(board: Board, *, beside_another: bool) -> float:
    """For which a signal waits until a switch's bias is up."""
    if board.electronics.is_bridge:
        return 0.0
    return 1e-3 * (BIAS_RAMP_MS if beside_another else board.electronics.ramp_ms)


def _bias_duty(board: Board, recording: Recording, stands_s: float) -> float | None:
    """Largest duty of a switch's bias once it stands."""
    if board.electronics.is_bridge:
        return None
    return float(recording.duty[round(stands_s * recording.carrier_hz)].max())
