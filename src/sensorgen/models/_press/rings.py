"""Rings of triangles that shrink towards the corners of outlines, where the field is singular."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sensorgen.models._press.cell import Edge
from sensorgen.scene import Point

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_SHARP = 0.3  # an outline that turns by less is no corner [rad]
_RATIO = 0.5  # of a ring to the one around it [-]
_RINGS = 6


def corners(edges: Mapping[Edge, tuple[int, int]], left_mm: float, right_mm: float) -> list[Point]:
    """Where the border between two regions turns, ends or branches; the walls of the cell are mirrors."""
    ways: dict[Point, list[Real]] = {}
    for (p, q), sides in edges.items():
        if min(sides) > 0:
            way = np.subtract(q, p) / np.hypot(*np.subtract(q, p))
            for place, out in ((p, way), (q, -way)):
                ways.setdefault(place, []).append(out)
                if place[0] in (left_mm, right_mm) and out[0]:
                    ways[place].append(out * (-1, 1))
    return [place for place, found in ways.items() if not _straight(found)]


def _straight(ways: list[Real]) -> bool:
    return len(ways) == 2 and bool(ways[0] @ ways[1] < -np.cos(_SHARP))


def ringed(points: Real, triangles: Whole, region: Whole, tips: list[int]) -> tuple[Real, Whole, Whole]:
    """Points (n, 2), corners of triangles (m, 3) and their regions, with rings around some of the points."""
    for tip in tips:
        for _ in range(_RINGS):
            points, triangles, region = _cut(points, triangles, region, tip)
    return points, triangles, region


def _cut(points: Real, triangles: Whole, region: Whole, tip: int) -> tuple[Real, Whole, Whole]:
    """Cut all sides that start at a point at the same share, and so each triangle there into three."""
    here = (triangles == tip).any(axis=1)
    first = (triangles[here] == tip).argmax(axis=1)
    _, a, b = np.take_along_axis(triangles[here], (first[:, None] + np.arange(3)) % 3, axis=1).T
    beside = np.unique([a, b])
    near_a, near_b = (len(points) + np.searchsorted(beside, k) for k in (a, b))
    parts = [(np.full_like(a, tip), near_a, near_b), (near_a, a, b), (near_a, b, near_b)]
    new = np.concatenate([np.column_stack(part) for part in parts])
    moved = points[tip] + _RATIO * (points[beside] - points[tip])
    return (
        np.concatenate([points, moved]),
        np.concatenate([triangles[~here], new]),
        np.concatenate([region[~here], np.tile(region[here], 3)]),
    )
