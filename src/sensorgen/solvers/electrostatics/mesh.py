"""Mesh with rings at singular corners, and its boundary as a stream function sees it: constant values and jumps.

No flux crosses a mirror: the function has one value along each. Around an island of electrode it grows by all the flux
that ends there: along a cut from each island to another boundary it jumps by an unknown value.
"""

from collections import defaultdict, deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sensorgen.core.arrays import Whole
from sensorgen.solvers.electrostatics.elimination import HELD, Numbers
from sensorgen.solvers.electrostatics.triangles import Edge, Fan, Triangles, fans


@dataclass(frozen=True)
class Flow:
    """The boundary as a flux sees it; unknown 0 is the value 0.

    Attributes
    ----------
    held : dict of int to int
        Points where the function has one value with others: the unknown that this is.
    walls : set of edge
        Edges that no flux crosses.
    lifts : dict of int to list of (int, int)
        Of the triangles beside a cut: a corner on it, and the unknown that adds to the function there.
    top : list of (int, int)
        Edges of the electrode at 1 V, counter-clockwise around the dielectric.
    rise : dict of int to int
        How often each jump adds to what flows into that electrode.
    count : int
        Unknowns so far.
    """

    held: dict[int, int]
    walls: set[Edge]
    lifts: dict[int, list[tuple[int, int]]]
    top: list[tuple[int, int]]
    rise: dict[int, int]
    count: int


def flow(mesh: Triangles, cones: Collection[int]) -> Flow:
    """Mirrors, cuts and electrode of a mesh whose every corner has one fan; cuts keep away from cones."""
    around = {corner: found[0] for corner, found in fans(mesh.triangles).items()}
    rim = [(corner, fan.spokes[0]) for corner, fan in around.items() if not fan.closed]  # counter-clockwise
    walls = [e for e in rim if _named(e) not in mesh.terminals]
    loops, mirrors = _groups(rim), _groups(walls)
    unknown_of: dict[int, int] = {}
    lifts: dict[int, list[tuple[int, int]]] = defaultdict(list)
    starts = {a for a, b in rim if _named((a, b)) in mesh.terminals}
    ends = starts - set(cones)  # a cut ends with an electrode to its left, lest it part a mirror's value
    carrying = {loops[a] for a in starts}  # a hole whose rim is all mirror does not
    count = HELD
    for piece in _connected(around):
        values, count = _on_mirrors(piece, mirrors, (piece & loops.keys()) - set(cones), count)
        unknown_of |= values
        start = loops[min(point for point, value in values.items() if value == 0)]
        rims = {k: loops[k] for k in piece if k in loops}
        for path in _cuts(around, rims, start, carrying & set(rims.values()) | {start}, ends, cones):
            for number, corner in _beside(around, path):
                lifts[number].append((corner, count))
            count += 1
    top = [e for e in rim if mesh.terminals.get(_named(e)) == "top"]
    return Flow(unknown_of, {_named(e) for e in walls}, dict(lifts), top, _rise(top, lifts, around), count)


def _connected(around: Mapping[int, Fan]) -> list[set[int]]:
    """Points of each connected piece of dielectric, by their least."""
    pieces: dict[int, set[int]] = defaultdict(set)
    for point, least in _groups((corner, spoke) for corner, fan in around.items() for spoke in fan.spokes).items():
        pieces[least].add(point)
    return [pieces[least] for least in sorted(pieces)]


def _on_mirrors(
    piece: set[int], mirrors: Mapping[int, int], rim: set[int], first: int
) -> tuple[dict[int, int], int]:  # fmt: skip
    """Unknown of each point on a mirror of a piece, and the next one; 0 on one mirror, else at one point of the rim."""
    names = sorted({mirrors[k] for k in piece if k in mirrors})
    values: dict[int, int] = {}
    for unknown, name in enumerate(names[1:], first):
        values |= dict.fromkeys((k for k in piece if mirrors.get(k) == name), unknown)
    zero = {k for k in piece if mirrors.get(k) == names[0]} if names else {min(rim)}
    return values | dict.fromkeys(zero, 0), first + max(len(names) - 1, 0)


def _rise(
    top: Iterable[Edge], lifts: Mapping[int, list[tuple[int, int]]], around: Mapping[int, Fan]
) -> dict[int, int]:  # fmt: skip
    """Number of times that each jump adds to what flows into the electrode at 1 V."""
    rise: dict[int, int] = defaultdict(int)
    for a, b in top:
        for corner, jump in lifts.get(around[a].members[0], ()):
            rise[jump] += (corner == b) - (corner == a)
    return rise


def _named(edge: Edge) -> Edge:
    return min(edge), max(edge)


def _groups(edges: Iterable[Edge]) -> dict[int, int]:
    """Points that edges join, each with the least of those that it is joined to."""
    beside: dict[int, list[int]] = defaultdict(list)
    for a, b in edges:
        beside[a].append(b)
        beside[b].append(a)
    least: dict[int, int] = {}
    for start in sorted(beside):
        todo = [start] if start not in least else []
        while todo:
            k = todo.pop()
            if k not in least:
                least[k] = start
                todo += beside[k]
    return least


def _cuts(
    around: dict[int, Fan], loops: dict[int, int], start: int, carrying: set[int], ends: set[int],
    cones: Collection[int],
) -> Iterator[list[int]]:  # fmt: skip
    """For each loop that carries flux but the first, points from it to another one, all inside but for both ends."""
    reached, before = {start}, {k: k for k in loops if loops[k] == start and k in ends}
    todo = deque(before)
    while todo and reached < carrying:
        here = todo.popleft()
        fan = around[here]
        for spoke in fan.spokes if fan.closed else fan.spokes[1:-1]:
            if spoke in before or spoke in cones:
                continue
            if spoke not in loops:
                before[spoke] = here
                todo.append(spoke)
            elif loops[spoke] in carrying - reached:
                path = [spoke, here]
                while before[path[-1]] != path[-1]:
                    path.append(before[path[-1]])
                yield path
                reached.add(loops[spoke])
                new = [k for k in loops if loops[k] == loops[spoke] and k in ends]
                before |= {k: k for k in new}
                todo += new


def _beside(around: dict[int, Fan], path: list[int]) -> Iterator[tuple[int, int]]:
    """Triangles to the left of a path, each with its corner there."""
    for k, corner in enumerate(path):
        fan = around[corner]
        start = fan.spokes.index(path[k + 1]) if k + 1 < len(path) else 0
        end = fan.spokes.index(path[k - 1]) if k else len(fan.members)
        for number in fan.members[start:end] if start <= end else fan.members[start:] + fan.members[:end]:
            yield number, corner


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

    def areas(self) -> Numbers:
        """Of all triangles, twice; 0 or less where double precision does not resolve it [mm2]."""
        a, b, c = self.triangles.points[self.corners].transpose(1, 2, 0)
        return np.asarray((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])

    def thinness(self) -> Numbers:
        """Ratio of each triangle's relative error of area to that of its corners' coordinates [-].

        A micrometre of height, a metre up or along a slope that is a metre long, makes it a million.
        """
        corners = self.triangles.points[self.corners]
        farthest, along = abs(corners).max(axis=1), np.ptp(corners, axis=1)
        return np.asarray((farthest * along[:, ::-1]).sum(axis=1) / self.areas())

    def elements(self) -> int:
        """Triangles, those in rings each for itself."""
        in_rings = [len(fan.members) * (1 + (2 << self.doublings[c])) for c, fan in self.fans.items()]
        return len(self.plain) + sum(in_rings)
