"""A cell as few triangles: what lies between the electrodes, with its edges at the electrodes."""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import atan2, hypot

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.core.arrays import Whole
from sensorgen.scene.connections import groups
from sensorgen.scene.repetition import Band, SectionCell, Slice, cell
from sensorgen.scene.sections import ROUNDING_MM, Section, distinct

Edge = tuple[int, int]
Triangle = tuple[int, int, int]


@dataclass(frozen=True)
class Triangles:
    """The dielectric between the electrodes.

    Attributes
    ----------
    points : (n, 2) array
        Corners [mm].
    triangles : list of (int, int, int)
        Counter-clockwise.
    regions : list of (str, float)
        Of each triangle: material, and how often it occurs in the sensor.
    terminals : dict of edge to str
        Edges that lie on an electrode, each with its lower corner's number first: "top" or "bottom".
    """

    points: NDArray[np.float64]
    triangles: list[Triangle]
    regions: list[tuple[str, float]]
    terminals: dict[Edge, str]


@lru_cache(maxsize=16)  # a cell is solved with many permittivities
def triangles(cell: SectionCell) -> Triangles:
    """Triangulate the dielectric of a cell between its electrodes.

    Raises
    ------
    ValueError
        The electrodes touch, none lies opposite the other, or the field between them would leave the sensor.
    """
    points, filled = _all(cell)
    _refuse_contact(points, filled)
    mesh, owners, inside = _triangulated(points, filled)
    _refuse_open(points, owners, inside, cell)
    return mesh


def insulated(cell: SectionCell) -> Triangles:
    """Triangulate a cell in which bands of no material are insulators, no matter how far the field reaches.

    Raises
    ------
    ValueError
        None of its materials reaches from the bottom to the top electrode.
    """
    return _triangulated(*_all(cell))[0]


def _triangulated(points: NDArray[np.float64], filled: "_Filled") -> tuple[Triangles, dict[Edge, list[int]], set[int]]:
    """The mesh of all dielectric between the electrodes; the triangles at each edge; those that were kept."""
    owners: dict[Edge, list[int]] = defaultdict(list)
    for number, (corners, _) in enumerate(filled):
        for edge in edges_of(corners):
            owners[edge].append(number)
    inside = _between_electrodes(filled, owners)
    numbers = sorted(inside)
    regions = [filled[n][1] for n in numbers]
    terminals = _terminals(filled, owners, inside)
    mesh = Triangles(points, flipped(points, [filled[n][0] for n in numbers], regions), regions, terminals)
    return apart(mesh), owners, inside


def _terminals(filled: "_Filled", owners: Mapping[Edge, Sequence[int]], inside: set[int]) -> dict[Edge, str]:
    """Electrode at each edge of the dielectric that has one."""
    terminals = {}
    for edge, sides in owners.items():
        names = {filled[n][1][0] for n in sides}
        if names & {"@top", "@bottom"} and any(n in inside for n in sides):
            terminals[edge] = next(n[1:] for n in names if n.startswith("@"))
    return terminals


def _between_electrodes(filled: "_Filled", owners: Mapping[Edge, Sequence[int]]) -> set[int]:
    """Dielectric triangles whose field runs from one electrode to the other."""
    what = np.array([name for _, (name, _) in filled])
    metal = {end: what == end for end in ("@bottom", "@top")}
    free = (what != "") & ~np.logical_or(*metal.values())
    pairs = np.array([sides for sides in owners.values() if len(sides) == 2], int).reshape(-1, 2)
    piece = groups(len(what), *pairs[free[pairs].all(axis=1)].T)
    beside = [pairs[(end[pairs] & free[pairs[:, ::-1]]).any(axis=1)] for end in metal.values()]
    both = np.intersect1d(*(piece[sides[free[sides]]] for sides in beside))
    inside = set(np.flatnonzero(free & np.isin(piece, both)).tolist())
    if not inside:
        raise ValueError("no dielectric lies between a top and a bottom electrode")
    return inside


def apart(mesh: Triangles) -> Triangles:
    """Triangles with a point for each of the pieces that only touch there: no field runs through a point."""
    for corner, meeting in fans(mesh.triangles).items():
        if len(meeting) > 1:
            # One of a corner's fans with a new point at the same place
            new = len(mesh.points)
            corners, terminals = list(mesh.triangles), dict(mesh.terminals)
            for n in meeting[1].members:
                a, b, c = (new if k == corner else k for k in corners[n])
                corners[n] = (a, b, c)
            for spoke in meeting[1].spokes:
                if name := terminals.pop((min(corner, spoke), max(corner, spoke)), ""):
                    terminals[spoke, new] = name
            return apart(Triangles(np.vstack([mesh.points, mesh.points[corner]]), corners, mesh.regions, terminals))
    return mesh


def edges_of(corners: Triangle) -> list[Edge]:
    """The edges of a triangle, each with its lower corner's number first."""
    a, b, c = corners
    return [(min(e), max(e)) for e in ((a, b), (b, c), (c, a))]


_Filled = list[tuple[Triangle, tuple[str, float]]]


def _all(cell: SectionCell) -> tuple[NDArray[np.float64], _Filled]:
    """All triangles of a cell, those of electrodes with "@top" or "@bottom" for a material."""
    ends = [cell.slices[0].left_mm, *(s.right_mm for s in cell.slices)]
    levels = [_levels(cell.slices, k) for k in range(len(ends))]
    first = np.concatenate([[0], np.cumsum([len(z) for z in levels])])
    places = [(x, z) for x, heights in zip(ends, levels, strict=True) for z in heights]
    points = np.array(places)
    cut: _Filled = []
    for k, (here, share) in enumerate(zip(cell.slices, cell.shares, strict=True)):
        for band in here.bands:
            region = (f"@{band.terminal}" if band.terminal else band.material, share)
            cut += [(corners, region) for corners in filled(_corners(levels, first, k, band), places)]
    return points, cut


def _levels(slices: Sequence[Slice], k: int) -> list[float]:
    """Heights at which anything meets the line between slice k - 1 and slice k [mm]."""
    sides = zip(slices[max(k - 1, 0) : k + 1], (1, 0) if k else (0,), strict=False)
    return distinct((z for s, side in sides for b in s.bands for z in (b.bottom_mm[side], b.top_mm[side])), ROUNDING_MM)


def _corners(levels: Sequence[Sequence[float]], first: Whole, k: int, band: Band) -> list[int]:
    """Corners of a band of slice k, counter-clockwise, those of its neighbours on its sides among them."""
    sides = []
    for line, lines in enumerate(zip(band.bottom_mm, band.top_mm, strict=True), k):
        low, high = lines[0] - 2 * ROUNDING_MM, lines[1] + 2 * ROUNDING_MM
        within = range(bisect_left(levels[line], low), bisect_left(levels[line], high))
        sides.append([int(first[line]) + n for n in within])
    return [*sides[0][::-1], *sides[1]]


def filled(polygon: Sequence[int], places: Sequence[Sequence[float]]) -> list[Triangle]:
    """Triangles of a simple polygon, some of whose corners may lie on a line; as few slender ones as can be.

    ``polygon`` are its corners' numbers, counter-clockwise, ``places`` the coordinates by number.
    """
    number = {tuple(places[k]): k for k in polygon}
    triangles = shapely.constrained_delaunay_triangles(shapely.Polygon(number))
    corners = shapely.get_coordinates(shapely.orient_polygons(shapely.get_parts(triangles))).reshape(-1, 4, 2)
    return [(number[tuple(a)], number[tuple(b)], number[tuple(c)]) for a, b, c, _ in corners.tolist()]


_CONTACT_MM = 1e-7  # a gap below a tenth of a nanometre is contact


def _refuse_contact(points: NDArray[np.float64], filled: _Filled) -> None:
    """Refuse electrodes that share a point, or are next to each other on one line of points."""
    places = {(*points[p].tolist(), what) for corners, (what, _) in filled if what.startswith("@") for p in corners}
    for (x, z, end), (at, above, other) in pairwise(sorted(places)):
        if x == at and above - z < _CONTACT_MM and end != other:
            raise ValueError("the electrodes touch: the capacitance grows without bound")


def _refuse_open(
    points: NDArray[np.float64], owners: dict[Edge, list[int]], inside: set[int], cell: SectionCell
) -> None:
    """Refuse a field that would reach the box's floor or lid: the scene does not describe what is beyond them."""
    last = cell.slices[0].bands
    ends = (last[0].bottom_mm[0], last[-1].top_mm[0])
    for edge, sides in owners.items():
        if len(sides) == 1 and sides[0] in inside:
            z = points[list(edge), 1]
            if any(np.abs(z - end).max() < ROUNDING_MM for end in ends):
                raise ValueError("an electrode does not cover the whole sensor")


_GAIN = 1e-9  # by which the sum of two opposite angles must exceed half a turn [rad]
_STRAIGHT = 1e-9  # sine of the angle of three corners on a line


def flipped(points: NDArray[np.float64], triangles: Sequence[Triangle], regions: Sequence[Hashable]) -> list[Triangle]:
    """Regions in triangles of equal number and corners, no two of which would be blunter if turned.

    Parameters
    ----------
    points : (n, 2) array
        Corners.
    triangles : list of (int, int, int)
        Counter-clockwise.
    regions : list
        Of each triangle; edges between different ones stay.
    """
    corners_of = list(triangles)
    owner = {edge: n for n, corners in enumerate(corners_of) for edge in _turns(corners)}
    todo = [edge for edge in owner if edge[0] < edge[1]]
    places = points.tolist()
    while todo:
        a, b = todo.pop()
        one, other = owner.get((a, b), -1), owner.get((b, a), -1)
        if min(one, other) < 0 or regions[one] != regions[other]:
            continue
        c, d = _third(corners_of[one], a, b), _third(corners_of[other], a, b)
        if not _is_better(*(places[k] for k in (a, b, c, d))):
            continue
        del owner[a, b], owner[b, a]
        corners_of[one], corners_of[other] = (a, d, c), (d, b, c)
        owner |= dict.fromkeys(_turns((a, d, c)), one) | dict.fromkeys(_turns((d, b, c)), other)
        todo += [(a, d), (d, b), (b, c), (c, a)]
    return corners_of


def _turns(corners: Triangle) -> list[Edge]:
    a, b, c = corners
    return [(a, b), (b, c), (c, a)]


def _third(corners: Triangle, a: int, b: int) -> int:
    return next(k for k in corners if k not in (a, b))


_Point = tuple[float, float]


def _is_better(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    """True if d-c is a better diagonal of a, d, b, c than a-b: the angles at c and d are more than half a turn."""
    if min(_sine(a, d, c), _sine(d, b, c)) < _STRAIGHT:
        return False
    return _angle(a, c, b) + _angle(a, d, b) > np.pi + _GAIN


def _sine(a: _Point, b: _Point, c: _Point) -> float:
    """Of the angle at b, from a to c, above 0 where the three turn left."""
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    return (ux * vy - uy * vx) / (hypot(ux, uy) * hypot(vx, vy))


def _angle(a: _Point, b: _Point, c: _Point) -> float:
    """At b, between a and c [rad]."""
    (ux, uy), (vx, vy) = (a[0] - b[0], a[1] - b[1]), (c[0] - b[0], c[1] - b[1])
    return atan2(abs(ux * vy - uy * vx), ux * vx + uy * vy)


@dataclass(frozen=True)
class Fan:
    """Triangles that meet at a corner, counter-clockwise.

    Attributes
    ----------
    members : list of int
        Their numbers.
    spokes : list of int
        Other ends of the edges that meet there; one more than members, unless the fan is closed.
    """

    members: list[int]
    spokes: list[int]

    @property
    def closed(self) -> bool:
        """True if it goes all around the corner."""
        return len(self.members) == len(self.spokes)

    @property
    def inside(self) -> list[int]:
        """Other ends of the edges between two of its triangles."""
        return self.spokes if self.closed else self.spokes[1:-1]


def fans(triangles: Sequence[Triangle]) -> dict[int, list[Fan]]:
    """Of each corner, its fans; more than one where pieces touch at a point only."""
    around: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
    for number, (a, b, c) in enumerate(triangles):
        around[a][b], around[b][c], around[c][a] = (number, c), (number, a), (number, b)
    by_corner: dict[int, list[Fan]] = defaultdict(list)
    for corner, by_first in around.items():  # from each triangle's first spoke to its number and last spoke
        lasts = {last for _, last in by_first.values()}
        for start in [first for first in by_first if first not in lasts] or [next(iter(by_first))]:
            by_corner[corner].append(_fan(by_first, start))
    return by_corner


def _fan(by_first: Mapping[int, tuple[int, int]], start: int) -> Fan:
    """Triangles around a corner from a spoke on."""
    fan, spoke = Fan([], []), start
    while spoke in by_first and not (fan.spokes and spoke == start):
        fan.spokes.append(spoke)
        number, spoke = by_first[spoke]
        fan.members.append(number)
    if spoke != start:
        fan.spokes.append(spoke)
    return fan


def energy(section: Section, height_mm: float, permittivity: Mapping[str, float]) -> float:
    """Least energy of such potentials at 1 V, per depth and over eps0 [-], the same in each repeating cell.

    Raises
    ------
    ValueError
        The electrodes touch, none lies opposite the other, or the field between them would leave the sensor.
    """
    mesh = triangles(cell(section, height_mm))
    used, corners = np.unique(np.array(mesh.triangles), return_inverse=True)
    corners = corners.reshape(-1, 3)
    points = mesh.points[used][corners]
    sides = np.roll(points, -1, axis=1) - np.roll(points, -2, axis=1)
    twice = np.abs(np.linalg.det(sides[:, :2]))
    eps = np.array([permittivity[material] * share for material, share in mesh.regions])
    stiffness = np.zeros((len(used),) * 2)
    parts = (eps / (2 * twice))[:, None, None] * (sides @ sides.transpose(0, 2, 1))
    np.add.at(stiffness, (corners[:, :, None], corners[:, None, :]), parts)
    volts = np.full(len(used), np.nan)
    for edge, name in mesh.terminals.items():
        volts[np.searchsorted(used, edge)] = float(name == "top")
    free = np.isnan(volts)
    volts[free] = np.linalg.solve(stiffness[free][:, free], -stiffness[free][:, ~free] @ volts[~free])
    return float(volts @ stiffness @ volts)
