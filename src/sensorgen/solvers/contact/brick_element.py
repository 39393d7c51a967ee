r"""Near-incompressible neo-Hookean bricks: 27 nodes for the displacement, a linear pressure in each.

.. math:: \Pi = \int \tfrac{\mu}{2} (F : F - 3) - \mu \ln J + p (J - 1) - \frac{p^2}{2 \lambda}

The pressure jumps between bricks (Q2 / P1, which does not lock: Boffi and Gastaldi 2002); it and the node in the middle
are condensed, brick by brick.
"""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.contact.bricks import Bricks
from sensorgen.solvers.contact.element import Inner, Law, Tangent, condensed

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_INNER = 13  # of the 27 nodes, the one in the middle
_OUTER = np.delete(np.arange(27), _INNER)
_CHUNK = 64  # bricks at once
_STIFF = 1e6  # in the tangent of an incompressible brick, the pressure's stiffness over mu


def values(s: Real) -> Real:
    """The three functions of a line from -1 to 1, (..., 3), in turn along it."""
    return np.stack([s * (s - 1) / 2, 1 - s**2, s * (s + 1) / 2], axis=-1)


def slopes(s: Real) -> Real:
    """Their derivatives."""
    return np.stack([s - 0.5, -2 * s, s + 0.5], axis=-1)


def gradients(at: Real) -> Real:
    """Derivatives of the 27 functions at the places of a lattice, ``at`` along each axis: (points, 27, 3)."""
    pair = values(at), slopes(at)
    found = [np.einsum("ai,bj,ck->abcijk", *(pair[int(a == axis)] for a in range(3))) for axis in range(3)]
    return np.stack([f.reshape(len(at) ** 3, 27) for f in found], axis=-1)


_CORNERS = np.array([0, 2, 6, 8, 18, 20, 24, 26])


def _shifting(gradient: Real) -> Real:
    """The same with the node in the middle counted from the mean of the corners, so that it goes along with them."""
    found = gradient.copy()
    found[:, _CORNERS] += gradient[:, [_INNER]] / 8
    return found


_GRADIENTS = _shifting(gradients(_POINTS))
_WEIGHT = np.einsum("a,b,c->abc", _WEIGHTS, _WEIGHTS, _WEIGHTS).ravel()
_PRESSURES = np.column_stack([np.ones(27), np.array(list(product(_POINTS, repeat=3)))])
_TURNS = [((i + 1) % 3, (i + 2) % 3) for i in range(3)]


@dataclass(frozen=True)
class BrickMesh:
    """The solid boxes of a cell, with nodes at corners, on edges and faces and within.

    Attributes
    ----------
    bricks : Bricks
        All boxes, air included.
    points_m : (n, 3) array
        Places of the nodes [m].
    boxes : (m, 3) array
        Which box each brick is, along x, y and z.
    nodes : (m, 27) array
        Of each brick.
    lattice : (n, 3) array
        Of each node, its place counted in half bricks along x, y and z.
    """

    bricks: Bricks
    points_m: Real
    boxes: Whole
    nodes: Whole
    lattice: Whole

    def some(self, which: slice) -> "BrickMesh":
        """Some of its bricks, with all nodes."""
        return replace(self, boxes=self.boxes[which], nodes=self.nodes[which])

    def edges_m(self) -> Real:
        """Edges of each brick (m, 3) [m]."""
        return np.column_stack([np.diff(p)[self.boxes[:, a]] for a, p in enumerate(self.bricks.planes_m)])

    @cached_property
    def region(self) -> Whole:
        """Region of each brick."""
        return np.asarray(self.bricks.fill[tuple(self.boxes.T)])


def mesh_of(bricks: Bricks, which: NDArray[np.bool_]) -> BrickMesh:
    """Some of the boxes of a cell, as one mesh."""
    boxes = np.argwhere(which)
    size = 2 * np.array(which.shape) + 1
    corners = 2 * boxes[:, None, :] + np.array(list(product(range(3), repeat=3)))
    flat = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), tuple(size))
    used, nodes = np.unique(flat, return_inverse=True)
    lattice = [np.interp(np.arange(2 * len(p) - 1) / 2, np.arange(len(p)), p) for p in bricks.planes_m]
    places = np.column_stack(np.unravel_index(used, tuple(size)))
    points = np.column_stack([line[k] for line, k in zip(lattice, places.T, strict=True)])
    return BrickMesh(bricks, points, boxes, nodes.reshape(flat.shape), places)


@dataclass(frozen=True)
class BrickElements:
    """All bricks of a mesh, at once."""

    mesh: BrickMesh
    law: Law
    _last: list[Any] = field(default_factory=list, repr=False, compare=False)

    @property
    def points_m(self) -> Real:
        """Places of the nodes [m]."""
        return self.mesh.points_m

    @cached_property
    def _scale(self) -> Real:
        """Derivative of the place in a brick, from -1 to 1, to that in the cell (m, 3) [1/m]."""
        return np.asarray(2 / self.mesh.edges_m())

    @cached_property
    def _weights(self) -> Real:
        """Of each quadrature point (m, 27) [m3]."""
        return np.asarray(self.mesh.edges_m().prod(axis=1)[:, None] / 8 * _WEIGHT)

    @cached_property
    def freedoms(self) -> Whole:
        """Numbers of the 78 displacements of each brick that its neighbours share."""
        return np.asarray((3 * self.mesh.nodes[:, _OUTER, None] + np.arange(3)).reshape(-1, 78))

    def start(self) -> Inner:
        """Unloaded."""
        m = len(self.mesh.nodes)
        return Inner(np.zeros((m, 3)), np.zeros((m, 4)))

    def all_nodes(self, u: Real, inner: Inner) -> Real:
        """Displacements of all nodes (n, 3), those within the bricks among them [m]."""
        found, nodes = u.reshape(-1, 3).copy(), self.mesh.nodes
        found[nodes[:, _INNER]] = inner.bubble + found[nodes[:, _CORNERS]].mean(axis=1)
        return np.asarray(found)

    def _local(self, u: Real, inner: Inner) -> Real:
        """Factors of the 27 functions of each brick (m, 27, 3) [m]."""
        found = u.reshape(-1, 3)[self.mesh.nodes]
        found[:, _INNER] = inner.bubble
        return np.asarray(found)

    def deformation(self, u: Real, inner: Inner) -> Real:
        """F at each quadrature point (m, 27, 3, 3)."""
        moved = np.einsum("qnj,mni->mqij", _GRADIENTS, self._local(u, inner), optimize=True)
        return np.asarray(moved * self._scale[:, None, None, :] + np.eye(3))

    def volume_ratio(self, u: Real, inner: Inner) -> Real:
        """J at each quadrature point (m, 27)."""
        return determinant(self.deformation(u, inner))

    def energy_j_per_m(self, u: Real, inner: Inner) -> float:
        """Energy stored [J]."""
        f = self.deformation(u, inner)
        j, p = determinant(f), inner.pressure @ _PRESSURES.T
        shape = self.law.mu_pa[:, None] * (0.5 * ((f**2).sum((-1, -2)) - 3) - np.log(j))
        held = p * (j - 1) - 0.5 * p**2 * self.law.yielding_per_pa[:, None]
        return float((self._weights * (shape + held)).sum())

    @cached_property
    def _chunks(self) -> "list[tuple[slice, BrickElements]]":
        """The same in pieces that stay near the processor."""
        places = [slice(k, k + _CHUNK) for k in range(0, len(self.mesh.nodes), _CHUNK)]
        return [
            (k, BrickElements(self.mesh.some(k), Law(self.law.mu_pa[k], self.law.yielding_per_pa[k]))) for k in places
        ]

    def tangent(self, u: Real, inner: Inner) -> Tangent:
        """Residual and its derivative at a state whose J is above 0; the last one is kept."""
        if not (self._last and self._last[0] is u and self._last[1] is inner):
            parts = [
                condensed(*some.full(u, Inner(inner.bubble[k], inner.pressure[k])), 78, 4, some.law.mu_pa)
                for k, some in self._chunks
            ]
            found = Tangent(*(np.concatenate([getattr(p, key.name) for p in parts]) for key in fields(Tangent)))
            self._last[:] = [u, inner, found]
        kept: Tangent = self._last[2]
        return kept

    def full(self, u: Real, inner: Inner) -> tuple[Real, Real]:
        """Residual (m, 85) and its derivative: 26 nodes, the one in the middle, the pressure."""
        f, w = self.deformation(u, inner), self._weights
        m = len(w)
        cof, j = cofactor(f), determinant(f)
        mu, p = self.law.mu_pa[:, None], inner.pressure @ _PRESSURES.T
        hydro = p - mu / j
        g = _GRADIENTS.transpose(0, 2, 1).reshape(81, 27)  # (points and directions, nodes)
        stress = (w[..., None, None] * (mu[..., None, None] * f + hydro[..., None, None] * cof)) * self._scale[
            :, None, None, :
        ]
        residual, matrix = np.zeros((m, 85)), np.zeros((m, 85, 85))
        forces = np.matmul(stress.transpose(0, 2, 1, 3).reshape(m, 3, 81), g)
        residual[:, :81] = forces.transpose(0, 2, 1).reshape(m, 81)
        scaled = cof * self._scale[:, None, None, :]
        for i, k in product(range(3), repeat=2):
            if i <= k:
                block = self._block(f, scaled, w * mu, w * mu / j**2, w * hydro, (i, k))
                found = np.matmul(g.T, np.matmul(block, _GRADIENTS.transpose(0, 2, 1)).reshape(m, 81, 27))
                matrix[:, i:81:3, k:81:3] = found
                matrix[:, k:81:3, i:81:3] = found.transpose(0, 2, 1)
        along = np.matmul(_GRADIENTS, scaled.transpose(0, 1, 3, 2)).reshape(m, 27, 81)  # dJ to the displacements
        coupling = np.matmul((along * w[..., None]).transpose(0, 2, 1), _PRESSURES)
        matrix[:, :81, 81:], matrix[:, 81:, :81] = coupling, coupling.transpose(0, 2, 1)
        mass = np.einsum("mq,qi,qk->mik", w, _PRESSURES, _PRESSURES)
        yielding = self.law.yielding_per_pa[:, None]
        matrix[:, 81:, 81:] = -mass * np.maximum(yielding, 1 / (_STIFF * mu))[..., None]
        residual[:, 81:] = (w * (j - 1)) @ _PRESSURES - yielding * np.einsum("mik,mk->mi", mass, inner.pressure)
        turn = np.concatenate([(3 * _OUTER[:, None] + np.arange(3)).ravel(), 3 * _INNER + np.arange(3), range(81, 85)])
        return residual[:, turn], matrix[:, turn[:, None], turn]

    def _block(self, f: Real, scaled: Real, plain: Real, bulk: Real, hydro: Real, pair: tuple[int, int]) -> Real:
        """Weighted derivative of row i of the stress to row k of F, along the brick's own axes (m, 27, 3, 3)."""
        i, k = pair
        scale = self._scale
        found = bulk[..., None, None] * scaled[:, :, i, :, None] * scaled[:, :, k, None, :]
        if i == k:
            found[:, :, range(3), range(3)] += plain[..., None] * scale[:, None] ** 2
            return np.asarray(found)
        rest = 3 - i - k
        sign = 1.0 if _TURNS[i][0] == k else -1.0
        for j in range(3):
            a, b = _TURNS[j]
            found[:, :, j, a] += sign * hydro * f[:, :, rest, b] * (scale[:, j] * scale[:, a])[:, None]
            found[:, :, j, b] -= sign * hydro * f[:, :, rest, a] * (scale[:, j] * scale[:, b])[:, None]
        return np.asarray(found)


def cofactor(f: Real) -> Real:
    """J F^-T of matrices (..., 3, 3)."""
    found = np.empty_like(f)
    for i, j in product(range(3), repeat=2):
        (a, b), (c, d) = _TURNS[i], _TURNS[j]
        found[..., i, j] = f[..., a, c] * f[..., b, d] - f[..., a, d] * f[..., b, c]
    return found


def determinant(f: Real) -> Real:
    """Of matrices (..., 3, 3)."""
    return np.asarray((f[..., 0, :] * cofactor(f)[..., 0, :]).sum(-1))
