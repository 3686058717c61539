"""Signals on their way to a device's fingers: one loop sends for all of them over one wire."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.device.finger_requests import FingerRequests
from chladni.host.device.stream_sources import SignalSource
from chladni.host.device.wires.link import Link

TURN_S = 0.005
"""Between two sendings, unless the wire is slower: 115,200 baud just carries two fingers."""
STUCK_S = 0.5
"""After which a device that takes no samples has ended a touch; those that wait last 0.05 s."""
AFTER_S = 0.05
"""For which a finger stays behind its signal, so that the last of it rings on."""


class SentSignal:
    """What one finger plays, as far as the device has it.

    Parameters
    ----------
    source
        Of its samples.
    ahead
        How many the device is to keep waiting.
    now_s
        The wire's clock.

    Attributes
    ----------
    sent
        Samples that the device took.
    fewest
        That waited before others came; at 0 there was a gap.
    """

    def __init__(
        self,
        fingers: FingerRequests,
        finger: int,
        source: SignalSource,
        ahead: int,
        now_s: Callable[[], float],
    ) -> None:
        self.sent, self.fewest = 0, ahead
        self._fingers, self._finger, self._source = fingers, finger, source
        self._ahead, self._now_s = ahead, now_s
        self._waiting, self._known_s = 0, now_s()

    @property
    def is_over(self) -> bool:
        """Whether all of it was sent."""
        return self._source.is_over

    def send(self) -> int:
        """Send what there may be room for; how many samples were taken."""
        # A wire is slow: whatever is sent beyond that room comes once more.
        now_s = self._now_s()
        left = max(0, self._waiting - int((now_s - self._known_s) * SIGNAL_HZ))
        self._known_s = now_s
        taken = self._take(self._source.next(max(self._ahead - left, 0)))
        if self.sent:
            self.fewest = min(self.fewest, self._waiting - taken)
        self._source.drop(taken)
        self.sent += taken
        return taken

    def left_s(self) -> float:
        """How long those that wait on the device last."""
        self._take(np.zeros(0))
        return self._waiting / SIGNAL_HZ

    def _take(self, samples: NDArray[np.float64]) -> int:
        taken, self._waiting = self._fingers.send(self._finger, samples)
        return taken


def send_all(signals: Sequence[SentSignal], link: Link) -> None:
    """Send signals until all are over, or the device takes no more; then wait for the last of them.

    Whether fingers are down still is for the caller to ask.
    """
    now_s = link.wire.now_s
    taken_s = now_s()
    while waiting := [own for own in signals if not own.is_over]:
        turn_s = now_s()
        if sum(own.send() for own in waiting):
            taken_s = now_s()
        elif now_s() - taken_s > STUCK_S:
            return
        if now_s() - turn_s < TURN_S:
            link.wait(TURN_S)
    link.wait(max(own.left_s() for own in signals) + AFTER_S)
