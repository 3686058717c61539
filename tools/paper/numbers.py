"""Numbers as the page prints them, and how near two printed ones are."""

from __future__ import annotations

import re

NUMBER = r"[−-]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[−-]?\d+)?"
"""What a printed number looks like, thousands apart by a comma."""

Numbers = dict[str, str]
"""By the name that stands in the page's template."""


def fixed(value: float, digits: int = 0) -> str:
    """A number with so many digits after the point; none of them says −0."""
    text = f"{value:,.{digits}f}".replace("-", "−")
    return text if value_of(text) else text.lstrip("−")


def rounded(value: float, digits: int) -> str:
    """A number with so many figures that count, such as 0.00012 or 3.1e−7."""
    return f"{value:.{digits}g}".replace("e-0", "e-").replace("-", "−")


def value_of(text: str) -> float:
    """A printed number."""
    return float(text.replace("−", "-").replace(",", ""))


def step_of(text: str) -> float:
    """One in the last place of a printed number."""
    mantissa, _, power = text.replace("−", "-").partition("e")
    places = len(mantissa.partition(".")[2])
    return float(10.0 ** (int(power or 0) - places))


def agree(first: str, second: str) -> bool:
    """Whether two printed numbers differ by no more than one in the last place.

    Machines round differently where a number lies between two printed ones.
    """
    if not (re.fullmatch(NUMBER, first) and re.fullmatch(NUMBER, second)):
        return first == second
    step = max(step_of(first), step_of(second))
    return abs(value_of(first) - value_of(second)) <= 1.001 * step
