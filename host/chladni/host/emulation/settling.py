"""When a touch plays steadily, and for how long a steady drive is measured."""

from __future__ import annotations

import numpy as np

from chladni.host.emulation.demodulate import Play
from chladni.host.emulation.emulator import Emulator, Recording
from chladni.sim.errors import ChladniError
from chladni.tables.table import Table

PANEL_MS, LONGEST_PANEL_MS = 10.0, 200.0
"""A report of the panel; when it must have been heard. An FT6x36 that was just powered on takes
40 ms to see a finger."""
SETTLE_MS = 2.0
"""After a ramp, until the error feedback has forgotten it."""
LEAST_WAVES = 8
"""A settled drive is measured over this many waves."""


def steady_play(emulator: Emulator, table: Table, waves_ms: float) -> tuple[Recording, Play]:
    """The pins until a touch that was put down has played steadily for so long, and that stretch.

    Raises
    ------
    ChladniError
        Nothing plays.
    """
    parts = [emulator.run(PANEL_MS)]
    while not parts[-1].duty_steps.any():
        if len(parts) * PANEL_MS > LONGEST_PANEL_MS:
            raise ChladniError(
                "the emulated device plays nothing", hint="does its panel reach there?"
            )
        parts.append(emulator.run(PANEL_MS))
    parts.append(emulator.run(table.limits.ramp_us / 1e3 + SETTLE_MS + waves_ms))
    steps = np.concatenate([part.duty_steps for part in parts])
    first = int(np.flatnonzero(steps.any(axis=1))[0])
    whole = Recording(steps, parts[0].carrier_hz, parts[0].pwm_bits)
    settled = first + int((table.limits.ramp_us / 1e3 + SETTLE_MS) * 1e-3 * whole.carrier_hz)
    return whole, Play(settled, len(steps))
