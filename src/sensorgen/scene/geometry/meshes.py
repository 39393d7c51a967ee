"""Triangle meshes straight from the scene, in double precision, without a CAD kernel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import acos, ceil, pi, sin, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.scene.scene import PLANE, Body, Outline, Piece, Prism

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

    def edges(self) -> Whole:
        """Directed edges of the triangles (3 m, 2), those of the first triangle first."""
        return self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)

    def sharp_edges(self, cosine: float = 0.999) -> Whole:
        """Edges (n, 2), sorted: of one face alone, or between faces whose normals have at most this cosine."""
        normal = self.normals_mm2()
        normal /= np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-300)
        sides = np.sort(self.edges(), axis=1)
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


def _grid(boxes: Sequence[Piece]) -> Mesh:
    """Outer faces of boxes, on the grid of all their coordinates."""
    lines = [np.unique([edge for p in boxes for edge in p.span(axis)]) for axis in "xyz"]
    filled = np.zeros([len(line) - 1 for line in lines], bool)
    for p in boxes:
        ends = (np.searchsorted(line, p.span(axis)) for line, axis in zip(lines, "xyz", strict=True))
        filled[tuple(slice(low, high) for low, high in ends)] = True
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
