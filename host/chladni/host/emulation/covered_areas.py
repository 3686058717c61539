"""Areas of a bank that no finger is ever in, as the firmware's own code finds them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from chladni.effects.bank.areas import Bank, reach_mm
from chladni.effects.bank.pack import pack_bank
from chladni.host.emulation._emulator import area_at

PLACES = 15
"""Along each side of an area's box."""


def covered_areas(bank: Bank) -> list[str]:
    """Names of areas all of whose places belong to areas before them.

    At places of a grid over each area's box; one of less than a grid's step may be missed.
    """
    found = []
    whole = pack_bank(bank)
    for k, area in enumerate(bank.areas):
        if not reach_mm(area.shape):
            continue
        alone = pack_bank(replace(bank, areas=(area,)))
        (left, low), (right, high) = reach_mm(area.shape)
        xs, ys = (
            np.linspace(a, b, PLACES + 2)[1:-1] * 1e3 for a, b in ((left, right), (low, high))
        )
        own = [
            (round(x), round(y)) for x in xs for y in ys if area_at(alone, round(x), round(y)) == 0
        ]
        if own and all(area_at(whole, x, y) != k for x, y in own):
            found.append(area.name)
    return found
