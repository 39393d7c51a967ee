r"""Capacitance of a cell of bent boxes, from both sides, solved on the boxes as drawn.

The displacement F maps straight boxes onto bent ones. Drawn back, the permittivity is the tensor
:math:`\varepsilon J F^{-1} F^{-T}`, and no new mesh is needed. Dirichlet: any potential that is right on the electrodes
has too much energy. Thomson: any flux without sources has too little; its normal component is kept continuous by
potentials on the faces (hybrid H(div)), and stays so when it is mapped.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations_with_replacement, product

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import BadInput, OutOfRange
from sensorgen.interval import Interval
from sensorgen.models._fem_boxes import Element, flux, potential
from sensorgen.models._fem_dissection import Elements, least
from sensorgen.models._press.brick_element import BrickMesh, cofactor, determinant, gradients
from sensorgen.models._press.bricks import Bricks
from sensorgen.units import EPS0_F_PER_M

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Mask = NDArray[np.bool_]

_ROUNDING = 1e-9
_MORE = 3  # points of quadrature beyond the order: the tensor is no polynomial
_CHUNK = 200  # bricks at once
_AXES = range(3)


class Folded(BadInput):
    """The displacement turns a part of the air inside out: faces run into each other."""


@dataclass(frozen=True)
class Orders:
    """Of the polynomials of the potential and of the flux."""

    potential: int = 3
    flux: int = 2


def capacitance(mesh: BrickMesh, u_m: Real, permittivity: Mapping[str, float], orders: Orders) -> Interval:
    """Bounds of the capacitance per area of the cell as it is [F/m2].

    Parameters
    ----------
    mesh : BrickMesh
        All boxes of the cell, air included.
    u_m : (3n,) array
        Displacements [m].
    permittivity : mapping of str to float
        Relative permittivity by material, with "air" [-].
    orders : Orders
        Of the polynomials.

    Raises
    ------
    OutOfRange
        The electrodes touch.
    BadInput
        An electrode does not cover the cell, nothing lies between them, or a displacement folds the air.
    """
    bricks = mesh.bricks
    ends = [np.isin(bricks.fill, _of(bricks, end)) for end in ("bottom", "top")]
    field = _between(mesh, ends)
    boxes = mesh.boxes[field]
    eps = np.array([permittivity.get(r.material, np.nan) for r in bricks.regions])[mesh.region[field]]
    moved = u_m.reshape(-1, 3)[mesh.nodes[field]] + mesh.points_m[mesh.nodes[field]]
    area = float(np.prod([np.ptp(moved[..., axis]) for axis in (0, 1)]))
    found = []
    for kind, local, order in (
        (_plain(flux(orders.flux)), _fluxes, orders.flux),
        (potential(orders.potential), _potentials, orders.potential),
    ):
        energies = np.concatenate(
            [local(moved[k : k + _CHUNK], eps[k : k + _CHUNK], order) for k in range(0, len(boxes), _CHUNK)]
        )
        found.append(_least(bricks, boxes, ends, kind, energies) / area)
    lower, upper = found
    if not 0 < lower <= upper * (1 + _ROUNDING):
        raise BadInput(f"bounds in the wrong order, {lower} above {upper}: the solver failed on this cell")
    return Interval(lower * (1 - _ROUNDING), upper * (1 + _ROUNDING)).times(EPS0_F_PER_M)


def _plain(kind: Element) -> Element:
    """The same unknowns in Legendre polynomials, of which the first on each face is a potential of 1/2."""
    one = np.zeros((6, len(kind.one) // 6))
    one[:, 0] = 2.0
    return replace(kind, one=one.ravel())


def _of(bricks: Bricks, terminal: str) -> list[int]:
    return [k for k, region in enumerate(bricks.regions) if region.terminal == terminal]


def _between(mesh: BrickMesh, ends: list[Mask]) -> Mask:
    """Which bricks carry field: dielectric in a piece that touches both electrodes."""
    from scipy.ndimage import binary_dilation, label

    free = ~(ends[0] | ends[1])
    numbers, _ = label(free)
    touched = [np.unique(numbers[binary_dilation(end) & free]) for end in ends]
    inside = np.isin(numbers, np.intersect1d(touched[0], touched[1])) & free
    if not inside.any():
        raise BadInput("no dielectric lies between a top and a bottom electrode")
    if inside[:, :, [0, -1]].any():
        raise BadInput("an electrode does not cover the whole cell")
    corners = [set(mesh.nodes[end[tuple(mesh.boxes.T)]].ravel().tolist()) for end in ends]
    if corners[0] & corners[1]:
        raise OutOfRange("the electrodes touch: the capacitance grows without bound")
    return np.asarray(inside[tuple(mesh.boxes.T)])


def _least(bricks: Bricks, boxes: Whole, ends: list[Mask], kind: Element, energies: Real) -> float:
    """Energy at 1 V of elements with given energies [m]."""
    count = np.array(bricks.fill.shape)
    keys = kind.keys(boxes, count)
    held = np.full(keys.shape, np.nan)
    for value, end in enumerate(ends):
        held[np.isin(keys, kind.keys(np.argwhere(end), count))] = value
    return float(least(Elements(boxes, keys, held, kind.one, lambda box: energies[box])).energy)


def _stretch(moved: Real, at: Real) -> tuple[Real, Real]:
    """Derivative of the place to that in the brick (m, points, 3, 3) [m], and its determinant [m3]."""
    f = np.einsum("qnj,mni->mqij", gradients(at), moved, optimize=True)
    j = determinant(f)
    if j.min() <= 0:
        raise Folded("faces run into each other: the deformed outlines have no capacitance")
    return f, j


def _potentials(moved: Real, eps: Real, order: int) -> Real:
    """Energies of the shared unknowns of potentials (m, b, b)."""
    at, weight, basis = _hats(order)
    f, j = _stretch(moved, at)
    cof = cofactor(f)
    tensor = np.matmul(cof.transpose(0, 1, 3, 2), cof) * (weight * eps[:, None] / j)[..., None, None]
    n = basis.shape[1]
    flat = basis.transpose(0, 2, 1).reshape(-1, n)
    energy = np.matmul(flat.T, np.matmul(tensor, basis.transpose(0, 2, 1)).reshape(len(eps), -1, n))
    shared = _shared(order)
    outer, coupling, inner = (
        energy[:, a][:, :, b] for a, b in ((shared, shared), (~shared, shared), (~shared, ~shared))
    )
    return np.asarray(outer - np.matmul(coupling.transpose(0, 2, 1), np.linalg.solve(inner, coupling)))


def _fluxes(moved: Real, eps: Real, order: int) -> Real:
    """Energies of the faces' potentials that the best flux without sources within has (m, b, b)."""
    at, weight, parts, divergence, faces = _legendres(order)
    f, j = _stretch(moved, at)
    tensor = np.matmul(f.transpose(0, 1, 3, 2), f) * (weight / (eps[:, None] * j))[..., None, None]
    n = parts[0].shape[1]
    mass = np.empty((len(eps), 3 * n, 3 * n))
    for a, b in combinations_with_replacement(_AXES, 2):
        block = np.matmul(parts[a].T, tensor[:, :, a, b, None] * parts[b])
        mass[:, a * n : a * n + n, b * n : b * n + n] = block
        mass[:, b * n : b * n + n, a * n : a * n + n] = block.transpose(0, 2, 1)
    drive = np.concatenate([faces, divergence]).T
    given = np.matmul(drive.T, np.linalg.solve(mass, drive))
    k = len(faces)
    coupling = given[:, k:, :k]
    held = np.matmul(coupling.transpose(0, 2, 1), np.linalg.solve(given[:, k:, k:], coupling))
    return np.asarray(given[:, :k, :k] - held)


def _shared(order: int) -> Mask:
    """Which products of modes neighbours share: not those that vanish at all six faces."""
    return np.asarray((np.indices((order + 1,) * 3).reshape(3, -1) < 2).any(axis=0))


@cache
def _hats(order: int) -> tuple[Real, Real, Real]:
    """Points along an axis, weights of their lattice, and gradients (points, n, 3) of hats and integrated Legendres."""
    at, weight = np.polynomial.legendre.leggauss(order + _MORE)
    legendre = np.polynomial.legendre.legvander(at, order)
    degree = np.arange(2, order + 1)
    norm = np.sqrt(4 * degree - 2)
    value = np.column_stack([(1 - at) / 2, (1 + at) / 2, (legendre[:, degree] - legendre[:, degree - 2]) / norm])
    slope = np.column_stack(
        [np.full_like(at, -0.5), np.full_like(at, 0.5), legendre[:, degree - 1] * (2 * degree - 1) / norm]
    )
    gradient = [_lattice([(value, slope)[int(a == axis)] for a in _AXES]) for axis in _AXES]
    return at, _weights(weight), np.stack(gradient, axis=-1)


def _lattice(factors: list[Real]) -> Real:
    """Products of functions (points, functions) of the three axes, on the lattice of their points."""
    found = np.einsum("ai,bj,ck->abcijk", *factors)
    return np.asarray(found.reshape(int(np.prod(found.shape[:3])), -1))


def _weights(weight: Real) -> Real:
    return np.asarray(np.einsum("a,b,c->abc", weight, weight, weight).ravel())


@cache
def _legendres(order: int) -> tuple[Real, Real, list[Real], Real, Real]:
    """Points and weights; each component of the flux (points, n); its divergence (k, 3n), and what leaves (b, 3n).

    Raviart and Thomas: of one order more along its own axis, in orthonormal Legendre polynomials.
    """
    at, weight = np.polynomial.legendre.leggauss(order + _MORE)
    norm = np.sqrt(np.arange(order + 2) + 0.5)
    value = np.polynomial.legendre.legvander(at, order + 1) * norm
    ends = np.polynomial.legendre.legvander(np.array([-1.0, 1.0]), order + 1) * norm
    slope = np.polynomial.legendre.legval(at, np.polynomial.legendre.legder(np.diag(norm))).T
    inwards = value[:, :-1].T @ (weight[:, None] * slope)  # (k + 1, k + 2)
    n, unit = order + 1, np.eye(order + 1)
    parts = [_lattice([value if a == axis else value[:, :-1] for a in _AXES]) for axis in _AXES]
    divergence = np.concatenate([_kron([inwards if a == axis else unit for a in _AXES]) for axis in _AXES], axis=1)
    faces = np.zeros((6 * n * n, 3, n * n * (n + 1)))
    for axis, side in product(_AXES, range(2)):
        leaving = (-1, 1)[side] * _kron([ends[side : side + 1] if a == axis else unit for a in _AXES])
        faces[(2 * axis + side) * n * n :][: n * n, axis] = leaving
    return at, _weights(weight), parts, divergence, faces.reshape(6 * n * n, -1)


def _kron(factors: list[Real]) -> Real:
    return np.asarray(np.kron(np.kron(factors[0], factors[1]), factors[2]))
