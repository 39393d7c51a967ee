"""A cell between mirrors with prisms, bodies of revolution, lofts and polyhedra in it, as plain data."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from math import atan, hypot, sqrt
from typing import Any, NamedTuple

import numpy as np
import shapely

from sensorgen.core.arrays import Mask, Real
from sensorgen.scene.polyhedra import surface
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import AXES, Piece, Point, Prism

SAME_MM = 1e-7  # places nearer than this are one
_ARC = 64  # chords of an arc, where it is asked whether a place lies within

Sized = tuple[float, float, float, float]  # a place, and the longest edge of elements there [mm]


@dataclass(frozen=True)
class RoundCell:
    """A box between mirrors, with pieces in it that do not overlap.

    Attributes
    ----------
    low_mm, high_mm : (float, float, float)
        Two corners [mm].
    pieces : sequence of (Piece, int)
        Each with the number of its conductor, from 0, or of its dielectric, after those; the last dielectric fills the
        rest. Pieces may reach beyond the box.
    conductors : int
        How many there are: the bottom electrode, the top electrode, and those that float.
    permittivity : sequence of float
        Of each dielectric [-].
    cuts_mm : (sequence of float, sequence of float)
        Where along x and y parts meet that occur unequally often in the sensor [mm].
    shares : (nx, ny) array
        How often each part occurs [-].
    """

    low_mm: tuple[float, float, float]
    high_mm: tuple[float, float, float]
    pieces: Sequence[tuple[Piece, int]]
    conductors: int
    permittivity: Sequence[float]
    cuts_mm: tuple[Sequence[float], Sequence[float]] = ((), ())
    shares: Real = field(default_factory=lambda: np.ones((1, 1)))

    def parts(self) -> list[tuple[Sequence[float], Sequence[float]]]:
        """Two corners of each part [mm]."""
        x, y = (list(pairwise((self.low_mm[a], *self.cuts_mm[a], self.high_mm[a]))) for a in (0, 1))
        z = self.low_mm[2], self.high_mm[2]
        return [((i[0], j[0], z[0]), (i[1], j[1], z[1])) for i, j in product(x, y)]

    def weights(self) -> Real:
        """Number of times that each part occurs beyond the least."""
        return np.asarray(self.shares - self.shares.min()).ravel()

    def boxes(self) -> list[tuple[Real, Piece, int]]:
        """Spans of each piece in the cell along x, y and z (3, 2) [mm], the piece, and its number."""
        spans = [(np.array([piece.span(axis) for axis in AXES]), piece, kind) for piece, kind in self.pieces]
        low, high = np.array(self.low_mm), np.array(self.high_mm)
        return [own for own in spans if ((own[0][:, 0] < high) & (own[0][:, 1] > low)).all()]

    def holds(self, places_mm: Real) -> Mask:
        """Mask of the places (n, 3) in the cell [mm]."""
        low, high = np.array(self.low_mm) - SAME_MM, np.array(self.high_mm) + SAME_MM
        return np.asarray(((places_mm > low) & (places_mm < high)).all(1))

    def conducts(self, places_mm: Real) -> Mask:
        """Mask: true where a conductor is at each of some places (n, 3), those beyond a side being mirrored [mm]."""
        p = places_mm.copy()
        for axis in (0, 1):
            low, high = self.low_mm[axis], self.high_mm[axis]
            p[:, axis] = high - abs(high - low - abs(p[:, axis] - low))
        is_metal = (p[:, 2] < self.low_mm[2]) | (p[:, 2] > self.high_mm[2])
        for spans, piece, kind in self.boxes():
            near = ((p > spans[:, 0]) & (p < spans[:, 1])).all(1)
            if kind < self.conductors and near.any():
                is_metal[near] |= inside(piece, p[near])
        return np.asarray(is_metal)

    def sizes(self, along: Real, times: float, longest_mm: float) -> list[Sized]:
        """Places on round faces and on some edges (n, 3), by the distance of bodies that the piece does not touch.

        Parameters
        ----------
        along : (n, 3) array
            Places on edges of pieces that are not round [mm].
        times : float
            Longest edge of elements over that distance [-].
        longest_mm : float
            Beyond which no place is sized [mm].
        """
        boxes, sized = self.boxes(), []
        for own, piece, kind in boxes:
            others = [box for box, _, its in boxes if its != kind and not _meet(box, own)]
            if isinstance(piece, Revolved):
                places = _round_places(piece)
            else:
                places = along[((along > own[:, 0] - SAME_MM) & (along < own[:, 1] + SAME_MM)).all(1)]
            places = places[self.holds(places)]
            if others and len(places):
                off = [np.maximum(box[:, 0] - places, 0) + np.maximum(places - box[:, 1], 0) for box in others]
                size = times * np.linalg.norm(off, axis=2).min(0)
                near = size < longest_mm
                sized += [(x, y, z, h) for (x, y, z), h in zip(places[near].tolist(), size[near].tolist(), strict=True)]
        return sized


def _round_places(piece: Revolved) -> Real:
    """Places on the faces of a body of revolution (n, 3) [mm]."""
    turn = np.linspace(0, 2 * np.pi, 33)[:-1]
    r, z = np.concatenate([edge.places(16) for edge in profile(piece)]).T[:, :, None]
    x, y = piece.x_mm + r * np.cos(turn), piece.y_mm + r * np.sin(turn)
    return np.stack([x, y, z + 0 * x], axis=-1).reshape(-1, 3)


class ProfileEdge(NamedTuple):
    """A straight edge of a profile, or an arc by its bulge, in radius and height [mm]."""

    start: Point
    end: Point
    bulge: float

    def circle(self) -> tuple[Point, float]:
        """Centre and radius of the arc."""
        (ra, za), (rb, zb) = self.start, self.end
        lift = (1 - self.bulge**2) / (4 * self.bulge)
        centre = ((ra + rb) / 2 - (zb - za) * lift, (za + zb) / 2 + (rb - ra) * lift)
        return centre, hypot(ra - centre[0], za - centre[1])

    def places(self, count: int) -> Real:
        """Points along it (count + 1, 2)."""
        return self.at(np.linspace(0.0, 1.0, count + 1))

    def at(self, shares: Real) -> Real:
        """Points at shares of its length (n, 2)."""
        share, a = shares[:, None], np.array(self.start)
        if not self.bulge:
            return np.asarray(a + share * np.subtract(self.end, self.start))
        centre, turn = np.array(self.circle()[0]), 4 * atan(self.bulge) * share
        way = a - centre
        return np.asarray(centre + np.cos(turn) * way + np.sin(turn) * np.array([-way[1], way[0]]))

    def distance(self, r: Any, z: Any, root: Any) -> Any:
        """Signed distance of places from its line, or from its whole circle."""
        if self.bulge:
            centre, radius = self.circle()
            return root((r - centre[0]) ** 2 + (z - centre[1]) ** 2) - radius
        way = np.subtract(self.end, self.start) / hypot(*np.subtract(self.end, self.start))
        return (r - self.start[0]) * way[1] - (z - self.start[1]) * way[0]

    def is_tip(self) -> bool:
        """Test whether it leaves the axis straight and neither level nor along it."""
        (ra, za), (rb, zb) = self.start, self.end
        return not self.bulge and min(ra, rb) < SAME_MM < max(ra, rb) and abs(za - zb) > SAME_MM


def profile(piece: Revolved) -> list[ProfileEdge]:
    """Edges of a profile."""
    ends = zip(piece.outline, piece.outline[1:] + piece.outline[:1], piece.bulges, strict=True)
    return [ProfileEdge(a, b, bulge) for a, b, bulge in ends]


@dataclass(frozen=True)
class DomeTouch:
    """Where a dome meets a level face at a point: the gap between them ends in a cusp that no mesh fills.

    A flat cylinder around the point, as high as the gap is at its rim, is filled with what has the lower permittivity
    for the lower bound, and for the upper one with the higher permittivity or the conductor: the bounds are those of
    two cells that enclose the true one.

    Attributes
    ----------
    piece, kind : Revolved, int
        The dome, and its number.
    z_mm : float
        Height of the point [mm].
    upwards : bool
        Whether the dome lies above the point.
    radius_mm : float
        Of the dome [mm].
    apart_mm : float
        From the point to the conductor behind the level face [mm].
    """

    piece: Revolved
    kind: int
    z_mm: float
    upwards: bool
    radius_mm: float
    apart_mm: float

    def rim_mm(self, gap_mm: float) -> float:
        """Radius at which the gap has a height [mm]."""
        return sqrt(gap_mm * (2 * self.radius_mm - gap_mm))

    def sizes(self, cell: RoundCell, gap_mm: float, times: float) -> list[Sized]:
        """Places in the gap beyond a height, by its height there, as :meth:`Cell.sizes` has them."""
        sized = []
        for r in np.geomspace(self.rim_mm(gap_mm), 0.7 * self.radius_mm, 24).tolist():
            gap = self.radius_mm - sqrt(self.radius_mm**2 - r**2)
            turn = np.arange(0.0, 2 * np.pi, max(gap / r, 0.05))
            z = self.z_mm + gap / 2 * (1.0 if self.upwards else -1.0)
            places = np.column_stack(
                [self.piece.x_mm + r * np.cos(turn), self.piece.y_mm + r * np.sin(turn), 0 * turn + z]
            )
            sized += [(x, y, at, times * gap) for x, y, at in places[cell.holds(places)].tolist()]
        return sized


def _faces(box: Real, at_mm: Real, z_mm: float, upwards: bool) -> bool:
    """True where a box (3, 2) has a level face at a place and height, above or below it [mm]."""
    over = (box[:2, 0] < at_mm + SAME_MM) & (box[:2, 1] > at_mm - SAME_MM)
    return bool(abs(box[2, int(upwards)] - z_mm) < SAME_MM and over.all())


def touches(cell: RoundCell) -> list[DomeTouch]:
    """All places in a cell where a dome meets a level face."""
    places_of = []
    for own, piece, kind in cell.boxes():
        if not isinstance(piece, Revolved):
            continue
        others = [(box, its) for box, _, its in cell.boxes() if its != kind]
        for z, upwards, radius in _poles(piece):
            if any(_faces(box, own[:2].mean(1), z, upwards) for box, _ in others):
                metal = [box for box, its in others if its < cell.conductors]
                places_of.append(DomeTouch(piece, kind, z, upwards, radius, _apart(metal, z, upwards, radius)))
    return places_of


def _apart(metal: Sequence[Real], z_mm: float, upwards: bool, most_mm: float) -> float:
    """Distance from a dome's pole to the nearest conductor behind the face that it touches [mm]."""
    way = -1.0 if upwards else 1.0
    offs = (way * (box[2, int(upwards)] - z_mm) for box in metal)
    return float(min((off for off in offs if off > SAME_MM), default=most_mm))


def _poles(piece: Revolved) -> Iterator[tuple[float, bool, float]]:
    """Where domes of a piece meet its axis: height, whether the dome lies above, and its radius [mm]."""
    for edge in profile(piece):
        for r, z in (edge.start, edge.end) if edge.bulge else ():
            if r < SAME_MM:
                centre, radius = edge.circle()
                if abs(centre[0]) < SAME_MM:
                    yield z, z < centre[1], radius


def inside(piece: Piece, places_mm: Real) -> Mask:
    """Mask: true where places (n, 3) lie in a piece [mm]."""
    x, y, z = places_mm.T
    if isinstance(piece, Prism):
        first, second = {"x": (y, z), "y": (x, z), "z": (x, y)}[piece.axis]
        return np.asarray(shapely.contains_xy(shapely.Polygon(piece.outline), first, second))
    if isinstance(piece, Revolved):
        outline = np.concatenate([edge.places(_ARC if edge.bulge else 1)[:-1] for edge in profile(piece)])
        return np.asarray(shapely.contains_xy(shapely.Polygon(outline), np.hypot(x - piece.x_mm, y - piece.y_mm), z))
    whole = surface(piece)
    a, b, c = (np.array(whole.vertices)[np.array(whole.triangles)[:, k]] for k in range(3))
    # How often a ray leaves (Moeller and Trumbore, 1997)
    way = np.array([0.5377, 0.3819, 0.7517])
    one, two = b - a, c - a
    across = np.cross(way, two)
    scale = (one * across).sum(1)
    off = places_mm[:, None, :] - a
    turn = np.cross(off, one)
    s, t, far = (off * across).sum(2) / scale, (turn @ way) / scale, (turn * two).sum(2) / scale
    return np.asarray(((s > 0) & (t > 0) & (s + t < 1) & (far > 0)).sum(1) % 2 == 1)


def _meet(one: Real, other: Real) -> bool:
    return bool(((one[:, 0] <= other[:, 1] + SAME_MM) & (other[:, 0] <= one[:, 1] + SAME_MM)).all())
