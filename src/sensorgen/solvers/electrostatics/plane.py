"""Potential and stream function on a graded mesh: unknowns, blocks for the solver, energies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.solvers.electrostatics.elements import Cone, RingLayout, condensed, crossed, numbered, ring_corners
from sensorgen.solvers.electrostatics.elimination import HELD, Block, Numbers, least
from sensorgen.solvers.electrostatics.mesh import Cones, Flow
from sensorgen.solvers.electrostatics.triangles import Edge


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
    """Map from the unknowns to the values on one block.

    Attributes
    ----------
    ids, signs : (k,) array
        The unknown of each value, and 1 or -1.
    jumps : list of (int, int)
        Places of values to which another unknown adds, and that one.
    """

    ids: Whole
    signs: Real
    jumps: Jumps

    def block(self, matrix: Numbers, place: Real) -> Block:
        """For the solver."""
        rows = np.array([*range(len(self.ids)), *(k for k, _ in self.jumps)])
        ids = np.array([*self.ids, *(jump for _, jump in self.jumps)])
        signed = self.signs[:, None] * matrix * self.signs
        return Block(ids, signed[rows[:, None], rows], place) if self.jumps else Block(self.ids, signed, place)

    def values(self, unknowns: Numbers) -> Numbers:
        """On the block."""
        own = unknowns[self.ids]
        for place, jump in self.jumps:
            own[place] += unknowns[jump]
        return np.asarray(own * self.signs)


@dataclass(frozen=True)
class PlaneProblem:
    """A function to be found: what weighs its slope, and where it is held.

    Attributes
    ----------
    mesh : Cones
        That it lives on.
    order : int
        Of the polynomials.
    plain : (n, k, k) array
        Energies of the plain triangles.
    cones : list of (array, array)
        Energies of a ring's triangles and of the innermost ones, at each singular corner.
    weight : (n,) array
        Of each triangle.
    held : dict of int to int
        Points whose value is an unknown that others share.
    walls : set of edge
        Sides along which it does not change.
    lifts : dict of int to list of (int, int)
        As :class:`sensorgen.solvers.electrostatics.mesh.Flow`.
    count : int
        Of the unknowns named in ``held`` and ``lifts``, 0 and 1 among them.
    """

    mesh: Cones
    order: int
    plain: Real
    cones: Sequence[tuple[Real, Real]]
    weight: Numbers
    held: Mapping[int, int]
    walls: set[Edge]
    lifts: Mapping[int, Jumps]
    count: int

    def solved(self, flow: Flow | None = None) -> Field:
        """The function of least energy, less twice what flows into the top where a flux is sought."""
        points = self.mesh.triangles.points
        plain, cones = self._plain_shares(), [self._cone(c, e) for c, e in zip(self.mesh.fans, self.cones, strict=True)]
        rims = [self._rim(corner, cone.layout) for corner, cone in zip(self.mesh.fans, cones, strict=True)]
        energies = self.weight[self.mesh.plain, None, None] * self.plain
        places = points[self.mesh.corners[self.mesh.plain, 0]]
        blocks = [share.block(*parts) for share, *parts in zip(plain, energies, places, strict=True)]
        corners = points[list(self.mesh.fans)]
        blocks += [rim.block(cone.matrix, at) for rim, cone, at in zip(rims, cones, corners, strict=True)]
        unknowns = least([*blocks, self._rise(flow)] if flow else blocks, self._unknowns[0]).values()
        inside = [cone.inside(rim.values(unknowns)) for cone, rim in zip(cones, rims, strict=True)]
        on_plain = np.array([share.values(unknowns) for share in plain])
        return Field(on_plain, inside)

    @cached_property
    def _unknowns(self) -> tuple[int, Whole, Whole]:
        """Number of unknowns; the unknown of each point; the first of each side, 0 where it has none."""
        mesh, count = self.mesh, self.count
        vertex = np.full(len(mesh.triangles.points), -1)
        vertex[list(self.held)] = list(self.held.values())
        used = np.unique(mesh.corners[mesh.plain])
        free = used[vertex[used] < 0]
        vertex[free] = count + np.arange(len(free))
        count += len(free)
        names, modes = mesh.sides[0], self.order - 1
        open_sides = ~np.isin(names, mesh.names(*np.array(list(self.walls)).reshape(-1, 2).T))
        first = np.zeros(len(names), np.int64)
        first[open_sides] = count + modes * np.arange(open_sides.sum())
        return count + modes * int(open_sides.sum()), vertex, first

    def _plain_shares(self) -> list[_Share]:
        mesh = self.mesh
        _, vertex, first = self._unknowns
        ids, signs = numbered(mesh.corners[mesh.plain], vertex, first[mesh.sides[1]], self.order)
        corners = mesh.triangles.triangles
        jumps = [
            [(corners[n].index(point), jump) for point, jump in self.lifts.get(n, ())] for n in mesh.plain.tolist()
        ]
        return [_Share(*parts) for parts in zip(ids, signs, jumps, strict=True)]

    def _cone(self, corner: int, energies: tuple[Real, Real]) -> Cone:
        fan, (rings, tips) = self.mesh.fans[corner], energies
        ends = self._is_wall(corner, fan.spokes[0]), self._is_wall(corner, fan.spokes[-1])
        layout = RingLayout.of(len(fan.spokes), fan.closed, ends, self.order)
        here = self.weight[fan.members][:, None, None]
        return Cone.of(layout, rings * here[:, None], tips * here, self.mesh.doublings[corner])

    def _is_wall(self, a: int, b: int) -> bool:
        return (min(a, b), max(a, b)) in self.walls

    def _rim(self, corner: int, layout: RingLayout) -> _Share:
        """Values that a cone shares with its neighbours, in its own turn."""
        _, vertex, first = self._unknowns
        mesh, fan = self.mesh, self.mesh.fans[corner]
        spokes = np.array(fan.spokes)
        free = spokes[layout.free]
        a, b = spokes[layout.rim].T
        on_side = first[np.searchsorted(mesh.sides[0], mesh.names(a, b))]
        modes = np.arange(self.order - 1)
        sign = np.where((a > b)[:, None], (-1.0) ** modes, 1.0)
        fixed = vertex[[corner]] if layout.held else vertex[:0]
        ids = np.concatenate([vertex[free], (on_side[:, None] + modes).ravel(), fixed])
        signs = np.concatenate([np.ones(len(free)), sign.ravel(), np.ones(len(fixed))])
        lifts = {lift for n in fan.members for lift in self.lifts.get(n, ())}
        return _Share(ids, signs, [(free.tolist().index(point), jump) for point, jump in sorted(lifts)])

    def _rise(self, flow: Flow) -> Block:
        """Minus the function's rise along the top, as an energy with the unknown 1, whose value is 1."""
        count, vertex, _ = self._unknowns
        ends = np.array(flow.top)
        start, end = (np.bincount(vertex[e] + 1, minlength=count + 1)[1:] for e in ends.T)  # -1, at cones, cancels
        rise = (end - start).astype(float)
        for jump, times in flow.rise.items():
            rise[jump] += times
        where = np.flatnonzero(rise)
        where = where[where >= HELD]
        matrix = np.zeros((len(where) + 1,) * 2)
        matrix[0, 1:] = matrix[1:, 0] = -rise[where]
        return Block(np.concatenate([[1], where]), matrix, self.mesh.triangles.points[ends[:, 0]].mean(axis=0))


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
        return self._grounded(self._problem(weight, volts, set(ends), {}, HELD).solved())

    def stream(self, weight: Numbers) -> Field:
        """The function whose curl is the flux at which twice what flows into the top, less its energy, is most."""
        flow = self.mesh.flow
        return self._grounded(self._problem(weight, flow.held, flow.walls, flow.lifts, flow.count).solved(flow))

    def energies(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . grad g over each triangle of the mesh."""
        return self._over(f, g, self._plain_energy, self._cone_energies)

    def crossings(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . curl g over each triangle of the mesh."""
        same = crossed(self.order)
        return self._over(f, g, same, [(same, same)] * len(f.cones))

    def energy_terms(self, f: Field) -> Numbers:
        """Moduli of all terms that :meth:`energies` of ``f`` and its conjugate adds, over each triangle."""
        size, cones = f.moduli(), [(abs(rings), abs(tips)) for rings, tips in self._cone_energies]
        return self._over(size, size, abs(self._plain_energy), cones)

    def crossing_terms(self, f: Field, g: Field) -> Numbers:
        """Moduli of all terms that :meth:`crossings` adds, over each triangle."""
        size = abs(crossed(self.order))
        return self._over(f.moduli(), g.moduli(), size, [(size, size)] * len(f.cones))

    def _problem(self, weight: Numbers, *boundary: Any) -> PlaneProblem:
        return PlaneProblem(self.mesh, self.order, self._plain_energy, self._cone_energies, weight, *boundary)

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
    def _plain_energy(self) -> Real:
        """Of the plain triangles (n, k, k)."""
        return self._matrices[0]

    @property
    def _cone_energies(self) -> list[tuple[Real, Real]]:
        """Of one ring's triangles (s, 2, k, k) and of the innermost (s, k, k), at each singular corner."""
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
