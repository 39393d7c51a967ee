"""Capacitance by FastCap: panels of constant charge on the faces of a cell and of its mirror images around it.

The cell's own part of the top electrode is a conductor of its own; the images of it around guard its field, and a lid
over each electrode keeps field from its back.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.solvers.electrostatics.boxes import Grid
from sensorgen.verification.peers import cells

_RINGS = 2  # of mirror images, at least
_REACH = 2.5  # of them, over the height of the field
_COARSER = (1.0, 1.0, 2.0)  # panels of the cell, of the first ring, and of the others
_TOLERANCE, _EXPANSION = 1e-4, 4  # of iterations; of multipoles

Rectangle = tuple[Real, Real, Real]  # a corner, and the two sides from it [mm]


@dataclass(frozen=True)
class _Face:
    """Between two sides: materials, or the ends "bottom" and "top"; ``within_mm`` lies on the first one's side."""

    corner_mm: Real
    along_mm: Real
    across_mm: Real
    sides: tuple[str, str]
    within_mm: Real


@dataclass(frozen=True)
class _Image:
    """The i-th and j-th mirror image of a cell, or with 0 and 0 the cell; its lowest corner and its size."""

    i: int
    j: int
    low_mm: Real
    size_mm: Real

    @property
    def ring(self) -> int:
        """Number of images between this one and the cell, with this one."""
        return max(abs(self.i), abs(self.j))

    def sides(self, face: _Face) -> tuple[str, str]:
        """Sides of a face; the cell's own part of the top electrode is "own"."""
        first, second = face.sides
        return "own" if first == "top" and self.ring == 0 and second != "lid" else first, second

    def place(self, place: Real) -> tuple[float, ...]:
        """Image of a place of the cell [mm]."""
        image = np.array(place, float)
        for axis, k in enumerate((self.i, self.j)):
            inside = image[axis] - self.low_mm[axis]
            shift = self.size_mm[axis] - inside if k % 2 else inside
            image[axis] = self.low_mm[axis] + k * self.size_mm[axis] + shift
        return tuple(image)


def _ends(faces: Iterable[_Face]) -> tuple[Real, Real]:
    """Lowest and highest corner of a cell."""
    corners = np.array([f.corner_mm + k * f.along_mm + n * f.across_mm for f in faces for k in (0, 1) for n in (0, 1)])
    return corners.min(0), corners.max(0)


def _lid(end: str, low_mm: Real, size_mm: Real, z_mm: float) -> _Face:
    """A lid over an electrode, as large as the cell."""
    at = np.array([low_mm[0], low_mm[1], z_mm])
    return _Face(at, np.diag(size_mm)[0], np.diag(size_mm)[1], (end, "lid"), at)


def _images(low_mm: Real, size_mm: Real) -> Iterator[_Image]:
    """The cell and its images around, as far as its field is high."""
    rings = [max(_RINGS, int(np.ceil(_REACH * size_mm[2] / s))) for s in size_mm[:2]]
    for i in range(-rings[0], rings[0] + 1):
        for j in range(-rings[1], rings[1] + 1):
            yield _Image(i, j, low_mm, size_mm)


def capacitance(cell: cells.PlaneSection | Grid, permittivity: Mapping[str, float], panels: int) -> float:
    """Of the whole sensor [F], by so many panels along the height of the cell."""
    import fastcap2

    faces = list(_of_plane(cell) if isinstance(cell, cells.PlaneSection) else _of_boxes(cell))
    low, high = _ends(faces)
    height, size = high[2] - low[2], high - low
    faces += [_lid("bottom", low, size, low[2] - height / 4), _lid("top", low, size, high[2] + height / 4)]
    surfaces: dict[tuple[str, str], fastcap2.Surface] = {}
    for image in _images(low, size):
        longest = height / panels * _COARSER[min(image.ring, len(_COARSER) - 1)]
        for face in faces:
            key = image.sides(face)
            if key not in surfaces:
                surfaces[key] = fastcap2.Surface(key[0])
            within = {} if face.sides[0] in cells.ENDS else {"rp": image.place(face.within_mm)}
            for quad in _panels(face, longest):
                surfaces[key].add_quad(*map(image.place, quad), **within)
    deep = cell.depth_mm / float(size[1]) if isinstance(cell, cells.PlaneSection) else 1.0
    return _charge(surfaces, permittivity) * cells.share(cell) * deep


def _charge(surfaces: "Mapping[tuple[str, str], object]", permittivity: Mapping[str, float]) -> float:
    """Between the cell's part of the top electrode, amid its guard, and all of the bottom [F]."""
    import fastcap2

    problem = fastcap2.Problem("sensorgen")
    problem.verbose, problem.iter_tol, problem.expansion_order = False, _TOLERANCE, _EXPANSION
    for (first, second), surface in surfaces.items():
        if first in (*cells.ENDS, "own"):
            outside = permittivity.get(second, 1.0)
            problem.add(surface, kind=fastcap2.Problem.CONDTR, outside_perm=outside, scale=M_PER_MM, group="g")
        else:
            problem.add(
                surface, kind=fastcap2.Problem.DIELEC, inside_perm=permittivity[first],
                outside_perm=permittivity[second], scale=M_PER_MM,
            )  # fmt: skip
    with _mute():
        matrix = np.array(problem.solve())
    names = [name.partition("%")[0] for name in problem.conductors()]
    return float(-matrix[names.index("own"), names.index("bottom")])


@contextmanager
def _mute() -> Iterator[None]:
    """Keep off the standard output what the program writes there past Python."""
    before, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(before, 1)
        os.close(before)
        os.close(nowhere)


def _panels(face: _Face, longest_mm: float) -> Iterator[list[Real]]:
    """Of a face, none longer than asked."""
    n, m = (max(1, int(np.ceil(np.linalg.norm(side) / longest_mm))) for side in (face.along_mm, face.across_mm))
    for k in range(n):
        for j in range(m):
            steps = ((k, j), (k + 1, j), (k + 1, j + 1), (k, j + 1))
            yield [face.corner_mm + a / n * face.along_mm + b / m * face.across_mm for a, b in steps]


def _of_plane(section: cells.PlaneSection) -> Iterator[_Face]:
    """Edges of a cross-section, as deep as the cell is wide."""
    depth = np.array([0.0, float(np.ptp(section.points_mm[:, 0])), 0.0])
    for ((ua, va), (ub, vb)), sides in section.faces.items():
        corner, along = np.array([ua, 0.0, va]), np.array([ub - ua, 0.0, vb - va])
        left = np.array([va - vb, 0.0, ub - ua])
        yield from _sided(corner, along, depth, left / 2, sides)


def _of_boxes(grid: Grid) -> Iterator[_Face]:
    """Faces between boxes of two kinds."""
    names = [name.removeprefix("@") for name in grid.names]
    widths = [np.diff(p) for p in grid.planes_mm]
    for axis in range(3):
        after, before = (np.moveaxis(grid.fill, axis, 0)[s] for s in (slice(1, None), slice(None, -1)))
        one, other = (k for k in range(3) if k != axis)
        for at in np.argwhere((after != before) & (after >= 0) & (before >= 0)).tolist():
            place = dict(zip((axis, one, other), (at[0] + 1, *at[1:]), strict=True))
            corner = np.array([grid.planes_mm[k][place[k]] for k in range(3)])
            along, across = (np.eye(3)[k] * widths[k][place[k]] for k in (one, other))
            sides = names[after[tuple(at)]], names[before[tuple(at)]]
            yield from _sided(corner, along, across, np.eye(3)[axis] * widths[axis].min() / 2, sides)


def _sided(corner: Real, along: Real, across: Real, first: Real, sides: tuple[str, str]) -> Iterator[_Face]:
    """A face with an electrode on its first side if on any; ``first`` leads from it to the first of ``sides``."""
    if not all(sides) or sides[0] == sides[1]:
        return
    if sides[1] in cells.ENDS or (sides[0] not in cells.ENDS and sides[1] < sides[0]):
        sides, first = (sides[1], sides[0]), -first
    yield _Face(corner, along, across, sides, corner + along / 2 + across / 2 + first)
