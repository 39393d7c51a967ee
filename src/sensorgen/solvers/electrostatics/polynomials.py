"""Polynomials on triangles, those inside eliminated: energies by what they are on the sides."""

from functools import cache

import numpy as np

from sensorgen.core.arrays import Real, Whole

SIDES = ((0, 1), (1, 2), (2, 0))  # of a triangle, as pairs of its corners


def condensed(corners: Real, order: int) -> Real:
    r"""Least of :math:`\int |\nabla v|^2` over polynomials of given values on the sides of triangles, as matrices.

    Parameters
    ----------
    corners : (n, 3, 2) array
        Of each triangle, counter-clockwise, in any unit: in the plane the integral has no scale.
    order : int
        Of the polynomials, 1 or more.

    Returns
    -------
    (n, 3 * order, 3 * order) array
        For values at the corners, then the modes 2 to ``order`` of each side in turn (integrated Legendre polynomials).

    Notes
    -----
    The slopes along the three sides, weighted with the opposite angles' cotangents: what hardly changes along the
    short side of a slender triangle then has no large terms that cancel.
    """
    u, v, w = (corners[:, b] - corners[:, a] for a, b in ((0, 1), (0, 2), (1, 2)))
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    metric = np.stack([(v * w).sum(1), -(u * w).sum(1), (u * v).sum(1)]) / area
    full = np.tensordot(metric, _reference(order), axes=(0, 0))
    n = 3 * order
    if full.shape[1] == n:
        return full
    side, mixed, inner = full[:, :n, :n], full[:, n:, :n], full[:, n:, n:]
    return side - mixed.transpose(0, 2, 1) @ np.linalg.solve(inner, mixed)


@cache
def _reference(order: int) -> Real:
    """Integrals of products of the derivatives along x, along y and along y - x; on the corner (0, 1)^2.

    Inner polynomials are made orthonormal to each other, and the sides' to them, for a triangle of equal sides.
    """
    at, weight = np.polynomial.legendre.leggauss(order + 1)
    at, weight = (at + 1) / 2, weight / 2
    y, x = np.repeat(at, order + 1), np.tile(at, order + 1)
    x = x * (1 - y)
    root = np.sqrt(np.outer(weight * (1 - at), weight).ravel())
    along = np.array([f[1:] * root for f in _functions(x, y, order)])
    a, b = along[:, 0], along[:, 1]
    products = np.stack([f @ f.T for f in (a, b, b - a)])
    n = 3 * order
    even = products.sum(axis=0) / 2
    change = np.eye(len(even))
    if len(even) > n:
        root = np.linalg.inv(np.linalg.cholesky(even[n:, n:]))
        change[n:, n:] = root
        change[3:n, n:] = -even[3:n, n:] @ root.T @ root  # straight functions are orthogonal to the inner ones
    return np.asarray(change @ products @ change.T)


def _functions(x: Real, y: Real, order: int) -> list[Real]:
    """Value and both derivatives (3, q) of each polynomial: corners, sides, inside (Beuchler and Schoeberl)."""
    one = np.stack([np.ones_like(x), 0 * x, 0 * x])
    corner = [_linear(1 - x - y, -1, -1), _linear(x, 1, 0), _linear(y, 0, 1)]
    sides = [_integrated(corner[b] - corner[a], corner[a] + corner[b], order) for a, b in SIDES]
    height = 2 * corner[2] - one
    inner = [
        _times(_times(sides[0][i - 2], corner[2]), f)
        for i in range(2, order)
        for f in _jacobi(height, one, 2 * i - 1, order - 1 - i)
    ]
    return [*corner, *(f for side in sides for f in side), *inner]


def _linear(value: Real, along_x: float, along_y: float) -> Real:
    return np.stack([value, np.full_like(value, along_x), np.full_like(value, along_y)])


def _times(f: Real, g: Real) -> Real:
    """Product of two functions with their derivatives."""
    return np.stack([f[0] * g[0], f[1] * g[0] + f[0] * g[1], f[2] * g[0] + f[0] * g[2]])


def _integrated(s: Real, t: Real, order: int) -> list[Real]:
    """Integrated Legendre polynomials t^n L_n(s / t) of degree 2 to ``order``, of unit slope's norm for t = 1."""
    square = _times(t, t)
    functions = [s, (_times(s, s) - square) / 2]
    for n in range(2, order):
        functions.append(((2 * n - 1) * _times(s, functions[-1]) - (n - 2) * _times(square, functions[-2])) / (n + 1))
    return [f * np.sqrt(n - 0.5) for n, f in enumerate(functions[1:order], 2)]


def _jacobi(x: Real, one: Real, a: int, degree: int) -> list[Real]:
    """Jacobi polynomials P^(a, 0) of degree 0 to ``degree``."""
    functions = [one, (a * one + (a + 2) * x) / 2]
    for n in range(2, degree + 1):
        across = (2 * n + a) * (2 * n + a - 2) * x + a * a * one
        last = 2 * (n + a - 1) * (n - 1) * (2 * n + a) * functions[-2]
        functions.append(((2 * n + a - 1) * _times(across, functions[-1]) - last) / (2 * n * (n + a) * (2 * n + a - 2)))
    return functions[: degree + 1]


@cache
def crossed(order: int) -> Real:
    """Integral of f dg around a triangle, counter-clockwise, for values on its sides as in :func:`condensed`."""
    at, weight = np.polynomial.legendre.leggauss(order + 1)
    s, t = np.stack([at, np.ones_like(at), 0 * at]), np.stack([np.ones_like(at), 0 * at, 0 * at])
    here = [(t - s) / 2, (t + s) / 2, *_integrated(s, t, order)]
    value, slope = (np.array([f[k] for f in here]) for k in (0, 1))
    along = (value * weight) @ slope.T
    matrix = np.zeros((3 * order, 3 * order))
    for number, (a, b) in enumerate(SIDES):
        ids = np.array([a, b, *range(3 + number * (order - 1), 3 + (number + 1) * (order - 1))])
        matrix[np.ix_(ids, ids)] += along
    return matrix


def numbered(corners: Whole, vertex: Whole, first: Whole, order: int) -> tuple[Whole, Real]:
    """Unknown of each value on the sides of triangles, and its sign there.

    Parameters
    ----------
    corners : (n, 3) array
        Vertices of each triangle; a side runs from the lower number to the higher.
    vertex : (k,) array
        Unknown of each vertex.
    first : (n, 3) array
        First unknown of each side, 0 where all its modes are 0.
    order : int
        Of the polynomials.

    Returns
    -------
    (n, 3 * order) arrays
        Unknowns, and 1 or -1.
    """
    modes = np.arange(order - 1)
    on_side = np.where(first[..., None] > 0, first[..., None] + modes, 0)
    backwards = corners > np.roll(corners, -1, axis=1)
    sign = np.where(backwards[..., None], (-1.0) ** modes, 1.0)
    n = len(corners)
    ids = np.concatenate([vertex[corners], on_side.reshape(n, -1)], axis=1)
    return ids, np.concatenate([np.ones((n, 3)), sign.reshape(n, -1)], axis=1)
