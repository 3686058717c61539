"""What an effect is: tones, clicks, noise and recordings over time, added up.

Amplitudes are shares of the loudest that a place allows, 0 to 1. A device plays samples, which
`Effect.samples` makes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.effects.low_pass import TAIL_S, low_passed
from chladni.sim.errors import ArgumentError

FloatArray = NDArray[np.float64]

MOST_S = 600.0
"""That an effect lasts."""
MOST_POINTS = 10_000
"""Breakpoints of a curve: half a minute of one every 3 ms."""
LEAST_HZ, MOST_HZ = 1.0, 1000.0
CLICK_WAVES = 1.5
"""Of a click, under a Hann window."""
NOISE_SEED = 20240160


@dataclass(frozen=True)
class Curve:
    """Breakpoints joined by straight lines; before the first and behind the last it stays.

    Attributes
    ----------
    times
        s, none before the one before it; two at one time are a step.
    values
        As many.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.times or len(self.times) != len(self.values):
            raise ArgumentError("points", len(self.times), "one or more, each with a value")
        if len(self.times) > MOST_POINTS:
            raise ArgumentError("points", f"{len(self.times):,}", f"{MOST_POINTS:,} at most")
        if any(late < early for early, late in zip(self.times, self.times[1:], strict=False)):
            raise ArgumentError("points", "times that go back", "times in order")

    @classmethod
    def constant(cls, value: float) -> Curve:
        """The same at all times."""
        return cls((0.0,), (value,))

    def at(self, times: FloatArray) -> FloatArray:
        """Its values, shape as `times`'."""
        own, values = np.asarray(self.times), np.asarray(self.values)
        # From the last of several points at one time on, its value.
        return np.asarray(np.interp(times, own, values))

    def points(
        self, begins_s: float, ends_s: float, more: Sequence[float] = ()
    ) -> list[tuple[float, float]]:
        """Its (s, value) from a begin to an end, with `more` times between."""
        own = [
            (at, value)
            for at, value in zip(self.times, self.values, strict=True)
            if begins_s < at < ends_s
        ]
        between = [at for at in more if at not in {time for time, _ in own}]
        others = np.array([begins_s, *between, ends_s])
        added = zip(others.tolist(), self.at(others).tolist(), strict=True)
        # In their own order, where two at one time are a step.
        return sorted([*own, *added], key=lambda point: point[0])


class Part(Protocol):
    """What an effect adds up."""

    @property
    def begins_s(self) -> float:
        """When it begins, s from the effect's begin."""
        ...

    @property
    def ends_s(self) -> float:
        """When it is over, s from the effect's begin."""
        ...

    def wave(self, times: FloatArray) -> FloatArray:
        """What it plays at evenly spaced times, s, from 0 on."""
        ...


@dataclass(frozen=True)
class Tone:
    """A sine whose amplitude (0 to 1) and frequency (Hz) follow curves over the effect's time."""

    begins_s: float
    ends_s: float
    amplitude: Curve
    frequency_hz: Curve

    def points_of(self, curve: Curve, more: Sequence[float] = ()) -> list[tuple[float, float]]:
        """One of its curves by (s, value) from its begin to its end, with `more` times between."""
        return curve.points(self.begins_s, self.ends_s, more)

    def wave(self, times: FloatArray) -> FloatArray:
        """As of `Part`; its phase is 0 where it begins."""
        if len(times) < 2:
            return np.zeros(len(times))
        step = times[1] - times[0]
        is_on = _is_on(self, times)
        hz = np.where(is_on, self.frequency_hz.at(times), 0.0)
        turns = np.concatenate(((0.0,), np.cumsum(0.5 * (hz[1:] + hz[:-1])))) * step
        first = int(np.argmax(is_on))
        wave = np.sin(2.0 * np.pi * (turns - turns[first]))
        return np.asarray(np.where(is_on, self.amplitude.at(times) * wave, 0.0))


@dataclass(frozen=True)
class Click:
    """One and a half waves of a frequency under a Hann window."""

    at_s: float
    amplitude: float
    frequency_hz: float

    @property
    def begins_s(self) -> float:
        """As of `Part`."""
        return self.at_s

    @property
    def ends_s(self) -> float:
        """As of `Part`."""
        return self.at_s + CLICK_WAVES / self.frequency_hz

    def wave(self, times: FloatArray) -> FloatArray:
        """As of `Part`."""
        turns = (times - self.at_s) * self.frequency_hz
        window = np.sin(np.pi * turns / CLICK_WAVES) ** 2
        wave = self.amplitude * window * np.sin(2.0 * np.pi * turns)
        return np.asarray(np.where((turns >= 0.0) & (turns <= CLICK_WAVES), wave, 0.0))


@dataclass(frozen=True)
class Noise:
    """Noise of a curve's amplitude, the same each time it plays."""

    begins_s: float
    ends_s: float
    amplitude: Curve

    def wave(self, times: FloatArray) -> FloatArray:
        """As of `Part`."""
        drawn = np.random.default_rng(NOISE_SEED).uniform(-1.0, 1.0, len(times))
        return np.asarray(np.where(_is_on(self, times), self.amplitude.at(times) * drawn, 0.0))


@dataclass(frozen=True)
class Clip:
    """A recording: samples, -1 to 1, of a rate in Hz."""

    begins_s: float
    samples: FloatArray
    rate_hz: float

    @property
    def ends_s(self) -> float:
        """As of `Part`."""
        return self.begins_s + len(self.samples) / self.rate_hz

    def wave(self, times: FloatArray) -> FloatArray:
        """As of `Part`."""
        own = self.begins_s + np.arange(len(self.samples)) / self.rate_hz
        return np.asarray(np.interp(times, own, self.samples, left=0.0, right=0.0))


@dataclass(frozen=True)
class Effect:
    """Parts that play together.

    Attributes
    ----------
    name
        What people call it.
    parts
        What is added up.
    loop_s
        While a device holds it, it goes from the second time back to the first, s; from its end to
        its begin if left out. Elsewhere it plays once.
    """

    name: str
    parts: tuple[Part, ...]
    loop_s: tuple[float, float] | None = None

    @property
    def frequencies_hz(self) -> list[float]:
        """Of its tones' breakpoints and its clicks."""
        tones = [hz for p in self.parts if isinstance(p, Tone) for hz in p.frequency_hz.values]
        return tones + [p.frequency_hz for p in self.parts if isinstance(p, Click)]

    @property
    def lasts_s(self) -> float:
        """Until its last part is over, s."""
        return max((part.ends_s for part in self.parts), default=0.0)

    def samples(self, rate_hz: float) -> FloatArray:
        """What a device plays: without what lies above 250 Hz, and with the low-pass's tail.

        Parameters
        ----------
        rate_hz
            Samples a second.

        Returns
        -------
        float64, -1 to 1. Where parts add up to more, all of the effect is made quieter.

        Raises
        ------
        ArgumentError
            It lasts too long.
        """
        if not self.lasts_s <= MOST_S:
            raise ArgumentError("effect", f"{self.lasts_s:g} s", f"{MOST_S:g} s at most")
        return limited(low_passed(self.wave(rate_hz, self.lasts_s + TAIL_S), rate_hz))

    def wave(self, rate_hz: float, lasts_s: float) -> FloatArray:
        """The sum of its parts, unfiltered."""
        times = np.arange(int(np.ceil(lasts_s * rate_hz)) + 1) / rate_hz
        return sum((part.wave(times) for part in self.parts), np.zeros(len(times)))


def kind_of(part: Part) -> str:
    """Its name for people: tone, click, noise or clip."""
    return type(part).__name__.lower()


def kinds(effect: Effect) -> list[str]:
    """Names of its parts' kinds, each with how many there are."""
    names = [kind_of(part) for part in effect.parts]
    return [f"{names.count(name)} {name}" for name in dict.fromkeys(names)]


def described(part: Part) -> str:
    """Its kind, and when it begins."""
    return f"{kind_of(part)} at {part.begins_s:g} s"


def _is_on(part: Part, times: FloatArray) -> NDArray[np.bool_]:
    return (times >= part.begins_s) & (times < part.ends_s)


def limited(samples: FloatArray) -> FloatArray:
    """Made quieter where the largest is beyond 1."""
    return np.asarray(samples / max(1.0, float(np.abs(samples).max(initial=0.0))))


def curve_of(points: Sequence[tuple[float, float]]) -> Curve:
    """A curve through (s, value)."""
    return Curve(tuple(at for at, _ in points), tuple(value for _, value in points))
