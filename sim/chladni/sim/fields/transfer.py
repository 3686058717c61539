"""Transfer fields: what each actuator of a board does to the whole plate, per newton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.checks import closest
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError, InputError, check_estimate
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.plate.loads import Load
from chladni.sim.plate.response import PlateModel, Response

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TOLERANCE = 5e-3
"""Estimated relative L² error allowed in a field unless the caller says otherwise. Estimates are
cautious: the error itself comes out around 1e-4 on `prototype`, a fortieth of an 8-bit image's
step, and 1e-3 of the amplitude is 0.01 dB against the 2.3 dB a finger tells apart."""


OFF_A_SCREW = 1.5
"""Radii from a screw's centre: the plate is clamped up to 1."""


@dataclass(frozen=True)
class TransferFields:
    """Displacement per newton from each actuator to every image point.

    Attributes
    ----------
    x, y
        Image points, m.
    values
        complex128, shape (actuators, nx, ny), m/N.
    frequency_hz
        Drive frequency.
    modes_used, error_estimate, tolerance, tolerance_met
        As in `Response`.
    reaction
        What coils and magnets do as they are moved by other forces, by its displacement at each:
        W′ = W − Σ wᵢ Rᵢ (driven.py), shape as `values`; None where that is nothing.
    """

    x: FloatArray
    y: FloatArray
    values: ComplexArray
    frequency_hz: float
    modes_used: int
    error_estimate: float
    tolerance: float
    reaction: ComplexArray | None = None

    @property
    def tolerance_met(self) -> bool:
        """Whether the estimated error is as small as was asked for."""
        return self.error_estimate <= self.tolerance


def transfer_fields(
    board: Board,
    *,
    frequency_hz: float | None = None,
    tolerance: float = TOLERANCE,
    model: PlateModel | None = None,
    mode_loss_factors: Sequence[float] = (),
    dtype: type[np.complex128 | np.complex64] = np.complex128,
    allow_unmet: bool = False,
) -> TransferFields:
    """Displacement per newton from each actuator to every image point.

    Parameters
    ----------
    board
        The board; its drive frequency is used unless `frequency_hz` is given.
    tolerance
        Relative L² error asked for.
    model
        `plate_model(board)`, if it is at hand.
    mode_loss_factors
        Loss factors of the lowest modes in place of the plate's, if they were measured.
    dtype
        complex64 halves the memory; computed in double precision all the same.
    allow_unmet
        Hand fields out whose estimated error is above the tolerance, up to `WORST_ESTIMATE`.

    Raises
    ------
    ToleranceError
        The estimated error is above the tolerance.
    ResonanceError
        The plate is undamped and the frequency lies on a mode; names the mode.
    InputError
        Loss factors of modes are given, and the foundation has one that is not the plate's.

    References
    ----------
    Eq. (2)–(6) of the paper, with the load's place restored.
    """
    model = model or plate_model(board)
    loads = actuator_loads(board)
    own_loss = board.foundation.total_loss_factor if board.foundation else board.section.loss_factor
    if mode_loss_factors and own_loss != board.section.loss_factor:
        raise InputError(
            "mode_loss_factors",
            list(mode_loss_factors),
            "none, where plate and foundation lose unlike shares: modes have one loss factor",
        )
    response = _respond(board, loads, model, frequency_hz, tolerance, allow_unmet=allow_unmet)
    frequency = response.frequency_hz
    values = response.values
    if len(mode_loss_factors):
        losses = np.asarray(mode_loss_factors, dtype=np.float64)
        shapes = model.modes(losses.size, loads, board.x, board.y)
        plate = np.full(losses.size, board.section.loss_factor)
        values = values + shapes.steady(frequency, losses) - shapes.steady(frequency, plate)
    return TransferFields(
        board.x,
        board.y,
        values.astype(dtype, copy=False),
        frequency,
        response.modes_used,
        response.error_estimate,
        tolerance,
    )


def target_field(
    board: Board,
    target_mm: tuple[float, float],
    *,
    frequency_hz: float | None = None,
    tolerance: float = TOLERANCE,
    model: PlateModel | None = None,
    allow_unmet: bool = False,
) -> Response:
    """Field of one unit load of the actuators' kind at a place, with nothing added there.

    Raises
    ------
    InputError
        The place is not on the board.
    ToleranceError
        The estimated error is above the tolerance; `allow_unmet` lets some pass.
    """
    return target_fields(
        board,
        [target_mm],
        frequency_hz=frequency_hz,
        tolerance=tolerance,
        model=model,
        allow_unmet=allow_unmet,
    )


def target_fields(
    board: Board,
    targets_mm: Sequence[tuple[float, float]],
    *,
    frequency_hz: float | None = None,
    tolerance: float = TOLERANCE,
    model: PlateModel | None = None,
    allow_unmet: bool = False,
) -> Response:
    """The same for several places at once, shape (places, nx, ny).

    Nothing can vibrate on a clamped screw: a place there means the nearest one beside it.

    Raises
    ------
    InputError
        A place is not on the board.
    """
    radius = board.magnet.radius if board.magnet else 0.0
    places = [off_screws(board, place, radius) for place in targets_mm]
    return disc_fields(
        board,
        places,
        radius,
        frequency_hz=frequency_hz,
        tolerance=tolerance,
        model=model,
        allow_unmet=allow_unmet,
    )


def disc_fields(
    board: Board,
    places_mm: Sequence[tuple[float, float]],
    radius: float,
    *,
    frequency_hz: float | None = None,
    tolerance: float = TOLERANCE,
    model: PlateModel | None = None,
    allow_unmet: bool = False,
) -> Response:
    """Fields of one newton spread over a disc (m) at each of several places, such as a finger's.

    A place in a corner that is rounded off means the nearest one on the plate.

    Raises
    ------
    InputError
        A place is not on the board.
    """
    places = [_out_of_corner(board, *check_target(board, place)) for place in places_mm]
    loads = [Load(*place, radius) for place in places]
    model = model or plate_model(board)
    return _respond(board, loads, model, frequency_hz, tolerance, allow_unmet=allow_unmet)


def fields_of_loads(
    board: Board,
    loads: Sequence[Load],
    *,
    tolerance: float = TOLERANCE,
    model: PlateModel | None = None,
    allow_unmet: bool = False,
) -> Response:
    """Fields of any unit loads at the board's own frequency, shape (loads, nx, ny)."""
    model = model or plate_model(board)
    return _respond(board, loads, model, None, tolerance, allow_unmet=allow_unmet)


def actuator_loads(board: Board) -> list[Load]:
    """A unit load per actuator: its magnet's disc, or a point."""
    return [_load(board, *actuator.at) for actuator in board.actuators]


def check_target(
    board: Board, target_mm: tuple[float, float], argument: str = "target_mm"
) -> tuple[float, float]:
    """A target in metres, if it is on the board; `argument` is what it came as."""
    x, y = target_mm[0] * MM, target_mm[1] * MM
    if not board.contains(x, y):
        half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
        raise ArgumentError(
            argument,
            f"{target_mm[0]:g},{target_mm[1]:g}",
            f"a place on the board in mm: |x| up to {half_x:g}, |y| up to {half_y:g}",
        )
    return x, y


def off_screws(
    board: Board, place_mm: tuple[float, float], radius: float = 0.0
) -> tuple[float, float]:
    """A place (mm), or, if a disc of a radius (m) there lies on a clamped screw, one beside it."""
    for screw in board.screws:
        offset = np.array(place_mm) * MM - screw.at
        apart = float(np.hypot(*offset))
        if screw.support != "clamped" or not apart + radius <= screw.radius:
            continue
        # In the middle of a screw every direction is as near: inwards there is plate for certain.
        ahead = offset if apart > 0.0 else -np.array(screw.at)
        ahead = ahead if np.hypot(*ahead) > 0.0 else np.array((1.0, 0.0))
        found = np.array(screw.at) + OFF_A_SCREW * screw.radius * ahead / np.hypot(*ahead)
        if board.contains(*found):
            return float(found[0] / MM), float(found[1] / MM)
    return place_mm


def _out_of_corner(board: Board, x: float, y: float) -> tuple[float, float]:
    """A place (m), or, if the corner there is rounded off, the nearest on the arc."""
    radius = board.plate.corner_radius
    beyond = np.maximum(np.abs((x, y)) - (np.array(board.plate.size) / 2.0 - radius), 0.0)
    away = float(np.hypot(*beyond))
    if away <= radius or not np.all(beyond > 0.0):
        return x, y
    onto = np.sign((x, y)) * (np.abs((x, y)) - beyond * (1.0 - radius / away))
    return float(onto[0]), float(onto[1])


def _respond(
    board: Board,
    loads: Sequence[Load],
    model: PlateModel,
    frequency_hz: float | None,
    tolerance: float,
    *,
    allow_unmet: bool,
) -> Response:
    """Fields on the board's image points, at its own frequency unless another is given."""
    frequency = board.drive.frequency_hz if frequency_hz is None else frequency_hz
    response = model.respond(
        loads, frequency_hz=frequency, x=board.x, y=board.y, tolerance=tolerance
    )
    _check(board, response, allow_unmet=allow_unmet)
    return response


def _check(board: Board, response: Response, *, allow_unmet: bool) -> None:
    """Refuse fields that are not exact enough, and name the features that are likely to blame."""
    if not response.tolerance_met:
        check_estimate(
            response.error_estimate,
            response.tolerance,
            allow_unmet=allow_unmet,
            closest=closest(board),
        )


def _load(board: Board, x: float, y: float) -> Load:
    return Load(x, y, board.magnet.radius if board.magnet else 0.0)
