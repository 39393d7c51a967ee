"""Outlines of a deformed cell: solid regions, with contacting faces merged, and the air that remains."""

from dataclasses import replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.solvers.contact.cell import OUTSIDE, ContactCell
from sensorgen.solvers.contact.closing import Sides, closed
from sensorgen.solvers.contact.contact import Faces
from sensorgen.solvers.contact.mesh import TriangleMesh, at_border

_ROUND = [0, 3, 1, 4, 2, 5]  # the nodes of a triangle, in turn


def deformed(cell: ContactCell, mesh: TriangleMesh, faces: Faces, u_m: Real) -> ContactCell:
    """The cell at given displacements (2n) [m]; the sides of gaps become two straight pieces each."""
    places = (mesh.points_m + u_m.reshape(-1, 2)) / M_PER_MM
    found = _edges(cell, mesh)
    if u_m.any():
        found = closed(found, cell.air, places, faces)
    edges = {}
    for (a, b), sides in found.items():
        p, q = (tuple(np.round(places[k], 9).tolist()) for k in (a, b))
        if sides[0] != sides[1] and p != q:
            edges[(p, q) if p < q else (q, p)] = sides if p < q else sides[::-1]
    return replace(cell, edges=edges, right_mm=float(np.round(places[mesh.points_m[:, 0].argmax(), 0], 9)))


def misfit(cell: ContactCell, mesh: TriangleMesh, u_m: Real) -> float:
    """Largest change of a solid's area by what was closed, over that area [-]; ``cell`` has the closed outlines."""
    places = (mesh.points_m + u_m.reshape(-1, 2)) / M_PER_MM
    x, y = places[mesh.outer[:, _ROUND]].transpose(2, 0, 1)
    areas = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) / 2
    kept = np.bincount(mesh.region, areas, len(cell.regions) + 1)
    found = np.zeros(len(kept))
    for (a, b), sides in cell.edges.items():
        half = (a[0] * b[1] - a[1] * b[0]) / 2
        found[sides[0]] += half
        found[sides[1]] -= half
    solid = kept > 0
    return float(np.abs(found[solid] / kept[solid] - 1).max())


def _edges(cell: ContactCell, mesh: TriangleMesh) -> Sides:
    """Sides between different regions: (node, node) to the regions on their left and right; halved but at walls."""
    found: Sides = {}
    air, x, middles = cell.air, mesh.points_m[:, 0], mesh.rim[:, 2]
    walls = set(middles[np.isin(x[middles], (x.min(), x.max()))].tolist())  # middles of sides at the cell's ends
    for k in range(3):
        for (a, m, b), region in zip(
            mesh.outer[:, [k, k + 3, (k + 1) % 3]].tolist(), mesh.region.tolist(), strict=True
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
