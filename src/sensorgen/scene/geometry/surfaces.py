"""Triangles of strangers as closed surfaces: what is wrong with them is put right where that is safe, or refused.

The order: equal corners become one, triangles that say nothing go, all look outwards, flat openings are closed. Faces
around an edge are paired through the material between them, so that solids which only touch stay apart.

What is drawn as an extrusion is one again, exactly: prisms where all faces are level or upright along one axis, else
polyhedra. Models for cross-sections, boxes and layers apply to it.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.connections import groups
from sensorgen.scene.geometry.meshes import Mesh, edges, joined
from sensorgen.scene.layers import outlines
from sensorgen.scene.polyhedra import Polyhedron
from sensorgen.scene.scene import AXES, PLANE, Outline, Piece, Place, Prism, box

if TYPE_CHECKING:
    import manifold3d

WELD_MM = 1e-6  # corners nearer than this are one
GAP_MM = 1e-3  # and these too where a surface is open without it: far below what any printer prints
FLAT_MM = 1e-3  # an opening whose edge is as flat as this is closed by a face
_NOTHING = 1e-9  # volume over surface and size below which a surface encloses nothing [-]


@dataclass(frozen=True)
class SurfaceFault:
    """Fault of a surface that cannot be put right.

    Attributes
    ----------
    message, advice : str
        What it is, and what to do in CAD.
    place_mm : (float, float, float)
        One place where it shows.
    """

    message: str
    advice: str
    place_mm: Place


@dataclass(frozen=True)
class Closed:
    """A closed surface, or what keeps it from being one.

    Attributes
    ----------
    shells : tuple of Mesh
        Connected surfaces, each edge between two triangles; cavities, which are inside out, after the outer ones.
    repairs : tuple of str
        What was put right.
    faults : tuple of SurfaceFault
        What was not; without shells.
    """

    shells: tuple[Mesh, ...]
    repairs: tuple[str, ...] = ()
    faults: tuple[SurfaceFault, ...] = ()


def closed(vertices_mm: Real, triangles: Whole, weld_mm: float = WELD_MM) -> Closed:
    """Closed surfaces of triangles in any state.

    Parameters
    ----------
    vertices_mm : (n, 3) array
        Corners [mm].
    triangles : (m, 3) array
        Numbers of corners.
    weld_mm : float
        Distance within which corners are one: the rounding of the file.
    """
    if not np.isfinite(vertices_mm).all():
        bad = vertices_mm[~np.isfinite(vertices_mm).all(1)]
        return Closed((), (), (SurfaceFault(f"{len(bad)} corners are no numbers", "export it again", (0.0, 0.0, 0.0)),))
    points, faces, repairs = _joined(vertices_mm, triangles, weld_mm)
    faces, twice = _once(faces)
    repairs += [f"{twice} faces that are there twice removed"] if twice else []
    faces, turned = _oriented(faces)
    repairs += [f"{turned} faces turned to look outwards like their neighbours"] if turned else []
    faces, filled, faults = _filled(points, faces)
    repairs += filled
    if faults:
        return Closed((), tuple(repairs), tuple(faults))
    mates, faults = _mates(points, faces)
    if faults:
        return Closed((), tuple(repairs), tuple(faults))
    shells, inverted, faults = _outwards(_shells(points, faces, mates))
    repairs += [f"{inverted} surfaces that were inside out turned"] if inverted else []
    return Closed(tuple(shells) if not faults else (), tuple(repairs), tuple(faults))


def _place(point: Real) -> Place:
    x, y, z = point.round(6).tolist()
    return x, y, z


def _joined(points: Real, faces: Whole, weld_mm: float) -> tuple[Real, Whole, list[str]]:
    """Corners within a distance as one, within ``GAP_MM`` where that leaves fewer openings; and what was repaired."""
    near = _welded(points, faces, weld_mm)
    if len(_open(near[1])) and weld_mm < GAP_MM:
        wider = _welded(points, faces, GAP_MM)
        if len(_open(wider[1])) < len(_open(near[1])):
            return *wider, [f"gaps of up to {GAP_MM:g} mm closed"]
    return *near, []


def _welded(points: Real, faces: Whole, near_mm: float) -> tuple[Real, Whole]:
    """Corners within a distance as one, faces of fewer than three corners left out."""
    from scipy.spatial import cKDTree

    exact, back = np.unique(points, axis=0, return_inverse=True)
    label = groups(len(exact), *cKDTree(exact).query_pairs(near_mm, output_type="ndarray").T)
    _, first = np.unique(label, return_index=True)
    faces = label[back.reshape(-1)[faces]]
    distinct = (faces != np.roll(faces, 1, axis=1)).all(1)
    return exact[first], faces[distinct]


def _open(faces: Whole) -> Whole:
    """Numbers of directed edges that have no opposite one."""
    ways = edges(faces)
    n = int(ways.max(initial=0)) + 1
    there, back = ways @ [n, 1], ways @ [1, n]
    keys = np.unique(there)
    place = np.searchsorted(keys, back).clip(max=max(len(keys) - 1, 0))
    has = keys[place] == back if len(keys) else np.zeros(0, bool)
    return np.flatnonzero(~has)


def _once(faces: Whole) -> tuple[Whole, int]:
    """Triangles without copies of others."""
    turn = np.argmin(faces, axis=1)
    canonical = faces[np.arange(len(faces))[:, None], (turn[:, None] + np.arange(3)) % 3]
    _, first = np.unique(canonical, axis=0, return_index=True)
    return faces[np.sort(first)], len(faces) - len(first)


def _oriented(faces: Whole) -> tuple[Whole, int]:
    """Triangles turned so that neighbours over an edge of two look to the same side, and how many were turned."""
    directed = edges(faces)
    sides = np.sort(directed, axis=1)
    order = np.lexsort(sides.T)
    same = (sides[order][1:] == sides[order][:-1]).all(1)
    pair = same & ~np.append(False, same[:-1]) & ~np.append(same[1:], False)
    one, other = order[:-1][pair], order[1:][pair]
    against = (directed[one] == directed[other]).all(1)
    if not against.any():
        return faces, 0
    # Every face as it is, and turned: numbers k and k + n
    a, b, n = one // 3, other // 3, len(faces)
    label = groups(2 * n, np.append(a, a + n), np.append(b + n * against, b + n * ~against))
    turned, surface = label[:n] > label[n:], np.minimum(label[:n], label[n:])
    most = np.bincount(surface, turned) > np.bincount(surface) / 2
    turned ^= most[surface]
    return np.where(turned[:, None], faces[:, ::-1], faces), int(turned.sum())


def _filled(points: Real, faces: Whole) -> tuple[Whole, list[str], list[SurfaceFault]]:
    """Triangles with flat openings closed, how, and the openings that are not flat."""
    after = defaultdict(list)
    for a, b in edges(faces)[_open(faces)].tolist():
        after[b].append(a)  # the other way round: as the face that is missing has them
    added, repairs, faults = [faces], [], []
    while after:
        *loop, last = _loop(after)
        closes = last == loop[0]
        ring = np.array(loop if closes else [*loop, last])
        cap = _cap(points[ring]) if closes and len(ring) > 2 else None
        place = _place(points[ring].mean(0))
        if cap is None:
            message = f"it is open: a gap with an edge of {len(ring)} sides that is not flat"
            faults.append(SurfaceFault(message, "close the gap in CAD, or join the faces into a solid", place))
        else:
            x, y, z = place
            repairs.append(f"a flat opening of {len(ring)} sides closed at x {x:g}, y {y:g}, z {z:g} mm")
            added.append(ring[cap])
    return np.concatenate(added), repairs, faults


def _loop(after: dict[int, list[int]]) -> list[int]:
    """Take the edges of one opening out of the next ends by corner: its corners, the first again where it closes."""
    loop = [next(iter(after))]
    while loop[-1] in after and (len(loop) == 1 or loop[-1] != loop[0]):
        ends = after[loop[-1]]
        loop.append(ends.pop())
        if not ends:
            del after[loop[-2]]
    return loop


def _cap(ring: Real) -> Whole | None:
    """Triangles over a flat ring of corners; None where it is not flat."""
    if len(ring) == 3:
        return np.array([[0, 1, 2]])
    middle = ring.mean(0)
    _, _, axes = np.linalg.svd(ring - middle, full_matrices=False)
    local = (ring - middle) @ axes.T
    if abs(local[:, 2]).max() > FLAT_MM:
        return None
    import manifold3d
    import shapely

    plane = local[:, :2]
    if not shapely.Polygon(plane).is_valid:
        return None
    area = np.sum(plane[:, 0] * np.roll(plane[:, 1], -1) - np.roll(plane[:, 0], -1) * plane[:, 1])
    flat = plane if area > 0 else plane * [1.0, -1.0]
    return np.asarray(manifold3d.triangulate([flat]), np.int64)


def _mates(points: Real, faces: Whole) -> tuple[Whole, list[SurfaceFault]]:
    """For each directed edge the one of the neighbouring face; faults where there is none."""
    ways = edges(faces)
    sides = np.sort(ways, axis=1)
    _, label = np.unique(sides, axis=0, return_inverse=True)
    order = np.argsort(label.reshape(-1), kind="stable")
    starts = np.flatnonzero(np.append(True, np.diff(label.reshape(-1)[order]) > 0))
    counts = np.diff(np.append(starts, len(order)))
    forward = ways[:, 0] < ways[:, 1]
    mates = np.full(len(ways), -1)
    two = starts[counts == 2]
    one, other = order[two], order[two + 1]
    good = forward[one] != forward[other]
    mates[one[good]], mates[other[good]] = other[good], one[good]
    bad = [*one[~good].tolist()]
    for start, count in zip(starts[counts != 2].tolist(), counts[counts != 2].tolist(), strict=True):
        here = order[start : start + count]
        if 2 * int(forward[here].sum()) != count:
            bad.append(int(here[0]))
            continue
        for a, b in _through_material(points, faces, ways, here, forward):
            mates[a], mates[b] = b, a
    faults = []
    if bad:
        place = _place(points[ways[bad[0]]].mean(0))
        many = f" and {len(bad) - 1} others" if len(bad) > 1 else ""
        message = f"no outside can be given to its faces: one edge{many} has faces that look to different sides"
        faults.append(SurfaceFault(message, "remove faces inside the body, and export a solid", place))
    return mates, faults


def _through_material(
    points: Real, faces: Whole, ways: Whole, here: Whole, forward: NDArray[np.bool_]
) -> list[tuple[int, int]]:
    """Pairs of the faces around one edge between which there is material."""
    a, b = points[np.sort(ways[here[0]])]
    axis = (b - a) / np.linalg.norm(b - a)
    tips = points[[next(c for c in faces[k // 3] if c not in ways[k]) for k in here]] - a
    tips -= (tips @ axis)[:, None] * axis
    u = tips[0] / max(np.linalg.norm(tips[0]), 1e-300)
    angle = np.arctan2(tips @ np.cross(axis, u), tips @ u)
    pairs, left = [], np.flatnonzero(~forward[here]).tolist()
    for k in np.flatnonzero(forward[here]).tolist():  # material lies clockwise of a face whose edge runs along the axis
        gaps = [(angle[k] - angle[j]) % (2 * np.pi) for j in left]
        gaps = [g if 1e-7 < g < 2 * np.pi - 1e-7 else 2 * np.pi for g in gaps]
        j = left.pop(int(np.argmin(gaps)))
        pairs.append((int(here[k]), int(here[j])))
    return pairs


def _shells(points: Real, faces: Whole, mates: Whole) -> list[Mesh]:
    """Connected surfaces, each with corners of its own: those of one fan of faces are one."""
    number = np.arange(len(mates))
    following = number - number % 3 + (number + 1) % 3  # directed edge k starts at corner k, and ends at this one
    vertex = groups(len(mates), np.append(number, following), np.append(following[mates], mates))
    label = groups(len(faces), number // 3, mates // 3)
    places = points[faces.reshape(-1)]
    shells = []
    for k in range(int(label.max(initial=-1)) + 1):
        own = vertex.reshape(-1, 3)[label == k]
        _, first, back = np.unique(own, return_index=True, return_inverse=True)
        where = np.flatnonzero(np.repeat(label == k, 3))[first]
        shells.append(Mesh(places[where], back.reshape(-1, 3).astype(np.int32)))
    return shells


def _outwards(shells: Sequence[Mesh]) -> tuple[list[Mesh], int, list[SurfaceFault]]:
    """Shells with their outside out; one inside another that is inside out is a cavity. And how many were turned."""
    outer: list[Mesh] = []
    inner: list[Mesh] = []
    faults, turned = [], 0
    for shell in shells:
        low, high = shell.vertices_mm.min(0), shell.vertices_mm.max(0)
        area = np.linalg.norm(shell.normals_mm2(), axis=1).sum() / 2
        volume = shell.volume_mm3()
        if abs(volume) <= _NOTHING * area * np.linalg.norm(high - low):
            faults.append(
                SurfaceFault("it encloses nothing: a sheet without thickness",
                             "give it a thickness in CAD, or leave it out", _place((low + high) / 2))
            )  # fmt: skip
        (outer if volume > 0 else inner).append(shell)
    cavities = []
    for shell in inner:
        low, high = shell.vertices_mm.min(0), shell.vertices_mm.max(0)
        inside = any(
            (o.vertices_mm.min(0) < low).all() and (o.vertices_mm.max(0) > high).all() for o in (*outer, *inner)
        )
        if inside and any((o.vertices_mm.min(0) < low).all() for o in outer):
            cavities.append(shell)
        else:
            outer.append(shell.turned())
            turned += 1
    return [*outer, *cavities], turned, faults


def crossing(mesh: Mesh) -> Place | None:
    """A place where faces of a surface pass through each other; None where none do [mm].

    Faces that share a corner are not compared.
    """
    import shapely

    corners = mesh.corners_mm()
    low, high = corners.min(1), corners.max(1)
    flat = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    one, other = shapely.STRtree(flat).query(flat, predicate="intersects")
    keep = (one < other) & (low[one, 2] <= high[other, 2]) & (low[other, 2] <= high[one, 2])
    one, other = one[keep], other[keep]
    shared = (mesh.triangles[one][:, :, None] == mesh.triangles[other][:, None, :]).any((1, 2))
    one, other = one[~shared], other[~shared]
    for a, b in ((one, other), (other, one)):
        for k in range(3):
            start, end = corners[a, k], corners[a, (k + 1) % 3]
            hit = _pierced(start, end, corners[b])
            if hit is not None:
                return _place(hit)
    return None


def _pierced(start: Real, end: Real, faces: Real) -> Real | None:
    """First place where a line segment passes through the inside of a triangle, row by row (Moeller, Trumbore 1997)."""
    way, side, other = end - start, faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]
    normal = np.cross(way, other)
    size = np.einsum("ij,ij->i", side, normal)
    scale = np.linalg.norm(way, axis=1) * np.linalg.norm(side, axis=1) * np.linalg.norm(other, axis=1)
    steep = abs(size) > 1e-9 * scale
    size = np.where(steep, size, 1.0)
    offset = start - faces[:, 0]
    turned = np.cross(offset, side)
    u, v = np.einsum("ij,ij->i", offset, normal) / size, np.einsum("ij,ij->i", way, turned) / size
    t = np.einsum("ij,ij->i", other, turned) / size
    eps = 1e-6
    inside = steep & (u > eps) & (v > eps) & (u + v < 1 - eps) & (t > eps) & (t < 1 - eps)
    at = np.flatnonzero(inside)
    return start[at[0]] + t[at[0]] * way[at[0]] if len(at) else None


def united(shells: Sequence[Mesh]) -> tuple[Mesh, ...]:
    """Shells of one body that overlap as one; cavities stay cavities."""
    import manifold3d

    outer = [shell.solid() for shell in shells if shell.volume_mm3() > 0]
    hollow = [shell for shell in shells if shell.volume_mm3() < 0]
    whole = manifold3d.Manifold.batch_boolean(outer, manifold3d.OpType.Add)
    for shell in hollow:
        whole = whole - shell.turned().solid()
    return shells_of(whole)


def shells_of(whole: "manifold3d.Manifold") -> tuple[Mesh, ...]:
    """Shells of a solid of manifold3d."""
    data = whole.to_mesh64()
    return closed(np.asarray(data.vert_properties)[:, :3], np.asarray(data.tri_verts).astype(np.int64)).shells


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
    for n, low in enumerate(levels[:-1]):
        here = caps[at == n]
        added, gone = (_region(mesh, here[(normal[here] > 0) == up], plane, near_mm) for up in (False, True))
        region = shapely.union(shapely.difference(region, gone, grid_size=_GRID_MM), added, grid_size=_GRID_MM)
        now = {outline: growing.pop(outline, low) for outline in outlines(region)}
        prisms += [_prism(axis, outline, start, low) for outline, start in growing.items()]
        growing = now
        if len(prisms) + len(now) > MOST_PRISMS:
            return ()
    prisms += [_prism(axis, outline, start, levels[-1]) for outline, start in growing.items()]
    return tuple(sorted(prisms, key=lambda p: (p.start_mm, p.outline)))


def _region(mesh: Mesh, faces: Whole, plane: Sequence[int], near_mm: float) -> shapely.Geometry:
    """Region that level faces cover, by the edges that only one of them has."""
    ways = edges(mesh.triangles[faces])
    _, first, count = np.unique(np.sort(ways, axis=1), axis=0, return_index=True, return_counts=True)
    border = ways[first[count == 1]]
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
