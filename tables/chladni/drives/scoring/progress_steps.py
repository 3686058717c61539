"""Steps of long work, counted for whoever wants to know."""

from __future__ import annotations

from chladni.drives.methods import Progress


class StepCounter:
    """Steps done, told to a progress as (done, all)."""

    def __init__(self, progress: Progress | None, steps: int) -> None:
        self._progress, self._steps, self._done = progress, steps, 0

    def step(self) -> None:
        """One more is done."""
        self._done += 1
        if self._progress:
            self._progress(self._done, self._steps)
