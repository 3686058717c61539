"""A line of a parts list."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """A line of the parts list: what, how many, which value, and what the value follows from.

    `mass_g` is that of one, where it is known.
    """

    part: str
    count: int
    value: str
    why: str
    mass_g: float | None = None
