"""What a drive may be asked to be best at, each with the method that finds the best one."""

from __future__ import annotations

from functools import partial

from chladni.drives.methods.base import Method
from chladni.drives.methods.contrast import contrast
from chladni.drives.methods.focus import focus
from chladni.drives.methods.phasor import phasor
from chladni.sim.board.board import Board

DECIBEL = 10.0 / 2.302585092994046
"""Decibels per unit of the natural logarithm of a power ratio."""
BALANCE = 0.02
"""SSIM that one decibel of contrast is worth in `balanced`; why, is in docs/five-actuators.md."""

OBJECTIVES: dict[str, Method] = {
    "ssim": phasor,
    "contrast": contrast,
    "balanced": partial(phasor, contrast=BALANCE * DECIBEL),
    "focus": focus,
}
"""By the name the command line knows. SSIM is what the paper is compared with."""


def default_objective(board: Board) -> str:
    """What a board's drives are best at unless something else is asked for.

    `focus` on a board whose file has a block `[focus]` or `[fingers]`, which means that no finger
    is to feel another's signal. Else `ssim`, as the paper has it.
    """
    return "ssim" if board.focus is None and board.fingers is None else "focus"


def objective_of(board: Board, method: str) -> str:
    """The same for a method: those besides `phasor` have `ssim` alone."""
    return default_objective(board) if method == "phasor" else "ssim"
