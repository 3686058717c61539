"""`.hjif` files of MPEG haptics (ISO/IEC 23090-31), in JSON.

Of the vibrotactile bands those of vectorial waves have tones, those of transients two waves in
22 ms at each keyframe, and those of curves are the signal itself. Wavelets, and effects within
effects, are left out.

References
----------
The reference software of the standard (MPEGGroup/HapticReferenceSoftware), for what a band sounds
like.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from chladni.effects.effect import (
    LEAST_HZ,
    MOST_HZ,
    MOST_POINTS,
    MOST_S,
    Clip,
    Curve,
    Effect,
    Part,
    Tone,
    curve_of,
)
from chladni.effects.file_values import FileValue, read_json

VIBRATION = ("Vibrotactile", "Vibrotactile Texture")
TRANSIENT_S, TRANSIENT_WAVES = 0.022, 2.0
CURVE_HZ = 2000.0
"""Samples a second of a curve: the low-pass leaves less than an eighth of that."""
MOST_TICKS = 1e9
MOST_GAIN = 1e3
Keyframe = tuple[float, float | None, float | None]


def read_hjif(path: Path, field: str) -> tuple[Effect, list[str]]:
    """The effect, and what of the file is left out.

    Raises
    ------
    InputError
        It breaks a rule of the format, or has nothing that vibrates; names the value and its place.
    """
    file = read_json(path, field)
    timescale = file["timescale"].number(1.0, 1e6, 1000.0)
    found: list[tuple[FileValue, FileValue]] = []
    reading = _Reading(timescale)
    for perception in file["perceptions"]:
        if perception["perception_modality"].text() not in VIBRATION:
            reading.leave_out(perception, str(perception["perception_modality"].value))
            continue
        found += [(perception, channel) for channel in perception["channels"]]
    if not found:
        raise file["perceptions"].error("a perception that is vibrotactile, with a channel")
    perception, channel = found[0]
    for _, other in found[1:]:
        reading.leave_out(other, "another channel")
    reading.take_library(perception["effect_library"])
    parts = [*reading.channel(channel)]
    return Effect(path.stem, tuple(parts)), reading.left_out


@dataclass
class _Reading:
    timescale: float
    left_out: list[str] = field(default_factory=list)
    library: dict[int, FileValue] = field(default_factory=dict)

    def leave_out(self, own: FileValue, what: str) -> None:
        self.left_out.append(f"{own.place}: {what[:40]}")

    def take_library(self, own: FileValue) -> None:
        for one in own if own.is_there else ():
            self.library[int(one["id"].number(0, MOST_TICKS))] = one

    def channel(self, own: FileValue) -> Iterator[Part]:
        gain = own["gain"].number(-MOST_GAIN, MOST_GAIN, 1.0)
        for band in own["bands"]:
            kind = band["band_type"].text()
            if kind not in ("VectorialWave", "Transient", "Curve"):
                self.leave_out(band, kind)
                continue
            for effect in band["effects"]:
                yield from self._effect(kind, band, effect, gain)

    def _effect(self, kind: str, band: FileValue, effect: FileValue, gain: float) -> Iterator[Part]:
        own = effect
        if effect["effect_type"].text() == "Reference":
            number = int(effect["id"].number(0, MOST_TICKS))
            if number not in self.library:
                raise effect["id"].error("the id of an effect in the perception's effect_library")
            own = self.library[number]
        if own["effect_type"].text() != "Basis":
            self.leave_out(own, own["effect_type"].text())
            return
        begins_s = effect["position"].number(0.0, MOST_S * self.timescale, 0.0) / self.timescale
        frames = self._keyframes(own["keyframes"])
        if not frames:
            return
        if kind == "VectorialWave":
            signal = own["base_signal"].text() if own["base_signal"].is_there else "Sine"
            if signal != "Sine":
                self.leave_out(own, f"{signal}, played as a sine")
            yield _tone(band, frames, begins_s, gain)
        elif kind == "Transient":
            yield from _transients(frames, begins_s, gain)
        else:
            yield _curve(band, frames, begins_s, gain)

    def _keyframes(self, own: FileValue) -> list[Keyframe]:
        """Seconds from the effect's position, amplitude and hertz, where they are given."""
        found: list[Keyframe] = []
        for one in own:
            if len(found) == MOST_POINTS:
                raise one.error(f"{MOST_POINTS:,} keyframes at most")
            least = found[-1][0] * self.timescale if found else 0.0
            at = one["relative_position"].number(
                least - 1e-6, MOST_S * self.timescale, 0.0 if not found else None
            )
            amplitude, hz = one["amplitude_modulation"], one["frequency_modulation"]
            found.append(
                (
                    max(at, least) / self.timescale,
                    amplitude.number(-1.0, 1.0) if amplitude.is_there else None,
                    hz.number(0.0, 1e5) if hz.is_there else None,
                )
            )
        return found


def _tone(band: FileValue, frames: list[Keyframe], begins_s: float, gain: float) -> Tone:
    low = band["lower_frequency_limit"].number(0.0, 1e5)
    high = band["upper_frequency_limit"].number(low, 1e5)
    amplitudes = [(begins_s + at, abs(gain * a)) for at, a, _ in frames if a is not None]
    hertz = [(begins_s + at, f) for at, _, f in frames if f is not None]
    middle = 0.5 * (low + high)
    limited = [
        (at, float(np.clip(np.clip(f, low, high), LEAST_HZ, MOST_HZ)))
        for at, f in hertz or [(begins_s, middle)]
    ]
    amplitude = curve_of(amplitudes) if amplitudes else Curve.constant(min(1.0, abs(gain)))
    return Tone(begins_s, begins_s + frames[-1][0], amplitude, curve_of(limited))


def _transients(frames: list[Keyframe], begins_s: float, gain: float) -> Iterator[Tone]:
    hz = Curve.constant(TRANSIENT_WAVES / TRANSIENT_S)
    for at, amplitude, _ in frames:
        if amplitude is not None:
            own = Curve.constant(abs(gain * amplitude))
            yield Tone(begins_s + at, begins_s + at + TRANSIENT_S, own, hz)


def _curve(band: FileValue, frames: list[Keyframe], begins_s: float, gain: float) -> Clip:
    """The signal itself, by straight lines or cubics that are level at each keyframe."""
    at = np.array([time for time, a, _ in frames if a is not None])
    values = gain * np.array([a for _, a, _ in frames if a is not None])
    if not len(at):
        at, values = np.array([0.0]), np.array([0.0])
    times = np.arange(0.0, at[-1] + 0.5 / CURVE_HZ, 1.0 / CURVE_HZ)
    is_cubic = not band["curve_type"].is_there or band["curve_type"].text() == "Cubic"
    if is_cubic and len(at) > 1 and np.all(np.diff(at) > 0.0):
        # A third of a second of SciPy, which other files do not need.
        from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415

        samples = CubicHermiteSpline(at, values, np.zeros(len(at)))(np.clip(times, at[0], at[-1]))
    else:
        samples = np.interp(times, at, values)
    return Clip(begins_s, np.asarray(samples), CURVE_HZ)
