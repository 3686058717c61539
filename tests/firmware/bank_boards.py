"""Emulated boards that hold an effect bank, and the fingers laid on them."""

from __future__ import annotations

from typing import Any

import numpy as np

from chladni.host.emulation.emulator import Emulator, Recording, TouchEvent
from chladni.tables.table import Limits, Table
from effects.banks import BYTES
from firmware.judged_device import BRIDGES
from made_up import device_of

LIMITS = Limits(4000, 100_000, 20_000_000)


def board(table: Table, bank: bytes = BYTES, **settings: Any) -> Emulator:
    with_bridges: dict[str, Any] = {**BRIDGES, **settings}
    return Emulator(device_of(table, **with_bridges), table, level=1.0, bank=bank)


def lay(emulator: Emulator, place: tuple[float, float] | None, finger: int = 0) -> None:
    """From the next millisecond on."""
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, place, finger))


def loudest(recording: Recording) -> float:
    """Beyond the few steps of what a bridge loses."""
    return float(np.abs(recording.duty).max()) - 8.0 / 1024.0
