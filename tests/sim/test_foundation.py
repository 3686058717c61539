"""A plate on foam: against shifted frequencies, a double sum, Kelvin functions and elements."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.special import j1, kei

from chladni.sim.board.parts import Edges
from chladni.sim.plate.geometry import FoundationLayer, Inclusion, PlateGeometry, RimSupport
from chladni.sim.plate.loads import Load
from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.parity import ParityBasis, find_mirrors, parity_classes
from chladni.sim.ritz.basis.resolution import Resolution
from chladni.sim.ritz.plate import RitzPlate
from chladni.sim.ritz.solver import Solver
from plate_fem.mesh import Disc, plate_mesh
from plate_fem.plate import ArgyrisPlate, Material
from plate_fem.plate import Inclusion as Added

FREE = PlateGeometry(0.05, 0.07, 0.015, 0.15, 0.38)
FOAM = FoundationLayer(3e7)
SUPPORTED = Edges("simply supported", "simply supported", "simply supported", "simply supported")


def fields(
    plate: RitzPlate, loads: list[Load], x: np.ndarray, y: np.ndarray, hz: float = 160.0
) -> np.ndarray:
    return plate.respond(loads, frequency_hz=hz, x=x, y=y, tolerance=1e-4).values


@pytest.mark.parametrize("with_magnets", [False, True])
def test_uniform_foam_shifts_every_frequency_alike(with_magnets: bool) -> None:
    """ω² + k/ρh, for any plate whose mass is its own; magnets without mass keep it so."""
    discs = (Inclusion(0.01, 0.012, 3e-3, 0.0, 1000.0),) if with_magnets else ()
    bare = dataclasses.replace(FREE, inclusions=discs)
    foam = dataclasses.replace(bare, foundation=FOAM)
    plain, lifted = (RitzPlate(g, 0.0).natural_frequencies(12) for g in (bare, foam))
    expected = np.sqrt(plain**2 + FOAM.stiffness / FREE.areal_mass / (2.0 * np.pi) ** 2)
    assert lifted == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("loss", [0.0, 0.03])
@pytest.mark.parametrize("foam_loss", [0.0, 0.03, 0.2])
def test_a_supported_plate_on_foam_matches_the_double_sum(loss: float, foam_loss: float) -> None:
    """Navier's sum with k(1 + iη′) beside D(1 + iη)κ⁴, for a load off every mirror."""
    k, hz = 3e6, 700.0
    geometry = dataclasses.replace(
        FREE,
        edges=SUPPORTED,
        foundation=FoundationLayer(k, foam_loss),
    )
    x, y = np.linspace(-0.02, 0.02, 9), np.linspace(-0.03, 0.03, 11)
    load = Load(0.007, -0.011, 4e-3)
    found = fields(RitzPlate(geometry, loss), [load], x, y, hz)[0]
    m, n = np.arange(1, 400)[:, None], np.arange(1, 500)[None]
    kx, ky = m * np.pi / FREE.width, n * np.pi / FREE.length
    kappa = np.hypot(kx, ky)
    mean = 2.0 * j1(kappa * load.radius) / (kappa * load.radius)
    stiffness = FREE.bending_stiffness * (1.0 + 1j * loss) * kappa**4 + k * (1.0 + 1j * foam_loss)
    dynamic = stiffness - FREE.areal_mass * (2.0 * np.pi * hz) ** 2

    def along(at: np.ndarray, wave: np.ndarray, side: float) -> np.ndarray:
        return np.sin(wave.ravel()[None] * (at[:, None] + side / 2.0))

    at_x = along(np.array([load.x]), kx, FREE.width)[0]
    at_y = along(np.array([load.y]), ky, FREE.length)[0]
    gain = 4.0 / (FREE.width * FREE.length) * mean * np.outer(at_x, at_y) / dynamic
    exact = along(x, kx, FREE.width) @ gain @ along(y, ky, FREE.length).T
    assert np.abs(found - exact).max() < 3e-5 * np.abs(exact).max()


def test_a_point_force_makes_a_kelvin_function() -> None:
    """w = −F λ²/(2πD) kei(r/λ), λ = (D/k)^¼, ten λ from every edge, far below the cut-off."""
    decay = (FREE.bending_stiffness / FOAM.stiffness) ** 0.25
    side = 20.0 * decay
    geometry = PlateGeometry(side, side, FREE.bending_stiffness, 0.15, 0.38, foundation=FOAM)
    x = decay * np.array([-4.0, -3.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0, 4.0])
    found = fields(RitzPlate(geometry, 0.0), [Load(0.0, 0.0)], x, x, 1.0)[0]
    r = np.maximum(np.hypot(x[:, None], x), 1e-9) / decay
    exact = -(decay**2) / (2.0 * np.pi * FREE.bending_stiffness) * kei(r)
    # Where it is looked at farthest out, edges answer with exp(−(10 + 6)/√2) = 1.2e-5 of it, and a
    # free edge moves about twice as far.
    assert np.abs(found - exact).max() < 5e-5 * exact.max()


SIZE = Resolution(14, 18, 3, 6, 4)


def test_cut_outs_and_strips_add_up_to_the_whole() -> None:
    """Two strips that meet are foam everywhere; mirrors used or not change nothing."""
    magnets = [Inclusion(sx * 0.01, 0.014, 3e-3, 15.0, 1000.0) for sx in (1.0, -1.0)]
    rims = (RimSupport(0.0, -0.03, 1e-3),)
    bare = dataclasses.replace(FREE, inclusions=tuple(magnets), rims=rims)
    half = (-FREE.width / 2.0, FREE.width / 2.0)
    meet = ((*half, -FREE.length / 2.0, -0.01), (*half, -0.01, FREE.length / 2.0))
    whole = FoundationLayer(3e7, 0.1, ((0.01, 0.014, 5e-3), (-0.01, 0.014, 5e-3)))
    strips = dataclasses.replace(whole, strips=meet)
    x, y = np.linspace(-0.02, 0.02, 9), np.linspace(-0.03, 0.03, 11)
    loads = [Load(0.01, 0.014, 3e-3), Load(0.003, -0.004, 3e-3)]
    expected, *others = (
        fields(
            RitzPlate(dataclasses.replace(bare, foundation=layer), 0.02, SIZE, mirrors=mirrors),
            loads,
            x,
            y,
        )
        for layer, mirrors in ((whole, None), (strips, None), (whole, Mirrors(False, False)))
    )
    # Rims make kinks: points of strips step over them, with an error as the third power of their
    # spacing, while those of the whole plate go round them.
    for found, error in zip(others, (5e-5, 1e-9), strict=True):
        assert np.abs(found - expected).max() < error * np.abs(expected).max()


def test_cut_outs_match_finite_elements() -> None:
    """Foam with holes round rigid magnets and one beside them; the mesh follows every circle."""
    material = Material(22e9, 0.15, 1900.0, 2e-4, 0.02)
    bending = 22e9 * 2e-4**3 / (12.0 * (1.0 - 0.15**2))
    foam, centres = 3e7 * (1.0 + 0.15j), ((0.009, 0.004), (-0.008, -0.005))
    rings = [Disc(x, y, r) for r in (5e-3, 3e-3) for x, y in centres] + [Disc(-0.01, 0.012, 3e-3)]
    geometry = PlateGeometry(
        0.04,
        0.04,
        bending,
        0.15,
        1900.0 * 2e-4,
        inclusions=tuple(Inclusion(x, y, 3e-3, 20.0, 1000.0) for x, y in centres),
        foundation=FoundationLayer(
            3e7, 0.15, tuple((d.x, d.y, d.radius) for d in (*rings[:2], rings[4]))
        ),
    )
    loads = [Load(*centres[0], 3e-3), Load(-0.002, 0.008, 3e-3)]
    x, y = np.linspace(-0.018, 0.018, 13), np.linspace(-0.018, 0.018, 13)
    response = RitzPlate(geometry, 0.02).respond(
        loads, frequency_hz=160.0, x=x, y=y, tolerance=5e-3
    )
    px, py = np.meshgrid(x, y, indexing="ij")
    places = np.column_stack((px.ravel(), py.ravel()))
    asked = [((load.x, load.y), load.radius) for load in loads]
    adds = [Added(0.0), Added(0.0), Added(20.0, 1000.0), Added(20.0, 1000.0)]
    found = response.values.reshape(2, -1)
    apart = []
    for h, segments in ((4e-3, 24), (2.5e-3, 48)):
        mesh = plate_mesh(0.04, 0.04, [], rings, h, segments=segments)
        plate = ArgyrisPlate(mesh, material, [*adds, Added(0.0)], foundation=(foam, range(5)))
        exact = plate.responses(asked, 160.0, places)
        apart.append(np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1))
    assert max(apart[1]) < response.error_estimate + max(np.abs(apart[0] - apart[1]))
    assert max(apart[1]) < 1e-3


@pytest.mark.parametrize("at", [-0.021, -0.019, -0.016, 0.0])
def test_a_strip_s_edge_may_go_through_a_cut_out(at: float) -> None:
    """Foam's area, from the energy of a plate that goes down as a whole; segments of a disc."""
    edge, radius, k = -0.018, 4e-3, 3e7
    magnet = Inclusion(at, 0.01, 3e-3, 15.0, 1000.0)
    strip = (-FREE.width / 2.0, edge, -FREE.length / 2.0, FREE.length / 2.0)
    layer = FoundationLayer(k, 0.0, ((at, 0.01, radius),), (strip,))
    geometry = dataclasses.replace(FREE, inclusions=(magnet,), foundation=layer)
    solver = Solver(geometry, Mirrors(False, False), SIZE)
    (parity,) = [ParityBasis(solver.basis, own) for own in parity_classes(solver.mirrors)]
    damped = solver.assembly.damped(parity, solver.assembly.overlap(parity))
    assert damped is not None
    height = np.clip(edge - at, -radius, radius)
    cut = radius**2 * np.arccos(-height / radius) + height * np.sqrt(radius**2 - height**2)
    area = (edge + FREE.width / 2.0) * FREE.length - cut
    # The first polynomial is 1 over the root of the plate's area.
    assert damped.stiffness[0, 0] * FREE.width * FREE.length / k == pytest.approx(area, rel=1e-3)


def test_patches_of_a_supported_plate_match_a_sum_of_sines() -> None:
    """Sines make the plate's energies diagonal, and quadrature that of the foam they lie on."""
    patches = ((-0.02, -0.03, 0.5), (0.02, -0.03, 2.0), (-0.02, 0.03, 3.0), (0.02, 0.03, 0.8))
    layer = FoundationLayer(3e6, 0.1, patches=patches)
    geometry = dataclasses.replace(FREE, edges=SUPPORTED, foundation=layer)
    hz, load = 300.0, Load(0.007, -0.011)
    x, y = np.linspace(-0.02, 0.02, 9), np.linspace(-0.03, 0.03, 11)
    found = fields(RitzPlate(geometry, 0.02), [load], x, y, hz)[0]

    count = 24
    orders = np.arange(1, count + 1)

    def sines(along: np.ndarray, side: float) -> np.ndarray:
        return np.sin(np.outer(along + side / 2.0, orders * np.pi / side))

    axes = [
        ((node + 1.0) / 2.0 - 0.5) * side
        for side in (FREE.width, FREE.length)
        for node in [np.polynomial.legendre.leggauss(80)[0]]
    ]
    weight = np.polynomial.legendre.leggauss(80)[1]
    sx, sy = sines(axes[0], FREE.width), sines(axes[1], FREE.length)
    area = np.outer(weight, weight) * FREE.width * FREE.length / 4.0
    stiffness = layer.stiffness * layer.ratio(*np.meshgrid(*axes, indexing="ij")) * area
    foam = np.einsum("xy,xm,xp,yn,yq->mnpq", stiffness, sx, sx, sy, sy, optimize=True)
    kappa = np.hypot(
        *np.meshgrid(*(orders * np.pi / s for s in (FREE.width, FREE.length)), indexing="ij")
    )
    own = FREE.bending_stiffness * (1.0 + 0.02j) * kappa**4
    own = own - FREE.areal_mass * (2.0 * np.pi * hz) ** 2
    matrix = (1.0 + 0.1j) * foam.reshape(count**2, -1)
    matrix = matrix + np.diag(own.ravel()) * FREE.width * FREE.length / 4.0
    push = np.outer(
        *(
            sines(np.array([at]), side)[0]
            for at, side in zip((load.x, load.y), (FREE.width, FREE.length), strict=True)
        )
    )
    modal = np.linalg.solve(matrix, push.ravel()).reshape(count, count)
    expected = sines(x, FREE.width) @ modal @ sines(y, FREE.length).T
    # The sum of sines lacks 1/N² of the load's own deflection.
    assert np.linalg.norm(found - expected) < 2e-3 * np.linalg.norm(expected)


def test_one_patch_is_a_stiffer_sheet_with_its_cut_outs() -> None:
    """The same ratio everywhere, by points of quadrature and by the plate's own overlap."""
    discs = (Inclusion(0.01, 0.012, 3e-3, 30.0, 1000.0), Inclusion(-0.01, 0.0, 3e-3, 30.0, 1000.0))
    holes = tuple((disc.x, disc.y, 3e-3) for disc in discs)
    x, y = np.linspace(-0.02, 0.02, 9), np.linspace(-0.03, 0.03, 11)
    found = []
    for layer in (
        FoundationLayer(6e7, 0.2, holes),
        FoundationLayer(3e7, 0.2, holes, patches=((0.0, 0.0, 2.0),)),
    ):
        plate = RitzPlate(dataclasses.replace(FREE, inclusions=discs, foundation=layer), 0.02)
        found.append(fields(plate, [Load(0.01, 0.012, 3e-3)], x, y)[0])
    assert np.linalg.norm(found[1] - found[0]) < 1e-3 * np.linalg.norm(found[0])


def test_patches_under_discs_match_points_all_over_the_plate() -> None:
    """The plate as one strip is summed point by point, its discs' kinks with all else."""
    discs = (Inclusion(0.01, 0.012, 3e-3, 30.0, 50.0), Inclusion(-0.01, 0.0, 3e-3, 30.0, 50.0))
    patches = ((-0.02, -0.03, 0.5), (0.02, -0.03, 2.0), (-0.02, 0.03, 3.0), (0.02, 0.03, 0.8))
    layer = FoundationLayer(2e7, 0.2, patches=patches)
    strip = (-FREE.width / 2.0, FREE.width / 2.0, -FREE.length / 2.0, FREE.length / 2.0)
    x, y = np.linspace(-0.02, 0.02, 9), np.linspace(-0.03, 0.03, 11)
    loads = [Load(0.01, 0.012, 3e-3), Load(-0.006, 0.002)]
    found = []
    for foam in (layer, dataclasses.replace(layer, strips=(strip,))):
        plate = RitzPlate(dataclasses.replace(FREE, inclusions=discs, foundation=foam), 0.02)
        found.append(fields(plate, loads, x, y))
    # Points of a product rule sum kinks to 3e-6. Discs on even foam would be 2e-2 off or more.
    assert np.linalg.norm(np.subtract(*found)) < 1e-5 * np.linalg.norm(found[0])


def test_patches_have_the_mirrors_that_they_lie_in() -> None:
    def mirrors(*patches: tuple[float, float, float]) -> Mirrors:
        return find_mirrors(
            dataclasses.replace(FREE, foundation=FoundationLayer(3e7, patches=patches))
        )

    assert mirrors((0.01, 0.0, 2.0), (-0.01, 0.0, 2.0)) == Mirrors(x=True, y=True)
    assert mirrors((0.01, 0.0, 2.0), (-0.01, 0.0, 1.5)) == Mirrors(x=False, y=True)
    assert mirrors((0.0, 0.02, 2.0)) == Mirrors(x=True, y=False)
