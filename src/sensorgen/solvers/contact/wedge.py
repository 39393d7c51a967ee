"""Wedges of air that end in a point, thinner than their sides are long: cut off and triangulated here.

A mesher would make triangles as small as the air is thin; quadratic triangles across it are as accurate.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import atan2, hypot, pi

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.scene.scene import Point
from sensorgen.solvers.contact.cell import Edge
from sensorgen.solvers.electrostatics.triangles import flipped

_SHARP = 0.7  # a point of air with a smaller angle is a wedge [rad]
_THICK = 0.4  # a wedge ends where it is thicker than this share of the next pieces of its sides [-]


@dataclass(frozen=True)
class Wedge:
    """The sides of a wedge of air, both from its tip: air lies left of the first and right of the second."""

    first: tuple[Point, ...]
    second: tuple[Point, ...]


def wedges(edges: Mapping[Edge, tuple[int, int]], air: int) -> list[Wedge]:
    """All wedges of a region of air."""
    ahead: dict[Point, list[Point]] = defaultdict(list)
    back: dict[Point, list[Point]] = defaultdict(list)
    for (p, q), (left, right) in edges.items():
        for a, b in ((p, q),) * (left == air) + ((q, p),) * (right == air):
            ahead[a].append(b)
            back[b].append(a)
    found: list[Wedge] = []
    used: set[Point] = set()
    points = np.array([*{p for edge in edges for p in edge}]).reshape(-1, 2)
    for tip in list(ahead):
        for out, into in product(ahead[tip], back[tip]):
            if _is_tip(tip, out, into, ahead) and not {out, into} & used and _is_free(tip, out, into, points):
                # Walk along both sides, where the way across is shorter, until the air is thick or both sides meet.
                first, second = [tip, out], [tip, into]
                while first[-1] != second[-1] and ahead[first[-1]] and back[second[-1]]:
                    on_first, on_second = ahead[first[-1]][0], back[second[-1]][0]
                    if on_first == second[-1]:
                        first.append(on_first)
                        break
                    thick = min(_off(first[-1], second[-1], on_second), _off(second[-1], first[-1], on_first))
                    if thick > _THICK * min(_far(first[-1], on_first), _far(second[-1], on_second)):
                        break
                    shorter = _far(on_first, second[-1]) < _far(first[-1], on_second)
                    side, ahead_on = (first, on_first) if shorter else (second, on_second)
                    if not _is_free(first[-1], ahead_on, second[-1], points):  # the way across would cut a side
                        break
                    side.append(ahead_on)
                found.append(Wedge(tuple(first), tuple(second)))
                used |= {*found[-1].first[1:], *found[-1].second[1:]}
    return found


def _is_tip(tip: Point, out: Point, into: Point, ahead: Mapping[Point, list[Point]]) -> bool:
    """Test whether air lies, sharp and undivided, between the edges to ``out`` and from ``into``."""
    angle = _turn(tip, out, into)
    return 0 < angle < _SHARP and not any(0 < _turn(tip, out, other) < angle for other in ahead[tip] if other != out)


def _is_free(a: Point, b: Point, c: Point, points: Real) -> bool:
    """Test whether a, b and c turn left, and no other of the points (n, 2) lies in their triangle or on its sides."""
    x, y = points.T
    inside = np.ones(len(points), bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0
    return _area(a, b, c) > 0 and {a, b, c}.issuperset(map(tuple, points[inside].tolist()))


def _turn(tip: Point, a: Point, b: Point) -> float:
    """Angle from a to b around the tip, anticlockwise, from 0 to 2 pi."""
    angle = atan2(b[1] - tip[1], b[0] - tip[0]) - atan2(a[1] - tip[1], a[0] - tip[0])
    return angle % (2 * pi)


def _off(p: Point, a: Point, b: Point) -> float:
    """Distance of p from the line through a and b."""
    return abs((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / _far(a, b)


def _far(a: Point, b: Point) -> float:
    return hypot(a[0] - b[0], a[1] - b[1])


def filled(ring: Sequence[int], places: Sequence[Point]) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon, anticlockwise; its corners may lie on a line. Ears cut off, and edges flipped."""
    left, ears = list(ring), []
    while len(left) > 2:
        k = max(range(len(left)), key=lambda k: _bluntness(left, k, places))
        ears.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    return flipped(np.array(places), ears, [0] * len(ears))


def _bluntness(ring: Sequence[int], k: int, places: Sequence[Point]) -> float:
    """Of the ear at a corner: its area over its longest side squared; -1 where another corner lies in it."""
    names = ring[k - 1], ring[k], ring[(k + 1) % len(ring)]
    a, b, c = (places[n] for n in names)
    if any(
        min(_area(a, b, p), _area(b, c, p), _area(c, a, p)) >= 0 for p in (places[n] for n in ring if n not in names)
    ):
        return -1.0
    return _area(a, b, c) / max(_far(a, b), _far(b, c), _far(c, a)) ** 2


def _area(a: Point, b: Point, c: Point) -> float:
    """Twice that of a triangle, above 0 where it turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
