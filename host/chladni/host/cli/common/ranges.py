"""The range of every number on the command line, declared where its option is."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import typer

from chladni.host.cli.common.command_group import name_of
from chladni.host.cli.common.output import Place, say
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError
from chladni.sim.image.metrics import FINGERTIP_RADIUS
from chladni.tables.layout import MAX_FREQUENCY_MILLIHERTZ, MIN_FREQUENCY_MILLIHERTZ

MOST_SAMPLES = 10_000
"""Boards: a share of their places is known to 0.5 % then, after an hour or more."""
MOST_SEED = 2**32 - 1
"""What the library `cma` takes."""
LEAST_APART_MM = 5.0
"""Less than two fingertips can lie apart."""
MOST_STEPS = 10_000_000
MOST_JOBS = 1024
LONGEST_S = 1e8
"""Three years: what is served without an end."""


def within(low: float, high: float, unit: str = "", *, above: bool = False) -> Callable[..., Any]:
    """Let an option have numbers of a range only, NaN not among them; it may be left out.

    Parameters
    ----------
    above
        Whether the low end itself is too little.
    """

    def check(parameter: typer.CallbackParam, value: Any) -> Any:
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is None or (low <= one <= high and not (above and one == low)):
                continue
            begin = f"more than {low:.12g}, at most" if above else f"{low:.12g} to"
            expected = f"{begin} {high:.12g} {unit}".rstrip()
            raise InputError(name_of(parameter), one, expected)
        return value

    return check


SEEDS = within(0, MOST_SEED)
STEPS = within(1, MOST_STEPS)
PITCHES = within(0.1, 1000.0, "mm")
FREQUENCIES = within(1.0, 20000.0, "Hz")
TABLE_FREQUENCIES = within(MIN_FREQUENCY_MILLIHERTZ / 1e3, MAX_FREQUENCY_MILLIHERTZ / 1e3, "Hz")
UDP_PORTS = within(1, 65535)


def check_apart(place: Place, other: Place, option: str, given: str) -> None:
    """Refuse two fingers that cannot lie so near, and remark on fingertips that overlap, mm.

    `given` is what `option`, which has the other one, was given.
    """
    apart = math.dist(place, other)
    if apart < LEAST_APART_MM:
        expected = f"{LEAST_APART_MM:g} mm or more from the finger at --at"
        raise InputError(option, given, expected)
    if apart < (wide := 2.0 * FINGERTIP_RADIUS / MM):
        say(f"fingertips are {wide:g} mm apart or more, and these are {apart:.2g}: they overlap")
