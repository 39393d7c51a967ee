"""Closed surfaces as pieces of a scene: prisms where all faces are level or upright along one axis, else polyhedra.

What is drawn as an extrusion is one again, exactly: models for cross-sections, boxes and layers apply to it.
"""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import shapely

from sensorgen.scene.geometry.meshes import Mesh, joined
from sensorgen.scene.layers import outlines
from sensorgen.scene.polyhedra import Polyhedron
from sensorgen.scene.scene import AXES, PLANE, Outline, Piece, Prism, box

_GRID_MM = 1e-9  # to which coordinates are rounded: far below SLIVER_MM
_VOLUME_RATIO = 1e-6  # by which prisms may differ from the surface that they replace
MOST_PRISMS = 20_000  # of one body


def pieces(shells: Sequence[Mesh], rounding_mm: float = _GRID_MM) -> tuple[Piece, ...]:
    """The pieces of a body, each connected surface for itself.

    Parameters
    ----------
    shells : sequence of Mesh
        Closed and oriented, as of :func:`sensorgen.scene.geometry.surfaces.closed`.
    rounding_mm : float
        Of its coordinates: faces that are level or upright to this are taken to be so [mm].
    """
    outer = [shell for shell in shells if shell.volume_mm3() > 0]
    bodies = [[shell] for shell in outer] if len(outer) == len(shells) else [list(shells)]
    meshes = [joined(body) for body in bodies]
    return tuple(
        piece
        for mesh in meshes
        for piece in _pieces(Mesh(mesh.vertices_mm.round(9) + 0.0, mesh.triangles), max(rounding_mm, _GRID_MM))
    )


def _pieces(mesh: Mesh, near_mm: float) -> tuple[Piece, ...]:
    """One connected body as the fewest prisms, or as it is."""
    exact = mesh.volume_mm3()
    area = np.linalg.norm(mesh.normals_mm2(), axis=1).sum() / 2
    best: tuple[Piece, ...] = ()
    for axis in "zyx":
        prisms = _prisms(mesh, axis, near_mm)
        same = abs(sum(prism.volume_mm3() for prism in prisms) - exact) <= _VOLUME_RATIO * exact + near_mm * area
        if prisms and same and (not best or len(prisms) < len(best)):
            best = prisms
    if best:
        return best
    places = [(x, y, z) for x, y, z in mesh.vertices_mm.tolist()]
    return (Polyhedron(tuple(places), tuple((a, b, c) for a, b, c in mesh.triangles.tolist())),)


def _prisms(mesh: Mesh, axis: str, near_mm: float) -> tuple[Prism, ...]:
    """Prisms along an axis; none where a face is neither level nor upright along it, or there are too many."""
    k, plane = AXES.index(axis), [AXES.index(other) for other in PLANE[axis]]
    corners = mesh.corners_mm()
    normal = mesh.normals_mm2()[:, k]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(1)
    level = np.ptp(corners[:, :, k], axis=1) <= near_mm
    upright = abs(normal) <= 2 * near_mm * longest
    if not (level | upright).all():
        return ()
    caps = np.flatnonzero(level & ~upright)
    heights = np.sort(corners[caps, :, k].mean(1))
    starts = heights[np.append(True, np.diff(heights) > 4 * near_mm)]
    at = np.searchsorted(starts + 4 * near_mm, corners[caps, :, k].mean(1))
    levels = [_rounded(float(value)) for value in starts]
    region, prisms = shapely.Polygon(), []
    growing: dict[Outline, float] = {}
    faces = defaultdict(list)
    for number, place, looks_up in zip(caps.tolist(), at.tolist(), (normal[caps] > 0).tolist(), strict=True):
        faces[place, looks_up].append(number)
    for n, low in enumerate(levels[:-1]):
        added, gone = (_region(mesh, faces[n, up], plane, near_mm) for up in (False, True))
        region = shapely.union(shapely.difference(region, gone, grid_size=_GRID_MM), added, grid_size=_GRID_MM)
        now: dict[Outline, float] = {}
        for outline in outlines(region):
            now[outline] = growing.pop(outline, low)
        prisms += [_prism(axis, outline, start, low) for outline, start in growing.items()]
        growing = now
        if len(prisms) + len(now) > MOST_PRISMS:
            return ()
    prisms += [_prism(axis, outline, start, levels[-1]) for outline, start in growing.items()]
    return tuple(sorted(prisms, key=lambda p: (p.start_mm, p.outline)))


def _region(mesh: Mesh, faces: Sequence[int], plane: Sequence[int], near_mm: float) -> shapely.Geometry:
    """Region that level faces cover, by the edges that only one of them has."""
    edges = mesh.edges().reshape(-1, 3, 2)[faces].reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    border = edges[first[count == 1]]
    lines = shapely.linestrings(mesh.vertices_mm[border][:, :, plane])
    rings = shapely.get_parts(shapely.polygonize([shapely.union_all(lines, grid_size=_GRID_MM)]))
    middles = shapely.point_on_surface(rings)
    tree = shapely.STRtree(shapely.polygons(mesh.corners_mm()[faces][:, :, plane]))
    covered = np.unique(tree.query(middles, predicate="intersects")[0])
    return shapely.simplify(shapely.union_all(rings[covered], grid_size=_GRID_MM), near_mm)


def _prism(axis: str, outline: Outline, start_mm: float, end_mm: float) -> Prism:
    """A prism; boxes along z, whichever axis they came from."""
    u, v = zip(*outline, strict=True)
    prism = Prism(axis, tuple((_rounded(a), _rounded(b)) for a, b in outline), start_mm, end_mm)
    if not prism.is_box():
        return prism
    spans = dict(zip(PLANE[axis], ((min(u), max(u)), (min(v), max(v))), strict=True)) | {axis: (start_mm, end_mm)}
    return box(*(_rounded(value) for name in AXES for value in spans[name]))


def _rounded(value: float) -> float:
    return round(value, 9) + 0.0
