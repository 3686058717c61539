"""Signals and effects that fingers on a device play, from their first sample to their last."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chladni.effects.bank.areas import level_within
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.device.finger_requests import FingerRequests, FloatArray
from chladni.host.device.sent_signals import SentSignal, send_all
from chladni.host.device.stream_sources import PlayedSignal, SignalSource
from chladni.host.device.wires.link import LinkError
from chladni.host.protocol.link import SIGNAL_SAMPLES
from chladni.sim.errors import ChladniError

if TYPE_CHECKING:
    from chladni.effects.effect import Effect

LIVE_SAMPLES = 80
"""That a device is to keep of a live signal: 33 ms, twice what a turn takes at 115,200 baud."""
RESTS_S = 0.1
"""For which several fingers rest first: until drives of all, and a switch's bias, are up."""


class DeviceFingers(FingerRequests):
    """Of a `Device`: its attribute `fingers`."""

    def play(
        self,
        samples: FloatArray,
        at_mm: tuple[float, float],
        *,
        finger: int = 0,
        level: float = 1.0,
        most_um: float | None = None,
    ) -> PlayedSignal:
        """Put a finger down, play a signal under it, and lift it once that is over.

        Parameters
        ----------
        samples
            -1 to 1, `SIGNAL_HZ` of them a second.
        at_mm
            Where, mm from the board's centre.
        finger
            0 to 4. Others that are held stay, and are left still where the table has responses.
        level
            Of the configured level, 0 to 1.
        most_um
            An amplitude of 1 moves the finger no further, where the device knows how far it does.

        Raises
        ------
        LinkError
            The device has no table, knows no micrometres, or ended the touch.
        """
        return self.stream(
            [samples], at_mm, finger=finger, level=level, most_um=most_um, ahead=SIGNAL_SAMPLES
        )

    def stream(
        self,
        blocks: Iterable[FloatArray],
        at_mm: tuple[float, float],
        *,
        finger: int = 0,
        level: float = 1.0,
        most_um: float | None = None,
        ahead: int = LIVE_SAMPLES,
    ) -> PlayedSignal:
        """The same for a signal that comes block by block, for as long as it does.

        Parameters
        ----------
        blocks
            Samples as of `play`; whoever makes them may take their time.
        ahead
            Samples that the device is to keep: what comes late by less is not heard, and all is
            heard that much later.
        """
        with self._signals_of([finger], level, most_um):
            return self._streamed(SignalSource(blocks), at_mm, finger, ahead)

    def play_together(
        self,
        signals: Sequence[FloatArray],
        places_mm: Sequence[tuple[float, float]],
        *,
        level: float = 1.0,
        most_um: float | None = None,
    ) -> list[PlayedSignal]:
        """Put several fingers down, have each play a signal of its own, and lift them.

        They rest for a moment first, until drives of all are up; then all signals begin.

        Parameters
        ----------
        signals, places_mm
            Of the first finger, the second and so on, as of `play`.
        level, most_um
            Of each, as of `play`.

        Raises
        ------
        LinkError
            As of `play`, or the table has no responses.
        """
        fingers = range(len(signals))
        with self._signals_of(fingers, level, most_um):
            held = [self.touch(own, *place) for own, place in zip(fingers, places_mm, strict=True)]
            self._link.wait(RESTS_S)
            sources = [SignalSource([own]) for own in signals]
            sent = [self._sent(own, sources[own], SIGNAL_SAMPLES) for own in fingers]
            send_all(sent, self._link)
            down = self._down()
            return [_played(down.get(own), held[own], sent[own]) for own in fingers]

    def _streamed(
        self, source: SignalSource, at_mm: tuple[float, float], finger: int, ahead: int
    ) -> PlayedSignal:
        sent = self._sent(finger, source, ahead)
        sent.send()
        place = self.touch(finger, *at_mm)
        send_all([sent], self._link)
        return _played(self._down().get(finger), place, sent)

    def _down(self) -> dict[int, dict[str, Any]]:
        return {one["finger"]: one for one in self.all()}

    def _sent(self, finger: int, source: SignalSource, ahead: int) -> SentSignal:
        return SentSignal(self, finger, source, ahead, self._link.wire.now_s)

    @contextlib.contextmanager
    def _signals_of(
        self, fingers: Iterable[int], level: float, most_um: float | None
    ) -> Iterator[None]:
        """Inside of it fingers play signals; after it they are lifted, and the device's own."""
        own = list(fingers)
        try:
            for finger in own:
                self.set_signal(finger, level)
                if most_um is not None:
                    self.limit_signal(finger, most_um)
            yield
        finally:
            # Also where whoever makes the samples failed.
            for finger in own:
                with contextlib.suppress(ChladniError):
                    self.lift(finger)
                with contextlib.suppress(ChladniError):
                    self.set_voice(finger)

    def play_effect(
        self,
        effect: Effect | str | Path,
        at_mm: tuple[float, float],
        *,
        level_db: float = 0.0,
        level_um: float | None = None,
        finger: int = 0,
    ) -> PlayedSignal:
        """The same for an effect.

        Parameters
        ----------
        effect
            An effect, the name of a shipped one, or its file.
        level_db
            Against the loudest for that place, 0 or less.
        level_um
            As much, wherever the place allows it and the device knows it.

        Raises
        ------
        InputError
            There is no such effect, or a level cannot be.
        LinkError
            As of `play`.
        """
        # They load SciPy, which takes longer than a device takes to answer.
        from chladni.effects.effect import Effect  # noqa: PLC0415
        from chladni.effects.files import read_effect  # noqa: PLC0415

        own = effect if isinstance(effect, Effect) else read_effect(effect).effect
        level = level_within(level_db)
        samples = own.samples(SIGNAL_HZ)
        return self.play(samples, at_mm, finger=finger, level=level, most_um=level_um)

    def stream_signal(
        self,
        signal: FloatArray | Iterable[FloatArray],
        at_mm: tuple[float, float],
        *,
        rate_hz: float,
        level_db: float = 0.0,
        level_um: float | None = None,
        finger: int = 0,
    ) -> PlayedSignal:
        """The same for a live signal, which is low-passed at 250 Hz on its way.

        Between a sample and the duties that it makes lie the 33 ms that the device keeps, 2 ms of
        the low-pass, and what the wire takes.

        Parameters
        ----------
        signal
            -1 to 1: one row of samples, or rows that come one after the other.
        rate_hz
            Samples of it in a second: 2 to 8 kHz are usual.

        Raises
        ------
        InputError
            A rate that cannot be, or no rows of numbers.
        LinkError
            As of `play`.
        """
        from chladni.effects.live import signal_samples  # noqa: PLC0415

        rows = [signal] if isinstance(signal, np.ndarray) else signal
        samples, level = signal_samples(rows, rate_hz, SIGNAL_HZ), level_within(level_db)
        return self.stream(samples, at_mm, finger=finger, level=level, most_um=level_um)


def _played(
    down: dict[str, Any] | None, place_mm: tuple[float, float], sent: SentSignal
) -> PlayedSignal:
    """How a signal went, by what the device says of its finger, which is to be down still."""
    if down is None:
        hint = "`chladni device info` shows its state and faults"
        raise LinkError("the device ended a touch", hint=hint)
    fewest = min(sent.fewest, sent.sent)
    return PlayedSignal(place_mm, sent.sent, fewest, down["isolation_db"], down["level_db"])
