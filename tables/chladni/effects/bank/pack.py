"""A bank's bytes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.effects.bank.areas import Area, Bank, Circle, Everywhere, Polygon, level_of
from chladni.effects.bank.curves import thinned
from chladni.effects.bank.layout import (
    ALONG,
    AREA,
    CLIP_STEPS,
    CORNER,
    CRC_BYTES,
    EFFECT,
    FREQUENCY_STEPS,
    FULL_SCALE,
    HEADER,
    LARGEST_FILE,
    MAGIC,
    MAX_FREQUENCY,
    MAX_PARTS,
    MAX_SAMPLES,
    MAX_TONES,
    NO_EFFECT,
    OCCASIONS,
    PART,
    PARTS,
    POINT,
    SHAPES,
    SIGNAL_HZ,
    UM_STEPS,
    VERSION_MAJOR,
    VERSION_MINOR,
)
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import Click, Clip, Curve, Effect, Noise, Part, Tone, kind_of
from chladni.sim.errors import ArgumentError

FloatArray = NDArray[np.float64]

AMPLITUDE_TOLERANCE = 66
"""Of 32767: 0.2 %, 54 dB below full scale."""
FREQUENCY_TOLERANCE = 3
"""A ninth of a hertz."""


def pack_bank(bank: Bank) -> bytes:
    """The bytes of a bank file.

    Raises
    ------
    InputError
        More than a device holds; names the effect.
    """
    names = list(bank.effects)
    # Behind the header and both directories.
    body = _Body(HEADER.size + AREA.size * len(bank.areas) + EFFECT.size * len(names))
    areas = b"".join(_area_entry(area, names, body) for area in bank.areas)
    effects = b"".join(_effect_entry(name, bank.effects[name], body) for name in names)
    total = body.next + CRC_BYTES
    if total > LARGEST_FILE:
        raise ArgumentError("bank", f"{total:,} bytes", f"{LARGEST_FILE:,} at most")
    head = HEADER.pack(
        MAGIC,
        VERSION_MAJOR,
        VERSION_MINOR,
        len(names),
        len(bank.areas),
        total,
        round(1e3 * bank.hysteresis_mm),
        0,
        bank.name.encode(),
    )
    whole = head + areas + effects + bytes(body.data)
    packed = whole + struct.pack("<I", zlib.crc32(whole))
    # Rounded to micrometres and samples: what a device would refuse is refused here.
    unpack_bank(packed)
    return packed


class _Body:
    """What the directories point to."""

    def __init__(self, begins: int) -> None:
        self.begins, self.data = begins, bytearray()

    @property
    def next(self) -> int:
        """Offset in the file of what is added next."""
        return self.begins + len(self.data)


def _area_entry(area: Area, names: list[str], body: _Body) -> bytes:
    corners = _corners(area)
    offset = body.next
    for x, y in corners:
        body.data += CORNER.pack(round(1e3 * x), round(1e3 * y))
    played = [area.effects.get(occasion) for occasion in OCCASIONS]
    return AREA.pack(
        area.name.encode(),
        SHAPES.index(type(area.shape).__name__.lower()),
        len(corners),
        ALONG.index(area.along),
        0,
        *(NO_EFFECT if name is None else names.index(name) for name in played),
        round(1e3 * area.every_mm),
        round(FULL_SCALE * level_of(area.level_db)),
        0 if area.level_um is None else round(UM_STEPS * area.level_um),
        offset,
    )


def _corners(area: Area) -> Sequence[tuple[float, float]]:
    match area.shape:
        case Circle(centre_mm=centre, radius_mm=radius):
            return [centre, (radius, 0.0)]
        case Polygon(corners_mm=corners):
            return corners
        case Everywhere():
            return []


def _effect_entry(name: str, effect: Effect, body: _Body) -> bytes:
    place = f"effect {name}"
    offset = body.next
    if not 1 <= len(effect.parts) <= MAX_PARTS:
        raise ArgumentError(place, f"{len(effect.parts)} parts", f"1 to {MAX_PARTS}")
    if sum(isinstance(part, Tone) for part in effect.parts) > MAX_TONES:
        raise ArgumentError(place, "more tones", f"{MAX_TONES} at most")
    spans = [_span(part, place) for part in effect.parts]
    # Where parts add up to more than a place allows, all of the effect is quieter.
    together = float(np.abs(effect.wave(SIGNAL_HZ, effect.lasts_s)).max())
    most = max(1.0, together, *(_loudest(part) for part in effect.parts))
    for part, (begins, lasts) in zip(effect.parts, spans, strict=True):
        body.data += _part(part, 1.0 / most, begins, lasts, place)
    lasts = max(begins + own for begins, own in spans)
    loop_from, loop_to = 0, lasts
    if effect.loop_s is not None:
        loop_from, loop_to = (_sample(at, place) for at in effect.loop_s)
        if not loop_from < loop_to <= lasts:
            raise ArgumentError(f"{place}.loop_ms", effect.loop_s, "from before to, within it")
    return EFFECT.pack(name.encode(), offset, len(effect.parts), 0, lasts, loop_from, loop_to)


def _span(part: Part, place: str) -> tuple[int, int]:
    """Samples before it begins, and those that it lasts: one at least."""
    begins = min(_sample(part.begins_s, place), MAX_SAMPLES - 1)
    return begins, max(1, _sample(part.ends_s, place) - begins)


def _loudest(part: Part) -> float:
    match part:
        case Tone() | Noise():
            return max(part.amplitude.values)
        case Click():
            return part.amplitude
        case Clip():
            return float(np.abs(part.samples).max(initial=0.0))
        case _:
            raise TypeError(f"no part of a bank: {part}")


def _part(part: Part, scale: float, begins: int, lasts: int, place: str) -> bytes:
    first, second, level, rate, data = 0, 0, 0, 0, b""
    match part:
        case Tone():
            own, hz = _amplitudes(part, scale, lasts), _frequencies(part, lasts, place)
            first, second, data = len(own), len(hz), b"".join(own + hz)
        case Noise():
            own = _amplitudes(part, scale, lasts)
            first, data = len(own), b"".join(own)
        case Click():
            level = round(FULL_SCALE * scale * part.amplitude)
            rate = _frequency(part.frequency_hz, place)
        case Clip():
            samples, rate = _clip(part, scale)
            most = float(np.abs(samples).max(initial=0.0))
            level = round(FULL_SCALE * most)
            data = np.round(samples * (127.0 / max(most, 1e-9))).astype(np.int8).tobytes()
            first = len(samples)
            lasts = max(1, min(lasts, (first * CLIP_STEPS - 1) // rate + 1))
    kind = PARTS.index(kind_of(part))
    return PART.pack(kind, 0, begins, lasts, first, second, level, rate) + data


def _clip(part: Clip, scale: float) -> tuple[FloatArray, int]:
    """Its samples, of the signal's own rate if it has more, and their number per sample of that."""
    if part.rate_hz > SIGNAL_HZ:
        count = max(1, int(len(part.samples) / part.rate_hz * SIGNAL_HZ))
        times = part.begins_s + np.arange(count) / SIGNAL_HZ
        return scale * part.wave(times), CLIP_STEPS
    return scale * part.samples, max(1, round(CLIP_STEPS * part.rate_hz / SIGNAL_HZ))


def _amplitudes(part: Tone | Noise, scale: float, lasts: int) -> list[bytes]:
    return _points(part, part.amplitude, FULL_SCALE * scale, lasts, AMPLITUDE_TOLERANCE)


def _frequencies(part: Tone, lasts: int, place: str) -> list[bytes]:
    for hz in part.frequency_hz.values:
        _frequency(hz, place)
    return _points(part, part.frequency_hz, FREQUENCY_STEPS, lasts, FREQUENCY_TOLERANCE)


def _points(
    part: Tone | Noise, curve: Curve, steps: float, lasts: int, tolerance: int
) -> list[bytes]:
    """A curve's breakpoints from the part's begin to its end, those that are enough."""
    own = curve.points(part.begins_s, part.begins_s + lasts / SIGNAL_HZ)
    times = np.array([at for at, _ in own])
    values = np.round(np.array([value for _, value in own]) * steps).astype(np.int64)
    at = np.minimum(np.round((times - part.begins_s) * SIGNAL_HZ), lasts).astype(np.int64)
    if len(set(values.tolist())) == 1:
        return [POINT.pack(0, values[0])]
    kept = thinned(at, values, tolerance)
    return [POINT.pack(int(at[k]), int(values[k])) for k in kept]


def _sample(at_s: float, place: str) -> int:
    at = round(at_s * SIGNAL_HZ)
    if not 0 <= at <= MAX_SAMPLES:
        expected = f"{MAX_SAMPLES / SIGNAL_HZ:.1f} s at most in a bank"
        raise ArgumentError(place, f"{at_s:g} s", expected)
    return at


def _frequency(hz: float, place: str) -> int:
    steps = round(FREQUENCY_STEPS * hz)
    if not 1 <= steps <= MAX_FREQUENCY:
        expected = f"{1.0 / FREQUENCY_STEPS:.2g} to {MAX_FREQUENCY / FREQUENCY_STEPS:.0f} Hz"
        raise ArgumentError(place, f"{hz:g} Hz", expected)
    return steps
