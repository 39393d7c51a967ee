"""The repeating cell of a cross-section, and that of a plan: the piece that mirrors or shifts make into the sensor.

Where planes x = m + k h mirror a section into itself, the field between the first two is the field everywhere:
a sensor of 100 mm is solved as half a period. The pattern is thought to go on beyond the sensor's ends, so that
no fringe arises there; a section without such planes is continued by its own mirror image instead.

A plan, of regions or of boxes, has polygons of any direction: posts have mirrors, strips at 45 degrees shifts only.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import chain, pairwise
from math import floor

import numpy as np
import shapely
from shapely.affinity import scale, translate

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.layers import Region
from sensorgen.scene.scene import Body, Piece, Point, Scene
from sensorgen.scene.sections import ROUNDING_MM, Section, SectionColumn, columns, distinct

LARGER = 2  # slices of a cell that the sensor's end does not cut, over those of one that it cuts
_MOST_PLACES = 400  # for the first two mirrors; a pattern of more corners than these is solved as a whole


@dataclass(frozen=True)
class Band:
    """One material between two straight lines of a slice.

    Attributes
    ----------
    material : str
        Name of a dielectric, or "" for a conductor.
    terminal : str
        "top" or "bottom" for a conductor, else "".
    bottom_mm, top_mm : (float, float)
        Heights at the slice's left and right side [mm].
    """

    material: str
    terminal: str
    bottom_mm: Point
    top_mm: Point

    def is_same(self, other: "Band") -> bool:
        """True where both are of one material, or of one conductor."""
        return (self.material, self.terminal) == (other.material, other.terminal)


@dataclass(frozen=True)
class Slice:
    """A vertical strip of a section, filled from bottom to top, air included; every interface is one straight line."""

    left_mm: float
    right_mm: float
    bands: tuple[Band, ...]

    def lines_mm(self, at_mm: float) -> tuple[float, ...]:
        """Heights of the interfaces at one place [mm]."""
        share = (at_mm - self.left_mm) / (self.right_mm - self.left_mm)
        return tuple(b.top_mm[0] + share * (b.top_mm[1] - b.top_mm[0]) for b in self.bands)

    def between(self, left_mm: float, right_mm: float) -> "Slice":
        """The part between two places within it [mm]."""
        if (left_mm, right_mm) == (self.left_mm, self.right_mm):
            return self
        ends = (self.lines_mm(left_mm), self.lines_mm(right_mm))
        floor = self.bands[0].bottom_mm[0]
        bands, below = [], (floor, floor)
        for band, *top in zip(self.bands, *ends, strict=True):
            bands.append(Band(band.material, band.terminal, below, (top[0], top[1])))
            below = (top[0], top[1])
        return Slice(left_mm, right_mm, tuple(bands))

    def is_flat(self) -> bool:
        """True where all interfaces are level."""
        return all(abs(b.top_mm[0] - b.top_mm[1]) < ROUNDING_MM for b in self.bands)


@dataclass(frozen=True)
class SectionCell:
    """Part of a section that has to be solved, with zero flux through both sides.

    Attributes
    ----------
    slices : tuple of Slice
        From left to right.
    shares : tuple of float
        How often each slice, or its mirror image, occurs in the sensor [-].
    """

    slices: tuple[Slice, ...]
    shares: tuple[float, ...]


@lru_cache(maxsize=8)
def cell(section: Section, height_mm: float, evenly: bool = True) -> SectionCell:
    """The smallest piece of a section that mirrors at its own two sides continue to the whole.

    Parameters
    ----------
    section : Section
        Polygons of any form.
    height_mm : float
        Up to where air fills what no polygon does [mm].
    evenly : bool
        Whether a larger piece that occurs a whole number of times is preferred to a smaller one that the end cuts.

    Raises
    ------
    ValueError
        Outlines overlap, or an outline is open.
    """
    return mirrored(tuple(slices(section, height_mm)), evenly)


def slices(section: Section, height_mm: float, *, layered: bool = False) -> list[Slice]:
    """Columns of a section with the air between them; ``layered`` keeps each layer, a conductor with its material."""
    return [_slice(column, height_mm, layered) for column in columns(section)]


@lru_cache(maxsize=16)
def mirrored(slices: tuple[Slice, ...], evenly: bool = True) -> SectionCell:
    """The smallest run of slices that mirrors at its own two sides continue to all of them."""
    whole = straightened(slices)
    places, end = _mirror_places(whole), whole[-1].right_mm
    is_mirror = cache(partial(_is_mirror, whole))
    for fits in (_is_even, _has_room) if evenly else (_shows_periods, _is_even, _has_room):
        for low, high in _pairs(places, end):
            if not fits(low - places[0], high - low, end - places[0]) or not (is_mirror(low) and is_mirror(high)):
                continue
            if repeats(whole, low, high):
                return _cell(whole, low, high)
    return SectionCell(tuple(whole), (1.0,) * len(whole))


def straightened(slices: Sequence[Slice]) -> list[Slice]:
    """Slices as wide as their interfaces are straight."""
    whole: list[Slice] = []
    for here in slices:
        last = whole[-1] if whole else None
        joined = Slice(last.left_mm, here.right_mm, _bridged(last, here)) if last else None
        if last and joined and len(joined.bands) == len(last.bands) and _runs_on(joined, last, here):
            whole[-1] = joined
        else:
            whole.append(here)
    return whole


def affordable(slices: tuple[Slice, ...], evenly: bool = True) -> SectionCell:
    """The piece that occurs a whole number of times, or the smallest where that has far fewer slices.

    Half a sensor may be a hundred periods: ``LARGER`` times as many slices are too many.
    """
    smallest = mirrored(slices, evenly=False)
    even = mirrored(slices) if evenly else smallest
    return even if len(even.slices) <= LARGER * len(smallest.slices) else smallest


def _slice(column: SectionColumn, height_mm: float, layered: bool) -> Slice:
    """A column with the air between its layers; layers of one material that touch are one."""
    bands: list[Band] = []
    at = (0.0, 0.0)
    for layer in column.layers:
        if min(layer.bottom_mm[0] - at[0], layer.bottom_mm[1] - at[1]) < -ROUNDING_MM:
            raise ValueError(f"outlines overlap near {column.left_mm:g} mm: {layer.body.name} runs into its neighbour")
        terminal = layer.body.terminal
        bands.append(Band("air", "", at, layer.bottom_mm))
        bands.append(
            Band("" if terminal and not layered else layer.body.material, terminal, layer.bottom_mm, layer.top_mm)
        )
        at = layer.top_mm
    bands.append(Band("air", "", at, (height_mm, height_mm)))
    return Slice(column.left_mm, column.right_mm, _joined(bands, layered))


def _joined(bands: Sequence[Band], layered: bool) -> tuple[Band, ...]:
    """Bands without those of no height, and neighbours of one material as one, unless ``layered``."""
    joined: list[Band] = []
    for band in bands:
        if max(t - b for b, t in zip(band.bottom_mm, band.top_mm, strict=True)) <= ROUNDING_MM:
            continue
        if joined and joined[-1].is_same(band) and not layered:
            band = Band(band.material, band.terminal, joined.pop().bottom_mm, band.top_mm)
        joined.append(band)
    return tuple(joined)


def _bridged(last: Slice, here: Slice) -> tuple[Band, ...]:
    pairs = zip(last.bands, here.bands, strict=False)
    return tuple(
        Band(a.material, a.terminal, (a.bottom_mm[0], b.bottom_mm[1]), (a.top_mm[0], b.top_mm[1])) for a, b in pairs
    )


def _runs_on(joined: Slice, last: Slice, here: Slice) -> bool:
    """True where two neighbours are one slice: the same materials, lines that neither jump nor bend."""
    if len(last.bands) != len(here.bands) or not all(map(Band.is_same, last.bands, here.bands)):
        return False
    middle = joined.lines_mm(here.left_mm)
    lines = zip(middle, last.lines_mm(last.right_mm), here.lines_mm(here.left_mm), strict=True)
    return all(max(abs(m - a), abs(m - b)) < ROUNDING_MM for m, a, b in lines)


def _is_even(start_mm: float, piece_mm: float, whole_mm: float) -> bool:
    """True where a piece occurs a whole number of times, each of its parts as often as another."""
    times = round(whole_mm / piece_mm)
    return abs(times * piece_mm - whole_mm) < ROUNDING_MM and (times % 2 == 0 or start_mm < ROUNDING_MM)


def _has_room(start_mm: float, piece_mm: float, whole_mm: float) -> bool:
    """True where two whole pieces follow each other: one alone would not show that it repeats."""
    return start_mm + 2 * piece_mm <= whole_mm + ROUNDING_MM


def _shows_periods(start_mm: float, piece_mm: float, whole_mm: float) -> bool:
    """True for two whole periods: in one alone, any place within its level ends may be the mirror."""
    return start_mm + 4 * piece_mm <= whole_mm + ROUNDING_MM


def _mirror_places(whole: Sequence[Slice]) -> list[float]:
    """Places at which a mirror may stand: between slices, and in the middle of level ones [mm]."""
    edges = {whole[0].left_mm, *(s.right_mm for s in whole)}
    return sorted(edges | {(s.left_mm + s.right_mm) / 2 for s in whole if s.is_flat()})


def _pairs(places: list[float], end_mm: float) -> Iterator[Point]:
    """Pairs of places, the nearest first, of which the first lies no further from the start than they are apart.

    The whole has to hold two of the pieces between them, or it would not show that they repeat. In windows of twice
    the size each, so that a long sensor's pattern is found in its first periods.
    """
    at = np.array(places) - places[0]
    reach = float(np.diff(at).min())
    most = (end_mm - places[0]) / 2 + ROUNDING_MM
    while reach / 2 < most:
        near = at[: min(int(np.searchsorted(at, 2 * reach + ROUNDING_MM)), _MOST_PLACES)]
        i, j = np.triu_indices(len(near), 1)
        apart = near[j] - near[i]
        fits = (near[i] <= apart + ROUNDING_MM) & (reach / 2 < apart) & (apart <= min(reach, most))
        order = np.argsort(apart[fits], kind="stable")
        yield from ((places[a], places[b]) for a, b in zip(i[fits][order], j[fits][order], strict=True))
        reach *= 2


def _is_mirror(slices: Sequence[Slice], at: float) -> bool:
    """True where a place mirrors both its sides, as far as the nearer end reaches."""
    reach = min(at - slices[0].left_mm, slices[-1].right_mm - at)
    return reach <= ROUNDING_MM or repeats(cut(slices, at - reach, at + reach), at, at + reach)


def repeats(slices: Sequence[Slice], low: float, high: float) -> bool:
    """True where mirrors at two places make the whole section from the part between them."""
    inside = cut(slices, low, high)
    lefts = [s.left_mm for s in inside]
    for piece in _folded(slices, low, high):
        at = max(bisect_right(lefts, (piece.left_mm + piece.right_mm) / 2) - 1, 0)
        if not _agree(piece, inside[at]):
            return False
    return True


def _agree(piece: Slice, place: Slice) -> bool:
    if piece.left_mm < place.left_mm - ROUNDING_MM or piece.right_mm > place.right_mm + ROUNDING_MM:
        return False
    if len(piece.bands) != len(place.bands) or not all(map(Band.is_same, piece.bands, place.bands)):
        return False
    ends = ((x, piece.lines_mm(x), place.lines_mm(x)) for x in (piece.left_mm, piece.right_mm))
    return all(abs(a - b) < 10 * ROUNDING_MM for _, mine, other in ends for a, b in zip(mine, other, strict=True))


def cut(slices: Sequence[Slice], low: float, high: float) -> list[Slice]:
    """The slices between two places."""
    first = bisect_right(slices, low + ROUNDING_MM, key=lambda s: s.right_mm)
    last = bisect_left(slices, high - ROUNDING_MM, key=lambda s: s.left_mm)
    inside = [s for s in slices[first:last] if s.right_mm - s.left_mm > ROUNDING_MM]
    for end in (0, -1) if inside else ():
        inside[end] = inside[end].between(max(inside[end].left_mm, low), min(inside[end].right_mm, high))
    return inside


def _folded(slices: Sequence[Slice], low: float, high: float) -> Iterator[Slice]:
    """Every piece of the section, mirrored until it lies between two places."""
    width = high - low
    for s in slices:
        first, last = (floor((x - low) / width) for x in (s.left_mm + ROUNDING_MM, s.right_mm - ROUNDING_MM))
        for k in range(first, last + 1):
            start = low + k * width
            for piece in cut([s], start, start + width):
                left, right, bands = piece.left_mm - start, piece.right_mm - start, piece.bands
                if k % 2:
                    left, right = width - right, width - left
                    bands = tuple(Band(b.material, b.terminal, b.bottom_mm[::-1], b.top_mm[::-1]) for b in bands)
                yield Slice(low + left, low + right, bands)


def _cell(slices: list[Slice], low: float, high: float) -> SectionCell:
    """The piece between two places, cut where a sensor's end falls into it, and how often each part occurs."""
    pieces = [(p.left_mm, p.right_mm) for p in _folded(slices, low, high)]
    inside = cut(slices, low, high)
    ends = chain.from_iterable([*pieces, *((s.left_mm, s.right_mm) for s in inside)])
    parts = [p for a, b in pairwise(distinct(ends, 10 * ROUNDING_MM)) for p in cut(inside, a, b)]
    shares = [float(sum(a < (p.left_mm + p.right_mm) / 2 < b for a, b in pieces)) for p in parts]
    if max(shares) == min(shares):
        return SectionCell(tuple(inside), (shares[0],) * len(inside))
    return SectionCell(tuple(parts), tuple(shares))


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
