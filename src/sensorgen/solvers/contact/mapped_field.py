r"""Bounds of the capacitance of a cell of deformed boxes, solved on the undeformed boxes.

The deformation gradient F maps undeformed boxes onto deformed ones. Pulled back, the permittivity is the tensor
:math:`\varepsilon J F^{-1} F^{-T}`, and no new mesh is needed. Dirichlet: any potential that is right on the electrodes
has too much energy. Thomson: any flux without sources has too little; its normal component is kept continuous by
potentials on the faces (hybrid H(div)), and so is the mapped one.

Displacements of the boxes are extended into the air between them without folds, so that F has an inverse. Air gaps that
are nearly shut are kept open by a little and deform evenly between their two faces; elsewhere the air's displacement is
harmonic, by finite differences between neighbouring nodes, and bounded by that of its surroundings. What the air does
between the faces does not change the capacitance, as long as it does not fold.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from functools import cache, cached_property
from itertools import combinations_with_replacement, pairwise, product

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.solvers.contact.bricks import BrickMesh
from sensorgen.solvers.contact.element import brick_gradients, cofactor, determinant
from sensorgen.solvers.contact.factors import Factors, factored, iterations, order_of, solved_by_lu
from sensorgen.solvers.electrostatics.boxes import Element, flux, hats, kron, legendres, potential, reached

_SHUT, _OPEN = 0.25, 0.5  # of a gap's width: below and above, its faces' nodes are opposite each other, or as they are
_THIN = 0.1  # of a gap's width: its air deforms evenly
_ROUNDING = 1e-9
_PLACES = np.array(list(product(range(3), repeat=3)))  # of a brick's 27 nodes
_SHARES = np.array([0.25, 0.5, 0.25])  # of a brick's width that belong to its three nodes
_ENDS = [0, 2]  # of three places along a line
_MORE = 3  # points of quadrature beyond the order: the tensor is no polynomial
_CHUNK = 200  # bricks at once
_SMALL = 1e-7  # of the energy, by which an unfinished solution may be off [-]
_LIKE = 30.0  # times which tensors may have grown since factors were made [-]
_AXES = range(3)


@dataclass(frozen=True)
class AirMap:
    """All boxes of a cell, and the solid ones among them."""

    whole: BrickMesh
    solid: BrickMesh

    @cached_property
    def _gaps(self) -> list[tuple[int, Whole, Whole]]:
        """Along each axis with gaps, the nodes of the faces below and above each of them (k, 9)."""
        mesh, gaps = self.solid, []
        number = np.full(mesh.bricks.fill.shape, -1)
        number[tuple(mesh.boxes.T)] = np.arange(len(mesh.boxes))
        lattice = mesh.nodes.reshape(-1, 3, 3, 3)
        for axis, below, above in facing(mesh.bricks.fill):
            near, far = (
                lattice[number[tuple(boxes.T)]].take(end, axis + 1).reshape(-1, 9)
                for boxes, end in ((below, 2), (above, 0))
            )
            gaps += [(axis, near, far)] if len(near) else []
        return gaps

    def displacements_m(self, moved_m: Real, share: float) -> Real:
        """Displacements of all nodes (3n,) from those of the solid ones (n, 3) [m].

        A gap thinner than a share of its width is opened to it, and those beside it until its parabola stays above.
        Where it is nearly shut, the lower face's nodes slide along it to those that they face, or the air between
        would be sheared until it folds.
        """
        mesh, opened = self.whole, moved_m.copy()
        size = mesh.lattice.max(axis=0) + 1
        number = np.ravel_multi_index(tuple(self.solid.lattice.T), tuple(size))
        thin = []
        for axis, near, far in self._gaps:
            width = self.solid.points_m[far, axis] - self.solid.points_m[near, axis]
            drawn = 1 + (moved_m[far, axis] - moved_m[near, axis]) / width
            gap = _bulged(np.maximum(drawn, share), far, share)
            slide = np.clip((_OPEN - drawn) / (_OPEN - _SHUT), 0.0, 1.0)[..., None] * (moved_m[far] - moved_m[near])
            slide[..., axis] = 0.0
            last = np.argsort(-(drawn * width), axis=None)  # a node at a corner has two gaps: the thinner one counts
            opened[far.ravel()[last], axis] += ((gap - drawn) * width).ravel()[last]
            slid = np.zeros_like(moved_m)
            slid[near.ravel()[last]] = slide.reshape(-1, 3)[last]
            opened += _spread(slid, near)
            here = (gap < _THIN).any(axis=1)
            thin.append((axis, near[here].ravel(), far[here].ravel()))
        u = np.full((len(mesh.points_m), 3), np.nan)
        u[number] = opened
        for axis, near, far in thin:
            stride = int(np.prod(size[axis + 1 :]))
            for start, stop in zip(number[near].tolist(), number[far].tolist(), strict=True):
                nodes = np.arange(start, stop + 1, stride)
                at = (mesh.points_m[nodes, axis] - mesh.points_m[start, axis])[:, None]
                u[nodes] = u[start] + at / at[-1] * (u[stop] - u[start])
        if np.isnan(u).any():
            matrix = _differences(mesh)
            u = np.column_stack([_harmonic(mesh, matrix, u[:, axis], axis) for axis in range(3)])
        return u.ravel()


def facing(fill: Whole) -> list[tuple[int, Whole, Whole]]:
    """Boxes on both sides of each gap: along which axis, and which boxes (k, 3) lie below and above it."""
    found = []
    for axis in range(3):
        runs = np.moveaxis(fill, axis, -1)
        pairs = []
        for place in np.ndindex(*runs.shape[:2]):
            solid = np.flatnonzero(runs[place])
            pairs += [(*place, a, b) for a, b in pairwise(solid.tolist()) if b - a > 1]
        rows = np.array(pairs, np.int64).reshape(-1, 4)
        below, above = (np.insert(rows[:, :2], axis, rows[:, k], axis=1) for k in (2, 3))
        found.append((axis, below, above))
    return found


def _bulged(gap: Real, nodes: Whole, least: float) -> Real:
    """Gaps at the nine nodes of faces (k, 9), raised where the parabolas through them would dip below a least one.

    Coefficients of Bernstein's polynomials bound a parabola: all are held above. Faces share nodes.
    """
    raised = gap.reshape(-1, 3, 3).copy()
    raised[:, 1, _ENDS] = np.maximum(raised[:, 1, _ENDS], raised[:, _ENDS][:, :, _ENDS].sum(axis=1) / 4 + least / 2)
    raised[:, _ENDS, 1] = np.maximum(raised[:, _ENDS, 1], raised[:, _ENDS][:, :, _ENDS].sum(axis=2) / 4 + least / 2)
    highest = np.zeros(nodes.max() + 1)
    np.maximum.at(highest, nodes, raised.reshape(nodes.shape))
    raised = highest[nodes].reshape(-1, 3, 3)
    edges = raised[:, 1, _ENDS].sum(axis=1) + raised[:, _ENDS, 1].sum(axis=1)
    corners = raised[:, _ENDS][:, :, _ENDS].sum((1, 2))
    raised[:, 1, 1] = np.maximum(raised[:, 1, 1], (least + edges - corners / 4) / 4)
    return raised.reshape(-1, 9)


def _spread(slide: Real, faces: Whole) -> Real:
    """Slides of nodes (n, 3), those amid edges and faces (k, 9) that do not slide by the mean of their ends.

    Where the corner of a face slides alone, its parabola would turn back.
    """
    slides, lattice = slide.copy(), faces.reshape(-1, 3, 3)
    corners = lattice[:, _ENDS][:, :, _ENDS]
    between = (
        (lattice[:, 1, _ENDS], lattice[:, _ENDS].transpose(1, 0, 2)[..., _ENDS]),
        (lattice[:, _ENDS, 1], lattice[..., _ENDS].transpose(2, 0, 1)[..., _ENDS]),
        (lattice[:, 1, 1], corners.reshape(-1, 4).T),
    )
    for middle, around in between:
        still = (slide[middle] == 0).all(axis=-1)
        slides[middle[still]] = slide[around].mean(axis=0)[still]
    return slides


def _harmonic(mesh: BrickMesh, matrix: csr_matrix, given: Real, axis: int) -> Real:
    """One component, NaN where unknown; at the mirrors across its axis it is as elsewhere on them."""
    values, place = given.copy(), mesh.points_m[:, axis]
    for end in (place.min(), place.max()):
        at = np.abs(place - end) < _ROUNDING * np.ptp(place)
        known = values[at & ~np.isnan(values)]
        values[at & np.isnan(values)] = known.mean() if axis < 2 and len(known) else 0.0
    free = np.isnan(values)
    if free.any():
        values[free] = 0.0
        values[free] = solved_by_lu(matrix[free][:, free], -(matrix @ values)[free])
    return values


def _differences(mesh: BrickMesh) -> csr_matrix:
    """Sum over neighbouring nodes of air of (area between them over their distance) times difference."""
    air, edges = mesh.nodes[mesh.region == 0], mesh.edges_m[mesh.region == 0]
    rows, columns, weights = [], [], []
    for axis in range(3):
        start = np.flatnonzero(_PLACES[:, axis] < 2)
        a, b = (k for k in range(3) if k != axis)
        share = _SHARES[_PLACES[start, a]] * _SHARES[_PLACES[start, b]]
        weight = ((2 * edges[:, a] * edges[:, b] / edges[:, axis])[:, None] * share).ravel()
        one, other = air[:, start].ravel(), air[:, start + 3 ** (2 - axis)].ravel()
        rows += [one, other, one, other]
        columns += [one, other, other, one]
        weights += [weight, weight, -weight, -weight]
    places = np.concatenate(rows), np.concatenate(columns)
    return coo_matrix((np.concatenate(weights), places), (len(mesh.points_m),) * 2).tocsr()


Local = Callable[[Real, Real, int], tuple[Real, Real]]


class Folded(BadInput):
    """The displacement turns a part of the air inside out: faces run into each other."""


@dataclass(frozen=True)
class FieldOrders:
    """Of the polynomials of the potential and of the flux."""

    potential: int = 3
    flux: int = 2


@dataclass
class MappedField:
    """Capacitance of a cell of boxes, load after load.

    Attributes
    ----------
    mesh : BrickMesh
        All boxes of the cell, air included.
    permittivity : mapping of str to float
        Relative permittivity by material, with "air" [-].
    orders : FieldOrders
        Of the polynomials.

    Raises
    ------
    OutOfRange
        The electrodes touch.
    BadInput
        An electrode does not cover the cell, or nothing lies between them.
    """

    mesh: BrickMesh
    permittivity: Mapping[str, float]
    orders: FieldOrders

    def __post_init__(self) -> None:
        """Select the boxes that carry field, and number their unknowns."""
        bricks = self.mesh.bricks
        of = [[k for k, r in enumerate(bricks.regions) if r.terminal == end] for end in ("bottom", "top")]
        ends = [np.isin(bricks.fill, regions) for regions in of]
        # Dielectric carries field in a piece that touches both electrodes
        fill = np.where(ends[0], 0, np.where(ends[1], 1, 2))
        inside = reached(fill, 0) & reached(fill, 1)
        if not inside.any():
            raise BadInput("no dielectric lies between a top and a bottom electrode")
        if inside[:, :, [0, -1]].any():
            raise BadInput("an electrode does not cover the whole cell")
        if np.intersect1d(*(self.mesh.nodes[end[tuple(self.mesh.boxes.T)]] for end in ends)).size:
            raise OutOfRange("the electrodes touch: the capacitance grows without bound")
        self.carrying = np.asarray(inside[tuple(self.mesh.boxes.T)])
        # Legendre polynomials, of which the first on each face is a potential of 1/2
        kind, one = flux(self.orders.flux), np.zeros((6, (self.orders.flux + 1) ** 2))
        one[:, 0] = 2.0
        boxes = self.mesh.boxes[self.carrying]
        self.systems = {
            "flux": _system(boxes, ends, replace(kind, one=one.ravel()), _fluxes, self.orders.flux),
            "potential": _system(boxes, ends, potential(self.orders.potential), _potentials, self.orders.potential),
        }

    def capacitance(self, u_m: Real) -> Interval:
        """Bounds of the capacitance of the deformed cell per area of the cell as drawn [F/m2].

        Parameters
        ----------
        u_m : (3n,) array
            Displacements of all nodes [m].

        Raises
        ------
        Folded
            The displacement folds the air.
        """
        regions, nodes = self.mesh.bricks.regions, self.mesh.nodes[self.carrying]
        eps = np.array([self.permittivity.get(r.material, np.nan) for r in regions])[self.mesh.region[self.carrying]]
        places = u_m.reshape(-1, 3)[nodes] + self.mesh.points_m[nodes]
        area = float(np.prod(np.ptp(self.mesh.points_m[nodes].reshape(-1, 3), axis=0)[:2]))
        least, missing = self.systems["flux"].least(places, eps)
        lower, upper = (least - missing) / area, self.systems["potential"].least(places, eps)[0] / area
        if not 0 < lower <= upper * (1 + _ROUNDING):
            raise BadInput(f"bounds in the wrong order, {lower} above {upper}: the solver failed on this cell")
        return Interval(lower * (1 - _ROUNDING), upper * (1 + _ROUNDING)).times(EPS0_F_PER_M)


@dataclass
class _System:
    """Energy of the unknowns that boxes share; the factors of one load serve for the next.

    An approximate potential is still one, so that its energy still lies above; that of an approximate flux lies below
    once the largest error that its residual allows is subtracted. With factors K0 of an earlier K, whose tensors T0 are
    such that T <= c T0 everywhere, this is c r' K0^-1 r at most; c <= the largest trace of T0^-1 T.

    Attributes
    ----------
    number : (m, b) array
        Of the free unknowns of each box, -1 for others.
    one : (m, b) array
        Values of the others: at 1 V on the top, else 0.
    places : (n, 3) array
        Of the free unknowns.
    local : callable
        Energies and tensors of boxes, by their places, permittivity and the polynomials' order.
    order : int
        Of the polynomials.
    """

    number: Whole
    one: Real
    places: Whole
    local: Local
    order: int
    factors: Factors | None = None
    _tensors: Real = dataclass_field(default_factory=lambda: np.empty(0), repr=False)
    _unknowns: Real = dataclass_field(default_factory=lambda: np.empty(0), repr=False)

    def least(self, places: Real, eps: Real) -> tuple[float, float]:
        """Energy at 1 V that is at least the least, and by how much it may be above it at most."""
        parts = [
            self.local(places[k : k + _CHUNK], eps[k : k + _CHUNK], self.order) for k in range(0, len(eps), _CHUNK)
        ]
        energies, tensors = (np.concatenate([part[k] for part in parts]) for k in range(2))
        n, b = len(self.places), self.number.shape[1]
        rows, columns = np.repeat(self.number, b, axis=1).ravel(), np.tile(self.number, (1, b)).ravel()
        coupled, free = (rows >= 0) & (columns >= 0), self.number >= 0
        matrix = coo_matrix((energies.ravel()[coupled], (rows[coupled], columns[coupled])), (n, n)).tocsr()
        pushed = np.einsum("mij,mj->mi", energies, self.one)
        push: Real = np.bincount(self.number[free], pushed[free], n).astype(float)
        constant = float((pushed * self.one).sum())
        if len(self._tensors):
            apart = float(np.trace(np.linalg.solve(self._tensors, tensors), axis1=-2, axis2=-1).max())
            if apart < _LIKE and (bounds := self._iterated(matrix, push, constant, apart)):
                return bounds
        self.factors = factored(matrix, order_of(matrix, self.places))
        self._tensors, self._unknowns = tensors, np.zeros_like(push)
        bounds = self._iterated(matrix, push, constant, 3.0)
        if bounds is None:
            raise BadInput("the field's equations could not be solved on this cell")
        return bounds

    def _iterated(self, matrix: csr_matrix, push: Real, constant: float, apart: float) -> tuple[float, float] | None:
        """Nearly the least of held + x' K x + 2 push' x, and by how much less it may be at most."""
        if self.factors is None:
            return None
        start = self._unknowns
        for step, left, power in iterations(matrix, -push - matrix @ start, self.factors):
            x = start + step
            energy = constant + float(push @ x - x @ left)
            if apart * power < _SMALL * energy:
                self._unknowns = x
                return energy, apart * power
        return None


def _system(boxes: Whole, ends: list[Mask], kind: Element, local: Local, order: int) -> _System:
    """Number the unknowns of boxes between two electrodes."""
    count = np.array(ends[0].shape)
    keys = kind.keys(boxes, count)
    below, above = (np.isin(keys, kind.keys(np.argwhere(end), count)) for end in ends)
    free = ~(below | above)
    known, number = np.unique(keys[free], return_inverse=True)
    numbers = np.full(keys.shape, -1)
    numbers[free] = number
    lattice = np.column_stack(np.unravel_index(known // 3, tuple(count * kind.pitch + 1)))
    places = 2 * (lattice // kind.pitch) + (lattice % kind.pitch > 0)
    return _System(numbers, np.where(above, kind.one, 0.0), places, local, order)


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
    shared = (np.indices((order + 1,) * 3).reshape(3, -1) < 2).any(axis=0)  # those that do not vanish at all faces
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
    inner = np.matmul(coupling.transpose(0, 2, 1), np.linalg.solve(given[:, k:, k:], coupling))
    return given[:, :k, :k] - inner, plain


@cache
def _hats(order: int) -> tuple[Real, Real, Real]:
    """Points along an axis, weights of their lattice, and gradients (points, n, 3) of hats and integrated Legendres."""
    at, weight = np.polynomial.legendre.leggauss(order + _MORE)
    pair = hats(order, at)
    gradient = [_lattice([pair[int(a == axis)] for a in _AXES]) for axis in _AXES]
    return at, _weights(weight), np.stack(gradient, axis=-1)


def _lattice(factors: list[Real]) -> Real:
    """Products of functions (points, functions) of the three axes, on the lattice of their points."""
    products = np.einsum("ai,bj,ck->abcijk", *factors)
    return np.asarray(products.reshape(int(np.prod(products.shape[:3])), -1))


def _weights(weight: Real) -> Real:
    return np.asarray(np.einsum("a,b,c->abc", weight, weight, weight).ravel())


@cache
def _legendres(order: int) -> tuple[Real, Real, list[Real], Real, Real]:
    """Points and weights; each component of the flux (points, n); its divergence (k, 3n), and what leaves (b, 3n).

    Raviart and Thomas: of one order more along its own axis, in orthonormal Legendre polynomials.
    """
    at, weight = np.polynomial.legendre.leggauss(order + _MORE)
    value, ends, inwards = legendres(order, at, weight)  # (q, k + 2), (2, k + 2), (k + 1, k + 2)
    n, unit = order + 1, np.eye(order + 1)
    parts = [_lattice([value if a == axis else value[:, :-1] for a in _AXES]) for axis in _AXES]
    divergence = np.concatenate([kron([inwards if a == axis else unit for a in _AXES]) for axis in _AXES], axis=1)
    faces = np.zeros((6 * n * n, 3, n * n * (n + 1)))
    for axis, side in product(_AXES, range(2)):
        leaving = (-1, 1)[side] * kron([ends[side : side + 1] if a == axis else unit for a in _AXES])
        faces[(2 * axis + side) * n * n :][: n * n, axis] = leaving
    return at, _weights(weight), parts, divergence, faces.reshape(6 * n * n, -1)
