"""Whole boards by finite elements: foundation, cut-outs, screws and rigid magnets in one mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from chladni.drives.methods.focus import focus_at
from chladni.drives.problem.problem import solved_board
from chladni.sim.board.board import Board
from chladni.sim.fields.driven import answered
from chladni.sim.fields.magnetic_coupling import couple_fields, couple_loads, magnetic_coupling
from chladni.sim.image import metrics
from plate_fem.mesh import Disc, plate_mesh
from plate_fem.plate import ArgyrisPlate, Inclusion, Material

ComplexArray = npt.NDArray[np.complex128]
FloatArray = npt.NDArray[np.float64]
Place = tuple[float, float]


def element_fields(board: Board, size: float, segments: int) -> tuple[ComplexArray, int]:
    """Displacement per newton of every coil on the image points, and the number of unknowns.

    After the coils' come the fields of `couple_loads`.

    Every circle of the board is in the mesh: the foundation ends where it should.

    Parameters
    ----------
    size
        Largest edge of a triangle, m.
    segments
        Edges round each circle.
    """
    plate, magnet, foundation = board.plate, board.magnet, board.foundation
    assert magnet is not None
    assert foundation is not None
    magnets = [Disc(*actuator.at, magnet.radius) for actuator in board.actuators]
    cuts = [Disc(*cut.at, cut.radius) for cut in board.all_cut_outs]
    # A cut-out of a magnet's own circle is one circle; others lie round or beside a magnet.
    rings = [disc for disc in cuts if disc not in magnets]
    discs = [*rings, *magnets]
    mesh = plate_mesh(
        *plate.size,
        [Disc(*screw.at, screw.radius) for screw in board.screws],
        discs,
        size,
        segments=segments,
    )
    adds = [Inclusion(0.0)] * len(rings)
    # m h²/3 about the glued face, beside the m r²/4 that the disc has by itself.
    turning = magnet.areal_mass * magnet.height**2 / 3.0 if magnet.remanence else 0.0
    adds += [Inclusion(magnet.areal_mass, magnet.stiffness_ratio, turning)] * len(magnets)
    bare = [k for k, disc in enumerate(discs) if _is_bare(disc, cuts)]
    elements = ArgyrisPlate(
        mesh,
        Material(
            plate.youngs_modulus,
            plate.poissons_ratio,
            plate.density,
            plate.thickness,
            plate.loss_factor,
        ),
        adds,
        foundation=(foundation.total_stiffness * (1.0 + 1j * foundation.total_loss_factor), bare),
    )
    points = np.stack(np.meshgrid(board.x, board.y, indexing="ij"), axis=-1).reshape(-1, 2)
    loads = [(actuator.at, magnet.radius) for actuator in board.actuators]
    loads += [((load.x, load.y), load.radius) for load in couple_loads(board)]
    values = elements.responses(loads, board.drive.frequency_hz, points)
    shape = (len(loads), board.x.size, board.y.size)
    return values.reshape(shape), elements.stiffness.shape[0]


def _is_bare(disc: Disc, cuts: list[Disc]) -> bool:
    """Whether a disc lies within a cut-out, so that there is no foundation under it."""
    return any(
        np.hypot(cut.x - disc.x, cut.y - disc.y) + disc.radius <= cut.radius + 1e-9 for cut in cuts
    )


@dataclass(frozen=True)
class Compared:
    """Second fingers (dB) from 12, 16 and 20 mm on, shape (places, 3), on two sets of fields."""

    own: FloatArray
    elements: FloatArray
    unknowns: int


def compared_second_fingers(
    board: Board, places_mm: list[Place], size: float, segments: int
) -> Compared:
    """The drives of `focus` at places, looked at on the model's fields and on the elements'."""
    solved = solved_board(board)
    values, unknowns = element_fields(board, size, segments)
    count = len(board.actuators)
    bare = replace(solved.fields, values=values[:count])
    driven = answered(
        board, bare, magnetic_coupling(board), couple_fields(board, values[:count], values[count:])
    ).values
    discs = metrics.FingertipDiscs(board.x, board.y)
    rows = []
    for place in places_mm:
        at = (place[0] * 1e-3, place[1] * 1e-3)
        disc = metrics.disc_mask(board.x, board.y, at, metrics.FINGERTIP_RADIUS)
        found = focus_at(solved, at, solved.fields.values[:, disc].mean(axis=1))
        assert found is not None
        rows.append(
            [
                discs.second_finger_db(
                    np.tensordot(found.drive, fields, axes=1), at, [12e-3, 16e-3, 20e-3]
                )
                for fields in (solved.fields.values, driven)
            ]
        )
    both = np.array(rows)
    return Compared(both[:, 0], both[:, 1], unknowns)
