"""Argyris triangles: C1 piecewise quintics on a plate's mesh, with NumPy and SciPy only.

The textbook Argyris element makes the curvature single-valued at every vertex. That is right where
the plate is uniform but locks where bending moments, not curvatures, are continuous (the rim of a
stiff disc) and where a clamped or supported edge turns. So every triangle starts with its own
curvatures at its vertices. At ordinary vertices they are then shared; at the others they are only
tied by what C1 continuity and the support imply: over an edge with tangent t, the jump of H t (H
the Hessian) vanishes.
"""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.spatial import cKDTree
from scipy.special import roots_jacobi

from plate_fem.mesh import BoolArray, FloatArray, IntArray, PlateMesh

HESSIAN = ((2, 0), (1, 1), (0, 2))
"""Derivative orders of w_xx, w_xy and w_yy."""

_POWERS = np.array([(i, n - i) for n in range(6) for i in range(n, -1, -1)])


def _monomials(points: FloatArray, dx: int, dy: int) -> FloatArray:
    """Return a derivative of the 21 monomials of degree 5 at local points, last axis added."""
    factor = np.ones(len(_POWERS))
    for order, power in ((dx, _POWERS[:, 0]), (dy, _POWERS[:, 1])):
        for k in range(order):
            factor *= np.maximum(power - k, 0)
    left = np.maximum(_POWERS - (dx, dy), 0)
    exponents = np.arange(6)
    x, y = (points[..., k, None] ** exponents for k in range(2))
    return np.asarray(factor * x[..., left[:, 0]] * y[..., left[:, 1]])


def _triangle_rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Return barycentric points and weights (sum 1), exact to degree 2 count - 1."""
    across, across_weight = roots_jacobi(count, 0.0, 0.0)
    along, along_weight = roots_jacobi(count, 1.0, 0.0)
    u = 0.5 * (1.0 + along[:, None]) + 0.0 * across
    v = (1.0 - u) * 0.5 * (1.0 + across)
    weight = np.outer(along_weight, across_weight).ravel()
    points = np.stack((1.0 - u - v, u, v), axis=-1).reshape(-1, 3)
    return points, weight / np.sum(weight)


class ArgyrisSpace:
    """Deflections of a plate that are C1, quintic on each triangle, and obey its supports.

    Parameters
    ----------
    mesh
        Mesh; the rims of its holes are clamped.
    stiffness
        Bending stiffness of each triangle, only compared for equality.
    supported
        Whether the outer edges are simply supported, or free.
    """

    def __init__(self, mesh: PlateMesh, stiffness: FloatArray, supported: bool) -> None:
        self.mesh = mesh
        # Lengths are in units near the element size, so that the unknowns are of like magnitude.
        self._unit = 0.01 * max(mesh.width, mesh.height)
        self._points = mesh.points / self._unit
        corners = self._points[mesh.triangles]
        self._centres = np.mean(corners, axis=1)
        side = corners[:, 1:] - corners[:, :1]
        twice_area = side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0]
        self._scales = np.sqrt(twice_area)
        self._local = (corners - self._centres[:, None]) / self._scales[:, None, None]
        self._tree = cKDTree(self._centres)
        self._number_edges()
        self._basis = self._basis_functions()
        self._transform = self._conforming_transform(stiffness, supported)

    def _number_edges(self) -> None:
        """Give the edges numbers; note each one's triangles, ends and unit tangent."""
        pairs = np.sort(self.mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        ends, numbers = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
        self._triangle_edges = numbers.reshape(-1, 3)
        self._edge_ends = ends
        tangent = self._points[ends[:, 1]] - self._points[ends[:, 0]]
        self._tangents = tangent / np.hypot(tangent[:, 0], tangent[:, 1])[:, None]

    def _basis_functions(self) -> FloatArray:
        """Return monomial coefficients (triangle, monomial, unknown) of the basis functions.

        Each triangle's unknowns: w, w_x, w_y at its corners; w_xx, w_xy, w_yy at its corners;
        the normal slope at its edges' midpoints.
        """
        count = len(self._local)
        system = np.empty((count, 21, 21))
        for corner in range(3):
            for row, (dx, dy) in enumerate(((0, 0), (1, 0), (0, 1))):
                system[:, 3 * corner + row] = _monomials(self._local[:, corner], dx, dy)
            for row, (dx, dy) in enumerate(HESSIAN):
                system[:, 9 + 3 * corner + row] = _monomials(self._local[:, corner], dx, dy)
            middle = 0.5 * (self._local[:, corner] + self._local[:, (corner + 1) % 3])
            tangent = self._tangents[self._triangle_edges[:, corner]]
            system[:, 18 + corner] = tangent[:, 1:] * _monomials(middle, 1, 0) - tangent[
                :, :1
            ] * _monomials(middle, 0, 1)
        order = np.array([0, 1, 1] * 3 + [2] * 9 + [1] * 3)
        scale = self._scales[:, None] ** order
        return np.asarray(np.linalg.inv(system) * scale[:, None, :])

    def _numbering(self) -> IntArray:
        """Return the numbers of each triangle's unknowns when curvatures are not shared."""
        triangles = self.mesh.triangles
        nodal = (3 * triangles[:, :, None] + np.arange(3)).reshape(-1, 9)
        start = 3 * len(self._points)
        edge = start + self._triangle_edges
        start += len(self._edge_ends)
        curvature = start + np.arange(9 * len(triangles)).reshape(-1, 9)
        return np.hstack((nodal, curvature, edge))

    def assembled(
        self,
        derivatives: Sequence[tuple[int, int]],
        form: FloatArray,
        factor: FloatArray,
        rule: int,
    ) -> csc_array:
        """Return the symmetric matrix of a bilinear form.

        Parameters
        ----------
        derivatives
            Orders along x and y of the derivatives in the form, all of the same total order.
        form
            Symmetric matrix that couples these derivatives.
        factor
            Factor of each triangle.
        rule
            Gauss points per direction.

        Returns
        -------
        csc_array
            The integral of factor * (derivatives of v) . form (derivatives of u) over the plate.
        """
        barycentric, share = _triangle_rule(rule)
        local = np.einsum("qc,tcx->tqx", barycentric, self._local)
        values = np.stack(
            [
                (_monomials(local, dx, dy) @ self._basis) / self._scales[:, None, None] ** (dx + dy)
                for dx, dy in derivatives
            ],
            axis=2,
        )
        flat = values.reshape(len(values), -1, 21)
        formed = np.einsum("q,de,tqej->tqdj", share, form, values).reshape(flat.shape)
        weight = factor * 0.5 * self._scales**2 * self._unit ** (2 - 2 * sum(derivatives[0]))
        blocks = weight[:, None, None] * (flat.transpose(0, 2, 1) @ formed)
        rows = np.broadcast_to(self._numbering()[:, :, None], blocks.shape)
        columns = rows.transpose(0, 2, 1)
        size = self._transform.shape[0]
        entries = (blocks.ravel(), (rows.ravel(), columns.ravel()))
        broken = coo_array(entries, shape=(size, size)).tocsr()
        matrix = self._transform.T @ broken @ self._transform
        return csc_array(0.5 * (matrix + matrix.T))

    def _supports(self, supported: bool) -> tuple[IntArray, BoolArray]:
        """Return the supported boundary edges and whether each of them is clamped."""
        uses = np.bincount(self._triangle_edges.ravel())
        boundary = np.flatnonzero(uses == 1)
        middle = np.mean(self.mesh.points[self._edge_ends[boundary]], axis=1)
        half = 0.5 * np.array([self.mesh.width, self.mesh.height])
        clamped = np.all(np.abs(middle) < half * (1.0 - 1e-9), axis=1)
        keep = clamped | supported
        return boundary[keep], clamped[keep]

    def _conforming_transform(self, stiffness: FloatArray, supported: bool) -> csr_array:
        """Return the matrix from the independent unknowns to the unshared ones."""
        count = len(self._points)
        triangles = self.mesh.triangles
        edges, clamped = self._supports(supported)
        support = dict(zip(edges.tolist(), clamped.tolist(), strict=True))
        stiffest, softest = np.zeros(count), np.full(count, np.inf)
        np.maximum.at(stiffest, triangles, stiffness[:, None])
        np.minimum.at(softest, triangles, stiffness[:, None])
        special = stiffest > softest
        special[self._edge_ends[edges]] = True

        # Ordinary vertices: six unknowns each, curvatures shared.
        ordinary = np.flatnonzero(~special)
        first = np.full(count, -1, dtype=np.int64)
        first[ordinary] = 6 * np.arange(len(ordinary))
        numbering = self._numbering()
        triangle, corner = np.nonzero(~special[triangles])
        slot = numbering[triangle[:, None], 9 + 3 * corner[:, None] + np.arange(3)]
        start = first[triangles[triangle, corner]][:, None]
        rows = [(3 * ordinary[:, None] + np.arange(3)).ravel(), slot.ravel()]
        columns = [
            (first[ordinary][:, None] + np.arange(3)).ravel(),
            (start + np.arange(3, 6)).ravel(),
        ]
        size = 6 * len(ordinary)
        free = np.setdiff1d(np.arange(len(self._edge_ends)), edges[clamped])
        rows.append(3 * count + free)
        columns.append(size + np.arange(len(free)))
        size += len(free)
        values = [np.ones(len(row)) for row in rows]

        # Special vertices: an orthonormal basis of what continuity and support allow.
        triangle, corner = np.nonzero(special[triangles])
        order = np.argsort(triangles[triangle, corner], kind="stable")
        triangle, corner = triangle[order], corner[order]
        vertices, starts = np.unique(triangles[triangle, corner], return_index=True)
        ends = np.append(starts, len(triangle))[1:]
        for vertex, start_at, end_at in zip(vertices, starts, ends, strict=True):
            fan, at = triangle[start_at:end_at], corner[start_at:end_at]
            basis = self._vertex_basis(int(vertex), fan, support)
            slots = numbering[fan[:, None], 9 + 3 * at[:, None] + np.arange(3)].ravel()
            slots = np.concatenate((3 * vertex + np.arange(3), slots))
            rows.append(np.repeat(slots, basis.shape[1]))
            columns.append(np.tile(size + np.arange(basis.shape[1]), len(slots)))
            values.append(basis.ravel())
            size += basis.shape[1]
        total = 3 * count + len(self._edge_ends) + 9 * len(triangles)
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return coo_array(entries, shape=(total, size)).tocsr()

    def _vertex_basis(self, vertex: int, fan: IntArray, support: dict[int, bool]) -> FloatArray:
        """Return a basis of a vertex's w, w_x, w_y and one Hessian per triangle around it."""
        beside: dict[int, list[int]] = {}
        for position, triangle in enumerate(fan):
            for edge in self._triangle_edges[triangle].tolist():
                if vertex in self._edge_ends[edge]:
                    beside.setdefault(edge, []).append(position)
        conditions = []
        for edge, sides in beside.items():
            tangent = self._tangents[edge]
            x, y = tangent
            apply = np.array([[x, y, 0.0], [0.0, x, y]])
            rows = np.zeros((5, 3 + 3 * len(fan)))
            hessian = rows[3:, 3:].reshape(2, len(fan), 3)
            if len(sides) == 2:
                hessian[:, sides[0]] = apply
                hessian[:, sides[1]] = -apply
            elif edge in support:
                rows[0, 0] = 1.0
                rows[1, 1:3] = tangent
                hessian[0, sides[0]] = tangent @ apply
                if support[edge]:
                    rows[2, 1:3] = (y, -x)
                    hessian[1, sides[0]] = np.array([y, -x]) @ apply
            conditions.append(rows)
        _, singular, right = np.linalg.svd(np.vstack(conditions))
        return np.asarray(right[np.count_nonzero(singular > 1e-9) :].T)

    def evaluation(self, points: FloatArray) -> csr_array:
        """Return the matrix from the unknowns to the deflections at points, in metres."""
        row, triangle, at = self._located(points / self._unit)
        values = np.einsum("pm,pmj->pj", _monomials(at, 0, 0), self._basis[triangle])
        entries = (values.ravel(), (np.repeat(row, 21), self._numbering()[triangle].ravel()))
        broken = coo_array(entries, shape=(len(points), self._transform.shape[0]))
        return csr_array(broken.tocsr() @ self._transform)

    def _located(self, points: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Return which points lie in a triangle, in which, and their local coordinates."""
        rows, triangles, local = [], [], []
        todo = np.arange(len(points))
        for candidates in (16, 400):
            _, near = self._tree.query(points[todo], k=np.arange(1, candidates + 1))
            near = np.minimum(near, len(self._centres) - 1)
            offset = self._local[near]
            at = (points[todo][:, None] - self._centres[near]) / self._scales[near][..., None]
            edge = np.roll(offset, -1, axis=2) - offset
            reach = at[:, :, None] - offset
            inside = np.min(edge[..., 0] * reach[..., 1] - edge[..., 1] * reach[..., 0], axis=2)
            best = np.argmax(inside, axis=1)
            every = np.arange(len(todo))
            hit = inside[every, best] > -1e-9
            rows.append(todo[hit])
            triangles.append(near[every, best][hit])
            local.append(at[every, best][hit])
            todo = todo[~hit]
        return np.concatenate(rows), np.concatenate(triangles), np.vstack(local)
