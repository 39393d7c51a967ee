r"""Mixed finite elements of a nearly incompressible neo-Hookean solid, in two and three dimensions.

.. math:: \Pi = \int \tfrac{\mu}{2} (F : F - d) - \mu \ln J + p (J - 1) - \frac{p^2}{2 \lambda}

Quadratic displacement with an inner node, linear pressure that is discontinuous between elements: P2+ / P1 triangles
(Crouzeix and Raviart 1973) and Q2 / P1 bricks (Boffi and Gastaldi 2002), which do not lock. Inner node and pressure are
condensed element by element. Stationary in p the energy is mu/2 (tr C - d) - mu ln J + lambda/2 (J - 1)^2; for
nu = 1/2 the last term vanishes and J = 1 on average. All derivatives are with respect to the reference coordinates, so
that one table of shape functions serves every element.

Around an axis elements are rings: the hoop stretch t = 1 + u / r enters, tr C + t^2 - 3 and J = t det F.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import product

import numpy as np

from sensorgen.core.arrays import Real, Whole

_STIFF = 1e6  # in the tangent of an incompressible element, the pressure's stiffness over mu
_CHUNK = 2**17  # entries of element matrices at once: with what they are made of they stay in a core's cache


@dataclass(frozen=True)
class ElementReference:
    """Shape functions of an element at its quadrature points.

    Attributes
    ----------
    gradients : (q, n, d) array
        Derivatives of the displacement's functions with respect to the reference coordinates, the inner node last.
    weights : (q,) array
        Of the quadrature.
    pressures : (q, d + 1) array
        Functions of the pressure.
    values : (q, n) array
        Functions of the displacement; none for bricks, which are not turned about an axis.
    """

    gradients: Real
    weights: Real
    pressures: Real
    values: Real

    @cached_property
    def flat(self) -> Real:
        """Gradients, points and directions in one (q d, n)."""
        return np.ascontiguousarray(self.gradients.transpose(0, 2, 1)).reshape(-1, self.gradients.shape[1])

    @cached_property
    def _products(self) -> Real:
        """Products of two gradients at each point (q d d, n n)."""
        products = np.einsum("qna,qmb->qabnm", self.gradients, self.gradients)
        return np.asarray(products.reshape(-1, self.gradients.shape[1] ** 2))

    def forms(self, weights: Real) -> Real:
        """Quadratic forms (m, n, n) of gradients by weights (m, q, d, d) at the points of each element."""
        m, q, d, n = *weights.shape[:3], self.gradients.shape[1]
        if d == 2:  # one product of all elements: triangles have few points
            return np.asarray((weights.reshape(m, -1) @ self._products).reshape(m, n, n))
        there = np.matmul(weights, self.flat.reshape(q, d, n)).reshape(m, -1, n)
        return np.asarray(np.matmul(self.flat.T, there))


def triangle_gradients(at: Real) -> Real:
    """Derivatives of the six nodal functions and the bubble of a triangle at places (p, 2): (p, 7, 2)."""
    share, slope = np.column_stack([1 - at.sum(axis=1), at]), np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    after, last = [1, 2, 0], [2, 0, 1]
    corners = (4 * share[..., None] - 1) * slope
    sides = 4 * (share[..., None] * slope[after] + share[:, after, None] * slope)
    bubble = 27 * (share[:, after] * share[:, last]) @ slope
    return np.concatenate([corners, sides, bubble[:, None]], axis=1)


def triangle_values(at: Real) -> Real:
    """The six nodal functions and the bubble of a triangle at places (p, 2): (p, 7)."""
    share = np.column_stack([1 - at.sum(axis=1), at])
    sides = 4 * share * share[:, [1, 2, 0]]
    return np.column_stack([share * (2 * share - 1), sides, 27 * share.prod(axis=1)])


def line_values(s: Real) -> Real:
    """Quadratic functions of a line from -1 to 1, (..., 3): start, middle, end."""
    return np.stack([s * (s - 1) / 2, 1 - s**2, s * (s + 1) / 2], axis=-1)


def line_slopes(s: Real) -> Real:
    """Their derivatives."""
    return np.stack([s - 0.5, -2 * s, s + 0.5], axis=-1)


def brick_gradients(at: Real) -> Real:
    """Derivatives of the 27 nodal functions of a brick on a lattice, ``at`` along each axis: (points, 27, 3)."""
    pair = line_values(at), line_slopes(at)
    gradients = [np.einsum("ai,bj,ck->abcijk", *(pair[int(a == axis)] for a in range(3))) for axis in range(3)]
    return np.stack([f.reshape(len(at) ** 3, 27) for f in gradients], axis=-1)


BRICK_INNER, BRICK_CORNERS = 13, np.array([0, 2, 6, 8, 18, 20, 24, 26])
BRICK_OUTER = np.delete(np.arange(27), BRICK_INNER)


def triangle_points() -> tuple[Real, Real]:
    """Six points (6, 2) with their weights, exact to degree 4 (Strang and Fix; Cowper 1973)."""
    orbits = ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322))
    at = np.array([p for a, _ in orbits for p in ((a, a), (1 - 2 * a, a), (a, 1 - 2 * a))])
    return at, np.repeat([w / 2 for _, w in orbits], 3)


def _triangle() -> ElementReference:
    at, weights = triangle_points()
    pressures = np.column_stack([np.ones(6), at - 1 / 3])
    return ElementReference(triangle_gradients(at), weights, pressures, triangle_values(at))


def _brick() -> ElementReference:
    """Gauss's 27 points; the inner node's displacement is relative to the mean of the corners'."""
    at, weight = np.polynomial.legendre.leggauss(3)
    gradients = brick_gradients(at)
    gradients[:, BRICK_CORNERS] += gradients[:, [BRICK_INNER]] / 8
    weights = np.einsum("a,b,c->abc", weight, weight, weight).ravel()
    pressures = np.column_stack([np.ones(27), np.array(list(product(at, repeat=3)))])
    return ElementReference(gradients[:, [*BRICK_OUTER, BRICK_INNER]], weights, pressures, np.empty((27, 0)))


TRIANGLE, BRICK = _triangle(), _brick()


@dataclass(frozen=True)
class ElementMesh:
    """A mesh of one kind of element, each an affine image of the reference.

    Attributes
    ----------
    reference : ElementReference
        Its shape functions.
    points_m : (n, d) array
        Places of the nodes [m].
    outer : (m, k) array
        Nodes of each element but the inner one, as in the reference.
    region : (m,) array
        Region of each element, from 1 on.
    turned : bool
        Whether triangles are sections of rings about the axis x = 0.
    """

    reference: ElementReference
    points_m: Real
    outer: Whole
    region: Whole
    turned: bool = field(default=False, kw_only=True)

    @cached_property
    def jacobians_m(self) -> Real:
        """Derivative of the place with respect to the reference coordinates (m, d, d) [m]."""
        corners = self.points_m[self.outer].transpose(0, 2, 1)
        return np.asarray(corners @ self.reference.gradients[0, :-1])


@dataclass(frozen=True)
class ElementMaterial:
    """Material of each element: shear modulus [Pa], and 1 / lambda [1/Pa], 0 where incompressible."""

    mu_pa: Real
    compliance_per_pa: Real


def law(youngs_modulus_pa: Real, poisson_ratio: Real) -> ElementMaterial:
    """Lame's constants from E [Pa] and nu [-], which may be 1/2."""
    e, nu = youngs_modulus_pa, poisson_ratio
    return ElementMaterial(e / (2 * (1 + nu)), (1 + nu) * (1 - 2 * nu) / (e * nu))


@dataclass(frozen=True)
class Inner:
    """Unknowns that elements do not share: displacement of the inner node (m, d) [m] and pressure (m, d + 1) [Pa]."""

    bubble: Real
    pressure: Real

    def moved(self, step: Real, share: float) -> "Inner":
        """After a share of a step (m, 2d + 1)."""
        own = self.bubble.shape[1]
        return Inner(self.bubble + share * step[:, :own], self.pressure + share * step[:, own:])

    def extrapolated(self, before: "Inner", share: float) -> "Inner":
        """Further by a share of the change since ``before``."""
        return Inner(
            self.bubble + share * (self.bubble - before.bubble),
            self.pressure + share * (self.pressure - before.pressure),
        )


@dataclass(frozen=True)
class Unbalanced:
    """Condensed force (m, k), step of the inner unknowns (m, 2d + 1) to their own equilibrium, and its size.

    The imbalance is the largest step of a pressure over mu [-].
    """

    force: Real
    step: Real
    imbalance: float


@dataclass(frozen=True)
class Tangent:
    """Condensed stiffness (m, k, k), and what condenses a residual: slope (m, i, k), inverse (m, i, i)."""

    stiffness: Real
    slope: Real
    inverse: Real

    def condensed(self, residual: Real, mu_pa: Real) -> Unbalanced:
        """Remainder of a residual (m, k + i), of the tangent's own state or one nearby; ``mu_pa`` (m,) [Pa]."""
        outer, inner = self.slope.shape[2], self.slope.shape[1]
        inside = residual[:, outer:, None]
        force = residual[:, :outer] - np.matmul(self.slope.transpose(0, 2, 1), inside)[..., 0]
        step = -np.matmul(self.inverse, inside)[..., 0]
        return Unbalanced(force, step, float(np.abs(step[:, inner // 2 :] / mu_pa[:, None]).max()))

    def inner_step(self, unbalanced: Unbalanced, du: Real) -> Real:
        """Step of the inner unknowns (m, 2d + 1) for a step of the other nodes (m, k)."""
        return np.asarray(unbalanced.step - np.matmul(self.slope, du[..., None])[..., 0])


@dataclass(frozen=True)
class Elements:
    """All elements of a mesh; d is 2 or 3."""

    mesh: ElementMesh
    law: ElementMaterial

    @cached_property
    def freedoms(self) -> Whole:
        """Numbers of the displacements that each element shares with its neighbours (m, k): x, y (, z) of each node."""
        outer, d = self.mesh.outer, self.mesh.points_m.shape[1]
        return np.asarray((d * outer[:, :, None] + np.arange(d)).reshape(len(outer), -1))

    @cached_property
    def _volumes(self) -> Real:
        """Volume of each element over that of the reference (m,) [m^d]."""
        return np.asarray(determinant(self.mesh.jacobians_m))

    @cached_property
    def _metric(self) -> Real:
        """Jacobian^-1 Jacobian^-T of each element (m, d, d) [1/m2]."""
        inverse = np.linalg.inv(self.mesh.jacobians_m)
        return np.asarray(inverse @ inverse.transpose(0, 2, 1))

    @cached_property
    def _weights(self) -> Real:
        """Of each quadrature point (m, q) [m^d], of rings [m3]."""
        flat = np.asarray(self._volumes[:, None] * self.mesh.reference.weights)
        return 2 * np.pi * self._radii_m * flat if self.mesh.turned else flat

    @cached_property
    def _radii_m(self) -> Real:
        """Distance of each quadrature point from the axis (m, q) [m]."""
        return np.asarray(self.mesh.points_m[self.mesh.outer, 0] @ self.mesh.reference.values[:, :-1].T)

    def _hoops(self, u: Real, inner: Inner, which: slice) -> tuple[Real, Real]:
        """Hoop stretch at each quadrature point (m, q), and its derivative to the nodes' distance (m, q, n) [1/m]."""
        rates = self.mesh.reference.values / self._radii_m[which, :, None]
        outwards = np.column_stack([u.reshape(-1, 2)[self.mesh.outer[which], 0], inner.bubble[which, 0]])
        return 1 + np.matmul(rates, outwards[..., None])[..., 0], rates

    def start(self) -> Inner:
        """Unloaded."""
        m, d = len(self.mesh.outer), self.mesh.points_m.shape[1]
        return Inner(np.zeros((m, d)), np.zeros((m, d + 1)))

    def _stretch(self, u: Real, inner: Inner, which: slice) -> Real:
        """Derivative of the deformed place with respect to the reference coordinates, F Jacobian (m, q, d, d) [m]."""
        gradients, d = self.mesh.reference.gradients, self.mesh.points_m.shape[1]
        local = np.concatenate([u.reshape(-1, d)[self.mesh.outer[which]], inner.bubble[which, None]], axis=1)
        rows = local.transpose(0, 2, 1).reshape(len(local) * d, -1)
        moved = (rows @ gradients.transpose(1, 0, 2).reshape(rows.shape[1], -1)).reshape(len(local), d, -1, d)
        return np.asarray(moved.transpose(0, 2, 1, 3) + self.mesh.jacobians_m[which, None])

    def volume_ratio(self, u: Real, inner: Inner) -> Real:
        """J at each quadrature point (m, q)."""
        j = np.asarray(determinant(self._stretch(u, inner, slice(None))) / self._volumes[:, None])
        return j * self._hoops(u, inner, slice(None))[0] if self.mesh.turned else j

    def energy_j(self, u: Real, inner: Inner) -> float:
        """Energy stored [J], per depth in plane strain [J/m]."""
        h, reference = self._stretch(u, inner, slice(None)), self.mesh.reference
        j, p = self.volume_ratio(u, inner), inner.pressure @ reference.pressures.T
        squares = ((h @ self._metric[:, None]) * h).sum((-1, -2))
        if self.mesh.turned:
            squares += self._hoops(u, inner, slice(None))[0] ** 2 - 1
        shape = self.law.mu_pa[:, None] * (0.5 * (squares - h.shape[-1]) - np.log(j))
        return float((self._weights * (shape + p * (j - 1) - 0.5 * p**2 * self.law.compliance_per_pa[:, None])).sum())

    def tangent(self, u: Real, inner: Inner) -> Tangent:
        """Derivative of the residual, condensed, at a state whose J is above 0."""
        parts = list(self._condensed(u, inner))
        return Tangent(*(np.concatenate([getattr(p, key.name) for p in parts]) for key in fields(Tangent)))

    def _condensed(self, u: Real, inner: Inner) -> Iterator[Tangent]:
        """Eliminate inner node and pressure, some elements at a time."""
        outer, pressures = self.freedoms.shape[1], inner.pressure.shape[1]
        step = max(_CHUNK // (outer + inner.bubble.shape[1] + pressures) ** 2, 1)
        for k in range(0, len(self.freedoms), step):
            matrix = self.derivative(u, inner, slice(k, k + step))
            inverse = np.asarray(np.linalg.inv(matrix[:, outer:, outer:]), float)  # small ones: sooner than solving
            slope = np.matmul(inverse, matrix[:, outer:, :outer])
            yield Tangent(matrix[:, :outer, :outer] - np.matmul(matrix[:, :outer, outer:], slope), slope, inverse)

    def residual(self, u: Real, inner: Inner) -> Real:
        """Unbalanced forces of all nodes, and errors of the pressures (m, k), before condensation."""
        every, table = slice(None), self.mesh.reference
        h, w, mu = self._stretch(u, inner, every), self._weights, self.law.mu_pa[:, None]
        (m, d), n = (len(h), h.shape[-1]), table.gradients.shape[1]
        p = inner.pressure @ table.pressures.T
        j, rate = determinant(h) / self._volumes[:, None], cofactor(h) / self._volumes[:, None, None, None]
        t, hoops = self._hoops(u, inner, every) if self.mesh.turned else (1.0, None)
        shear, hydro = (each[..., None, None] for each in (w * mu, w * (p * t - mu / j)))
        stress = shear * (h @ self._metric[:, None]) + hydro * rate
        forces = (stress.transpose(0, 2, 1, 3).reshape(m * d, -1) @ table.flat).reshape(m, d, n)
        if hoops is not None:
            forces[:, 0] += np.matmul((w * (mu * t + p * j - mu / t))[:, None], hoops)[:, 0]
        compressed = np.matmul(self._masses, inner.pressure[..., None])[..., 0] * self.law.compliance_per_pa[:, None]
        swollen = (w * (j * t - 1)) @ table.pressures - compressed
        return np.concatenate([forces.transpose(0, 2, 1).reshape(m, -1), swollen], axis=1)

    @cached_property
    def _masses(self) -> Real:
        """Integrals of products of two functions of the pressure (m, d + 1, d + 1) [m^d]."""
        pressures = self.mesh.reference.pressures
        return np.asarray(np.einsum("mq,qi,qk->mik", self._weights, pressures, pressures))

    def derivative(self, u: Real, inner: Inner, which: slice = slice(None)) -> Real:
        """Derivative of the residual (m, k, k) before condensation: displacements, inner node, pressures."""
        h, w, volume = self._stretch(u, inner, which), self._weights[which], self._volumes[which, None]
        table, metric = self.mesh.reference, self._metric[which, None]
        m, d, n = len(w), h.shape[-1], table.gradients.shape[1]
        size = d * n
        mu, p = self.law.mu_pa[which, None], inner.pressure[which] @ table.pressures.T
        j, rate = determinant(h) / volume, cofactor(h) / volume[..., None, None]  # det F and its derivative to h
        t, hoops = self._hoops(u, inner, which) if self.mesh.turned else (np.ones_like(j), None)
        hydro = p * t - mu / j
        matrix = np.empty((m, size + d + 1, size + d + 1))
        for i in range(d):
            for k in range(i, d):
                block = (w * mu / j**2)[..., None, None] * rate[:, :, i, :, None] * rate[:, :, k, None, :]
                if i == k:
                    block += (w * mu)[..., None, None] * metric
                else:
                    block += (w * hydro / volume)[..., None, None] * mixed_minors(h, i, k)
                part = table.forms(block)
                matrix[:, i:size:d, k:size:d] = part
                matrix[:, k:size:d, i:size:d] = part.transpose(0, 2, 1)
        along = np.matmul(table.gradients, rate.transpose(0, 1, 3, 2)).reshape(m, -1, size)  # dJ to the displacements
        if hoops is not None:
            out = slice(0, size, d)
            matrix[:, out, out] += np.matmul(hoops.transpose(0, 2, 1), (w * mu * (1 + t**-2))[..., None] * hoops)
            both = np.matmul(hoops.transpose(0, 2, 1), (w * p)[..., None] * along)
            matrix[:, out, :size] += both
            matrix[:, :size, out] += both.transpose(0, 2, 1)
            along *= t[..., None]
            along[..., out] += j[..., None] * hoops
        coupling = np.matmul((along * w[..., None]).transpose(0, 2, 1), table.pressures)
        matrix[:, :size, size:], matrix[:, size:, :size] = coupling, coupling.transpose(0, 2, 1)
        compliance = np.maximum(self.law.compliance_per_pa[which, None], 1 / (_STIFF * mu))
        matrix[:, size:, size:] = -self._masses[which] * compliance[..., None]
        return matrix


def cofactor(h: Real) -> Real:
    """Derivative of the determinant of matrices (..., d, d): det h h^-T."""
    if h.shape[-1] == 2:
        return np.asarray(h[..., ::-1, ::-1] * [[1.0, -1.0], [-1.0, 1.0]])
    cofactors = np.empty_like(h)
    for i in range(3):
        cofactors[..., i, :] = np.cross(h[..., (i + 1) % 3, :], h[..., (i + 2) % 3, :])
    return cofactors


def determinant(h: Real) -> Real:
    """Of matrices (..., d, d)."""
    if h.shape[-1] == 2:
        return np.asarray(h[..., 0, 0] * h[..., 1, 1] - h[..., 0, 1] * h[..., 1, 0])
    return np.asarray((h[..., 0, :] * np.cross(h[..., 1, :], h[..., 2, :])).sum(-1))


def mixed_minors(h: Real, i: int, k: int) -> Real:
    """Second derivative of the determinant with respect to rows i < k: (..., d, d), or (d, d) in two dimensions."""
    if h.shape[-1] == 2:
        return np.array([[0.0, 1.0], [-1.0, 0.0]])
    minors = np.zeros_like(h)
    rest, sign = h[..., 3 - i - k, :], 1.0 if k == i + 1 else -1.0
    for a in range(3):
        minors[..., a, (a + 1) % 3] = sign * rest[..., (a + 2) % 3]
        minors[..., (a + 1) % 3, a] = -sign * rest[..., (a + 2) % 3]
    return minors
