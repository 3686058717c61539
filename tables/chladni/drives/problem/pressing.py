"""A problem as it is while the finger presses at its target: its own finger loads every field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import Problem, SolvedBoard, SolvedPlate
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import FINGERS, NO_FINGER, USUAL, Finger
from chladni.sim.image import metrics
from chladni.sim.image.finger import dynamic_stiffness, fields_under_finger

ComplexArray = NDArray[np.complex128]


def finger_of(problem: Problem) -> Finger:
    """The finger of the board file; the usual one where it has none."""
    own = problem.board.finger
    return FINGERS[USUAL] if own is None or own == NO_FINGER else own


def with_finger(problem: Problem, fields: ComplexArray) -> ComplexArray:
    """Fields (…, nx, ny) of the board as they are while the finger presses at the target."""
    answer, own = problem.pressing
    stiffness = dynamic_stiffness(finger_of(problem), problem.solved.fields.frequency_hz)
    means = fields[..., problem.disc].mean(axis=-1)
    return fields_under_finger(fields, means, answer, own, stiffness)


def pressed_at(
    board: Board, place: tuple[float, float], fields: ComplexArray, answer: ComplexArray, z: complex
) -> ComplexArray:
    """Fields (…, nx, ny) under a fingertip at a place, m, that pushes back with z, N/m.

    `answer` is what a newton spread over the fingertip does, (nx, ny), m/N.
    """
    disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
    own = complex(answer[disc].mean())
    return fields_under_finger(fields, fields[..., disc].mean(axis=-1), answer, own, z)


def pressed_problem(problem: Problem) -> Problem:
    """The same target with the finger on it, for drives that make up for what it changes.

    What is wanted stays the field of a unit load on the board without a finger.
    """
    plate, stiffer = problem.solved.plate, problem.solved.for_focus
    fields = replace(plate.fields, values=with_finger(problem, problem.transfer))
    own = SolvedPlate(plate.model, fields, plate.mirrors, plate.static)
    if stiffer is not problem.solved:
        there = Problem(stiffer, problem.target_mm, problem.wanted, problem.wanted_error)
        own.for_focus.append(pressed_problem(there).solved)
    return Problem(
        SolvedBoard(problem.board, own), problem.target_mm, problem.wanted, problem.wanted_error
    )
