"""Random boards against finite elements, which share no code with the plate and are refined once.

A comparison counts as far as two meshes agree: what they differ by is the elements' own error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.sim.board.parts import EdgeKind, Edges
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.plate.geometry import Inclusion, PlateGeometry, RimSupport
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.plate import RitzPlate
from plate_fem.mesh import Disc, plate_mesh
from plate_fem.plate import ArgyrisPlate, Material
from plate_fem.plate import Inclusion as FemInclusion
from soaking import tries

ComplexArray = NDArray[np.complex128]
MESHES = ((6e-3, 32), (5e-3, 64))
"""Size of the elements and segments on a circle. A polygon of 32 sides in place of a screw moves a
board that one screw holds by 2e-4, whatever the elements: so both are refined."""
SEEDS = [seed for seed in range(21) if seed != 15]
"""All of them in bench/stability.py. The mesher loses a sliver of a disc of the fifteenth."""
SCREW, MAGNET = 1.5e-3, 5e-3


@dataclass(frozen=True)
class Scene:
    """A board that elements can model: clamped screws, glued discs, free or supported edges."""

    geometry: PlateGeometry
    material: Material
    loads: list[Load]
    frequency_hz: float

    @property
    def grid(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        x = np.linspace(-0.46, 0.46, 15) * self.geometry.width
        y = np.linspace(-0.46, 0.46, 25) * self.geometry.length
        return x, y


def scene(seed: int) -> Scene:
    """A random board; discs are at least 0.8 mm from each other and from the edges."""
    rng = np.random.default_rng([19, seed])
    width = rng.uniform(0.05, 0.09)
    length = width * rng.uniform(1.0, 2.2)
    thickness = rng.uniform(0.6e-3, 1.6e-3)
    material = Material(rng.uniform(3e9, 40e9), rng.uniform(0.1, 0.4), 1900.0, thickness, 0.03)
    taken: list[tuple[float, float, float]] = []

    def place(radius: float) -> tuple[float, float] | None:
        for _ in range(30):
            x, y = rng.uniform(-0.5, 0.5, 2) * (np.array([width, length]) - 2 * radius - 1.6e-3)
            if all(np.hypot(x - u, y - v) > radius + r + 0.8e-3 for u, v, r in taken):
                taken.append((float(x), float(y), radius))
                return float(x), float(y)
        return None

    screws = [at for _ in range(rng.integers(0, 6)) if (at := place(SCREW))]
    magnets = [at for _ in range(rng.integers(0, 6)) if (at := place(MAGNET))]
    kind: EdgeKind = "simply supported" if rng.random() < 0.5 else "free"
    ratio = float(rng.choice([1.0, 30.0, 1000.0]))
    bending = material.young * thickness**3 / 12.0 / (1.0 - material.poisson**2)
    geometry = PlateGeometry(
        width,
        length,
        bending,
        material.poisson,
        1900.0 * thickness,
        rims=tuple(RimSupport(*at, SCREW) for at in screws),
        inclusions=tuple(Inclusion(*at, MAGNET, 22.5, ratio) for at in magnets),
        edges=Edges(kind, kind, kind, kind),
    )
    loads = [Load(*at, MAGNET) for at in magnets[:2]]
    loads += [Load(*at, 3e-3) for _ in range(2) if (at := place(3e-3))]
    return Scene(geometry, material, loads, float(rng.uniform(50.0, 500.0)))


def by_elements(board: Scene, size: float, segments: int) -> ComplexArray:
    geometry, (x, y) = board.geometry, board.grid
    mesh = plate_mesh(
        geometry.width,
        geometry.length,
        [Disc(r.x, r.y, r.radius) for r in geometry.rims],
        [Disc(i.x, i.y, i.radius) for i in geometry.inclusions],
        size,
        segments=segments,
    )
    elements = ArgyrisPlate(
        mesh,
        board.material,
        [FemInclusion(i.areal_mass, i.stiffness_ratio) for i in geometry.inclusions],
        "free" if geometry.edges.left == "free" else "supported",
    )
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    loads = [((load.x, load.y), load.radius) for load in board.loads]
    found = elements.responses(loads, board.frequency_hz, points)
    return np.asarray(found).reshape(len(loads), x.size, y.size)


def apart(found: ComplexArray, exact: ComplexArray) -> float:
    norms = np.linalg.norm(exact, axis=(1, 2))
    return float(np.max(np.linalg.norm(found - exact, axis=(1, 2)) / norms))


@dataclass(frozen=True)
class Comparison:
    """What two meshes differ by, what ours and the finer differ by, and what ours expects."""

    meshes: float
    error: float
    estimate: float


def compared(seed: int) -> Comparison:
    board = scene(seed)
    x, y = board.grid
    coarse, fine = (by_elements(board, *mesh) for mesh in MESHES)
    found = RitzPlate(board.geometry, 0.03).respond(
        board.loads, frequency_hz=board.frequency_hz, x=x, y=y, tolerance=TOLERANCE
    )
    return Comparison(apart(coarse, fine), apart(found.values, fine), found.error_estimate)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS[: tries(2, 4)])
def test_random_boards_match_finite_elements(seed: int) -> None:
    found = compared(seed)
    assert found.meshes < 0.02
    assert found.error <= found.estimate + found.meshes
