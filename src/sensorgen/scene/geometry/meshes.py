"""Triangle meshes straight from the scene, without a CAD kernel, and checks that they are closed and apart."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from math import acos, ceil, pi, sin, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.scene.scene import AXES, PLANE, Body, Outline, Piece, Prism, Scene, extent
from sensorgen.scene.sections import overlap, sections

if TYPE_CHECKING:
    import manifold3d

    from sensorgen.scene.revolved import Revolved

_AT_ONCE = 1_000_000  # triangles
CHORD_MM = 0.01  # of a round body, from the middle of its triangles: less than slicers resolve


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles over shared vertices, seen counter-clockwise from outside.

    Attributes
    ----------
    vertices_mm : (n, 3) float64 array
        Corners [mm].
    triangles : (m, 3) int32 array
        Indices into ``vertices_mm`` [-].
    """

    vertices_mm: NDArray[np.float64]
    triangles: NDArray[np.int32]

    def corners_mm(self) -> Real:
        """Corners of every triangle (m, 3, 3) [mm]."""
        return np.asarray(self.vertices_mm[self.triangles], float)

    def normals_mm2(self) -> Real:
        """Normals of the triangles, as long as twice their areas (m, 3) [mm2]."""
        a, b, c = self.corners_mm().swapaxes(0, 1)
        return np.asarray(np.cross(b - a, c - a))

    def area_mm2(self) -> float:
        """Area of the surface [mm2]."""
        some = (Mesh(self.vertices_mm, part) for part in self._parts())
        return sum(float(np.linalg.norm(part.normals_mm2(), axis=1).sum()) / 2 for part in some)

    def _parts(self) -> Iterator[NDArray[np.int32]]:
        """Triangles, so many at once that a sum over them takes little memory."""
        return (self.triangles[k : k + _AT_ONCE] for k in range(0, len(self.triangles), _AT_ONCE))

    def sharp_edges(self, cosine: float = 0.999) -> Whole:
        """Edges (n, 2), sorted: of one face alone, or between faces whose normals have at most this cosine."""
        normal = self.normals_mm2()
        normal /= np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-300)
        sides = np.sort(edges(self.triangles), axis=1)
        order = np.lexsort((sides[:, 1], sides[:, 0]))
        first = np.flatnonzero(np.append(True, (sides[order][1:] != sides[order][:-1]).any(1)))
        count = np.diff(np.append(first, len(order)))
        one, other = order[first] // 3, order[(first + 1).clip(max=len(order) - 1)] // 3
        smooth = (count == 2) & (np.einsum("ij,ij->i", normal[one], normal[other]) > cosine)
        return np.asarray(sides[order[first[~smooth]]])

    def turned(self) -> "Mesh":
        """Mesh with inside and outside exchanged."""
        return Mesh(self.vertices_mm, self.triangles[:, ::-1].copy())

    def solid(self) -> "manifold3d.Manifold":
        """Solid of manifold3d, in double precision; look at its ``status()``."""
        return self._solid

    @cached_property
    def _solid(self) -> "manifold3d.Manifold":
        import manifold3d

        data = manifold3d.Mesh64(vert_properties=self.vertices_mm, tri_verts=self.triangles.astype(np.uint64))
        return manifold3d.Manifold(data)

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in vars(self).items() if key != "_solid"}  # a solid cannot be pickled

    def volume_mm3(self) -> float:
        """Enclosed volume, by the divergence theorem [mm3]."""
        if len(self.triangles) == 0:
            return 0.0
        places = self.vertices_mm - self.vertices_mm[0]  # near the body, so that little cancels
        some = (places[part] for part in self._parts())
        return sum(float(np.einsum("ij,ij->", of[:, 0], np.cross(of[:, 1], of[:, 2]))) for of in some) / 6.0


def edges(triangles: NDArray[np.integer[Any]]) -> Whole:
    """Directed edges of triangles (3 m, 2), those of the first triangle first."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)


def joined(parts: Sequence[Mesh]) -> Mesh:
    """Meshes side by side in one."""
    first = np.cumsum([0, *(len(p.vertices_mm) for p in parts)])
    triangles = [p.triangles + start for p, start in zip(parts, first, strict=False)]
    return Mesh(np.concatenate([p.vertices_mm for p in parts]), np.concatenate(triangles).astype(np.int32))


def mesh(body: Body) -> Mesh:
    """Mesh a body: boxes that share faces become one shell, other pieces one shell each.

    Shells that touch along an edge or at a corner keep vertices of their own, so that every edge
    belongs to two triangles.
    """
    if all(p.is_box() for p in body.pieces):
        return _grid(body.pieces)
    return joined([_of_piece(p) for p in body.pieces])


def _of_piece(piece: Piece) -> Mesh:
    if isinstance(piece, Prism):
        return _prism(piece)
    from sensorgen.scene.polyhedra import surface
    from sensorgen.scene.revolved import Revolved

    if isinstance(piece, Revolved):
        return _revolved(piece)
    flat = surface(piece)
    return Mesh(np.array(flat.vertices), np.array(flat.triangles, np.int32))


def _revolved(piece: "Revolved") -> Mesh:
    """Rings of the corners of its profile, as many to each, and one corner for a ring on the axis."""
    profile = np.array(piece.profile(CHORD_MM / 4))
    n = 4 * max(ceil(pi / 4 / acos(max(1 - CHORD_MM / profile[:, 0].max(), 0.0))), 2)
    turns = 2 * pi * np.arange(n) / n
    wider = sqrt(2 * pi / n / sin(2 * pi / n))  # polygons of the circles' areas
    rings: list[Real] = []
    numbers = []
    for radius, z in profile.tolist():
        first, around = sum(len(ring) for ring in rings), turns if radius > 0 else turns[:1]
        places = np.stack([np.cos(around), np.sin(around)], 1) * radius * wider + (piece.x_mm, piece.y_mm)
        rings.append(np.column_stack([places, np.full(len(around), z)]))
        numbers.append(first + np.arange(n) % len(around))
    here, there = np.array(numbers), np.roll(numbers, -1, axis=0)
    quads = [ring.ravel() for ring in (here, np.roll(here, -1, 1), np.roll(there, -1, 1), there)]
    triangles = np.concatenate([np.stack([quads[k] for k in way], 1) for way in ((0, 1, 2), (0, 2, 3))])
    a, b, c = triangles.T
    return Mesh(np.concatenate(rings), triangles[(a != b) & (b != c) & (c != a)].astype(np.int32))


def _prism(prism: Prism) -> Mesh:
    """Two caps and a wall."""
    ring = np.array(prism.outline)
    n = len(ring)
    vertices = np.empty((2 * n, 3))
    for half, level in ((slice(0, n), prism.start_mm), (slice(n, None), prism.end_mm)):
        for column, axis in enumerate(PLANE[prism.axis]):
            vertices[half, "xyz".index(axis)] = ring[:, column]
        vertices[half, "xyz".index(prism.axis)] = level
    cap = _cap(prism.outline)
    here = np.arange(n)
    after = (here + 1) % n
    wall = np.concatenate([np.stack([here, after, after + n], 1), np.stack([here, after + n, here + n], 1)])
    triangles = np.concatenate([cap[:, ::-1], cap + n, wall])
    if prism.axis == "y":  # x, z and y are a left-handed set
        triangles = triangles[:, ::-1]
    return Mesh(vertices, triangles.astype(np.int32))


def _cap(outline: Outline) -> Whole:
    """Triangles of a flat outline, as indices of its corners."""
    if len(outline) == 3:
        return np.array([[0, 1, 2]])
    import manifold3d

    return np.asarray(manifold3d.triangulate([np.array(outline)]), np.int64)


def _filled(boxes: Sequence[Piece], lines: Sequence[Real]) -> Mask:
    """Cells between the lines of a grid that boxes fill, (x, y, z)."""
    filled = np.zeros([len(line) - 1 for line in lines], bool)
    for p in boxes:
        ends = (np.searchsorted(line, p.span(axis)) for line, axis in zip(lines, "xyz", strict=True))
        filled[tuple(slice(low, high) for low, high in ends)] = True
    return filled


def _grid(boxes: Sequence[Piece]) -> Mesh:
    """Outer faces of boxes, on the grid of all their coordinates."""
    lines = [np.unique([edge for p in boxes for edge in p.span(axis)]) for axis in "xyz"]
    filled = _filled(boxes, lines)
    # Which of the eight cells around each grid point are filled, as bits x + 2 y + 4 z
    padded = np.pad(filled, 1).astype(np.uint8)
    around = np.zeros([n + 1 for n in filled.shape], np.uint8)
    for bit, shift in enumerate(_CORNERS):
        window = tuple(slice(s, s + n) for s, n in zip(shift, around.shape, strict=True))
        around |= padded[window] << bit
    keys = np.concatenate([_faces(filled, around, axis, side) for axis in range(3) for side in (0, 1)])
    used = np.zeros(around.size * 4, bool)
    used[keys.ravel()] = True
    number = np.cumsum(used) - 1
    quads = number[keys]
    places = np.unravel_index(np.flatnonzero(used) // 4, around.shape)
    vertices = np.stack([line[place] for line, place in zip(lines, places, strict=True)], 1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(vertices, triangles.astype(np.int32))


def _faces(filled: Mask, around: NDArray[np.uint8], axis: int, side: int) -> Whole:
    """Outer faces on one side of the filled cells: (n, 4) keys of corners, counter-clockwise from outside.

    A key is four times the number of the grid point, plus the number of the solid at that point: two
    solids that meet there in an edge or corner only differ by it.
    """
    outside = np.zeros_like(filled)
    inner = tuple(slice(1 - side, filled.shape[k] - side) if k == axis else slice(None) for k in range(3))
    beyond = tuple(slice(side, filled.shape[k] - 1 + side) if k == axis else slice(None) for k in range(3))
    outside[...] = filled
    outside[inner] &= ~filled[beyond]
    cells = np.argwhere(outside)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    turn = ((0, 0), (1, 0), (1, 1), (0, 1)) if side else ((0, 0), (0, 1), (1, 1), (1, 0))
    keys = np.empty((len(cells), 4), np.int64)
    for corner, (du, dv) in enumerate(turn):
        offset = np.zeros(3, np.int64)
        offset[[axis, u, v]] = side, du, dv
        point = np.ravel_multi_index(tuple((cells + offset).T), around.shape)
        own = int((1 - offset) @ (1, 2, 4))  # the cell itself, seen from its corner
        keys[:, corner] = 4 * point + _SOLIDS[around.ravel()[point], own]
    return keys


_CORNERS = [(x, y, z) for z, y, x in product((0, 1), repeat=3)]


def _number_solids() -> Whole:
    """For each pattern of eight cells around a point: which of the solids there each cell belongs to.

    Cells that share a face are one solid; (256, 8), cells in the order of the bits.
    """
    table = np.zeros((256, 8), np.int64)
    for pattern in range(256):
        solid = {cell: cell for cell in range(8) if pattern >> cell & 1}
        for _ in range(3):  # a label travels at most three faces
            for cell, step in product(solid, (1, 2, 4)):
                if cell ^ step in solid:
                    solid[cell] = solid[cell ^ step] = min(solid[cell], solid[cell ^ step])
        order = {label: number for number, label in enumerate(sorted(set(solid.values())))}
        for cell, label in solid.items():
            table[pattern, cell] = order[label]
    return table


_SOLIDS = _number_solids()


# Where bodies share a face, rounding leaves a film of some 1e-13 mm; a real overlap is far above this.
OVERLAP_MM = 1e-9
_MANY = 10_000  # triangles, from which on taking a mesh apart takes seconds


def faults(scene: Scene, meshes: Mapping[str, Mesh]) -> list[tuple[str, str]]:
    """Bodies, and what is wrong with them; empty when all are valid.

    Parameters
    ----------
    scene : Scene
        For the volumes that the meshes must have.
    meshes : mapping of str to Mesh
        One for each body, by its name.
    """
    broken = [(body.name, fault) for body in scene.bodies if (fault := _fault(body, meshes[body.name]))]
    if broken or _are_apart(scene):
        return broken
    solids = {name: mesh.solid() for name, mesh in meshes.items()}
    return _overlaps(solids, {body.name: _off_mm(body) for body in scene.bodies})


def _fault(body: Body, mesh: Mesh) -> str:
    """Fault of one body; "" if none.

    A solid of many triangles takes a gigabyte: where boxes show that shells are apart, edges tell whether they close.
    """
    import manifold3d

    exact, got, off = body.volume_mm3(), mesh.volume_mm3(), _off_mm(body)
    is_sound = _two_manifold(mesh)
    near = _near(mesh)
    are_apart = is_sound and len(mesh.triangles) > _MANY and not len(near.triangles)
    status = manifold3d.Error.NoError if are_apart else mesh.solid().status()
    if status != manifold3d.Error.NoError:
        return f"not a closed oriented surface ({status.name})"
    if not is_sound:
        return "shells are welded along an edge: programs that read 3MF refuse that"
    area = mesh.area_mm2()
    if abs(got - exact) > 1e-9 * exact + off * area:  # rounding, and chords in place of arcs
        return f"encloses {got:.9g} mm3, not {exact:.9g} mm3"
    if (twice := _self_overlap_mm3(near.solid())) > (OVERLAP_MM + off) * area:
        return f"overlaps itself by {twice:.3g} mm3"
    ends = np.transpose([mesh.vertices_mm.min(0), mesh.vertices_mm.max(0)])
    drawn = [extent(body.pieces, axis) for axis in AXES]
    return "" if np.allclose(ends, drawn, rtol=0.0, atol=OVERLAP_MM + off) else "is not where it is drawn"


def _off_mm(body: Body) -> float:
    """Largest distance of a mesh from the surface [mm]."""
    return CHORD_MM if any(p.is_round() for p in body.pieces) else 0.0


def _are_apart(scene: Scene) -> bool:
    """True where cross-sections show that no bodies overlap; solids take ten times longer to intersect."""
    try:
        sections(scene)
    except ValueError:
        return False
    return overlap(scene) is None


def _two_manifold(mesh: Mesh) -> bool:
    """True where every edge has one triangle on each side; manifold3d takes a seam with four and parts it."""
    there, back = (_keys(way, len(mesh.vertices_mm)) for way in (mesh.triangles, mesh.triangles[:, ::-1]))
    return bool(np.all(np.diff(there) > 0) and np.array_equal(there, back))


def _keys(triangles: NDArray[np.int32], count: int) -> Whole:
    """Number of each directed edge of triangles of ``count`` corners, sorted."""
    keys: Whole = np.empty(3 * len(triangles), np.int64)
    for key, start, end in zip(np.split(keys, 3), (0, 1, 2), (1, 2, 0), strict=True):
        np.multiply(triangles[:, end], count, out=key, dtype=np.int64)
        key += triangles[:, start]
    keys.sort()
    return keys


def _self_overlap_mm3(solid: "manifold3d.Manifold") -> float:
    """Volume that the shells of one body enclose more than once [mm3]."""
    import manifold3d

    shells = solid.decompose()
    united = manifold3d.Manifold.batch_boolean(shells, manifold3d.OpType.Add) if len(shells) > 1 else solid
    return float(solid.volume() - united.volume())


def _near(mesh: Mesh) -> Mesh:
    """Shells whose boxes share more than a face with another's: of others no two overlap."""
    from sensorgen.scene.connections import groups

    label = groups(len(mesh.vertices_mm), *mesh.triangles[:, [0, 1, 1, 2]].reshape(-1, 2).T)
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.diff(label[order], prepend=-1))
    places = mesh.vertices_mm[order]
    low, high = (end.reduceat(places, starts) for end in (np.minimum, np.maximum))
    plans = shapely.box(*low[:, :2].T, *high[:, :2].T)
    one, other = shapely.STRtree(plans).query(plans)
    shared = np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])
    near = np.isin(label, label[order][starts][one[(shared > OVERLAP_MM).all(1) & (one != other)]])
    triangles = (np.cumsum(near) - 1)[mesh.triangles[near[mesh.triangles[:, 0]]]]
    return Mesh(mesh.vertices_mm[near], triangles.astype(np.int32))


def _overlaps(solids: Mapping[str, "manifold3d.Manifold"], off_mm: Mapping[str, float]) -> list[tuple[str, str]]:
    overlaps = []
    for a, b in combinations(solids, 2):
        one, other = solids[a], solids[b]
        boxes = np.array([one.bounding_box(), other.bounding_box()])
        if (boxes[:, 3:].min(axis=0) - boxes[:, :3].max(axis=0) > OVERLAP_MM).all():  # they share more than a face
            volume = (one ^ other).volume()
            depth = OVERLAP_MM + off_mm[a] + off_mm[b]
            if volume > depth * min(one.surface_area(), other.surface_area()):
                overlaps.append((f"{a} / {b}", f"overlap by {volume:.3g} mm3"))
    return overlaps


def electrode_gap_mm(scene: Scene, meshes: Mapping[str, Mesh]) -> float:
    """Smallest distance between bodies at different terminals, exact; infinite where there are no two [mm]."""
    ends = [(b.terminal, meshes[b.name].solid()) for b in scene.bodies if b.terminal]
    for reach in (scene.size_mm[2], sum(scene.size_mm)):  # of an array a long reach takes a hundred times longer
        gap = min((float(a.min_gap(b, reach)) for (s, a), (t, b) in combinations(ends, 2) if s != t), default=np.inf)
        if gap < reach:
            break
    return gap
