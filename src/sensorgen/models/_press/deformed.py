"""The outlines of a pressed cell: sides bent as they are, faces that touch closed, what is left between them is air."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sensorgen.models._press.cell import AIR, OUTSIDE, Cell
from sensorgen.models._press.contact import Faces
from sensorgen.models._press.mesh import Mesh, at_border
from sensorgen.units import M_PER_MM

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Run = tuple[int, int]
Sides = dict[Run, tuple[int, int]]

_CLOSED = 5e-3  # gaps less than this share of their side are none [-]
_ROUND = [0, 3, 1, 4, 2, 5]  # the nodes of a triangle, in turn
_BETWEEN = 0.3  # and less than this share where both ends of the side touch [-]


def deformed(cell: Cell, mesh: Mesh, faces: Faces, u_m: Real) -> Cell:
    """The cell at given displacements (2n) [m]; the sides of gaps become two straight pieces each."""
    places = (mesh.points_m + u_m.reshape(-1, 2)) / M_PER_MM
    found = _edges(cell, mesh)
    if u_m.any():
        found = _closed(found, _air(cell), places, faces, mesh.points_m)
    edges = {}
    for (a, b), sides in found.items():
        p, q = (tuple(np.round(places[k], 9).tolist()) for k in (a, b))
        if sides[0] != sides[1] and p != q:
            edges[(p, q) if p < q else (q, p)] = sides if p < q else sides[::-1]
    return replace(cell, edges=edges, right_mm=float(np.round(places[mesh.points_m[:, 0].argmax(), 0], 9)))


def misfit(cell: Cell, mesh: Mesh, u_m: Real) -> float:
    """Largest change of a solid's area by what was closed, over that area [-]; ``cell`` has the closed outlines."""
    places = (mesh.points_m + u_m.reshape(-1, 2)) / M_PER_MM
    kept = np.bincount(mesh.region, _areas(places[mesh.triangles[:, _ROUND]]), len(cell.regions) + 1)
    found = np.zeros(len(kept))
    for (a, b), sides in cell.edges.items():
        half = (a[0] * b[1] - a[1] * b[0]) / 2
        found[sides[0]] += half
        found[sides[1]] -= half
    solid = kept > 0
    return float(np.abs(found[solid] / kept[solid] - 1).max())


def _areas(corners: Real) -> Real:
    """Of polygons (m, n, 2)."""
    ahead = np.roll(corners, -1, axis=1)
    return np.asarray((corners[..., 0] * ahead[..., 1] - corners[..., 1] * ahead[..., 0]).sum(axis=1) / 2)


def _air(cell: Cell) -> int:
    return next((k + 1 for k, region in enumerate(cell.regions) if region.material == AIR), OUTSIDE)


def _edges(cell: Cell, mesh: Mesh) -> Sides:
    """Sides between different regions: (node, node) to the regions on their left and right; halved but at walls."""
    found: Sides = {}
    air, walls = _air(cell), _walls(mesh)
    for k in range(3):
        for (a, m, b), region in zip(
            mesh.triangles[:, [k, k + 3, (k + 1) % 3]].tolist(), mesh.region.tolist(), strict=True
        ):
            for p, q in ((a, b),) if m in walls else ((a, m), (m, b)):
                if (q, p) in found:
                    found[q, p] = (found[q, p][0], region)
                else:
                    found[p, q] = (region, OUTSIDE)
    for a, b, m in mesh.rim[~at_border(mesh)].tolist():
        for run in ((a, m), (m, b)):
            found[run] = (found[run][0], air)
    nodes = {tuple(np.round(p / M_PER_MM, 9).tolist()): k for k, p in enumerate(mesh.points_m)}
    for (p, q), sides in cell.edges.items():
        if air != OUTSIDE and set(sides) == {air, OUTSIDE}:
            found[nodes[p], nodes[q]] = sides
    return {run: sides for run, sides in found.items() if sides[0] != sides[1]}


def _walls(mesh: Mesh) -> set[int]:
    """Middles of the sides on the left and right end of the cell."""
    x, middles = mesh.points_m[:, 0], mesh.rim[:, 2]
    return set(middles[np.isin(x[middles], (x.min(), x.max()))].tolist())


def _closed(edges: Sides, air: int, places: Real, faces: Faces, drawn: Real) -> Sides:
    """Edges with the upper faces laid along the lower ones where they touch; corners in ``places`` may move a bit."""
    lower, upper = (_runs(side) for side in (faces.lower, faces.upper))
    if not (lower and upper):
        return edges
    instead = _touching(places, lower, upper)
    for corner in _corners(drawn, upper) & set(instead):
        places[instead[corner]] = places[corner]  # the point below moves to the corner of an upper face
    found: Sides = {}
    ways = dict(zip(upper, _ways(places, lower, upper, instead), strict=True))
    for run, sides in edges.items():
        for a, b in pairwise(ways.get(run) or [instead.get(k, k) for k in run]):
            if a != b:
                key, here = ((a, b), sides) if a < b else ((b, a), sides[::-1])
                known = found.get(key, (air, air))
                found[key] = (known[0] if here[0] == air else here[0], known[1] if here[1] == air else here[1])
    return found


def _touching(places: Real, lower: list[Run], upper: list[Run]) -> dict[int, int]:
    """Points of the upper faces that touch a lower one, each with the nearest point of that."""
    points = np.array(sorted({k for run in upper for k in run}))
    ends = np.array(lower)
    a, b, p = places[ends[:, 0]], places[ends[:, 1]], places[points][:, None]
    share = (p[..., 0] - a[:, 0]) / (b - a)[:, 0]
    size = np.hypot(*(b - a).T)
    height = p[..., 1] - (a[:, 1] + share * (b - a)[:, 1])
    near = (share >= 0) & (share <= 1) & (height < _CLOSED * size) & (height > -size)
    distance = np.where(near, np.abs(height), np.inf)
    rows, best = np.arange(len(points)), distance.argmin(axis=1)
    nearest = ends[best, (share[rows, best] > 0.5).astype(int)]
    hit = np.isfinite(distance[rows, best]) & (points != nearest)
    return dict(zip(points[hit].tolist(), nearest[hit].tolist(), strict=True))


def _ways(places: Real, lower: list[Run], upper: list[Run], instead: dict[int, int]) -> Iterator[list[int]]:
    """For each run of an upper face its way over the points of lower faces that touch it."""
    points = np.array(sorted({k for run in lower for k in run}))
    p = places[points]
    for run in upper:
        a, b = (instead.get(k, k) for k in run)
        (xa, ya), (xb, yb) = places[a], places[b]
        if xa == xb:
            yield [a, b]
            continue
        limit = _BETWEEN if a != run[0] and b != run[1] else _CLOSED
        size = float(np.hypot(xb - xa, yb - ya))
        gap = ya + (p[:, 0] - xa) * (yb - ya) / (xb - xa) - p[:, 1]
        inside = (p[:, 0] > min(xa, xb)) & (p[:, 0] < max(xa, xb)) & (gap < limit * size) & (gap > -size)
        order = np.argsort(p[inside, 0] * np.sign(xb - xa))
        yield [a, *points[inside][order].tolist(), b]


def _runs(sides: Whole) -> list[Run]:
    return [(a, m) for a, _, m in sides.tolist()] + [(m, b) for _, b, m in sides.tolist()]


def _corners(places: Real, runs: list[Run]) -> set[int]:
    """Points at which a face turns by more than a tenth, or ends."""
    after, before = dict(runs), {b: a for a, b in runs}
    found = set(after) ^ set(before)
    for k in set(after) & set(before):
        u, v = places[k] - places[before[k]], places[after[k]] - places[k]
        if abs(u[0] * v[1] - u[1] * v[0]) > 0.1 * np.hypot(*u) * np.hypot(*v):
            found.add(k)
    return found
