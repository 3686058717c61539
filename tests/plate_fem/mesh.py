"""Triangle meshes of a rectangular plate that conform to circular holes and inclusions.

Pure NumPy and SciPy: fixed points on the circles and the outer edges, spring-relaxed points
elsewhere, one Delaunay triangulation. Circles become polygons of the same area.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay, cKDTree

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

PLATE_REGION = -1
"""Region label of triangles that lie in no inclusion."""


@dataclass(frozen=True)
class Disc:
    """A disc in the plate's plane.

    Attributes
    ----------
    x, y
        Centre, in metres, from the plate's centre.
    radius
        Radius, in metres.
    """

    x: float
    y: float
    radius: float

    def distance(self, points: FloatArray) -> FloatArray:
        """Return the distance of points of shape (n, 2) from the disc's centre."""
        return np.asarray(np.hypot(points[:, 0] - self.x, points[:, 1] - self.y))


@dataclass(frozen=True)
class PlateMesh:
    """A triangulated rectangular plate centred on the origin.

    Attributes
    ----------
    width, height
        Extent along x and y, in metres.
    holes
        Clamped discs that were cut out.
    points
        Vertices, shape (n, 2), in metres.
    triangles
        Counter-clockwise vertex numbers, shape (m, 3).
    regions
        Inclusion number of each triangle, or `PLATE_REGION`.
    """

    width: float
    height: float
    holes: tuple[Disc, ...]
    points: FloatArray
    triangles: IntArray
    regions: IntArray


@dataclass(frozen=True)
class _Sizing:
    """Wanted edge length: fine at circles, growing with the distance from them."""

    circles: tuple[Disc, ...]
    segments: int
    largest: float
    grading: float

    def rim(self, circle: Disc) -> float:
        """Return the edge length on a circle."""
        return 2.0 * np.pi * circle.radius / self.segments

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the wanted edge length at points of shape (n, 2)."""
        size = np.full(len(points), self.largest)
        for circle in self.circles:
            gap = np.abs(circle.distance(points) - circle.radius)
            size = np.minimum(size, self.rim(circle) + self.grading * gap)
        return size


def _ring(circle: Disc, radius: float, segments: int, phase: float) -> FloatArray:
    """Return equally spaced points on a circle concentric with a disc."""
    angle = 2.0 * np.pi * (np.arange(segments) + phase) / segments
    return np.column_stack((circle.x + radius * np.cos(angle), circle.y + radius * np.sin(angle)))


def _circle_points(circle: Disc, is_hole: bool, sizing: _Sizing) -> FloatArray:
    """Return the fixed points that make a circle's polygon part of the triangulation."""
    count = sizing.segments
    step = 2.0 * np.pi / count
    offset = 0.87 * sizing.rim(circle)
    equal_area = circle.radius * np.sqrt(step / np.sin(step))
    rings = [
        _ring(circle, equal_area, count, 0.0),
        _ring(circle, circle.radius + offset, count, 0.5),
    ]
    if is_hole:
        rings.append(np.array([[circle.x, circle.y]]))
    else:
        rings.append(_ring(circle, circle.radius - offset, count, 0.5))
    return np.vstack(rings)


def _graded_line(start: FloatArray, end: FloatArray, sizing: _Sizing) -> FloatArray:
    """Return points from start up to, not including, end, spaced by the wanted edge length."""
    fine = np.linspace(0.0, 1.0, 2001)
    density = 1.0 / sizing(start + fine[:, None] * (end - start))
    total = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    edges = max(2, int(np.ceil(np.linalg.norm(end - start) * total[-1] / (len(fine) - 1))))
    where = np.interp(np.arange(edges) * total[-1] / edges, total, fine)
    return np.asarray(start + where[:, None] * (end - start))


def _scattered(width: float, height: float, sizing: _Sizing) -> FloatArray:
    """Return interior points whose density follows the wanted edge length."""
    rng = np.random.default_rng(20240607)
    pitch = min([sizing.largest, *(sizing.rim(circle) for circle in sizing.circles)])
    x = np.arange(-0.5 * width + pitch, 0.5 * width, pitch)
    y = np.arange(-0.5 * height + pitch, 0.5 * height, pitch * np.sqrt(0.75))
    grid_x, grid_y = np.meshgrid(x, y)
    grid_x[1::2] += 0.5 * pitch
    points = np.column_stack((grid_x.ravel(), grid_y.ravel()))
    keep = rng.random(len(points)) < (pitch / sizing(points)) ** 2
    return np.asarray(points[keep])


def _allowed(
    points: FloatArray, fixed: FloatArray, half: FloatArray, holes: Sequence[Disc], sizing: _Sizing
) -> FloatArray:
    """Return the free points that lie in the plate and not too near a fixed point."""
    near, _ = cKDTree(fixed).query(points)
    size = sizing(points)
    keep = near > 0.6 * size
    keep &= np.all(np.abs(points) < half - 0.4 * size[:, None], axis=1)
    for hole in holes:
        keep &= hole.distance(points) > hole.radius
    return np.asarray(points[keep])


def _relaxed(
    free: FloatArray, fixed: FloatArray, half: FloatArray, sizing: _Sizing, sweeps: int
) -> FloatArray:
    """Move the free points as if the mesh's edges were springs under compression."""
    points = np.vstack((fixed, free))
    for _ in range(sweeps):
        corners = Delaunay(points).simplices
        bars = np.sort(np.vstack((corners[:, :2], corners[:, 1:], corners[:, ::2])), axis=1)
        code = np.unique(bars[:, 0].astype(np.int64) * len(points) + bars[:, 1])
        first, second = code // len(points), code % len(points)
        vector = points[first] - points[second]
        length = np.hypot(vector[:, 0], vector[:, 1])
        wanted = sizing(0.5 * (points[first] + points[second]))
        wanted *= 1.2 * np.sqrt(np.sum(length**2) / np.sum(wanted**2))
        force = (np.maximum(wanted - length, 0.0) / length)[:, None] * vector
        move = np.column_stack(
            [
                np.bincount(first, force[:, k], len(points))
                - np.bincount(second, force[:, k], len(points))
                for k in range(2)
            ]
        )
        points[len(fixed) :] += 0.2 * move[len(fixed) :]
        points = np.clip(points, -half, half)
    return np.asarray(points[len(fixed) :])


def _check_areas(mesh: PlateMesh, inclusions: Sequence[Disc], areas: FloatArray) -> None:
    """Raise if a circle's polygon is not a union of triangles."""
    expected = [np.pi * disc.radius**2 for disc in inclusions]
    for k, outer in enumerate(inclusions):
        # What lies within another disc is its own, smaller one's.
        within = [d for d in inclusions if (d.x, d.y) == (outer.x, outer.y)]
        smaller = [d.radius for d in within if d.radius < outer.radius]
        expected[k] -= np.pi * max(smaller, default=0.0) ** 2
    plate = mesh.width * mesh.height - sum(np.pi * hole.radius**2 for hole in mesh.holes)
    expected.append(plate - sum(expected))
    for region, area in zip([*range(len(inclusions)), PLATE_REGION], expected, strict=True):
        found = float(np.sum(areas[mesh.regions == region]))
        if abs(found - area) > 1e-9 * plate:
            message = f"region {region} has area {found:.9g} m^2, not {area:.9g} m^2"
            raise ValueError(message)


def plate_mesh(
    width: float,
    height: float,
    holes: Sequence[Disc],
    inclusions: Sequence[Disc],
    h: float,
    *,
    segments: int = 32,
    grading: float = 0.4,
    sweeps: int = 40,
) -> PlateMesh:
    """Mesh a rectangular plate, conforming to discs that touch neither each other nor an edge.

    Discs about one centre may lie within each other, the larger ones before the smaller.

    Parameters
    ----------
    width, height
        Extent along x and y, in metres.
    holes
        Discs to cut out.
    inclusions
        Discs whose triangles get their number as region.
    h
        Largest edge length, in metres.
    segments
        Number of edges on each circle.
    grading
        Growth of the edge length per unit distance from a circle.
    sweeps
        Relaxation steps.

    Returns
    -------
    PlateMesh
        The mesh.
    """
    sizing = _Sizing((*holes, *inclusions), segments, h, grading)
    half = 0.5 * np.array([width, height])
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    sides = [_graded_line(corners[k], corners[(k + 1) % 4], sizing) for k in range(4)]
    rims = [_circle_points(disc, True, sizing) for disc in holes]
    rims += [_circle_points(disc, False, sizing) for disc in inclusions]
    fixed = np.vstack((*sides, *rims))
    free = _allowed(_scattered(width, height, sizing), fixed, half, holes, sizing)
    free = _relaxed(free, fixed, half, sizing, sweeps)
    points = np.vstack((fixed, _allowed(free, fixed, half, holes, sizing)))
    triangles = Delaunay(points).simplices.astype(np.int64)

    a, b, c = (points[triangles[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles[twice < 0.0] = triangles[twice < 0.0][:, ::-1]
    centres = (a + b + c) / 3.0
    keep = np.abs(twice) > 1e-12 * width * height
    for hole in holes:
        keep &= hole.distance(centres) > hole.radius
    triangles, centres, areas = triangles[keep], centres[keep], 0.5 * np.abs(twice[keep])
    regions = np.full(len(triangles), PLATE_REGION, dtype=np.int64)
    for number, disc in enumerate(inclusions):
        regions[disc.distance(centres) < disc.radius] = number
    used, renumbered = np.unique(triangles, return_inverse=True)
    mesh = PlateMesh(width, height, tuple(holes), points[used], renumbered.reshape(-1, 3), regions)
    _check_areas(mesh, inclusions, areas)
    return mesh
