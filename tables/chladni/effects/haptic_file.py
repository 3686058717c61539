"""`.haptic` files, version 1.0.0: what Meta Haptics Studio and Lofelt Studio write.

One continuous signal: an amplitude envelope, perhaps a frequency envelope, and emphases at
breakpoints of amplitude, each of which is a click here. Players whose actuators have no transients
of their own make room for one: the signal is silent beside it, or an emphasis of a loud signal is
not felt (Lofelt's own renderer: 30 ms before and behind it, for motors).
"""

from __future__ import annotations

import json
from bisect import bisect_left, bisect_right
from pathlib import Path

import numpy as np

from chladni.effects.effect import (
    MOST_POINTS,
    MOST_S,
    Click,
    Effect,
    Tone,
    curve_of,
    described,
)
from chladni.effects.file_values import FileValue, read_json
from chladni.effects.normalised import beyond, from_hz, to_hz

MAJOR = 1
ROOM_S = 10e-3
"""In which the signal is silent before and behind an emphasis: a plate is still after 5 ms."""


def read_haptic(path: Path, field: str) -> tuple[Effect, list[str]]:
    """The effect, and what of the file is left out.

    Raises
    ------
    InputError
        It breaks a rule of the format; names the value and where it stands.
    """
    file = read_json(path, field)
    major = file["version"]["major"]
    if major.number(0, 1000) != MAJOR:
        raise major.error("1, of version 1.0.0")
    signals = file["signals"]
    left_out = [f"signals.{key}" for key in signals.keys() if key != "continuous"]  # noqa: SIM118
    envelopes = signals["continuous"]["envelopes"]
    amplitudes = [*envelopes["amplitude"]]
    if not amplitudes:
        raise envelopes["amplitude"].error("one breakpoint or more")
    amplitude = _points(amplitudes, "amplitude")
    frequency = envelopes["frequency"]
    shares = _points([*frequency], "frequency") if frequency.is_there else []
    hertz = [(at, to_hz(share)) for at, share in shares] or [(0.0, to_hz(0.5))]
    clicks: list[Click] = []
    for one, (at, _) in zip(amplitudes, amplitude, strict=True):
        emphasis = one["emphasis"]
        if emphasis.is_there:
            size = emphasis["amplitude"].number(0.0, 1.0)
            clicks.append(Click(at, size, to_hz(emphasis["frequency"].number(0.0, 1.0))))
    points = _with_room(amplitude, clicks)
    if len(points) > MOST_POINTS:
        raise envelopes["amplitude"].error(
            f"at most {MOST_POINTS:,} breakpoints, with four for each emphasis"
        )
    tone = Tone(amplitude[0][0], amplitude[-1][0], curve_of(points), curve_of(hertz))
    return Effect(path.stem, (tone, *clicks)), left_out


def _with_room(points: list[tuple[float, float]], clicks: list[Click]) -> list[tuple[float, float]]:
    """The envelope, silent beside and under each click."""
    begins, ends = points[0][0], points[-1][0]
    gaps: list[tuple[float, float]] = []
    for click in (own for own in clicks if own.amplitude > 0.0):
        low, high = max(begins, click.begins_s - ROOM_S), min(ends, click.ends_s + ROOM_S)
        if gaps and low <= gaps[-1][1]:
            low, ended = gaps.pop()
            high = max(ended, high)
        gaps.append((low, high))
    curve, times = curve_of(points), [at for at, _ in points]
    # Where a step is already, what was before it stays.
    before = curve.at(np.array([np.nextafter(low, begins - 1.0) for low, _ in gaps])).tolist()
    after = curve.at(np.array([high for _, high in gaps])).tolist()
    made: list[tuple[float, float]] = []
    done = 0
    for (low, high), early, late in zip(gaps, before, after, strict=True):
        first, last = bisect_left(times, low), bisect_right(times, high)
        if early or late or any(value for _, value in points[first:last]):
            made += [*points[done:first], (low, early), (low, 0.0), (high, 0.0), (high, late)]
            done = last
    return [*made, *points[done:]]


def _points(values: list[FileValue], key: str) -> list[tuple[float, float]]:
    if len(values) > MOST_POINTS:
        raise values[MOST_POINTS].error(f"{MOST_POINTS:,} breakpoints at most")
    found: list[tuple[float, float]] = []
    for one in values:
        low = found[-1][0] if found else 0.0
        found.append((one["time"].number(low, MOST_S, unit="s"), one[key].number(0.0, 1.0)))
    return found


def to_haptic(effect: Effect) -> tuple[bytes, list[str]]:
    """A `.haptic` file's bytes, and what of the effect it cannot say."""
    left_out = beyond(effect.frequencies_hz)
    left_out += [described(part) for part in effect.parts if not isinstance(part, Tone | Click)]
    tones = [part for part in effect.parts if isinstance(part, Tone)]
    left_out += [f"{described(tone)}, which plays beside another" for tone in tones[1:]]
    clicks = {part.at_s: part for part in effect.parts if isinstance(part, Click)}
    amplitude, frequency = _envelopes(tones[0] if tones else None, sorted(clicks))
    rows = []
    for at, value in amplitude:
        row: dict[str, object] = {"time": at, "amplitude": value}
        click = clicks.pop(at, None)
        if click is not None:
            share = from_hz(click.frequency_hz)
            row["emphasis"] = {"amplitude": click.amplitude, "frequency": share}
        rows.append(row)
    envelopes = {
        "amplitude": rows,
        "frequency": [{"time": at, "frequency": from_hz(hz)} for at, hz in frequency],
    }
    document = {
        "version": {"major": MAJOR, "minor": 0, "patch": 0},
        "metadata": {"editor": "chladni", "description": effect.name},
        "signals": {"continuous": {"envelopes": envelopes}},
    }
    return json.dumps(document, indent=1).encode(), left_out


def _envelopes(
    tone: Tone | None, clicks: list[float]
) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Breakpoints of amplitude and hertz, with one at each click's time."""
    if tone is None:
        ends = [*clicks, clicks[-1] if clicks else 0.0]
        return [(at, 0.0) for at in ends], [(0.0, to_hz(0.5))]
    return tone.points_of(tone.amplitude, clicks), tone.points_of(tone.frequency_hz)
