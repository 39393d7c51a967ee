r"""A scene of boxes as a grid, and elements on them in which every matrix is known in closed form.

The grid is the repeating cell, in layers that shrink towards every edge. In a box of edges h the energy is a
sum over the three directions, each a product of one-dimensional matrices:

.. math:: E = \varepsilon \sum_x \frac{h_y h_z}{2 h_x} \, G_x, \qquad G_x = g \otimes m \otimes m

- Potential (Dirichlet): g is the stiffness and m the mass of polynomials on -1..1.
- Flux (Thomson), with potentials lambda on the faces that keep its normal component continuous and u that keeps it free
  of sources: g is what remains when the flux along x is worked out, m is 1 in an orthonormal basis.

In the eigenvectors of g the unknowns inside a box do not couple, so that they are eliminated by a division.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.bounds import Interval
from sensorgen.scene.repetition import raster
from sensorgen.scene.scene import Body, Scene
from sensorgen.solvers.electrostatics.elimination import HELD, Block, EnergySolution, least
from sensorgen.solvers.electrostatics.mesh import exponent

RATIO = 0.15  # of a layer's distance from an edge to the next layer's
_INFINITE = 1 - 1e-6  # exponents of the potential below this: the field is infinite


@dataclass(frozen=True)
class Grid:
    """Boxes between planes square to the axes.

    Attributes
    ----------
    planes_mm : three arrays
        Where the planes lie on x, y and z [mm].
    fill : (i, j, k) array
        What is in each box: an index into ``names``.
    names : list of str
        Materials; "@bottom" and "@top" first.
    shares : (i, j) array
        How often each place of the cell, or a mirror image, occurs in the sensor [-].
    """

    planes_mm: tuple[Real, ...]
    fill: Whole
    names: list[str]
    shares: Real


def grid(scene: Scene) -> Grid:
    """The repeating cell of a scene of boxes, between its mirrors.

    Raises
    ------
    ValueError
        A prism is no box, bodies overlap, the electrodes touch, or one does not cover the sensor.
    """
    cut = _cell(scene)
    # Refuse electrodes that share a face, an edge or a corner
    corners = []
    for terminal in (0, 1):
        full = np.pad(cut.fill == terminal, 1)
        for axis in range(3):
            full = full | np.roll(full, 1, axis)
        corners.append(full)
    if (corners[0] & corners[1]).any():
        raise ValueError("the electrodes touch: the capacitance grows without bound")
    # The grid with every dielectric outside the field turned to conductor; refuses an open field
    inside = reached(cut.fill, 0) & reached(cut.fill, 1)
    if not inside.any():
        raise ValueError("no dielectric lies between a top and a bottom electrode")
    if inside[:, :, [0, -1]].any():
        raise ValueError("an electrode does not cover the whole sensor")
    used = np.unique(cut.fill[inside])
    number = np.full(len(cut.names), -1)
    number[[0, 1, *used]] = np.arange(len(used) + 2)
    fill = np.where(inside, number[cut.fill], np.where(cut.fill > 1, -1, cut.fill))
    return Grid(cut.planes_mm, fill, ["@bottom", "@top", *(cut.names[k] for k in used)], cut.shares)


def insulated(scene: Scene, axis: int) -> Grid:
    """The repeating cell of boxes in air that insulates, with planes at 0 V and 1 V square to x (0) or y (1).

    Raises
    ------
    ValueError
        A prism is no box, bodies overlap, or none reaches from one plane to the other.
    """
    cut = _cell(scene, evenly=False)
    planes, sides = list(cut.planes_mm), [(int(k == axis),) * 2 for k in range(3)]
    planes[axis] = np.pad(planes[axis], 1, mode="reflect", reflect_type="odd")
    fill = np.pad(np.where(cut.fill == cut.names.index("air"), -1, cut.fill), sides)
    np.moveaxis(fill, axis, 0)[-1] = 1
    inside = reached(fill, 0) & reached(fill, 1)
    if not inside.any():
        raise ValueError("no body reaches from one end to the other")
    x, y, z = planes
    shares = np.pad(cut.shares, sides[:2], mode="edge")
    return Grid((x, y, z), np.where(inside | (fill < 2), fill, -1), cut.names, shares)


def _cell(scene: Scene, evenly: bool = True) -> Grid:
    names = ["@bottom", "@top", *sorted({b.material for b in scene.bodies if not b.terminal} | {"air"})]

    def number(body: Body) -> int:
        return names.index(f"@{body.terminal}" if body.terminal else body.material)

    boxes = raster(scene, number, names.index("air"), [(0.0, size) for size in scene.size_mm], evenly)
    return Grid(boxes.planes_mm, boxes.fill, names, boxes.shares)


def reached(fill: Whole, terminal: int) -> Mask:
    """Dielectric boxes, 2 or more, that a walk through dielectric reaches from one electrode, 0 or 1."""
    reach = fill == terminal
    allowed = reach | (fill > 1)
    while True:
        grown = reach.copy()
        for axis in range(3):
            ahead, back = (np.moveaxis(m, axis, 0) for m in (grown, reach))
            ahead[1:] |= back[:-1]
            ahead[:-1] |= back[1:]
        grown &= allowed
        if (grown == reach).all():
            return np.asarray(reach & (fill > 1))
        reach = grown


def layered(coarse: Grid, values: Sequence[float], layers: int) -> Grid:
    """Cut a grid into layers that shrink towards planes in which the field is infinite at some edge.

    Parameters
    ----------
    coarse : Grid
        A cell.
    values : list of float
        Relative permittivity of each name; its modulus where it is complex [-].
    layers : int
        How many times the distance from a plane shrinks where it holds an edge of an electrode; half as often where
        dielectrics meet [-].
    """
    counts = [np.zeros(len(p), dtype=int) for p in coarse.planes_mm]
    for axis in range(3):
        first, second = (a for a in range(3) if a != axis)
        boxes = np.moveaxis(coarse.fill, axis, 2)
        around = np.stack([boxes[:-1, :-1], boxes[1:, :-1], boxes[1:, 1:], boxes[:-1, 1:]])
        patterns, which = np.unique(around.reshape(4, -1), axis=1, return_inverse=True)
        wanted = np.array([_wanted(p, values, layers) for p in patterns.T.tolist()])[which].reshape(around.shape[1:])
        counts[first][1:-1] = np.maximum(counts[first][1:-1], wanted.max((1, 2), initial=0))
        counts[second][1:-1] = np.maximum(counts[second][1:-1], wanted.max((0, 2), initial=0))
    parts = [_graded(planes, count.tolist()) for planes, count in zip(coarse.planes_mm, counts, strict=True)]
    owners = [owner for _, owner in parts]
    x, y, z = (planes for planes, _ in parts)
    return Grid((x, y, z), coarse.fill[np.ix_(*owners)], coarse.names, coarse.shares[np.ix_(*owners[:2])])


def _wanted(around: list[int], values: Sequence[float], layers: int) -> int:
    """Layers that an edge asks for, by what fills the four boxes around it in turn."""
    fans = [tuple((np.pi / 2, values[code]) for code in run) for run in _runs(around)]
    if all(code > 1 for code in around):
        return layers // 2 if exponent(fans[0], None) < _INFINITE else 0
    return layers if any(exponent(fan, (True, True)) < _INFINITE for fan in fans) else 0


def _runs(around: list[int]) -> Iterator[list[int]]:
    """Dielectrics in turn around an edge, parted by the conductors there."""
    start = next((k for k in range(4) if around[k] <= 1), 0)
    for is_free, run in groupby(around[start:] + around[:start], lambda code: code > 1):
        if is_free:
            yield list(run)


def _graded(planes: Real, layers: list[int]) -> tuple[Real, Whole]:
    """Planes with layers between them, and from which interval each layer comes."""
    finer, owners = [planes[0]], []
    for k, (a, b) in enumerate(pairwise(planes.tolist())):
        half = (b - a) / 2
        left = a + half * RATIO ** np.arange(layers[k], 0, -1)
        right = b - half * RATIO ** np.arange(1, layers[k + 1] + 1)
        inner = [*left.tolist(), *right.tolist(), b]
        finer += inner
        owners += [k] * len(inner)
    return np.array(finer), np.array(owners)


@dataclass(frozen=True)
class Element:
    """One kind of element on -1..1 cubed, of one order.

    Attributes
    ----------
    outer : three (b, b) arrays
        G of each direction for what neighbours share.
    coupling : three (i, b) arrays
        G between what lies inside and what neighbours share.
    inner : three (i,) arrays
        G of what lies inside, which is diagonal.
    one : (b,) array
        What neighbours share where the potential is 1.
    numbers : (b, 4) array
        Of each shared unknown: its place on the lattice of one element, and its kind.
    pitch : int
        Places of the lattice from one element to the next.
    """

    outer: tuple[Real, Real, Real]
    coupling: tuple[Real, Real, Real]
    inner: tuple[Real, Real, Real]
    one: Real
    numbers: Whole
    pitch: int

    def keys(self, boxes: Whole, count: Whole) -> Whole:
        """Numbers of the shared unknowns of boxes, equal where boxes share them.

        Parameters
        ----------
        boxes : (n, 3) array
            Which box of the grid each is, along x, y and z.
        count : (3,) array
            Boxes of the grid along x, y and z.
        """
        sizes = count * self.pitch + 1
        place = boxes[:, None, :] * self.pitch + self.numbers[None, :, :3]
        flat = (place[..., 0] * sizes[1] + place[..., 1]) * sizes[2] + place[..., 2]
        numbers: Whole = flat * 3 + self.numbers[:, 3]
        return numbers

    def condensed(self, scale: Real) -> Real:
        """Energy of the shared unknowns when those inside have found their best values, of a box of three scales."""
        shared, coupling, inner = (
            sum(s * g for s, g in zip(scale, of, strict=True)) for of in (self.outer, self.coupling, self.inner)
        )
        energy: Real = shared - coupling.T @ (coupling / inner[:, None])
        return energy


@cache
def potential(order: int) -> Element:
    """Continuous polynomials of an order: what they minimise lies above."""
    stiffness, mass, _ = _modes(order)
    pair = (stiffness, mass)
    places = np.indices((order + 1,) * 3).reshape(3, -1).T
    ends = places < 2
    shared, inside = ends.any(1), ~ends.any(1)
    lattice = np.array([0, order, *range(1, order)])  # both ends, then the modes between them
    numbers = np.column_stack([lattice[places[shared]], np.zeros(shared.sum(), dtype=np.int64)])
    whole = np.stack([kron([pair[int(a != axis)] for a in range(3)]) for axis in range(3)])
    return Element(
        _three(whole[:, shared][:, :, shared]),
        _three(whole[:, inside][:, :, shared]),
        _three(np.diagonal(whole[:, inside][:, :, inside], axis1=1, axis2=2)),
        ends[shared].all(1).astype(float),
        numbers,
        order,
    )


def kron(factors: list[Real]) -> Real:
    """Kronecker product of three matrices."""
    first, second, third = factors
    return np.kron(np.kron(first, second), third)


def _modes(order: int) -> tuple[Real, Real, Real]:
    """Stiffness and mass of two straight hats and of modes that vanish at both ends and diagonalise both; the modes."""
    at, weight = np.polynomial.legendre.leggauss(order + 1)
    value, slope = hats(order, at)
    stiffness, mass = (v.T @ (weight[:, None] * v) for v in (slope, value))
    turn = np.eye(order + 1)
    turn[2:, 2:] = np.linalg.eigh(mass[2:, 2:]).eigenvectors  # the bubbles' stiffness is 1
    return turn.T @ stiffness @ turn, turn.T @ mass @ turn, turn


def hats(order: int, at: Real) -> tuple[Real, Real]:
    """Two straight hats, and bubbles of degree 2 and more (integrated Legendre), at some places; their slopes."""
    legendre = np.polynomial.legendre.legvander(at, order)
    degree = np.arange(2, order + 1)
    norm = np.sqrt(4 * degree - 2)
    bubbles = (legendre[:, degree] - legendre[:, degree - 2]) / norm
    rising = legendre[:, degree - 1] * (2 * degree - 1) / norm
    half = np.full_like(at, 0.5)
    return np.column_stack([(1 - at) / 2, (1 + at) / 2, bubbles]), np.column_stack([-half, half, rising])


def legendres(order: int, at: Real, weight: Real) -> tuple[Real, Real, Real]:
    """Orthonormal Legendre polynomials up to ``order`` + 1 at points of a quadrature, and at -1 and 1.

    Third, the moments of their slopes with those up to ``order``: the divergence of a flux of Raviart and Thomas.
    """
    norm = np.sqrt(np.arange(order + 2) + 0.5)
    value = np.polynomial.legendre.legvander(at, order + 1) * norm
    ends = np.polynomial.legendre.legvander(np.array([-1.0, 1.0]), order + 1) * norm
    slope = np.polynomial.legendre.legval(at, np.polynomial.legendre.legder(np.diag(norm))).T
    return value, ends, value[:, :-1].T @ (weight[:, None] * slope)


@cache
def flux(order: int) -> Element:
    """Fluxes without sources of an order, and potentials on faces: what they minimise lies below."""
    ends, between, squares, turn = _worked_out(order)
    n = order + 1
    inside = np.indices((n, n, n)).reshape(3, -1)
    pair = np.indices((n, n)).reshape(2, -1)
    outer, coupling = np.zeros((3, 6 * n * n, 6 * n * n)), np.zeros((3, n**3, 6 * n * n))
    numbers = np.zeros((6 * n * n, 4), dtype=np.int64)
    for axis, side in np.ndindex(3, 2):
        face = (2 * axis + side) * n * n
        across = [a for a in range(3) if a != axis]
        rows = face + np.arange(n * n)
        for other in (0, 1):
            outer[axis, rows, rows + (other - side) * n * n] = ends[side, other]
        coupling[axis, np.arange(n**3), face + inside[across[0]] * n + inside[across[1]]] = between[inside[axis], side]
        numbers[rows, axis], numbers[rows[:, None], across], numbers[rows, 3] = side * n, pair.T, axis
    one = np.tile(2.0 * np.outer(turn[0], turn[0]).ravel(), 6)
    return Element(_three(outer), _three(coupling), _three(squares[inside]), one, numbers, n)


@cache
def traces(order: int, flux_order: int) -> Real:
    """Coupling of fluxes to potentials: moments of :func:`potential` with the functions on the faces of :func:`flux`.

    Parameters
    ----------
    order, flux_order : int
        Of both elements.

    Returns
    -------
    (f, b) array
        Of a potential's shared unknowns, its moments on six faces. With the moments of a flux, which G gives of its own
        unknowns, their product is the integral of the potential's gradient along the flux.
    """
    at, weight = np.polynomial.legendre.leggauss(order + flux_order + 2)
    modes = hats(order, at)[0] @ _modes(order)[2]
    _, _, _, turn = _worked_out(flux_order)
    n = flux_order + 1
    legendre = np.polynomial.legendre.legvander(at, flux_order) * np.sqrt(np.arange(n) + 0.5)
    along = (legendre @ turn).T @ (weight[:, None] * modes)
    places = np.indices((order + 1,) * 3).reshape(3, -1).T
    places = places[(places < 2).any(1)]
    moments = np.zeros((6 * n * n, len(places)))
    for axis, side in np.ndindex(3, 2):
        here = np.flatnonzero(places[:, axis] == side)
        first, second = (along[:, places[here, a]] for a in range(3) if a != axis)
        face = (2 * axis + side) * n * n
        moments[face : face + n * n, here] = (first[:, None] * second[None]).reshape(n * n, -1)
    return moments


def _worked_out(order: int) -> tuple[Real, Real, Real, Real]:
    """In one dimension: energy of a flux driven by potentials at two ends and between them, in the latter's modes.

    Returns the ends' matrix, that between modes and ends, the modes' energies, and the modes (orthonormal Legendre).
    """
    _, ends, divergence = legendres(order, *np.polynomial.legendre.leggauss(order + 2))
    squares, turn = np.linalg.eigh(divergence @ divergence.T)
    drive = np.array([[-1.0], [1.0]]) * ends
    return drive @ drive.T, -turn.T @ divergence @ drive.T, squares, turn


def _three(arrays: Real) -> tuple[Real, Real, Real]:
    return arrays[0], arrays[1], arrays[2]


Matrix = NDArray[Any]


@dataclass(frozen=True)
class Boxes:
    """All boxes between the electrodes as elements of one kind.

    Attributes
    ----------
    places : (n, 3) array
        Which box of the grid each is, along x, y and z.
    ids : (n, b) array
        Numbers of the unknowns, equal where boxes share them; 0 and 1 on the bottom and on the top electrode.
    scale : (n, b) array
        By which a number's value is the box's unknown: 1, or on an electrode that of a potential of 1 V.
    eps : (n,) array
        Relative permittivity, complex where it loses [-].
    shares : (n,) array
        How often each occurs in the sensor [-].
    shape : callable
        From a box's number to its matrix for a permittivity of 1: energies over eps0 [mm].
    load : (n, b) array, optional
        Forces on the unknowns, in place of a top at 1 V.
    """

    places: Whole
    ids: Whole
    scale: Real
    eps: Matrix
    shares: Real
    shape: Callable[[int], Real]
    load: Matrix | None = None

    def unknowns(self) -> int:
        """Number of unknowns that the boxes share."""
        return len(np.unique(self.ids[self.ids >= HELD]))

    def least(self, keep: bool = False) -> EnergySolution:
        """The least energy; ``keep`` what finds the unknowns."""
        ids = self.ids if self.load is None else np.pad(self.ids, ((0, 0), (0, 1)), constant_values=1)
        blocks = [Block(own, partial(self._matrix, box), self.places[box]) for box, own in enumerate(ids)]
        return least(blocks, int(self.ids.max()) + HELD, leaf=1, keep=keep)

    def _matrix(self, box: int) -> Matrix:
        scale = self.scale[box]
        energy: Matrix = self.eps[box] * (scale[:, None] * self.shape(box) * scale)
        if self.load is None:
            return energy
        push = -(scale * self.load[box])[:, None]
        return np.block([[energy, push], [push.T, np.zeros((1, 1))]])

    def solved(self) -> Matrix:
        """The unknowns of each box (n, b) that have the least energy."""
        unknowns: Matrix = self.least(keep=True).values()[self.ids] * self.scale
        return unknowns

    def pushed(self, load: Matrix) -> "Boxes":
        """Boxes with both electrodes at 0 V and forces (n, b) on the unknowns."""
        return replace(self, ids=np.where(self.ids < HELD, 0, self.ids), load=load)

    def answers(self, unknowns: Matrix) -> Matrix:
        """Answers (n, b) to the unknowns (n, b): of a flux's, its moments on the six faces."""
        return np.array([e * (self.shape(box) @ x) for box, (e, x) in enumerate(zip(self.eps, unknowns, strict=True))])


def boxes_of(fine: Grid, values: Sequence[complex], kind: Element) -> Boxes:
    """The boxes of a grid whose materials have some relative permittivities."""
    places, count = np.argwhere(fine.fill > 1), np.array(fine.fill.shape)
    keys = kind.keys(places, count)
    ids = np.unique(keys, return_inverse=True)[1].reshape(keys.shape) + HELD
    for code in (0, 1):
        ids[np.isin(keys, kind.keys(np.argwhere(fine.fill == code), count))] = code
    edges = np.column_stack([np.diff(p)[places[:, axis]] for axis, p in enumerate(fine.planes_mm)])
    scales = edges.prod(1)[:, None] / (2 * edges**2)
    return Boxes(
        places, ids, np.where(ids == 1, kind.one, 1.0), np.array(values)[fine.fill[tuple(places.T)]],
        fine.shares[places[:, 0], places[:, 1]], lambda box: kind.condensed(scales[box]),
    )  # fmt: skip


@dataclass(frozen=True)
class Pair:
    """Both kinds of elements on the same boxes; ``seen``, what fluxes feel of potentials."""

    potential: Boxes
    flux: Boxes
    seen: Real

    @classmethod
    def of(cls, fine: Grid, values: Sequence[complex], order: int, flux_order: int) -> "Pair":
        """Of a grid, by the orders of their polynomials."""
        one, other = (boxes_of(fine, values, kind) for kind in (potential(order), flux(flux_order)))
        return cls(one, other, traces(order, flux_order))

    def unknowns(self) -> int:
        """That the larger of the two systems couples."""
        return max(self.potential.unknowns(), self.flux.unknowns())

    def apart(self, u: Matrix, level: Matrix, rho: Real) -> float:
        r"""Distance of fields with these unknowns, :math:`\int |\varepsilon \nabla u - D|^2 / \rho`."""
        squares = np.empty(len(rho))
        for box, (here, there) in enumerate(zip(u, level, strict=True)):
            into, out = self.potential.shape(box) @ here, self.flux.shape(box) @ there
            squares[box] = (here.conj() @ into - 2 * (self.seen @ here) @ out.conj() + there.conj() @ out).real
        return max(float((abs(self.flux.eps) ** 2 / rho) @ squares), 0.0)

    def part(self, level: Matrix, rho: Real) -> tuple[Any, float]:
        """Energy of a flux, by its unknowns, weighted with how often boxes occur beyond the least; and kappa squared.

        The latter is weighted with 1 / ``rho``.
        """
        more = self.flux.shares - self.flux.shares.min()
        if not more.any():
            return 0.0, 0.0
        moments = self.flux.answers(level)
        load = more[:, None] * moments
        gradient, best = self.potential.pushed(load @ self.seen).solved(), self.flux.pushed(load).solved()
        return more @ (level * moments).sum(axis=1), self.apart(gradient, best, rho)


def whole(cell: Interval, part: float, unmet: float, shares: Real) -> Interval:
    """Bounds of all that a sensor holds, from those of its cell and :meth:`Pair.part`."""
    least, most = float(shares.min()), float(shares.max())
    off, kappa = np.sqrt(cell.upper - cell.lower), np.sqrt(unmet)
    energy, worst = least * cell.lower + part, min(off, kappa / least) if least else off
    lower, upper = energy + worst * (least * worst - 2 * kappa), energy + off * (2 * kappa + most * off)
    return Interval(float(lower), float(upper))
