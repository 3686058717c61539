"""How large a basis a plate needs: from its wavelength, its proportions and the tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.cost import Cost
from chladni.sim.plate.geometry import PlateGeometry

FloatArray = NDArray[np.float64]

MOST_VALUES = 1 << 26
"""Of circle functions on grids that are kept, half a gigabyte; more are worked out each time."""
LEVELS = 7
"""Sizes that are tried, each with about four more polynomials along the short side."""
BASE, STEP = 10, 4
ASPECT_POWER = 0.6
"""A long side needs more polynomials than the short one, but the features on it are as large."""
LONGEST_FACTOR = 4.0
WAVES = 0.55
"""Polynomials per k·L: π per wavelength resolves a wave, and 0.55 · 2π = 3.5."""
DECAY_SHARE = 0.5
"""Of a decaying field's rate that counts as a wave number: it has no zeros to follow. On a pad with
16 magnets estimates come to a fifth of the tolerance, as they do without a foundation."""
LARGE, LARGE_POWER = 20.0, 0.75
"""Decay lengths along the short side from which each level needs more polynomials, and with which
power: at 46 lengths 46 polynomials leave 0.3 %, at 19 lengths 24 do (16 magnets on 0.1 mm)."""
PER_RADIUS = 6.5
"""Degrees of a polynomial per radius of a disc along a half side, whose product with functions on
that disc is integrated: with 4.9 of them 82 polynomials on 150 mm, discs of 3 mm, left 1 %, with
5.7 and more 0.1 %."""
MOST_ORDER = 40
"""Highest angular order on a circle: 10 µm between a screw and a magnet take 37 for 1e-3."""
MORE_CROWDED = 2.5
"""Powers of ten of a crowded circle's field that are followed beyond its level."""
CROWDED = 1.5
"""Decay per order from which a circle needs no more orders than any other."""
BACK_AND_FORTH = 1.4
"""What an order does to the board decays that many times as fast as what neighbours do to it (twice
were it only sent back to them); seen on crowded boards, 0.55 per order where decay is 0.37."""
POINTS_PER_DISC = 450
LEAST_BYTES = 1e8
FEATURELESS = 2
"""A plate without circles converges so fast that two levels fewer do."""


@dataclass(frozen=True)
class Resolution:
    """How many functions a basis has.

    Parameters
    ----------
    nx, ny
        Polynomials along x and y.
    rim_orders, inclusion_orders, inclusion_bubbles
        Highest angular order of the functions on each circle (circles/functions.py).
    crowded
        What neighbours may leave of a circle's field: circles near others get higher orders for it
        (resolution.py); 1 for none.
    """

    nx: int
    ny: int
    rim_orders: int = 2
    inclusion_orders: int = 6
    inclusion_bubbles: int = 4
    crowded: float = 1.0


def resolution_for(
    geometry: PlateGeometry, wave_number: float, level: int, orders: int | None = None
) -> Resolution:
    """A basis for waves of up to `wave_number` (rad/m).

    The larger, the higher `level` is; functions on circles may have a level of their own.
    """
    orders = level if orders is None else orders
    sides = np.array([geometry.width, geometry.length])
    own = (BASE + STEP * level) * max(1.0, decay_lengths(geometry) / LARGE) ** LARGE_POWER
    counts = np.ceil(WAVES * wave_number * sides + stretch(geometry) * own)
    nx, ny = (2 * round(float(count) / 2.0) for count in counts)
    return Resolution(
        nx=nx,
        ny=ny,
        rim_orders=3 if orders < 4 else 4,
        inclusion_orders=4 + orders,
        inclusion_bubbles=2 + orders,
        crowded=10.0 ** -(orders + MORE_CROWDED),
    )


def area_points(geometry: PlateGeometry, resolution: Resolution) -> tuple[int, int]:
    """Gauss points along x and y for products of functions over the plate; even numbers.

    N points integrate up to degree 2N − 1: polynomials' own, and those of functions on small discs.
    """
    smallest = min((own.radius for own in geometry.inclusions), default=np.inf)
    x, y = (
        2 * max(3 * n // 2 + 15, int(np.ceil((n + PER_RADIUS * side / smallest) / 4.0)))
        for n, side in (
            (resolution.nx, geometry.width),
            (resolution.ny, geometry.length),
        )
    )
    return x, y


def stretch(geometry: PlateGeometry) -> FloatArray:
    """How many times as many polynomials as the short side each side needs, along x and y."""
    sides = np.array([geometry.width, geometry.length])
    return np.asarray(np.minimum((sides / sides.min()) ** ASPECT_POWER, LONGEST_FACTOR))


def crowding(geometry: PlateGeometry) -> FloatArray:
    """Decay per angular order of what neighbours do to each circle: rims first, then inclusions.

    The field that comes to a circle of radius R is smooth up to a place in the nearest neighbour,
    at a distance s from the circle's centre, so its order m is as small as (s/R)^−m. For another
    circle that place is the limit point of the two circles, for an edge that of the circle and its
    mirror image, for a point the point itself. The result is the least ln(s/R), shape (circles,).
    """
    rims = [(r.x, r.y, r.radius) for r in geometry.rims]
    circles = np.array(rims + [(i.x, i.y, i.radius) for i in geometry.inclusions]).reshape(-1, 3)
    points = np.array([(p.x, p.y, 0.0) for p in geometry.points]).reshape(-1, 3)
    others = np.concatenate((circles, points))
    result = np.full(len(circles), np.inf)
    half = np.array([geometry.width, geometry.length]) / 2.0
    for k, (x, y, radius) in enumerate(circles):
        apart = np.hypot(others[:, 0] - x, others[:, 1] - y)
        to_edges = np.concatenate((half - np.array((x, y)), half + np.array((x, y))))
        apart = np.concatenate((np.delete(apart, k), 2.0 * to_edges))
        radii = np.concatenate((np.delete(others[:, 2], k), np.full(4, radius)))
        middle = (apart**2 + radius**2 - radii**2) / (2.0 * apart)
        reach = middle + np.sqrt(np.maximum(middle**2 - radius**2, 0.0))
        result[k] = np.log(np.maximum(np.min(reach) / radius, 1.0))
    return result


def left_beside(decay: float) -> float:
    """What the orders beyond the last one do, as so many times what the last one does."""
    ratio = np.exp(-BACK_AND_FORTH * decay)
    return float(ratio / (1.0 - ratio)) if ratio < 1.0 else np.inf


def order_beside(decay: float, left: float) -> int:
    """The order after which neighbours leave a share `left` of a circle's field, at most."""
    if decay > CROWDED:
        return 0
    orders = np.log(1.0 / left) / (BACK_AND_FORTH * max(decay, 1e-9)) + 0.5
    return int(min(np.ceil(orders), MOST_ORDER)) if left < 1.0 else 0


def first_level(geometry: PlateGeometry, tolerance: float) -> int:
    """The level that usually meets a tolerance: a factor of ten per level from 1e-1 on."""
    level = int(np.ceil(-np.log10(max(tolerance, 1e-12)) - 0.01)) - 1
    if not (geometry.rims or geometry.inclusions or geometry.points):
        level -= FEATURELESS
    return int(min(max(level, 0), LEVELS - 1))


def wave_number(geometry: PlateGeometry, omega: float) -> float:
    """Bending wave number (ρhω²/D)^(1/4) of the endless plate, rad/m.

    On a stiff foundation a share of (k/D)^(1/4), by which fields decay.
    """
    waves = (geometry.areal_mass * omega**2 / geometry.bending_stiffness) ** 0.25
    return float(max(waves, DECAY_SHARE * decay_rate(geometry)))


def decay_rate(geometry: PlateGeometry) -> float:
    """(k/D)^(1/4), rad/m."""
    layer = geometry.foundation
    stiffest = max((1.0, *(ratio for _, _, ratio in layer.patches))) if layer else 0.0
    foundation = layer.stiffness * stiffest if layer else 0.0
    return float((foundation / geometry.bending_stiffness) ** 0.25)


def decay_lengths(geometry: PlateGeometry) -> float:
    """How many of them the short side has; 0 without circles, whose fields are smooth."""
    if not (geometry.rims or geometry.inclusions):
        return 0.0
    return min(geometry.width, geometry.length) * decay_rate(geometry)


def wave_number_of_mode(geometry: PlateGeometry, count: int) -> float:
    """Wave number by which a plate has about `count` modes: Weyl's law, A k²/(4π) = count."""
    area = geometry.width * geometry.length
    return float(np.sqrt(4.0 * np.pi * count / area))


def least_size(geometry: PlateGeometry, resolution: Resolution) -> int:
    """How many functions a basis has at least: crowded circles bring more."""
    per_rim = 2 * (2 * resolution.rim_orders + 1)
    per_disc = 2 * (2 * resolution.inclusion_orders + 1) + 2 * resolution.inclusion_bubbles + 1
    circles = per_rim * len(geometry.rims) + per_disc * len(geometry.inclusions)
    return resolution.nx * resolution.ny + circles + len(geometry.points)


def cost_of(
    geometry: PlateGeometry, resolution: Resolution, classes: int, points: int, size: int
) -> Cost:
    """What solving a plate costs, in a basis of `size` functions and that many parity classes.

    Measured on one core from 1,800 to 6,000 functions: matrices of seven and a half times the
    basis squared, three copies of its functions at the points of area and discs, and one at the
    points of the image.
    """
    on_circles = max(size - resolution.nx * resolution.ny, 0)
    along_x, along_y = area_points(geometry, resolution)
    area = along_x * along_y / classes
    discs = POINTS_PER_DISC * len(geometry.inclusions) / classes
    sampled = area * on_circles + discs * size
    image = min(points / classes * on_circles, MOST_VALUES)
    matrices = size**2 / classes
    values = 7.5 * matrices + 3.0 * sampled + image
    # Beyond what is kept, functions are worked out once a class.
    read = points / classes * on_circles
    read *= classes if read > MOST_VALUES else 1
    seconds = 1.5e-10 * matrices * size / classes + 5e-8 * sampled + 2e-8 * read
    kinds = {
        "screws": len(geometry.rims),
        "magnets, glued masses and holes": len(geometry.inclusions),
    }
    if on_circles > resolution.nx * resolution.ny:
        most = max(kinds, key=lambda kind: kinds[kind])
        lower = f"the number of {most} ({kinds[most]}), or ask for a looser tolerance"
    else:
        lower = "drive.frequency_hz, or make the plate thicker or smaller (plate.thickness_mm)"
    return Cost(f"a plate of {size:,} functions", 8.0 * values + LEAST_BYTES, seconds, lower)
