r"""Near-incompressible neo-Hookean triangles: six nodes and a bubble for the displacement, and a linear pressure.

.. math:: \Pi = \int \tfrac{\mu}{2} (F : F - 2) - \mu \ln J + p (J - 1) - \frac{p^2}{2 \lambda}

The pressure jumps between triangles; it and the bubble are condensed, triangle by triangle. Stationary in p it is the
energy mu/2 (tr C - 2) - mu ln J + lambda/2 (J - 1)^2; for nu = 1/2 the last term is gone and J = 1 holds on average.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.contact.mesh import Mesh

Real = NDArray[np.float64]

# Six points, exact to degree 4 (Strang and Fix; Cowper 1973): barycentric a, a, 1 - 2a, and weight.
_ORBITS = ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322))
_POINTS = np.array([p for a, _ in _ORBITS for p in ((a, a), (1 - 2 * a, a), (a, 1 - 2 * a))])
_WEIGHTS = np.array([w / 2 for _, w in _ORBITS for _ in range(3)])
_OUTER = 12  # displacements of the six nodes; then the bubble's two, then three of the pressure
_STIFF = 1e6  # in the tangent of an incompressible triangle, the pressure's stiffness over mu


def gradients(xi: Real, eta: Real) -> Real:
    """Derivatives of the six nodal functions and the bubble to xi and eta, (points, 7, 2)."""
    one, o = np.ones_like(xi), np.zeros_like(xi)
    a, b, c = 1 - xi - eta, xi, eta
    da, db, dc = (-one, -one), (one, o), (o, one)
    both = range(2)
    rows = [[(4 * x - 1) * d[k] for k in both] for x, d in ((a, da), (b, db), (c, dc))]
    rows += [
        [4 * (x * dy[k] + y * dx[k]) for k in both] for x, dx, y, dy in ((a, da, b, db), (b, db, c, dc), (c, dc, a, da))
    ]
    rows += [[27 * (da[k] * b * c + a * db[k] * c + a * b * dc[k]) for k in both]]
    return np.moveaxis(np.array(rows), 2, 0)


_GRADIENTS = gradients(*_POINTS.T)
_PRESSURES = np.column_stack([np.ones(len(_POINTS)), _POINTS - 1 / 3])  # constant, and two slopes without mean
_PRODUCTS = (_PRESSURES[:, :, None] * _PRESSURES[:, None]).reshape(-1, 9)
_UNMOVED = np.array([1.0, 0.0, 0.0, 1.0])
_ALTERNATING = np.array([1.0, -1.0, -1.0, 1.0])  # signs of a cofactor


@dataclass(frozen=True)
class Law:
    """What each triangle is made of: shear modulus [Pa], and 1 / lambda [1/Pa], 0 where incompressible."""

    mu_pa: Real
    yielding_per_pa: Real


def law(youngs_modulus_pa: Real, poisson_ratio: Real) -> Law:
    """Lame's constants from E [Pa] and nu [-], which may be 1/2."""
    e, nu = youngs_modulus_pa, poisson_ratio
    return Law(e / (2 * (1 + nu)), (1 + nu) * (1 - 2 * nu) / (e * nu))


@dataclass(frozen=True)
class Inner:
    """What elements keep for themselves: bubble (m, 2 or 3) [m] and pressure (m, 3 or 4) [Pa]."""

    bubble: Real
    pressure: Real

    def moved(self, step: Real, share: float) -> "Inner":
        """After a share of a step (m, 5 or 7)."""
        own = self.bubble.shape[1]
        return Inner(self.bubble + share * step[:, :own], self.pressure + share * step[:, own:])

    def ahead(self, before: "Inner", share: float) -> "Inner":
        """As much further as it has come since ``before``, times a share."""
        bubble, pressure = (
            getattr(self, key) + share * (getattr(self, key) - getattr(before, key)) for key in ("bubble", "pressure")
        )
        return Inner(bubble, pressure)


@dataclass(frozen=True)
class Tangent:
    """Condensed stiffness (m, k, k) and force (m, k); the inner step is ``offset - slope @ du``.

    ``pressure_step`` is how far the pressures are from their own equilibrium.
    """

    stiffness: Real
    force: Real
    offset: Real
    slope: Real
    pressure_step: Real
    mu_pa: Real

    def imbalance(self) -> float:
        """How far the inner unknowns are from their own equilibrium: the largest step of a pressure over mu [-]."""
        return float(np.abs(self.pressure_step / self.mu_pa[:, None]).max())

    def inner_step(self, du: Real) -> Real:
        """Step of bubble and pressure that belongs to a step of the nodes (m, k)."""
        return np.asarray(self.offset - np.einsum("mij,mj->mi", self.slope, du))


def condensed(residual: Real, matrix: Real, outer: int, pressures: int, mu_pa: Real) -> Tangent:
    """Without what elements keep for themselves: all beyond the first ``outer`` unknowns, pressures last."""
    o = outer
    inside = np.concatenate([matrix[:, o:, :o], residual[:, o:, None]], axis=2)
    solved = np.linalg.solve(matrix[:, o:, o:], inside)
    taken = np.matmul(matrix[:, :o, o:], solved)
    return Tangent(
        matrix[:, :o, :o] - taken[..., :-1],
        residual[:, :o] - taken[..., -1],
        -solved[..., -1],
        solved[..., :-1],
        -solved[:, -pressures:, -1],
        mu_pa,
    )


@dataclass(frozen=True)
class Elements:
    """All triangles of a mesh, at once."""

    mesh: Mesh
    law: Law

    @property
    def points_m(self) -> Real:
        """Places of the nodes [m]."""
        return self.mesh.points_m

    @cached_property
    def _geometry(self) -> tuple[Real, Real, Real]:
        """Slopes of the seven functions along x and y (m, 7, points) [1/m], and weights (m, points) [m2]."""
        a, b, c = (self.mesh.points_m[self.mesh.triangles[:, k]] for k in range(3))
        jacobian = np.stack([b - a, c - a], axis=2)
        x, y = np.einsum("qnk,mki->imnq", _GRADIENTS, np.linalg.inv(jacobian))
        return np.ascontiguousarray(x), np.ascontiguousarray(y), np.linalg.det(jacobian)[:, None] * _WEIGHTS

    @cached_property
    def _soft(self) -> Real:
        """Second derivatives of mu/2 F : F, to displacements of one direction (m, 7, 7) [Pa]."""
        x, y, w = self._geometry
        weight = (w * self.law.mu_pa[:, None])[:, None]
        return np.asarray(np.matmul(weight * x, x.transpose(0, 2, 1)) + np.matmul(weight * y, y.transpose(0, 2, 1)))

    @cached_property
    def _turning(self) -> Real:
        """Second derivatives of J, to one displacement sideways and one up (m, points, 49) [1/m2]."""
        x, y = (slopes.swapaxes(1, 2) for slopes in self._geometry[:2])
        mixed = x[..., :, None] * y[..., None, :]
        return np.asarray((mixed - mixed.swapaxes(2, 3)).reshape(*x.shape[:2], 49))

    def _rates(self, t: Real) -> Real:
        """Of T : F to the 14 displacements (m, 14, points), for entries 11, 12, 21, 22 of T (m, points, 4)."""
        x, y, _ = self._geometry
        found = np.empty((len(x), 7, 2, x.shape[2]))
        for row in range(2):
            found[:, :, row] = t[:, None, :, 2 * row] * x + t[:, None, :, 2 * row + 1] * y
        return found.reshape(len(x), 14, -1)

    def start(self) -> Inner:
        """Unloaded."""
        m = len(self.mesh.triangles)
        return Inner(np.zeros((m, 2)), np.zeros((m, 3)))

    def deformation(self, u: Real, inner: Inner) -> Real:
        """Entries 11, 12, 21, 22 of F at each quadrature point (m, points, 4)."""
        x, y, _ = self._geometry
        local = np.concatenate([u[self.freedoms], inner.bubble], axis=1).reshape(-1, 7, 2).transpose(0, 2, 1)
        found = np.stack([np.matmul(local, x), np.matmul(local, y)], axis=-1)
        return np.asarray(found.transpose(0, 2, 1, 3).reshape(len(x), -1, 4) + _UNMOVED)

    def volume_ratio(self, u: Real, inner: Inner) -> Real:
        """J at each quadrature point (m, points)."""
        f = self.deformation(u, inner)
        return np.asarray(f[..., 0] * f[..., 3] - f[..., 1] * f[..., 2])

    @cached_property
    def freedoms(self) -> NDArray[np.int64]:
        """Numbers of the 12 displacements of each triangle: x, y of one node after the other."""
        return np.asarray((2 * self.mesh.triangles[:, :, None] + np.arange(2)).reshape(-1, _OUTER))

    def energy_j_per_m(self, u: Real, inner: Inner) -> float:
        """Energy stored, per depth [J/m]."""
        f, (_, _, weights) = self.deformation(u, inner), self._geometry
        j = f[..., 0] * f[..., 3] - f[..., 1] * f[..., 2]
        p = inner.pressure @ _PRESSURES.T
        shape = self.law.mu_pa[:, None] * (0.5 * ((f**2).sum(-1) - 2) - np.log(j))
        return float((weights * (shape + p * (j - 1) - 0.5 * p**2 * self.law.yielding_per_pa[:, None])).sum())

    def tangent(self, u: Real, inner: Inner) -> Tangent:
        """Residual and its derivative at a state whose J is above 0."""
        return condensed(*self.full(u, inner), _OUTER, 3, self.law.mu_pa)

    def full(self, u: Real, inner: Inner) -> tuple[Real, Real]:
        """Residual (m, 17) and its derivative before the inner unknowns are condensed."""
        f, (_, _, w) = self.deformation(u, inner), self._geometry
        m = len(w)
        cofactor = f[..., ::-1] * _ALTERNATING
        j = f[..., 0] * f[..., 3] - f[..., 1] * f[..., 2]
        mu, p = self.law.mu_pa[:, None], inner.pressure @ _PRESSURES.T
        along = self._rates(cofactor)
        stress = (w * mu)[..., None] * f + (w * (p - mu / j))[..., None] * cofactor
        stiffness = np.matmul(along * (w * mu / j**2)[:, None], along.transpose(0, 2, 1)).reshape(m, 7, 2, 7, 2)
        stiffness[:, :, 0, :, 0] += self._soft
        stiffness[:, :, 1, :, 1] += self._soft
        turned = np.matmul((w * (p - mu / j))[:, None], self._turning).reshape(m, 7, 7)
        stiffness[:, :, 0, :, 1] += turned
        stiffness[:, :, 1, :, 0] -= turned
        coupling = np.matmul(along * w[:, None], _PRESSURES)
        mass = (w @ _PRODUCTS).reshape(m, 3, 3)
        yielding = self.law.yielding_per_pa[:, None]
        matrix = np.zeros((m, 17, 17))
        matrix[:, :14, :14] = stiffness.reshape(m, 14, 14)
        matrix[:, :14, 14:], matrix[:, 14:, :14] = coupling, coupling.transpose(0, 2, 1)
        matrix[:, 14:, 14:] = -mass * np.maximum(yielding, 1 / (_STIFF * mu))[..., None]
        residual = np.empty((m, 17))
        residual[:, :14] = self._rates(stress).sum(axis=2)
        residual[:, 14:] = (w * (j - 1)) @ _PRESSURES - yielding * np.einsum("mik,mk->mi", mass, inner.pressure)
        return residual, matrix
