"""How often a page may say something."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic


class Rate:
    """A bucket that fills at `per_second` up to `most`; what comes is taken out of it."""

    def __init__(
        self, per_second: float, most: float, clock: Callable[[], float] = monotonic
    ) -> None:
        self._per_second, self._most, self._clock = per_second, most, clock
        self._left, self._at = most, clock()

    def allows(self, amount: float = 1.0) -> bool:
        """Whether there is room for so much more, which is taken."""
        now = self._clock()
        self._left = min(self._most, self._left + (now - self._at) * self._per_second)
        self._at = now
        if self._left < amount:
            return False
        self._left -= amount
        return True
