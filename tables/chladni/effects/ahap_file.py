"""AHAP files, Apple's for Core Haptics: transient and continuous events, parameters and curves.

A curve's points count their times from the curve's own. `HapticIntensityControl` multiplies what
plays, `HapticSharpnessControl` is added to its sharpness. Each is in force from its time until the
next of its kind. Sounds are left out.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.effects.effect import (
    MOST_POINTS,
    MOST_S,
    Click,
    Effect,
    Part,
    Tone,
    curve_of,
    described,
)
from chladni.effects.file_values import FileValue, read_json
from chladni.effects.normalised import beyond, from_hz, to_hz

FloatArray = NDArray[np.float64]

INTENSITY, SHARPNESS = "HapticIntensityControl", "HapticSharpnessControl"
LEAST = {INTENSITY: 0.0, SHARPNESS: -1.0}
DEFAULT = {INTENSITY: 1.0, SHARPNESS: 0.0}
EVENT_DEFAULTS = {"HapticIntensity": 1.0, "HapticSharpness": 0.5}
TIMES = ("AttackTime", "DecayTime", "ReleaseTime")
GRID_S = 2e-3
"""A tone's breakpoints beside those of its own, where curves act on it."""
CURVE_POINTS = 16
"""That Core Haptics takes of a curve."""


@dataclass(frozen=True)
class Control:
    """A parameter over time: (begins, points from there on), in order of their begins."""

    default: float
    curves: tuple[tuple[float, tuple[tuple[float, float], ...]], ...]

    def at(self, times: FloatArray) -> FloatArray:
        """Its values."""
        found = np.full(times.shape, self.default)
        for begins, points in self.curves:
            own = curve_of(points).at(times)
            found = np.where(times >= begins, own, found)
        return found

    def times(self) -> list[float]:
        """Of all its points."""
        return [at for _, points in self.curves for at, _ in points]


def read_ahap(path: Path, field: str) -> tuple[Effect, list[str]]:
    """The effect, and what of the file is left out.

    Raises
    ------
    InputError
        A value is missing or out of its range; names it and where it stands.
    """
    file = read_json(path, field)
    left_out: list[str] = []
    events: list[FileValue] = []
    curves: dict[str, list[tuple[float, tuple[tuple[float, float], ...]]]] = {
        INTENSITY: [],
        SHARPNESS: [],
    }
    for entry in file["Pattern"]:
        for key in entry.keys():  # noqa: SIM118
            own = entry[key]
            if key == "Event":
                events.append(own)
            elif key in {"Parameter", "ParameterCurve"}:
                kind = own["ParameterID"].text()
                if kind in curves:
                    curves[kind].append(_curve(own, LEAST[kind], is_curve=key != "Parameter"))
                else:
                    left_out.append(f"{own.place}: {kind}")
            else:
                left_out.append(own.place)
    controls = {
        kind: Control(DEFAULT[kind], tuple(sorted(own, key=lambda one: one[0])))
        for kind, own in curves.items()
    }
    parts: list[Part] = []
    for event in events:
        kind = event["EventType"].text()
        made = _PARTS.get(kind)
        if made is None:
            left_out.append(f"{event.place}: {kind}")
        else:
            parts.append(made(event, controls))
            left_out += _unread(event)
    return Effect(path.stem, tuple(parts)), left_out


def _curve(
    own: FileValue, low: float, *, is_curve: bool
) -> tuple[float, tuple[tuple[float, float], ...]]:
    begins = own["Time"].number(0.0, MOST_S)
    if not is_curve:
        return begins, ((begins, own["ParameterValue"].number(low, 1.0)),)
    points: list[tuple[float, float]] = []
    for one in own["ParameterCurveControlPoints"]:
        if len(points) == MOST_POINTS:
            raise one.error(f"{MOST_POINTS:,} points at most")
        least = points[-1][0] - begins if points else 0.0
        # Added up and taken away again, a time may come out a bit smaller.
        at = one["Time"].number(least - 1e-9, MOST_S)
        points.append((begins + max(at, least), one["ParameterValue"].number(low, 1.0)))
    if not points:
        raise own["ParameterCurveControlPoints"].error("one point or more")
    return begins, tuple(points)


def _unread(event: FileValue) -> list[str]:
    """Parameters of an event that no haptic engine has, such as misspelt ones."""
    own = event["EventParameters"]
    kinds = [(one.place, one["ParameterID"].text()) for one in own] if own.is_there else []
    known = (*EVENT_DEFAULTS, *TIMES, "Sustained")
    return [f"{place}: {kind}" for place, kind in kinds if kind not in known]


def _parameters(event: FileValue) -> dict[str, float]:
    found = dict(EVENT_DEFAULTS)
    if event["EventParameters"].is_there:
        for one in event["EventParameters"]:
            kind = one["ParameterID"].text()
            is_time = kind in TIMES
            value = one["ParameterValue"]
            if kind in EVENT_DEFAULTS or is_time or kind == "Sustained":
                found[kind] = value.number(0.0, MOST_S if is_time else 1.0)
    return found


def _transient(event: FileValue, controls: dict[str, Control]) -> Part:
    at = event["Time"].number(0.0, MOST_S)
    own, times = _parameters(event), np.array([at])
    size = own["HapticIntensity"] * float(controls[INTENSITY].at(times)[0])
    sharpness = own["HapticSharpness"] + float(controls[SHARPNESS].at(times)[0])
    return Click(at, size, to_hz(sharpness))


def _continuous(event: FileValue, controls: dict[str, Control]) -> Part:
    begins = event["Time"].number(0.0, MOST_S)
    lasts = event["EventDuration"].number(0.0, MOST_S)
    own = _parameters(event)
    release = own.get("ReleaseTime", 0.0)
    attack = min(own.get("AttackTime", 0.0), lasts)
    decay = min(own.get("DecayTime", 0.0), lasts - attack)
    held = 1.0 if own.get("Sustained", 1.0) >= 0.5 else 0.0
    own_points = [(0.0, 0.0 if attack else 1.0), (attack, 1.0), (attack + decay, held)]
    own_points += [(lasts, held), (lasts + release, 0.0)]
    ends = begins + lasts + release
    times = _times(begins, ends, [begins + at for at, _ in own_points], controls)
    shape = curve_of([(begins + at, value) for at, value in own_points]).at(times)
    size = np.clip(own["HapticIntensity"] * shape * controls[INTENSITY].at(times), 0.0, 1.0)
    sharpness = own["HapticSharpness"] + controls[SHARPNESS].at(times)
    hertz = [to_hz(one) for one in sharpness.tolist()]
    at = times.tolist()
    return Tone(
        begins,
        ends,
        curve_of(list(zip(at, size.tolist(), strict=True))),
        curve_of(list(zip(at, hertz, strict=True))),
    )


def _times(
    begins: float, ends: float, own: list[float], controls: dict[str, Control]
) -> FloatArray:
    """Breakpoints of a tone: where anything bends, and between where two things move at once."""
    bends = [at for control in controls.values() for at in control.times()]
    inside = [at for at in (*own, *bends) if begins <= at <= ends]
    between = np.arange(begins, ends, max(GRID_S, (ends - begins) / (MOST_POINTS // 2)))
    return np.unique(np.concatenate((between, inside, (begins, ends))))


_PARTS: dict[str, Callable[[FileValue, dict[str, Control]], Part]] = {
    "HapticTransient": _transient,
    "HapticContinuous": _continuous,
}


def to_ahap(effect: Effect) -> tuple[bytes, list[str]]:
    """An AHAP file's bytes, and what of the effect it cannot say."""
    pattern: list[dict[str, object]] = []
    left_out = beyond(effect.frequencies_hz)
    # Curves act on all events, and so can make one tone alone.
    first = next((part for part in effect.parts if isinstance(part, Tone)), None)
    for part in effect.parts:
        if isinstance(part, Click):
            pattern.append(_event("HapticTransient", part.at_s, part.amplitude, part.frequency_hz))
        elif isinstance(part, Tone) and part is first:
            pattern += _tone(part)
        else:
            left_out.append(described(part))
    document = {"Version": 1.0, "Metadata": {"Description": effect.name}, "Pattern": pattern}
    return json.dumps(document, indent=1).encode(), left_out


def _event(kind: str, at_s: float, intensity: float, hz: float) -> dict[str, object]:
    parameters = {"HapticIntensity": intensity, "HapticSharpness": from_hz(hz)}
    return {
        "Event": {
            "Time": at_s,
            "EventType": kind,
            "EventParameters": [
                {"ParameterID": key, "ParameterValue": value} for key, value in parameters.items()
            ],
        }
    }


def _tone(tone: Tone) -> list[dict[str, object]]:
    """A continuous event of full intensity and sharpness 0, and curves that make it the tone."""
    event = _event("HapticContinuous", tone.begins_s, 1.0, 0.0)
    event["Event"]["EventDuration"] = tone.ends_s - tone.begins_s  # type: ignore[index]
    entries = [event]
    for kind, curve, scale in (
        (INTENSITY, tone.amplitude, float),
        (SHARPNESS, tone.frequency_hz, from_hz),
    ):
        points = [(at, scale(value)) for at, value in tone.points_of(curve)]
        for first in range(0, len(points) - 1, CURVE_POINTS - 1):
            some = points[first : first + CURVE_POINTS]
            rows = [{"Time": at - some[0][0], "ParameterValue": value} for at, value in some]
            curve_entry = {
                "ParameterID": kind,
                "Time": some[0][0],
                "ParameterCurveControlPoints": rows,
            }
            entries.append({"ParameterCurve": curve_entry})
    return entries
