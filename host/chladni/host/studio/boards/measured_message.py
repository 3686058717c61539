"""What was measured of a board beside what was drawn, as a page shows it."""

from __future__ import annotations

from typing import Any

import numpy as np

from chladni.calibration.restored import gained
from chladni.calibration.wiring import coil_fault
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

TIMES = "×"
"""The unit of what the board's file has in no unit of its own: how often the drawn one."""


def measured_message(board: Board) -> dict[str, Any] | None:
    """A sentence, and a row for each value; None of a board that was not measured."""
    own = board.measured
    if own is None:
        return None
    comma = "," if "," in own.by else ""
    said = f"Measured by {own.by}{comma} on {own.date}"
    if own.before and own.after:
        said += f": {gained(own.before, own.after)}"
    faulty = [one.name for one in board.actuators if coil_fault(one)]
    look = f" Look at {', '.join(faulty)}." if faulty else ""
    known, rows = _values(board), []
    for one in own.values:
        what, unit, value = known.get(one.name, (one.name, TIMES, one.ratio))
        drawn = value / one.ratio
        rows.append(
            {
                "what": what,
                "unit": unit,
                "drawn": drawn,
                "measured": value,
                "low": drawn * one.low,
                "high": drawn * one.high,
            }
        )
    return {"said": f"{said}.{look}", "rows": rows}


def _values(board: Board) -> dict[str, tuple[str, str, float]]:
    """By the names that calibration gives: words, unit and value of what the file says itself."""
    plate, foundation = board.plate, board.foundation
    values = {
        "sheet thickness": ("sheet’s thickness", "mm", plate.thickness / MM),
        "modulus": ("sheet’s modulus", "GPa", plate.youngs_modulus / 1e9),
        "sheet's loss": ("sheet’s loss factor", "", plate.loss_factor),
    }
    if foundation is not None:
        # What was measured is the mean over all patches, by logarithms.
        ratios = [patch.ratio for patch in foundation.patches] or [1.0]
        stiffness = foundation.sheet_stiffness * float(np.exp(np.mean(np.log(ratios))))
        values["foam"] = ("foam’s stiffness", "N/mm³", stiffness * MM**3)
        values["foam's loss"] = ("foam’s loss factor", "", foundation.sheet_loss_factor)
    return values
