"""Potential and stream function on a graded mesh of the plane: elements, unknowns, blocks for the solver, energies.

Elements are polynomials on triangles, those inside eliminated, and rings of triangles around a corner. In the plane
energies have no scale, so that all rings are one. One ring joined to itself makes two, these four, and so on (cyclic
reduction): a thousand rings take ten steps, and no radius is ever written down, be it 1e-300 of the cell's.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.solvers.electrostatics.elimination import HELD, Block, Numbers, added, eliminated, least
from sensorgen.solvers.electrostatics.mesh import Cones, Flow

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


RATIO = 0.25  # of one ring's radius to the last; more lowers the error no further


def ring_corners(tips: Real) -> Real:
    """The two triangles (2 s, 3, 2) of each tip (s, 3, 2; at the origin, first, last) in the outermost ring."""
    first, last = tips[:, 1], tips[:, 2]
    both = [last, RATIO * last, first], [RATIO * last, RATIO * first, first]
    return np.stack([np.stack(part, axis=1) for part in both], axis=1).reshape(-1, 3, 2)


@dataclass(frozen=True)
class RingLayout:
    """Unknowns of one ring around a corner, by what they touch.

    Attributes
    ----------
    free : array
        Spokes that are not held. Their outer ends are the first unknowns.
    rim : (s, 2) array
        Spokes at the ends of each outer side, the lower first. Their modes are the next unknowns.
    outer : int
        m, how many unknowns these are.
    held : bool
        Whether the corner lies on a line of one value.
    ring, ring_signs : (s, 2, 3 order) array
        Unknowns of both triangles in each sector: 1 to m outer, m more inner, the held value if any, others; 0 is none.
    tip, tip_signs : (s, 3 order) array
        Of the innermost triangles: 1 to m outer, the held value if any, others.
    """

    free: Whole
    rim: Whole
    outer: int
    held: bool
    ring: Whole
    ring_signs: Real
    tip: Whole
    tip_signs: Real

    @classmethod
    @cache
    def of(cls, spokes: int, closed: bool, ends: tuple[bool, bool], order: int) -> "RingLayout":
        """For so many spokes, of which the first and the last may be held."""
        fixed = np.zeros(spokes, bool)
        fixed[0], fixed[-1] = ends
        a = np.arange(spokes if closed else spokes - 1)
        b = (a + 1) % spokes
        pairs = np.stack([b, b + spokes, a, b + spokes, a + spokes, a], axis=1).reshape(-1, 3)
        ring, ring_signs = _arranged(pairs, spokes, 2, np.tile(fixed, 2), order)
        tips = np.stack([np.full_like(a, spokes), a, b], axis=1)
        tip, tip_signs = _arranged(tips, spokes, 1, np.append(fixed, fixed.any()), order)
        rim = np.stack([np.minimum(a, b), np.maximum(a, b)], axis=1)
        rim = rim[np.lexsort((rim[:, 1], rim[:, 0]))]
        outer = int((~fixed).sum()) + len(a) * (order - 1)
        shape = (len(a), 2, 3 * order)
        free, held = np.flatnonzero(~fixed), bool(fixed.any())
        return cls(free, rim, outer, held, ring.reshape(shape), ring_signs.reshape(shape), tip, tip_signs)


def _arranged(corners: Whole, spokes: int, levels: int, fixed: Mask, order: int) -> tuple[Whole, Real]:
    """Unknowns of triangles, numbered from 1: by levels of so many points, then the held value, then all others."""
    points, after = np.arange(len(fixed)), np.roll(corners, -1, axis=1)
    ends = np.sort(np.stack([corners, after], axis=-1), axis=-1).reshape(-1, 2)
    (low, high), side = np.unique(ends.T, axis=1, return_inverse=True)
    vertex, first, level = np.zeros(len(fixed), np.int64), np.zeros(len(low), np.int64), np.full(len(low), levels)
    level[low // spokes == high // spokes] = (low // spokes)[low // spokes == high // spokes]
    is_spoke = (low % spokes == high % spokes) | (levels == 1)
    level[fixed[low] & fixed[high] & is_spoke & (level == levels)] = -1
    count = 1
    for here in range(levels + 1):
        if here == levels and fixed.any():
            vertex[fixed], count = count, count + 1
        own, sides = (np.minimum(points // spokes, levels) == here) & ~fixed, level == here
        vertex[own] = count + np.arange(own.sum())
        count += int(own.sum())
        first[sides] = count + (order - 1) * np.arange(sides.sum())
        count += (order - 1) * int(sides.sum())
    return numbered(corners, vertex, first[side.reshape(corners.shape)], order)


@dataclass(frozen=True)
class Cone:
    """All rings around a corner: energy of the outermost unknowns, and recovery of the inner ones.

    Attributes
    ----------
    layout : RingLayout
        Of its unknowns.
    matrix : (m, m) or (m + 1, m + 1) array
        Of the outermost unknowns, and of the held value if there is one.
    in_ring, at_tip : array
        Unknowns within a ring from those at its rims; of the innermost triangles from their outer ones.
    between : list of array
        Unknowns amid two rings, amid four, ... from those at their rims.
    innermost : array
        Unknowns at the innermost triangles' rim from what ``matrix`` takes.
    """

    layout: RingLayout
    matrix: Numbers
    in_ring: Numbers
    between: list[Numbers]
    innermost: Numbers
    at_tip: Numbers

    @classmethod
    def of(cls, layout: RingLayout, rings: Numbers, tips: Numbers, doublings: int) -> "Cone":
        """Of energies (s, 2, k, k) of one ring's triangles, and (s, k, k) of the innermost, 2 ** doublings rings."""
        m, held = layout.outer, int(layout.held)
        ring, in_ring = eliminated(_assembled(layout.ring, layout.ring_signs, rings), 2 * m + held)
        tip, at_tip = eliminated(_assembled(layout.tip, layout.tip_signs, tips), m + held)
        between = []
        for _ in range(doublings):
            ring, amid = _doubled(ring, m)
            between.append(amid)
        # A ring around the innermost triangles, without the unknowns amid them, and the matrix that gives those
        inner, kept = slice(m, 2 * m), np.r_[:m, 2 * m : len(ring)]
        mixed = ring[inner][:, kept]
        mixed[:, m:] += tip[:m, m:]
        innermost = -np.linalg.solve(ring[inner, inner] + tip[:m, :m], mixed)
        both = ring[kept[:, None], kept]
        both[m:, m:] += tip[m:, m:]
        return cls(layout, both + mixed.T @ innermost, in_ring, between, innermost, at_tip)

    def inside(self, values: Numbers) -> tuple[Numbers, Numbers]:
        """Values in all rings' triangles (rings, s, 2, k) and in the innermost (s, k), from those ``matrix`` takes."""
        m = self.layout.outer
        fixed = values[m:]
        rims = np.stack([values[:m], self.innermost @ values])
        for amid in reversed(self.between):
            finer = np.empty((2 * len(rims) - 1, m), rims.dtype)
            finer[::2], finer[1::2] = rims, _pairs(rims, fixed) @ amid.T
            rims = finer
        pairs, last = _pairs(rims, fixed), np.concatenate([rims[-1], fixed])
        rings = np.concatenate([np.zeros((len(pairs), 1)), pairs, pairs @ self.in_ring.T], axis=1)
        tip = np.concatenate([[0.0], last, self.at_tip @ last])
        layout = self.layout
        return rings[:, layout.ring] * layout.ring_signs, tip[layout.tip] * layout.tip_signs


def _pairs(rims: Numbers, fixed: Numbers) -> Numbers:
    """Each rim beside the next, and the held value."""
    return np.concatenate([rims[:-1], rims[1:], np.broadcast_to(fixed, (len(rims) - 1, len(fixed)))], axis=1)


def _assembled(ids: Whole, signs: Real, matrices: Numbers) -> Numbers:
    """Sum of the triangles' energies; unknown 0 is none."""
    signed = signs[..., :, None] * matrices * signs[..., None, :]
    return added(int(ids.max()) + 1, [(ids, signed)])[1:, 1:]


def _doubled(ring: Numbers, m: int) -> tuple[Numbers, Numbers]:
    """Two rings as one, without the unknowns amid them, and the matrix that gives those."""
    outer, inner, fixed = slice(m), slice(m, 2 * m), slice(2 * m, None)
    mixed = np.concatenate([ring[inner, outer], ring[outer, inner], ring[inner, fixed] + ring[outer, fixed]], axis=1)
    amid = -np.linalg.solve(ring[inner, inner] + ring[outer, outer], mixed)
    apart = ring.copy()
    apart[outer, inner] = apart[inner, outer] = 0.0
    apart[fixed, fixed] *= 2
    return apart + mixed.T @ amid, amid


@dataclass(frozen=True)
class Field:
    """A function on all triangles, by its values on their sides.

    Attributes
    ----------
    plain : (n, k) array
        Of the triangles that are no tips.
    cones : list of ((rings, s, 2, k) array, (s, k) array)
        Of the rings at each singular corner, and of the innermost triangles.
    """

    plain: Numbers
    cones: list[tuple[Numbers, Numbers]]

    def conj(self) -> "Field":
        """Complex conjugate of the field."""
        return Field(self.plain.conj(), [(rings.conj(), tips.conj()) for rings, tips in self.cones])

    def moduli(self) -> "Field":
        """The moduli of its values."""
        return Field(abs(self.plain), [(abs(rings), abs(tips)) for rings, tips in self.cones])


Jumps = list[tuple[int, int]]


@dataclass(frozen=True)
class _Share:
    """Map from the unknowns to the values on blocks of one size.

    Attributes
    ----------
    ids, signs : (n, k) array
        The unknown of each value, and 1 or -1.
    jumps : mapping of int to list of (int, int)
        By block, places of values to which another unknown adds, and that one.
    """

    ids: Whole
    signs: Real
    jumps: Mapping[int, Jumps]

    def blocks(self, matrices: Numbers, places: Real) -> list[Block]:
        """For the solver."""
        signed = self.signs[:, :, None] * matrices * self.signs[:, None, :]
        blocks = [Block(*parts) for parts in zip(self.ids, signed, places, strict=True)]
        for number, jumps in self.jumps.items():
            rows = np.array([*range(len(self.ids[number])), *(k for k, _ in jumps)])
            ids = np.array([*self.ids[number], *(jump for _, jump in jumps)])
            blocks[number] = Block(ids, signed[number][rows[:, None], rows], places[number])
        return blocks

    def values(self, unknowns: Numbers) -> Numbers:
        """On each block (n, k)."""
        own = unknowns[self.ids]
        for number, jumps in self.jumps.items():
            for place, jump in jumps:
                own[number, place] += unknowns[jump]
        return np.asarray(own * self.signs)


@dataclass(frozen=True)
class PlaneProblem:
    """A function to be found: what weighs its slope, and where it is held.

    Attributes
    ----------
    plane : Plane
        Mesh that it lives on, and its polynomials.
    weight : (n,) array
        Of each triangle.
    edge : Flow
        Boundary: points whose value is an unknown that others share, sides along which the function does not change,
        and what flows into the top, which is nothing for a potential.
    """

    plane: "Plane"
    weight: Numbers
    edge: Flow

    def solved(self) -> Field:
        """The function of least energy, less twice what flows into the top where a flux is sought."""
        mesh, points = self.plane.mesh, self.plane.mesh.triangles.points
        plain, cones = self._plain_share(), list(map(self._cone, mesh.fans, self.plane.cone_energies))
        rims = [self._rim(corner, cone.layout) for corner, cone in zip(mesh.fans, cones, strict=True)]
        energies = self.weight[mesh.plain, None, None] * self.plane.plain_energy
        blocks, corners = plain.blocks(energies, points[mesh.corners[mesh.plain, 0]]), points[list(mesh.fans)][:, None]
        for rim, cone, at in zip(rims, cones, corners, strict=True):
            blocks += rim.blocks(cone.matrix[None], at)
        unknowns = least([*blocks, *self._rises()], self._unknowns[0]).values()
        inside = [cone.inside(rim.values(unknowns)[0]) for cone, rim in zip(cones, rims, strict=True)]
        return Field(plain.values(unknowns), inside)

    @cached_property
    def _unknowns(self) -> tuple[int, Whole, Whole]:
        """Number of unknowns; the unknown of each point; the first of each side, 0 where it has none."""
        mesh, held, count = self.plane.mesh, self.edge.held, self.edge.count
        vertex = np.full(len(mesh.triangles.points), -1)
        vertex[list(held)] = list(held.values())
        used = np.unique(mesh.corners[mesh.plain])
        free = used[vertex[used] < 0]
        vertex[free] = count + np.arange(len(free))
        count += len(free)
        names, modes = mesh.sides[0], self.plane.order - 1
        open_sides = ~np.isin(names, mesh.names(*np.array(list(self.edge.walls)).reshape(-1, 2).T))
        first = np.zeros(len(names), np.int64)
        first[open_sides] = count + modes * np.arange(open_sides.sum())
        return count + modes * int(open_sides.sum()), vertex, first

    def _plain_share(self) -> _Share:
        mesh, lifts, (_, vertex, first) = self.plane.mesh, self.edge.lifts, self._unknowns
        corners, at = mesh.triangles.triangles, {n: k for k, n in enumerate(mesh.plain.tolist())}
        jumps = {at[n]: [(corners[n].index(p), jump) for p, jump in own] for n, own in lifts.items() if n in at}
        return _Share(*numbered(mesh.corners[mesh.plain], vertex, first[mesh.sides[1]], self.plane.order), jumps)

    def _cone(self, corner: int, energies: tuple[Real, Real]) -> Cone:
        mesh, (rings, tips) = self.plane.mesh, energies
        fan, walls = mesh.fans[corner], self.edge.walls
        first, last = ((min(corner, end), max(corner, end)) in walls for end in (fan.spokes[0], fan.spokes[-1]))
        layout = RingLayout.of(len(fan.spokes), fan.closed, (first, last), self.plane.order)
        here = self.weight[fan.members][:, None, None]
        return Cone.of(layout, rings * here[:, None], tips * here, mesh.doublings[corner])

    def _rim(self, corner: int, layout: RingLayout) -> _Share:
        """Values that a cone shares with its neighbours, in its own turn."""
        _, vertex, first = self._unknowns
        mesh, fan = self.plane.mesh, self.plane.mesh.fans[corner]
        spokes = np.array(fan.spokes)
        free = spokes[layout.free]
        a, b = spokes[layout.rim].T
        on_side = first[np.searchsorted(mesh.sides[0], mesh.names(a, b))]
        modes = np.arange(self.plane.order - 1)
        sign = np.where((a > b)[:, None], (-1.0) ** modes, 1.0)
        fixed = vertex[[corner]] if layout.held else vertex[:0]
        ids = np.concatenate([vertex[free], (on_side[:, None] + modes).ravel(), fixed])
        signs = np.concatenate([np.ones(len(free)), sign.ravel(), np.ones(len(fixed))])
        lifts = {lift for n in fan.members for lift in self.edge.lifts.get(n, ())}
        jumps = [(free.tolist().index(point), jump) for point, jump in sorted(lifts)]
        return _Share(ids[None], signs[None], {0: jumps} if jumps else {})

    def _rises(self) -> Iterator[Block]:
        """Minus the function's rise along the top, as an energy with the unknown 1, whose value is 1; none without."""
        if not self.edge.top:
            return
        count, vertex, _ = self._unknowns
        ends = np.array(self.edge.top)
        start, end = (np.bincount(vertex[e] + 1, minlength=count + 1)[1:] for e in ends.T)  # -1, at cones, cancels
        rise = (end - start).astype(float)
        for jump, times in self.edge.rise.items():
            rise[jump] += times
        where = np.flatnonzero(rise)
        where = where[where >= HELD]
        matrix = np.zeros((len(where) + 1,) * 2)
        matrix[0, 1:] = matrix[1:, 0] = -rise[where]
        yield Block(np.concatenate([[1], where]), matrix, self.plane.mesh.triangles.points[ends[:, 0]].mean(axis=0))


@dataclass(frozen=True)
class Plane:
    """A mesh with polynomials of one order."""

    mesh: Cones
    order: int

    @property
    def unknowns(self) -> int:
        """That triangles and cones share, up to those held."""
        points = len(np.unique(self.mesh.corners[self.mesh.plain]))
        return points + len(self.mesh.sides[0]) * (self.order - 1)

    def potential(self, weight: Numbers) -> Field:
        """The best potential, 0 V at the bottom and 1 V at the top; ``weight`` (n,) of each triangle."""
        ends = self.mesh.triangles.terminals
        volts = {point: int(name == "top") for edge, name in ends.items() for point in edge}
        return self._grounded(PlaneProblem(self, weight, Flow(volts, set(ends), {}, [], {}, HELD)).solved())

    def stream(self, weight: Numbers) -> Field:
        """The function whose curl is the flux at which twice what flows into the top, less its energy, is most."""
        return self._grounded(PlaneProblem(self, weight, self.mesh.flow).solved())

    def energies(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . grad g over each triangle of the mesh."""
        return self._over(f, g, self.plain_energy, self.cone_energies)

    def crossings(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . curl g over each triangle of the mesh."""
        same = crossed(self.order)
        return self._over(f, g, same, [(same, same)] * len(f.cones))

    def energy_terms(self, f: Field) -> Numbers:
        """Moduli of all terms that :meth:`energies` of ``f`` and its conjugate adds, over each triangle."""
        size, cones = f.moduli(), [(abs(rings), abs(tips)) for rings, tips in self.cone_energies]
        return self._over(size, size, abs(self.plain_energy), cones)

    def crossing_terms(self, f: Field, g: Field) -> Numbers:
        """Moduli of all terms that :meth:`crossings` adds, over each triangle."""
        size = abs(crossed(self.order))
        return self._over(f.moduli(), g.moduli(), size, [(size, size)] * len(f.cones))

    def _grounded(self, f: Field) -> Field:
        """Less the value at one end of each triangle's shortest side.

        A constant has no energy, but rounding times 1e10 is some; both ends have about the same value.
        """
        # The corner at which each triangle's shortest side starts.
        starts = [((np.roll(s, -1, axis=1) - s) ** 2).sum(axis=-1).argmin(axis=-1) for s in self._shapes]
        plain, *others = starts
        cones = [
            (_less(rings, ring.reshape(-1, 2)), _less(tips, tip))
            for (rings, tips), ring, tip in zip(f.cones, others[::2], others[1::2], strict=True)
        ]
        return Field(_less(f.plain, plain), cones)

    def _over(self, f: Field, g: Field, plain: Real, cones: Sequence[tuple[Real, Real]]) -> Numbers:
        by_triangle = np.zeros(len(self.mesh.corners), np.result_type(f.plain, g.plain))
        by_triangle[self.mesh.plain] = _product(f.plain, plain, g.plain)
        for fan, (rings, tips), mine, other in zip(self.mesh.fans.values(), cones, f.cones, g.cones, strict=True):
            by_triangle[fan.members] = _product(mine[0], rings, other[0]).sum(axis=(0, 2))
            by_triangle[fan.members] += _product(mine[1], tips, other[1])
        return by_triangle

    @property
    def plain_energy(self) -> Real:
        """Energies of the plain triangles (n, k, k)."""
        return self._matrices[0]

    @property
    def cone_energies(self) -> list[tuple[Real, Real]]:
        """Energies of one ring's triangles (s, 2, k, k) and of the innermost (s, k, k), at each singular corner."""
        rings = (m.reshape(-1, 2, *m.shape[1:]) for m in self._matrices[1::2])
        return list(zip(rings, self._matrices[2::2], strict=True))

    @cached_property
    def _matrices(self) -> list[Real]:
        energies = condensed(np.concatenate(self._shapes), self.order)
        return np.split(energies, np.cumsum([len(s) for s in self._shapes])[:-1])

    @cached_property
    def _shapes(self) -> list[Real]:
        """Corners (n, 3, 2) of the plain triangles, then of one ring and of the tips at each singular corner."""
        points = self.mesh.triangles.points
        shapes = [points[self.mesh.corners[self.mesh.plain]]]
        for corner, fan in self.mesh.fans.items():
            away = points[[*fan.spokes, fan.spokes[0]]] - points[corner]
            tips = np.stack([0 * away[:-1], away[:-1], away[1:]], axis=1)[: len(fan.members)]
            shapes += [ring_corners(tips), tips]
        return shapes


def _less(values: Numbers, corner: Whole) -> Numbers:
    """Values on triangles (..., k) less the one at a corner of each."""
    place = np.broadcast_to(corner, values.shape[:-1])[..., None]
    reduced: Numbers = values.copy()
    reduced[..., :3] -= np.take_along_axis(values, place, axis=-1)
    return reduced


def _product(f: Numbers, matrix: Numbers, g: Numbers) -> Numbers:
    found: Numbers = (f * (matrix @ g[..., None])[..., 0]).sum(axis=-1)
    return found
