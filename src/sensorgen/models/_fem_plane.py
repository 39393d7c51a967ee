r"""Potential and stream function on one mesh: both bounds by the same matrices.

In the plane a flux without sources is the curl of a function psi, which has one value along each line that no flux
crosses, and :math:`\int |D|^2 / \varepsilon = \int |\nabla \psi|^2 / \varepsilon`. Hence both problems are one, with
the permittivity or its inverse for a weight, and values held at the electrodes or at the mirrors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sensorgen.models._fem_cones import Cone, Layout, ring_corners
from sensorgen.models._fem_cuts import Flow, flow
from sensorgen.models._fem_fans import Fan, fans
from sensorgen.models._fem_fronts import HELD, Block, Numbers, Whole, least
from sensorgen.models._fem_polynomials import Real, condensed, crossed, numbered
from sensorgen.models._fem_triangles import Edge, Triangles


@dataclass(frozen=True)
class Cones:
    """Triangles of which those at singular corners stand for rings without end.

    Attributes
    ----------
    triangles : Triangles
        Each corner has one fan.
    doublings : dict of int to int
        Of singular corners: logarithm of the number of their rings.
    """

    triangles: Triangles
    doublings: Mapping[int, int]

    @cached_property
    def corners(self) -> Whole:
        """Of all triangles (n, 3)."""
        return np.array(self.triangles.triangles)

    @cached_property
    def fans(self) -> dict[int, Fan]:
        """Triangles at each singular corner."""
        return {c: found[0] for c, found in fans(self.triangles.triangles).items() if c in self.doublings}

    @cached_property
    def plain(self) -> Whole:
        """Numbers of the triangles that are no tips."""
        is_plain = np.ones(len(self.corners), bool)
        is_plain[[n for fan in self.fans.values() for n in fan.members]] = False
        return np.flatnonzero(is_plain)

    @cached_property
    def sides(self) -> tuple[Whole, Whole]:
        """Distinct sides of the plain triangles (:meth:`names`), and which of them each of these has (k, 3)."""
        corners = self.corners[self.plain]
        found, at = np.unique(self.names(corners, np.roll(corners, -1, axis=1)), return_inverse=True)
        return found, at.reshape(corners.shape)

    @cached_property
    def flow(self) -> Flow:
        """The boundary as a flux sees it."""
        return flow(self.triangles, self.fans)

    def names(self, a: Whole, b: Whole) -> Whole:
        """One number for each side, by its ends."""
        return np.minimum(a, b) * len(self.triangles.points) + np.maximum(a, b)

    def slenderness(self) -> float:
        """Of the most slender triangle: its longest side squared over twice its area [-]."""
        corners = self.triangles.points[self.corners]
        sides = np.roll(corners, -1, axis=1) - corners
        area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
        return float(((sides**2).sum(axis=2).max(axis=1) / area).max())

    def elements(self) -> int:
        """Triangles, those in rings each for itself."""
        in_rings = [len(fan.members) * (1 + (2 << self.doublings[c])) for c, fan in self.fans.items()]
        return len(self.plain) + sum(in_rings)


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
        """Its complex conjugate."""
        return Field(self.plain.conj(), [(rings.conj(), tips.conj()) for rings, tips in self.cones])


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
        held = {point: int(name == "top") for edge, name in ends.items() for point in edge}
        return _Problem(self, weight, held, set(ends), {}, HELD).solved()

    def stream(self, weight: Numbers) -> Field:
        """The function whose curl is the flux at which twice what flows into the top, less its energy, is most."""
        flow = self.mesh.flow
        return _Problem(self, weight, flow.held, flow.walls, flow.lifts, flow.count).solved(flow)

    def energies(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . grad g over each triangle of the mesh."""
        return self._over(f, g, self.plain_energy, self.cone_energies)

    def crossings(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . curl g over each triangle of the mesh."""
        same = crossed(self.order)
        return self._over(f, g, same, [(same, same)] * len(f.cones))

    def _over(self, f: Field, g: Field, plain: Real, cones: Sequence[tuple[Real, Real]]) -> Numbers:
        found = np.zeros(len(self.mesh.corners), np.result_type(f.plain, g.plain))
        found[self.mesh.plain] = _product(f.plain, plain, g.plain)
        for fan, (rings, tips), mine, other in zip(self.mesh.fans.values(), cones, f.cones, g.cones, strict=True):
            found[fan.members] = _product(mine[0], rings, other[0]).sum(axis=(0, 2))
            found[fan.members] += _product(mine[1], tips, other[1])
        return found

    @property
    def plain_energy(self) -> Real:
        """Of the plain triangles (n, k, k)."""
        return self._matrices[0]

    @property
    def cone_energies(self) -> list[tuple[Real, Real]]:
        """Of one ring's triangles (s, 2, k, k), and of the innermost (s, k, k), at each singular corner."""
        rings = (m.reshape(-1, 2, *m.shape[1:]) for m in self._matrices[1::2])
        return list(zip(rings, self._matrices[2::2], strict=True))

    @cached_property
    def _matrices(self) -> list[Real]:
        points = self.mesh.triangles.points
        shapes = [points[self.mesh.corners[self.mesh.plain]]]
        for corner, fan in self.mesh.fans.items():
            away = points[[*fan.spokes, fan.spokes[0]]] - points[corner]
            tips = np.stack([0 * away[:-1], away[:-1], away[1:]], axis=1)[: len(fan.members)]
            shapes += [ring_corners(tips), tips]
        return np.split(condensed(np.concatenate(shapes), self.order), np.cumsum([len(s) for s in shapes])[:-1])


def _product(f: Numbers, matrix: Numbers, g: Numbers) -> Numbers:
    found: Numbers = (f * (matrix @ g[..., None])[..., 0]).sum(axis=-1)
    return found


@dataclass(frozen=True)
class _Problem:
    """One of the two functions: what weighs its slope, and where it is held.

    Attributes
    ----------
    weight : (n,) array
        Of each triangle.
    held : dict of int to int
        Points whose value is an unknown that others share.
    walls : set of edge
        Sides along which it does not change.
    lifts : dict of int to list of (int, int)
        As :class:`sensorgen.models._fem_cuts.Flow`.
    count : int
        Of the unknowns named in ``held`` and ``lifts``, 0 and 1 among them.
    """

    plane: Plane
    weight: Numbers
    held: Mapping[int, int]
    walls: set[Edge]
    lifts: Mapping[int, list[tuple[int, int]]]
    count: int

    def solved(self, flow: Flow | None = None) -> Field:
        """The function of least energy, less twice what flows into the top where a flux is sought."""
        mesh, plain = self.plane.mesh, self.plane.mesh.plain
        count, vertex, first = self._unknowns
        ids, signs = numbered(mesh.corners[plain], vertex, first[mesh.sides[1]], self.plane.order)
        scaled = (self.weight[plain, None, None] * signs[:, :, None] * signs[:, None, :]) * self.plane.plain_energy
        places = mesh.triangles.points[mesh.corners[plain]].mean(axis=1)
        cones = [self._cone(*parts) for parts in zip(mesh.fans, self.plane.cone_energies, strict=True)]
        shared = [self._shared(corner, cone.layout) for corner, cone in zip(mesh.fans, cones, strict=True)]
        blocks = [Block(*parts) for parts in zip(ids, scaled, places, strict=True)]
        for n, added in self._lifted_plain():
            blocks[n] = blocks[n].lifted(added)
        for corner, cone, (at, sign, added) in zip(mesh.fans, cones, shared, strict=True):
            block = Block(at, sign[:, None] * cone.matrix * sign, mesh.triangles.points[corner])
            blocks.append(block.lifted(added))
        if flow:
            blocks.append(self._rise(flow))
        values = least(blocks, count)
        on_plain = values[ids]
        for n, added in self._lifted_plain():
            _lift(on_plain[n], added, values)
        inside = []
        for cone, (at, sign, added) in zip(cones, shared, strict=True):
            rim = values[at]
            _lift(rim, added, values)
            inside.append(cone.inside(rim * sign))
        return Field(_grounded(on_plain * signs), [(_grounded(rings), _grounded(tips)) for rings, tips in inside])

    @cached_property
    def _unknowns(self) -> tuple[int, Whole, Whole]:
        """How many there are; the unknown of each point; the first of each side, 0 where it has none."""
        mesh, count = self.plane.mesh, self.count
        vertex = np.full(len(mesh.triangles.points), -1)
        vertex[list(self.held)] = list(self.held.values())
        used = np.unique(mesh.corners[mesh.plain])
        free = used[vertex[used] < 0]
        vertex[free] = count + np.arange(len(free))
        count += len(free)
        names, modes = mesh.sides[0], self.plane.order - 1
        open_sides = ~np.isin(names, mesh.names(*np.array(sorted(self.walls)).T))
        first = np.zeros(len(names), np.int64)
        first[open_sides] = count + modes * np.arange(open_sides.sum())
        return count + modes * int(open_sides.sum()), vertex, first

    def _cone(self, corner: int, energies: tuple[Real, Real]) -> Cone:
        mesh = self.plane.mesh
        fan = mesh.fans[corner]
        ends = self._is_wall(corner, fan.spokes[0]), self._is_wall(corner, fan.spokes[-1])
        layout = Layout.of(len(fan.spokes), fan.closed, ends, self.plane.order)
        here = self.weight[fan.members][:, None, None]
        rings, tips = energies
        return Cone.of(layout, rings * here[:, None], tips * here, mesh.doublings[corner])

    def _is_wall(self, a: int, b: int) -> bool:
        return (min(a, b), max(a, b)) in self.walls

    def _shared(self, corner: int, layout: Layout) -> tuple[Whole, Real, list[tuple[int, int]]]:
        """Of a cone's outermost values, in its own turn: unknowns, signs, and jumps that add."""
        _, vertex, first = self._unknowns
        mesh, fan = self.plane.mesh, self.plane.mesh.fans[corner]
        spokes = np.array(fan.spokes)
        free = spokes[layout.free]
        a, b = spokes[layout.rim].T
        on_side = first[np.searchsorted(mesh.sides[0], mesh.names(a, b))]
        modes = np.arange(self.plane.order - 1)
        sign = np.where((a > b)[:, None], (-1.0) ** modes, 1.0)
        held = vertex[[corner]] if layout.held else vertex[:0]
        ids = np.concatenate([vertex[free], (on_side[:, None] + modes).ravel(), held])
        signs = np.concatenate([np.ones(len(free)), sign.ravel(), np.ones(len(held))])
        lifts = {lift for n in fan.members for lift in self.lifts.get(n, ())}
        return ids, signs, [(free.tolist().index(point), jump) for point, jump in sorted(lifts)]

    def _lifted_plain(self) -> list[tuple[int, list[tuple[int, int]]]]:
        """Plain triangles beside a cut, each with its corners there and the jumps that add."""
        mesh = self.plane.mesh
        at = {int(n): k for k, n in enumerate(mesh.plain)} if self.lifts else {}
        corners = mesh.triangles.triangles
        return [
            (at[n], [(corners[n].index(point), jump) for point, jump in added])
            for n, added in self.lifts.items()
            if n in at
        ]

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
        return Block(np.concatenate([[1], where]), matrix, self.plane.mesh.triangles.points[ends[:, 0]].mean(axis=0))


def _grounded(values: Numbers) -> Numbers:
    """Less the value at a triangle's first corner: a constant has no energy, but rounding times 1e10 is some."""
    values[..., :3] -= values[..., :1].copy()
    return values


def _lift(values: Numbers, added: Sequence[tuple[int, int]], unknowns: Numbers) -> None:
    for place, jump in added:
        values[place] += unknowns[jump]
