"""The plate of a board: its geometry, and the model that solves it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from chladni.sim.board.board import Board
from chladni.sim.board.parts import Mass, Screw
from chladni.sim.plate.geometry import (
    FoundationLayer,
    Inclusion,
    PlateGeometry,
    PointFeature,
    RimSupport,
)
from chladni.sim.plate.response import PlateModel


def plate_model(board: Board, *, more_loss: float = 0.0) -> PlateModel:
    """The plate of a board, ready to be asked for modes and fields; keep it to ask again.

    Parameters
    ----------
    more_loss
        Added to the loss factors of all that bends or gives way.
    """
    # Solvers load half a second of SciPy, and many ask for a board's geometry alone.
    from chladni.sim.navier.plate import SimplySupportedPlate  # noqa: PLC0415
    from chladni.sim.ritz.plate import RitzPlate  # noqa: PLC0415

    plate, section = board.plate, board.section
    own_loss = section.loss_factor + more_loss
    features = (
        board.screws,
        board.pins,
        board.springs,
        board.masses,
        board.holes,
        board.magnet,
        board.foundation,
    )
    if plate.edges.are_all("simply supported") and not any(features):
        return SimplySupportedPlate(
            *plate.size, section.bending_stiffness, section.areal_mass, own_loss
        )
    return RitzPlate(plate_geometry(board).with_more_loss(more_loss), own_loss)


MODES, STILL_HZ = 8, 1.0
"""Of a plate that are looked at; below so much they are rigid motions."""


def first_natural_hz(board: Board, modes_hz: Sequence[float] | None = None) -> float:
    """The lowest frequency at which a board's plate resonates; infinite where none is known.

    Parameters
    ----------
    modes_hz
        Its lowest ones, if they are at hand.
    """
    modes = plate_model(board).natural_frequencies(MODES).tolist() if modes_hz is None else modes_hz
    return min((own for own in modes if own > STILL_HZ), default=np.inf)


def _foundation(board: Board) -> FoundationLayer | None:
    """What the plate lies on, with a hole in it round every actuator if the board has one."""
    foundation = board.foundation
    if foundation is None:
        return None
    return FoundationLayer(
        foundation.total_stiffness,
        foundation.total_loss_factor,
        tuple((*cut.at, cut.radius) for cut in board.all_cut_outs),
        board.foundation_strips,
        tuple((*patch.at, patch.ratio) for patch in foundation.patches),
    )


def plate_geometry(board: Board) -> PlateGeometry:
    """A board's plate with everything that holds it and sits on it.

    A magnet of a known remanence is the cylinder that it is. One without is the paper's: a disc of
    mass on the plate, for which the finite elements that others published stand.
    """
    plate, section, magnet = board.plate, board.section, board.magnet
    discs = [
        Inclusion(
            *actuator.at,
            magnet.radius,
            magnet.areal_mass,
            magnet.stiffness_ratio,
            _tilting(magnet.areal_mass, magnet.height) if magnet.remanence else 0.0,
        )
        for actuator in (board.actuators if magnet else ())
        if magnet
    ]
    discs += [_glued_disc(mass) for mass in board.masses if mass.radius > 0.0]
    discs += [Inclusion(*hole.at, hole.radius, -section.areal_mass, 0.0) for hole in board.holes]
    points = [PointFeature(*pin.at, is_pinned=True) for pin in board.pins]
    points += [
        PointFeature(*spring.at, stiffness=spring.stiffness, loss_factor=spring.loss_factor)
        for spring in board.springs
    ]
    points += [PointFeature(*m.at, mass=m.mass) for m in board.masses if m.radius == 0.0]
    return PlateGeometry(
        *plate.size,
        section.bending_stiffness,
        section.poissons_ratio,
        section.areal_mass,
        rims=tuple(_rim(screw) for screw in board.screws),
        inclusions=tuple(discs),
        points=tuple(points),
        edges=plate.edges,
        corner_radius=plate.corner_radius,
        foundation=_foundation(board),
    )


def _rim(screw: Screw) -> RimSupport:
    return RimSupport(
        *screw.at,
        screw.radius,
        holds_deflection=screw.support != "sprung",
        holds_slope=screw.support == "clamped",
        stiffness=screw.stiffness,
        rotational=screw.rotational_stiffness,
        loss_factor=screw.loss_factor,
    )


def _glued_disc(mass: Mass) -> Inclusion:
    areal = mass.mass / (np.pi * mass.radius**2)
    rotary = _tilting(areal, mass.height)
    return Inclusion(*mass.at, mass.radius, areal, mass.stiffness_ratio, rotary)


def _tilting(areal_mass: float, height: float) -> float:
    """Rotary inertia per area of a cylinder that stands on the plate, kg.

    About its end face it is m (r²/4 + h²/3), and its extent across gives m r²/4 by itself.
    """
    return areal_mass * height**2 / 3.0
