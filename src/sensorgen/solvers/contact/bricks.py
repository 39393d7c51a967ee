"""Unit cell of a scene of boxes between its mirror planes, and its mesh of bricks graded towards its planes."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import BadInput
from sensorgen.core.units import M_PER_MM
from sensorgen.scene.repetition import raster
from sensorgen.scene.scene import Scene
from sensorgen.solvers.contact.cell import AIR, Region
from sensorgen.solvers.contact.element import BRICK, BRICK_CORNERS, BRICK_INNER, BRICK_OUTER, ElementMesh


@dataclass(frozen=True)
class Bricks:
    """Boxes between planes square to the axes.

    Attributes
    ----------
    planes_m : three arrays
        Where the planes lie on x, y and z [m].
    fill : (i, j, k) array
        What is in each box: an index into ``regions``.
    regions : tuple of Region
        Air first.
    """

    planes_m: tuple[Real, Real, Real]
    fill: Whole
    regions: tuple[Region, ...]

    def spans_m(self) -> Real:
        """Where it begins and ends along each axis (3, 2) [m]."""
        return np.array([[p[0], p[-1]] for p in self.planes_m])

    def written(self) -> str:
        """Everything that it is, as text."""
        return repr(([planes.tolist() for planes in self.planes_m], self.fill.tolist(), self.regions))

    def cut(self, pieces: int, shrink: float) -> "Bricks":
        """Every box in that many pieces along each axis, each ``shrink`` of the next towards planes inside."""
        parts = [_cut(planes, pieces, shrink) for planes in self.planes_m]
        x, y, z = (planes for planes, _ in parts)
        return Bricks((x, y, z), self.fill[np.ix_(*(owner for _, owner in parts))], self.regions)


def bricks_of(scene: Scene) -> Bricks:
    """The cell of a scene of boxes, between mirrors at its four sides.

    Raises
    ------
    BadInput
        A piece is no box, or bodies overlap.
    """
    pieces = scene.pieces
    if not all(p.is_box() for _, p in pieces):
        raise BadInput("pressing in 3D needs a scene of boxes: not all of its bodies are")
    regions = [Region(AIR, ""), *dict.fromkeys(Region(body.material, body.terminal) for body, _ in pieces)]
    try:
        found = raster(scene, lambda body: regions.index(Region(body.material, body.terminal)), 0, ((), (), ()), False)
    except ValueError as error:
        raise BadInput(str(error)) from None
    planes, fill = [p * M_PER_MM for p in found.planes_mm], found.fill
    for axis in (0, 1):  # planes at which only the sensor ends
        apart = np.diff(fill, axis=axis) != 0
        begins = np.append(True, np.moveaxis(apart, axis, 0).any(axis=(1, 2)))
        planes[axis] = planes[axis][np.append(begins, True)]
        fill = fill.compress(begins, axis)
    x, y, z = planes
    return Bricks((x, y, z), fill, tuple(regions))


def _cut(planes: Real, pieces: int, shrink: float) -> tuple[Real, Whole]:
    """Planes with more between them, and from which interval each piece is; both ends are as coarse as the middle."""
    found, last, steps = [planes[:1]], len(planes) - 2, np.arange(pieces)
    for k, (a, b) in enumerate(pairwise(planes.tolist())):
        apart = np.minimum(steps + pieces * (k == 0), steps[::-1] + pieces * (k == last))
        size = (1 / shrink) ** np.minimum(apart, pieces - 1)
        found.append(a + (b - a) * np.cumsum(size) / size.sum())
    return np.concatenate(found), np.repeat(np.arange(last + 1), pieces)


@dataclass(frozen=True)
class BrickMesh(ElementMesh):
    """Some boxes of a cell as elements, with nodes at corners, on edges and faces and within.

    Attributes
    ----------
    bricks : Bricks
        All boxes, air included.
    boxes : (m, 3) array
        Which box each brick is, along x, y and z.
    nodes : (m, 27) array
        Of each brick.
    lattice : (n, 3) array
        Of each node, its place counted in half bricks along x, y and z.
    """

    bricks: Bricks
    boxes: Whole
    nodes: Whole
    lattice: Whole

    @cached_property
    def edges_m(self) -> Real:
        """Edges of each brick (m, 3) [m]."""
        return np.column_stack([np.diff(p)[self.boxes[:, a]] for a, p in enumerate(self.bricks.planes_m)])

    def top(self) -> tuple[Whole, Real]:
        """Faces on the top, from line to line (k, 9), and their areas (k, 1) [m2]."""
        on_top = self.boxes[:, 2] == self.bricks.fill.shape[2] - 1
        return self.nodes[on_top].reshape(-1, 9, 3)[..., 2], self.edges_m[on_top, :2].prod(axis=1, keepdims=True)

    def all_nodes(self, u_m: Real, inner_m: Real) -> Real:
        """Displacements of all nodes (n, 3) from those of the outer ones (3n,) and of the inner ones (m, 3) [m]."""
        found = u_m.reshape(-1, 3).copy()
        found[self.nodes[:, BRICK_INNER]] = inner_m + found[self.nodes[:, BRICK_CORNERS]].mean(axis=1)
        return np.asarray(found)


def mesh_of(bricks: Bricks, which: Mask) -> BrickMesh:
    """Mesh some of the boxes of a cell."""
    boxes = np.argwhere(which)
    size = 2 * np.array(which.shape) + 1
    corners = 2 * boxes[:, None, :] + np.array(list(product(range(3), repeat=3)))
    flat = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), tuple(size))
    used, nodes = np.unique(flat, return_inverse=True)
    lattice = [np.interp(np.arange(2 * len(p) - 1) / 2, np.arange(len(p)), p) for p in bricks.planes_m]
    places = np.column_stack(np.unravel_index(used, tuple(size)))
    points = np.column_stack([line[k] for line, k in zip(lattice, places.T, strict=True)])
    nodes = nodes.reshape(flat.shape)
    return BrickMesh(BRICK, points, nodes[:, BRICK_OUTER], bricks.fill[which], bricks, boxes, nodes, places)
