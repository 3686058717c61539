"""When a touch plays steadily, and for how long a steady drive is measured."""

from __future__ import annotations

from chladni.host.emulation.emulator import TouchEvent
from chladni.tables.table import Table

PANEL_MS = 12.0
"""One report of the panel and one turn of the main loop."""
SETTLE_MS = 2.0
"""After a ramp, until the error feedback has forgotten it."""
LEAST_WAVES = 8
"""A settled drive is measured over this many waves."""


def settled_ms(table: Table, touch: TouchEvent) -> float:
    """When a touch plays steadily: after its report and the ramp."""
    return touch.at_ms + PANEL_MS + table.limits.ramp_us / 1e3 + SETTLE_MS
