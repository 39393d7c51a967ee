"""Geometric refinement by rings of triangles towards corners, where fields and stresses are singular."""

from collections.abc import Mapping
from math import atan2, pi

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.scene import Point
from sensorgen.solvers.contact.cell import ContactCell, Edge

_SHARP = 0.3  # an outline that turns by less is no corner [rad]
_RATIO = 0.5  # of a ring to the one around it [-]


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
    return [place for place, found in ways.items() if len(found) != 2 or found[0] @ found[1] >= -np.cos(_SHARP)]


def notches(cell: ContactCell) -> list[Point]:
    """Where the solids fill more than half a turn around a corner; the walls of the cell are mirrors."""
    ways: dict[Point, list[tuple[float, bool]]] = {}
    for edge, sides in cell.edges.items():
        left, right = (cell.solid(side) for side in sides)
        if left != right:
            for (p, q), solid in ((edge, left), (edge[::-1], right)):
                ways.setdefault(p, []).append((atan2(q[1] - p[1], q[0] - p[0]), solid))
    alone = {place: found for place, found in ways.items() if len(found) == 2}
    halves = {place: pi / 2 if place[0] in (cell.left_mm, cell.right_mm) else pi for place in alone}
    angles = {place: _filled(found) for place, found in alone.items()}
    return [place for place, half in halves.items() if angles[place] > half and abs(angles[place] - pi) > _SHARP]


def _filled(ways: list[tuple[float, bool]]) -> float:
    """Solid angle between two directions [rad]; each with whether the solid is on its left."""
    (one, solid), (other, _) = ways
    return (other - one if solid else one - other) % (2 * pi)


def ringed(points: Real, triangles: Whole, region: Whole, tips: list[int], count: int) -> tuple[Real, Whole, Whole]:
    """Points (n, 2), corners of triangles (m, 3) and their regions, with so many rings around some of the points."""
    is_tip = np.zeros(len(points) + 1, bool)
    is_tip[tips] = True
    at: dict[int, dict[int, list[int]]] = {tip: {} for tip in tips}  # triangles there: corners and region, by number
    made, gone, total = [], set[int](), 0

    def add(new: Whole, regions: Whole) -> None:
        beside = is_tip[np.minimum(new, len(is_tip) - 1)]
        for k in np.flatnonzero(beside.any(axis=1)).tolist():
            for corner in new[k, beside[k]].tolist():
                at[corner][total + k] = [*new[k].tolist(), int(regions[k])]
        made.append(np.column_stack([new, regions]))

    add(triangles, region)
    for tip in tips:
        # Cut all sides that start at a point at the same shares, and so each triangle there into a small one and pairs
        total = sum(map(len, made))
        whole = {k: own for k, own in at[tip].items() if k not in gone}
        gone.update(whole)
        found = np.array(list(whole.values()))
        here, fill = found[:, :3], found[:, 3]
        first = (here == tip).argmax(axis=1)
        _, *ends = np.take_along_axis(here, (first[:, None] + np.arange(3)) % 3, axis=1).T
        beside = np.unique(ends)
        levels = np.arange(count)[:, None] * len(beside)
        a, b = (np.vstack([k, len(points) + levels + np.searchsorted(beside, k)]) for k in ends)
        sides = [(a[1:], a[:-1], b[:-1]), (a[1:], b[:-1], b[1:]), (np.full_like(a[-1], tip), a[-1], b[-1])]
        new = np.concatenate([np.stack(side, axis=-1).reshape(-1, 3) for side in sides])
        near = points[tip] + _RATIO ** np.arange(1, count + 1)[:, None, None] * (points[beside] - points[tip])
        points = np.concatenate([points, near.reshape(-1, 2)])
        add(new, np.tile(fill, 2 * count + 1))
    kept = np.concatenate(made)[~np.isin(np.arange(sum(map(len, made))), list(gone))]
    return points, kept[:, :3], kept[:, 3]
