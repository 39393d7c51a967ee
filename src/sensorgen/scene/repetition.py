"""The repeating cell of a plan, of regions or of boxes: the part that mirrors or shifts make into the whole.

Unlike :mod:`sensorgen.scene.unit_cell` it reads polygons of any direction: posts have mirrors, strips at 45 degrees
shifts only. A pattern without either is continued by its own mirror image.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely.affinity import scale, translate

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.layers import Region
from sensorgen.scene.scene import Body, Piece, Scene
from sensorgen.scene.sections import ROUNDING_MM
from sensorgen.scene.unit_cell import Band, Slice, affordable

_CUTS = (0.137, 0.311, 0.523, 0.741, 0.887)  # of the width: lines along which repetition is looked for first
_SAME_MM = 1e-6  # places nearer than this are one
_SAME = 1e-6  # share of the area by which a repeated pattern may differ: what rounding does to slanted edges


@dataclass(frozen=True)
class Repeat:
    """Part of a plan that repeats along one axis.

    Attributes
    ----------
    low_mm, high_mm : float
        The cell [mm].
    shifts : bool
        Whether it repeats by shifts; else its ends are mirrors.
    places_mm : (n + 1,) array
        Ends of the parts of the cell that occur equally often, from low to high [mm].
    shares : (n,) array
        How often each occurs in the whole [-].
    """

    low_mm: float
    high_mm: float
    shifts: bool
    places_mm: Real
    shares: Real

    @classmethod
    def of(cls, low_mm: float, high_mm: float, shifts: bool, whole_mm: float) -> "Repeat":
        """A cell of a whole that runs from 0."""
        size = high_mm - low_mm
        first = int(np.floor(-low_mm / size)) - 1
        copies = np.arange(first, int(np.ceil((whole_mm - low_mm) / size)) + 1)
        ends = (np.array([0.0, whole_mm])[:, None] - low_mm - copies * size).clip(0.0, size)
        back = (copies % 2 == 1) & (not shifts)
        low, high = np.where(back, size - ends[1], ends[0]), np.where(back, size - ends[0], ends[1])
        places = np.unique(np.concatenate([low, high, [0.0, size]]).round(9))
        places = places[np.append(True, np.diff(places) > _SAME_MM)]
        places[-1] = size
        middle = (places[:-1] + places[1:]) / 2
        shares = ((low < middle[:, None]) & (middle[:, None] < high)).sum(1).astype(float)
        return cls(low_mm, high_mm, shifts, places + low_mm, shares)


def repeat(regions: Sequence[Region], size_mm: Sequence[float], axis: int) -> Repeat:
    """The cell along an axis, 0 or 1, of regions that lie between 0 and a size; all of it where nothing repeats.

    Two whole periods have to be there: one alone would not show that it repeats.
    """
    whole, wide = size_mm[axis], size_mm[1 - axis]
    looks = [region for region in dict.fromkeys(regions) if not _is_plain(region, size_mm, axis)]
    if not looks:
        return Repeat.of(0.0, whole, False, whole)
    lines = sorted(_crossings(looks, axis, whole, wide), key=lambda line: -len(line[0]))
    period = _period(looks, lines, size_mm, axis)
    if not period:
        return Repeat.of(0.0, whole, False, whole)
    at, kind = lines[0]
    near = at < at[0] + period + _SAME_MM
    mirrors = np.unique((((at[near][:, None] + at[near]) / 2)[kind[near][:, None] != kind[near]]).round(9))
    for mirror in mirrors.tolist():
        if are_mirrored([shapely.clip_by_rect(r, *_around(mirror, axis, size_mm)) for r in looks], axis, mirror):
            low = mirror % (period / 2)
            return Repeat.of(low, low + period / 2, False, whole)
    corners = np.unique(shapely.get_coordinates(looks)[:, axis] % period)  # no outline lies on the seam
    gaps = np.diff(np.append(corners, corners[0] + period))
    low = float((corners[gaps.argmax()] + gaps.max() / 2) % period)
    return Repeat.of(low, low + period, True, whole)


def _period(looks: Sequence[Region], lines: Sequence[tuple[Real, Real]], size_mm: Sequence[float], axis: int) -> float:
    """Least shift that continues regions, of those by which the first line's crossings repeat; 0 for none [mm]."""
    whole, (at, kind) = size_mm[axis], lines[0]
    if not len(at):  # a piece that lies between the lines
        return 0.0
    firsts = [at[kind == k] for k in np.unique(kind)]
    steps = np.unique(np.concatenate([own[1:] - own[0] for own in firsts]).round(9))
    for period in steps[(steps > _SAME_MM) & (steps < whole / 2 + _SAME_MM)].tolist():
        if all(_shifts(own, k, period, whole) for own, k in lines) and _is_shifted(looks, axis, period, size_mm):
            return float(period)
    return 0.0


def widened(regions: Sequence[Region], size_mm: Sequence[float], axis: int, by_mm: float) -> Repeat:
    """All of some regions along an axis with what is beyond their ends; half of it where its middle is a mirror."""
    whole = size_mm[axis]
    if are_mirrored(regions, axis, whole / 2):
        return Repeat(whole / 2, whole + by_mm, False, np.array([whole / 2, whole + by_mm]), np.array([2.0]))
    return Repeat(-by_mm, whole + by_mm, False, np.array([-by_mm, whole + by_mm]), np.array([1.0]))


def _is_plain(region: Region, size_mm: Sequence[float], axis: int) -> bool:
    """True where a region does not change along an axis."""
    slab = shapely.bounds(shapely.get_parts(region))
    through = (slab[:, axis] < _SAME_MM) & (slab[:, axis + 2] > size_mm[axis] - _SAME_MM)
    boxes = (slab[:, 2] - slab[:, 0]) * (slab[:, 3] - slab[:, 1])
    return bool(through.all() and abs(boxes.sum() - region.area) < _SAME_MM)


def _crossings(looks: Sequence[Region], axis: int, whole: float, wide: float) -> list[tuple[Real, Real]]:
    """Where lines along the axis cross outlines, in order, and a number for which, and whether it is entered."""
    lines_of = []
    for share in _CUTS:
        ends = np.array([[-1.0, share * wide], [whole + 1.0, share * wide]])
        line = shapely.linestrings(ends if axis == 0 else ends[:, ::-1])
        at, kind = [], []
        for number, region in enumerate(looks):
            runs = shapely.bounds(shapely.get_parts(shapely.intersection(region, line)))
            runs = runs[~np.isnan(runs[:, 0])]
            for side in (0, 1):
                at.append(runs[:, axis + 2 * side])
                kind.append(np.full(len(runs), 2 * number + side))
        every = np.concatenate(at)
        inside = (every > _SAME_MM) & (every < whole - _SAME_MM)
        order = np.argsort(every[inside], kind="stable")
        lines_of.append((every[inside][order], np.concatenate(kind)[inside][order]))
    return lines_of


def _shifts(at: Real, kind: Real, period: float, whole: float) -> bool:
    """True where every crossing is one again a period further."""
    for one in np.unique(kind):
        own = at[kind == one]
        here = own[own < whole - period - _SAME_MM] + period
        if len(here) and abs(own[np.abs(own[:, None] - here).argmin(0)] - here).max() > 10 * _SAME_MM:
            return False
    return True


def _is_shifted(looks: Sequence[Region], axis: int, period: float, size_mm: Sequence[float]) -> bool:
    x, y = (period, 0.0) if axis == 0 else (0.0, period)
    return all(
        _are_same(translate(shapely.clip_by_rect(r, 0, 0, size_mm[0] - x, size_mm[1] - y), x, y),
                  shapely.clip_by_rect(r, x, y, *size_mm[:2]))
        for r in looks
    )  # fmt: skip


def halved(sides: tuple[Repeat, Repeat], regions: Sequence[Region]) -> tuple[Repeat, Repeat]:
    """Half of a cell between mirrors, or a quarter, where its middle is a mirror too: the rest is its image.

    Parameters
    ----------
    sides : (Repeat, Repeat)
        Of the cell, along x and y.
    regions : sequence of Region
        All that lies in it.
    """
    halves = list(sides)
    for axis, side in enumerate(sides):
        middle = (side.low_mm + side.high_mm) / 2
        if len(side.shares) == 1 and not side.shifts and are_mirrored(regions, axis, middle):
            halves[axis] = Repeat(side.low_mm, middle, False, np.array([side.low_mm, middle]), 2 * side.shares)
    return halves[0], halves[1]


def are_mirrored(regions: Sequence[Region], axis: int, at_mm: float) -> bool:
    """True where each of some regions is its own mirror image at a place along an axis."""
    ways = (-1.0, 1.0) if axis == 0 else (1.0, -1.0)
    return all(_are_same(scale(r, *ways, origin=(at_mm, at_mm)), r) for r in regions)


def _around(at_mm: float, axis: int, size_mm: Sequence[float]) -> tuple[float, ...]:
    """Part of a plan that lies as far to one side of a place as to the other: x and y, low and high [mm]."""
    reach = min(at_mm, size_mm[axis] - at_mm)
    low, high = [0.0, 0.0], list(size_mm[:2])
    low[axis], high[axis] = at_mm - reach, at_mm + reach
    return (*low, *high)


def _are_same(one: Region, other: Region) -> bool:
    return bool(shapely.symmetric_difference(one, other).area < _SAME * max(one.area, other.area, _SAME_MM))


@dataclass(frozen=True)
class Raster:
    """Boxes between planes.

    Attributes
    ----------
    planes_mm : three arrays
        Where the planes lie on x, y and z [mm].
    fill : (i, j, k) array
        Number of what is in each box.
    shares : (i, j) array
        How often each place of the cell, or a mirror image, occurs in the scene [-].
    """

    planes_mm: tuple[Real, Real, Real]
    fill: Whole
    shares: Real


def raster(
    scene: Scene, number: Callable[[Body], int], air: int, outer_mm: Sequence[Sequence[float]], evenly: bool = True
) -> Raster:
    """The cell of a scene of boxes, between mirrors at its four sides.

    Parameters
    ----------
    scene : Scene
        Of boxes.
    number : callable
        From a body to what ``fill`` says of it, 0 or more; the same for bodies that are alike.
    air : int
        What it says of air.
    outer_mm : three sequences of float
        Planes on x, y and z beside those of the boxes [mm].
    evenly : bool
        Whether a piece that occurs a whole number of times is preferred, where it is affordable.

    Raises
    ------
    ValueError
        A piece is no box, or bodies overlap.
    """
    pieces = scene.pieces
    if not all(p.is_box() for _, p in pieces):
        raise ValueError("not all of it is boxes")
    planes = [_planes([p for _, p in pieces], *each) for each in zip("xyz", outer_mm, strict=True)]
    fill = _filled(pieces, planes, number)
    fill[fill < 0] = air
    shares = []
    for k in (0, 1):
        cell = affordable(_walk(fill, planes[k], k), evenly)
        middles = [(s.left_mm + s.right_mm) / 2 for s in cell.slices]
        fill = fill.take(np.searchsorted(planes[k], middles) - 1, k)
        planes[k] = np.array([cell.slices[0].left_mm, *(s.right_mm for s in cell.slices)])
        shares.append(np.array(cell.shares))
    x, y, z = planes
    return Raster((x, y, z), fill, np.outer(shares[0], shares[1]))


def _planes(pieces: Sequence[Piece], axis: str, outer_mm: Sequence[float]) -> Real:
    """Ends of some pieces along an axis, and further planes, those that rounding parted as one [mm]."""
    edges = np.unique(np.array([*outer_mm, *(x for p in pieces for x in p.span(axis))]))
    return np.asarray(edges[np.diff(edges, prepend=-np.inf) > ROUNDING_MM])


def _filled(pieces: Sequence[tuple[Body, Piece]], planes: Sequence[Real], number: Callable[[Body], int]) -> Whole:
    """Number of the body in each box between planes, -1 where none is."""
    fill = np.full([len(p) - 1 for p in planes], -1)
    for body, piece in pieces:
        ends = [np.searchsorted(p, np.array(piece.span(a)) - ROUNDING_MM) for a, p in zip("xyz", planes, strict=True)]
        here = tuple(slice(*end) for end in ends)
        if (fill[here] >= 0).any():
            raise ValueError(f"{body.name} overlaps its neighbour")
        fill[here] = number(body)
    return fill


def _walk(fill: Whole, at_mm: Real, axis: int) -> tuple[Slice, ...]:
    """Layers of boxes along an axis as slices, each of one level band, named by all that is in the layer."""
    looks: dict[bytes, str] = {}
    names = [looks.setdefault(layer.tobytes(), str(len(looks))) for layer in np.moveaxis(fill, axis, 0)]
    bands = [(Band(name, "", (0.0, 0.0), (1.0, 1.0)),) for name in names]
    return tuple(Slice(a, b, band) for (a, b), band in zip(pairwise(at_mm.tolist()), bands, strict=True))
