"""Effects in TOML, for people who write their own (docs/effects.md)."""

from __future__ import annotations

from pathlib import Path

from chladni.effects.effect import (
    LEAST_HZ,
    MOST_HZ,
    MOST_POINTS,
    MOST_S,
    Click,
    Curve,
    Effect,
    Noise,
    Part,
    Tone,
    curve_of,
)
from chladni.effects.file_values import FileValue, read_toml
from chladni.sim.errors import Faults

MS = 1e-3
KEYS = {
    "tone": ("amplitude", "at_ms", "frequency_hz", "lasts_ms"),
    "noise": ("amplitude", "at_ms", "lasts_ms"),
    "click": ("amplitude", "at_ms", "frequency_hz"),
}


def read_toml_effect(path: Path, field: str) -> tuple[Effect, list[str]]:
    """The effect; nothing of it is left out.

    Raises
    ------
    InputError
        Keys are unknown or values out of their range; names all of them.
    """
    file = read_toml(path, field)
    name, loop, parts, faults = path.stem, None, list[Part](), Faults()
    file.check_keys(("name", "loop_ms", *KEYS), faults)
    with faults.kept():
        name = file["name"].text() if file["name"].is_there else name
    with faults.kept():
        loop = _loop(file["loop_ms"])
    for kind in filter(KEYS.__contains__, file.keys()):
        with faults.kept():
            for one in file[kind]:
                one.check_keys(KEYS[kind], faults)
                with faults.kept():
                    parts.append(_part(kind, one))
    faults.tell()
    return Effect(name, tuple(parts), loop), []


def _loop(own: FileValue) -> tuple[float, float] | None:
    if not own.is_there:
        return None
    times = [one.number(0.0, MOST_S / MS) for one in own]
    if len(times) != 2 or times[0] >= times[1]:
        raise own.error("[milliseconds, later milliseconds]")
    return MS * times[0], MS * times[1]


def _part(kind: str, own: FileValue) -> Part:
    at = MS * own["at_ms"].number(0.0, MOST_S / MS, 0.0)
    if kind == "click":
        hz = own["frequency_hz"].number(LEAST_HZ, MOST_HZ, 160.0)
        return Click(at, own["amplitude"].number(0.0, 1.0, 1.0), hz)
    ends = at + MS * own["lasts_ms"].number(0.0, MOST_S / MS)
    amplitude = _curve(own["amplitude"], at, 0.0, 1.0, 1.0)
    if kind == "noise":
        return Noise(at, ends, amplitude)
    return Tone(at, ends, amplitude, _curve(own["frequency_hz"], at, LEAST_HZ, MOST_HZ, 160.0))


def _curve(own: FileValue, begins: float, low: float, high: float, default: float) -> Curve:
    """A number, or a list of [ms from the part's begin, value]."""
    if not isinstance(own.value, list):
        return Curve.constant(own.number(low, high, default))
    points: list[tuple[float, float]] = []
    for row in own:
        pair = [*row]
        if len(pair) != 2 or len(points) == MOST_POINTS:
            raise row.error(f"[milliseconds, value], {MOST_POINTS:,} of them at most")
        least = (points[-1][0] - begins) / MS if points else 0.0
        at_ms = pair[0].number(least - 1e-6, MOST_S / MS)
        points.append((begins + MS * max(at_ms, least), pair[1].number(low, high)))
    if not points:
        raise own.error("one point or more")
    return curve_of(points)
