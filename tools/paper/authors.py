"""What the paper's authors recorded of their own annealings: authors.toml."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("authors.toml")


@dataclass(frozen=True)
class Run:
    """One annealing of the authors.

    Attributes
    ----------
    target_mm
        Where the vibration was to be.
    steps, ssim
        Selected steps, the first being 1, and the SSIM after each.
    best, best_step
        The highest of all their steps, and at which.
    length
        How many steps they made.
    maximum_off_mm
        From the target to the maximum of their composite, where there is a picture of it.
    """

    target_mm: tuple[float, float]
    steps: tuple[int, ...]
    ssim: tuple[float, ...]
    best: float
    best_step: int
    length: int
    maximum_off_mm: int | None

    @property
    def first(self) -> float:
        """SSIM after the first step."""
        return self.ssim[0]


def short_runs() -> list[Run]:
    """The four targets' runs of 1000 steps."""
    return [_run(entry) for entry in _document()["short"]]


def long_run() -> Run:
    """The run of 10 000 steps that the paper's figure 5C shows."""
    return _run(_document()["long"])


def _document() -> dict[str, Any]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def _run(entry: dict[str, Any]) -> Run:
    x, y = entry["target_mm"]
    return Run(
        (x, y),
        tuple(entry["steps"]),
        tuple(entry["ssim"]),
        entry["best"],
        entry["best_step"],
        entry["length"],
        entry.get("maximum_off_mm"),
    )
