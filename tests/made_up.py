"""Tables with made-up drives and short limits, for tests of the firmware."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.tables import format as f
from chladni.tables.regions import RegionGrid

RAMP_MS, TIMEOUT_MS, MAX_ON_MS = 4.0, 60.0, 400.0


def make_table(drives: NDArray[Any], columns: int = 1, rows: int = 1) -> f.Table:
    """A table of the given drives, shape (regions, actuators), at full scale 10."""
    limits = f.Limits(int(RAMP_MS * 1e3), int(TIMEOUT_MS * 1e3), int(MAX_ON_MS * 1e3))
    grid = RegionGrid(columns, rows, 71500, 146700)
    iq = f.quantise(np.asarray(drives, dtype=np.complex128), 10.0)
    return f.Table("t", 1, 160.0, grid, 10.0, limits, iq)
