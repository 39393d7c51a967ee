r"""Capacitance of a cell of bent boxes, from both sides, solved on the boxes as drawn.

The displacement F maps straight boxes onto bent ones. Drawn back, the permittivity is the tensor
:math:`\varepsilon J F^{-1} F^{-T}`, and no new mesh is needed. Dirichlet: any potential that is right on the electrodes
has too much energy. Thomson: any flux without sources has too little; its normal component is kept continuous by
potentials on the faces (hybrid H(div)), and stays so when it is mapped.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from functools import cache, cached_property
from itertools import combinations_with_replacement, product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.solvers.contact.bricks import BrickMesh, Bricks
from sensorgen.solvers.contact.element import brick_gradients, cofactor, determinant
from sensorgen.solvers.contact.factors import Factors, Order, factored, iterations, order_of
from sensorgen.solvers.electrostatics.boxes import Element, flux, potential

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Mask = NDArray[np.bool_]
Local = Callable[[Real, Real, int], tuple[Real, Real]]

_ROUNDING = 1e-9
_MORE = 3  # points of quadrature beyond the order: the tensor is no polynomial
_CHUNK = 200  # bricks at once
_SMALL = 1e-7  # of the energy, by which an unfinished solution may be off [-]
_LIKE = 30.0  # times which tensors may have grown since factors were made [-]
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
    return Field(mesh, permittivity, orders).capacitance(u_m)


@dataclass
class _Earlier:
    """What solving a system leaves for the next one that is like it: unknowns, factors, and its tensors."""

    unknowns: Real
    factors: Factors
    tensors: Real


@dataclass
class Field:
    """The field in a cell, load after load: factors of one serve for the next.

    An approximate potential is still one, so that its energy still lies above; that of an approximate flux lies below
    once what its residual could take away is subtracted. With factors K0 of an earlier K, whose tensors T0 are such
    that T <= c T0 everywhere, this is c r' K0^-1 r at most; c <= the largest trace of T0^-1 T.
    """

    mesh: BrickMesh
    permittivity: Mapping[str, float]
    orders: Orders
    _earlier: dict[str, _Earlier] = dataclass_field(default_factory=dict, repr=False)

    @cached_property
    def _ends(self) -> list[Mask]:
        return [np.isin(self.mesh.bricks.fill, _of(self.mesh.bricks, end)) for end in ("bottom", "top")]

    @cached_property
    def _carrying(self) -> Mask:
        return _between(self.mesh, self._ends)

    @cached_property
    def _systems(self) -> dict[str, "System"]:
        kinds = {"flux": _plain(flux(self.orders.flux)), "potential": potential(self.orders.potential)}
        boxes = self.mesh.boxes[self._carrying]
        return {name: system_of(self.mesh.bricks, boxes, self._ends, kind) for name, kind in kinds.items()}

    def capacitance(self, u_m: Real) -> Interval:
        """Bounds at given displacements of all nodes (3n,), as :func:`capacitance` gives them."""
        regions, nodes = self.mesh.bricks.regions, self.mesh.nodes[self._carrying]
        eps = np.array([self.permittivity.get(r.material, np.nan) for r in regions])[self.mesh.region[self._carrying]]
        moved = u_m.reshape(-1, 3)[nodes] + self.mesh.points_m[nodes]
        area = float(np.prod([np.ptp(moved[..., axis]) for axis in (0, 1)]))
        lower = self._bound("flux", moved, eps, _fluxes, self.orders.flux) / area
        upper = self._bound("potential", moved, eps, _potentials, self.orders.potential) / area
        if not 0 < lower <= upper * (1 + _ROUNDING):
            raise BadInput(f"bounds in the wrong order, {lower} above {upper}: the solver failed on this cell")
        return Interval(lower * (1 - _ROUNDING), upper * (1 + _ROUNDING)).times(EPS0_F_PER_M)

    def _bound(self, name: str, moved: Real, eps: Real, local: "Local", order: int) -> float:
        """Energy at 1 V: at least the least of potentials, at most the least of fluxes."""
        parts = [local(moved[k : k + _CHUNK], eps[k : k + _CHUNK], order) for k in range(0, len(eps), _CHUNK)]
        energies, tensors = (np.concatenate([part[k] for part in parts]) for k in range(2))
        system, earlier = self._systems[name], self._earlier.get(name)
        matrix, push, held = system.assembled(energies)
        found = None
        if earlier and (far := _apart(earlier.tensors, tensors)) < _LIKE:
            found = _iterated(matrix, push, held, earlier, far)
        if found is None:
            factors = factored(matrix, system.order(matrix))
            if factors is None:
                raise BadInput("the field's equations are not positive: the solver failed on this cell")
            earlier = self._earlier[name] = _Earlier(np.zeros_like(push), factors, tensors)
            found = _iterated(matrix, push, held, earlier, 3.0)
        if found is None or earlier is None:
            raise BadInput("the field's equations could not be solved on this cell")
        earlier.unknowns, energy, missing = found
        return energy - (missing if name == "flux" else 0.0)


def _apart(earlier: Real, now: Real) -> float:
    """The largest trace of T0^-1 T."""
    return float(np.trace(np.linalg.solve(earlier, now), axis1=-2, axis2=-1).max())


def _iterated(
    matrix: csr_matrix, push: Real, held: float, earlier: _Earlier, apart: float
) -> tuple[Real, float, float] | None:
    """Unknowns x that nearly make held + x' K x + 2 push' x least, this energy, and how much less it may be at most."""
    residual = -push - matrix @ earlier.unknowns
    for step, left, power in iterations(matrix, residual, earlier.factors):
        x = earlier.unknowns + step
        energy = held + float(push @ x - x @ left)
        if apart * power < _SMALL * energy:
            return x, energy, apart * power
    return None


@dataclass(frozen=True)
class System:
    """Unknowns that boxes share: which are free, as numbers (m, b), -1 for others; those at 1 V; and their places."""

    number: Whole
    one: Real
    places: Whole

    @cached_property
    def _pattern(self) -> tuple[Whole, Whole]:
        b = self.number.shape[1]
        return np.repeat(self.number, b, axis=1).ravel(), np.tile(self.number, (1, b)).ravel()

    def assembled(self, energies: Real) -> tuple[csr_matrix, Real, float]:
        """Matrix of the free unknowns, what the top at 1 V pushes them with, and the energy if they were 0."""
        rows, columns = self._pattern
        kept, n = (rows >= 0) & (columns >= 0), len(self.places)
        matrix = coo_matrix((energies.ravel()[kept], (rows[kept], columns[kept])), (n, n)).tocsr()
        pushed, free = np.einsum("mij,mj->mi", energies, self.one), self.number >= 0
        push: Real = np.bincount(self.number[free], pushed[free], n).astype(float)
        return matrix, push, float((pushed * self.one).sum())

    def order(self, matrix: csr_matrix) -> Order:
        """Of elimination."""
        return order_of(matrix, self.places)


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


def system_of(bricks: Bricks, boxes: Whole, ends: list[Mask], kind: Element) -> System:
    """The unknowns of boxes between two electrodes."""
    count = np.array(bricks.fill.shape)
    keys = kind.keys(boxes, count)
    below, above = (np.isin(keys, kind.keys(np.argwhere(end), count)) for end in ends)
    free = ~(below | above)
    known, number = np.unique(keys[free], return_inverse=True)
    numbers = np.full(keys.shape, -1)
    numbers[free] = number
    lattice = np.column_stack(np.unravel_index(known // 3, tuple(count * kind.pitch + 1)))
    places = 2 * (lattice // kind.pitch) + (lattice % kind.pitch > 0)
    return System(numbers, np.where(above, kind.one, 0.0), places)


def _stretch(moved: Real, at: Real) -> tuple[Real, Real]:
    """Derivative of the place to that in the brick (m, points, 3, 3) [m], and its determinant [m3]."""
    f = np.einsum("qnj,mni->mqij", brick_gradients(at), moved, optimize=True)
    j = determinant(f)
    if j.min() <= 0:
        raise Folded("faces run into each other: the deformed outlines have no capacitance")
    return f, j


def _potentials(moved: Real, eps: Real, order: int) -> tuple[Real, Real]:
    """Energies of the shared unknowns of potentials (m, b, b), and the tensors (m, points, 3, 3)."""
    at, weight, basis = _hats(order)
    f, j = _stretch(moved, at)
    cof = cofactor(f)
    plain = np.matmul(cof.transpose(0, 1, 3, 2), cof) * (eps[:, None] / j)[..., None, None]
    tensor = plain * weight[:, None, None]
    n = basis.shape[1]
    flat = basis.transpose(0, 2, 1).reshape(-1, n)
    energy = np.matmul(flat.T, np.matmul(tensor, basis.transpose(0, 2, 1)).reshape(len(eps), -1, n))
    shared = _shared(order)
    outer, coupling, inner = (
        energy[:, a][:, :, b] for a, b in ((shared, shared), (~shared, shared), (~shared, ~shared))
    )
    return outer - np.matmul(coupling.transpose(0, 2, 1), np.linalg.solve(inner, coupling)), plain


def _fluxes(moved: Real, eps: Real, order: int) -> tuple[Real, Real]:
    """Energies of the faces' potentials that the best flux without sources within has (m, b, b), and the tensors."""
    at, weight, parts, divergence, faces = _legendres(order)
    f, j = _stretch(moved, at)
    plain = np.matmul(f.transpose(0, 1, 3, 2), f) / (eps[:, None] * j)[..., None, None]
    tensor = plain * weight[:, None, None]
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
    return given[:, :k, :k] - held, plain


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
