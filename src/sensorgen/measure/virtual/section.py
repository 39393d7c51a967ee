"""Cells of the virtual specimen: the raster of a section, and upright prisms as bricks.

Every interface of a section, level or sloping, is a line of edges of elements.
"""

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from itertools import chain, pairwise
from math import prod

import numpy as np
import shapely

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.measure.virtual.cell import CellBricks, SectionRaster
from sensorgen.scene.scene import FLOATING, Body, Outline, Point, Scene, is_rectangle, seen_from_above
from sensorgen.scene.sections import Section, SectionColumn, columns, sections

FINE_MM = 0.025
_MOST_COLUMNS = 120  # of elements; the width of a cell with a larger one is cut evenly
_GRADED = 0.7  # share of the cosine in the grading of elements
_NONE_MM = 1e-9
TERMINALS = {"bottom": 1, "top": 2, FLOATING: 3}


def section_of(scene: Scene) -> Section | None:
    """The one cross-section of a scene; None where it has none, or several."""
    try:
        sections_ = sections(scene)
    except ValueError:
        return None
    return sections_[0] if len(sections_) == 1 else None


def raster(scene: Scene, materials: Mapping[str, int], fine_mm: float = FINE_MM) -> SectionRaster:
    """A scene's section as elements.

    Parameters
    ----------
    scene : Scene
        With one cross-section.
    materials : mapping of str to int
        Number of each material, from 1 on.
    fine_mm : float
        Largest edge of an element; in wide cells, of those along a height [mm].

    Raises
    ------
    OutOfRange
        The scene has several cross-sections, or one whose interfaces are not the same lines from side to side.
    """
    section = section_of(scene)
    if section is None:
        raise OutOfRange("a raster of a body with several cross-sections; expected one along the sensor or across it")
    across = "xy".index(section.across)
    columns_ = columns(section)
    sides = [columns_[0].left_mm, *(c.right_mm for c in columns_)]
    widest = max(fine_mm, (sides[-1] - sides[0]) / _MOST_COLUMNS)
    lines = _interfaces(columns_)
    highest = np.max([np.diff(of, axis=0) for of in lines], axis=(0, 2))
    rows = np.maximum(np.round(highest / fine_mm), 1).astype(int).tolist()
    pieces = np.maximum(np.ceil(np.diff(sides) / widest - 1e-6), 1).astype(int).tolist() if len(columns_) > 1 else [1]
    shares = np.concatenate([[0.0], *(k + graded(n) for k, n in enumerate(rows))])
    x, z, kinds = [sides[0]], list[Real](), list[Whole]()
    for column, of, n in zip(columns_, lines, pieces, strict=True):
        x += (column.left_mm + (column.right_mm - column.left_mm) * graded(n)).tolist()
        ends = [np.interp(shares, np.arange(len(of)), of[:, side]) for side in (0, 1)]
        at = [0.0, *graded(n).tolist()]
        z += [ends[0] + (ends[1] - ends[0]) * share for share in at[bool(z) :]]
        for share in np.add(at[1:], at[:-1]) / 2:
            kinds.append(_kinds(column, ends, share, materials))
    material, electrode = np.moveaxis(np.array(kinds), 0, 2)
    return SectionRaster(np.array(x) * M_PER_MM, np.array(z).T * M_PER_MM, material, electrode, scene.repeats[across])


def graded(count: int) -> Real:
    """Ends of parts of 1 that are smaller towards both its ends, where corners are."""
    even = np.arange(1, count + 1) / count
    return np.asarray(_GRADED * (1 - np.cos(np.pi * even)) / 2 + (1 - _GRADED) * even)


def _interfaces(columns_: Sequence[SectionColumn]) -> list[Real]:
    """Heights of the interfaces of all columns at their sides, the same ones from side to side [mm]."""
    ends = [{end for layer in c.layers for end in (layer.bottom_mm, layer.top_mm)} for c in columns_]
    levels = {0.0, *(round(a, 9) for a, b in chain(*ends) if abs(a - b) < _NONE_MM and a > _NONE_MM)}
    lines = [_lines(of, levels) for of in ends]
    if len(set(map(len, lines))) > 1 or not _joined(lines):
        raise OutOfRange(
            "a virtual specimen of a section whose sloping interfaces end inside it; print it: what is printed in "
            "layers has level ones"
        )
    return lines


def _lines(ends: Collection[Point], levels: Collection[float]) -> Real:
    """Heights of all interfaces of a column at its sides, upwards (k, 2) [mm]: its sloping ones and all levels."""
    sloping = [end for end in ends if abs(end[0] - end[1]) >= _NONE_MM]
    return np.array(sorted([*((z, z) for z in levels), *sloping], key=lambda e: (round(sum(e), 9), e)))


def _joined(lines: Sequence[Real]) -> bool:
    """Test whether interfaces of neighbours meet, and none crosses another."""
    meet = all(np.allclose(a[:, 1], b[:, 0], atol=10 * _NONE_MM) for a, b in pairwise(lines))
    return meet and all((np.diff(of, axis=0) >= -10 * _NONE_MM).all() for of in lines)


def _kinds(column: SectionColumn, ends: Sequence[Real], share: float, materials: Mapping[str, int]) -> Whole:
    """Materials and terminals of a column's elements, upwards, at a share of its width (2, n)."""
    z = ends[0] + (ends[1] - ends[0]) * share
    spans = [tuple(e[0] + (e[1] - e[0]) * share for e in (layer.bottom_mm, layer.top_mm)) for layer in column.layers]
    bottoms = [low for low, _ in spans]
    kinds = np.zeros((2, len(z) - 1), int)
    for n, middle in enumerate(((z[1:] + z[:-1]) / 2).tolist()):
        k = bisect_right(bottoms, middle) - 1
        if k >= 0 and middle < spans[k][1]:
            body = column.layers[k].body
            kinds[:, n] = materials[body.material], TERMINALS.get(body.terminal, 0)
    return kinds


_STEP_MM = 1e-6
_SAME_MM = 1e-3  # places of a pattern that differ by less are one, rounded
_COARSER = 1.1
_INNER = 0.9  # share of a pattern that has to repeat; its ends may be cut


def bricks(scene: Scene, materials: Mapping[str, int], size_mm: float, most: int, parts: int = 1) -> CellBricks:
    """A scene between mirrors as bricks; of a symmetric scene the part in its middle that mirrors repeat.

    The ends of a scene, where the pattern may be cut, are taken to be as its middle. An outline that is not parallel to
    the axes becomes steps around as large an area, the same for all ``parts``.

    Parameters
    ----------
    scene : Scene
        Of upright prisms.
    materials : mapping of str to int
        Number of each material, from 1 on.
    size_mm : float
        Largest edge of a brick before it is cut; longer where there would be too many bricks [mm].
    most : int
        Number of bricks before they are cut.
    parts : int
        Into which each brick is cut along each axis.

    Raises
    ------
    OutOfRange
        The pattern repeats by shifts, a body is no upright prism, or the cell has too many faces.
    """
    pieces = _pieces(scene)
    outlines = [outline for _, outline, _ in pieces]
    levels = np.unique(np.round([0.0, scene.size_mm[2], *(z for _, _, span in pieces for z in span)], 9))
    planes = [*(_edges(outlines, axis, scene.size_mm[axis]) for axis in (0, 1)), levels]
    kinds = _filled(pieces, planes, materials)
    part = [*(_part(planes[axis], _looks(kinds, axis)) for axis in (0, 1)), levels]
    counts = _counts(part, size_mm, most)
    kinds = _filled(pieces, [_cut(at, n) for at, n in zip(part, counts, strict=True)], materials)
    for axis in range(3):
        kinds = kinds.repeat(parts, axis + 1)
    x, y, z = (_cut(at, parts * n) * M_PER_MM for at, n in zip(part, counts, strict=True))
    return CellBricks(x, y, z, *kinds)


def _pieces(scene: Scene) -> list[tuple[Body, Outline, Point]]:
    """Upright prisms of a scene between mirrors: body, outline in plan and heights [mm]."""
    if any(scene.repeats):
        raise OutOfRange("a virtual specimen of a pattern without mirrors; expected strips along or across the sensor")
    try:
        return [(body, seen_from_above(p), p.span("z")) for body in scene.bodies for p in body.pieces]
    except ValueError:
        raise OutOfRange("a virtual specimen of a body that is no upright prism; expected a printed one") from None


def _filled(
    pieces: Sequence[tuple[Body, Outline, Point]], planes: Sequence[Real], materials: Mapping[str, int]
) -> Whole:
    """Materials and terminals of the bricks between planes (2, nx, ny, nz)."""
    x, y, z = planes
    found = np.zeros((2, len(x) - 1, len(y) - 1, len(z) - 1), int)
    for body, outline, (low, high) in pieces:
        here = _covered(outline, x, y)[..., None] & (low < (z[1:] + z[:-1]) / 2) & ((z[1:] + z[:-1]) / 2 < high)
        found[:, here] = np.array([materials[body.material], TERMINALS.get(body.terminal, 0)])[:, None]
    return found


def _covered(outline: Outline, x: Real, y: Real) -> Mask:
    """Bricks that an outline covers, seen from above (nx, ny): most of them, and together as much as it."""
    area = np.outer(np.diff(x), np.diff(y))
    if is_rectangle(outline):
        (x0, y0), (x1, y1) = min(outline), max(outline)
        inside = np.outer(*(np.diff(at.clip(*ends)) for at, ends in ((x, (x0, x1)), (y, (y0, y1)))))
    else:
        plans = shapely.box(x[:-1, None], y[:-1], x[1:, None], y[1:])
        inside = shapely.area(shapely.intersection(shapely.Polygon(outline), plans))
    share = np.round(inside / area, 6)
    least = np.unique(np.append(share[share > 0], 1.0))
    covered = np.array([area[share >= level].sum() for level in least])
    return np.asarray(share >= least[np.abs(covered - inside.sum()).argmin()])


def _edges(outlines: Sequence[Outline], axis: int, size_mm: float) -> Real:
    """Places of the sides of a cell, of its middle, and of the extents and edges of outlines along an axis [mm]."""
    edges = [0.0, size_mm / 2, size_mm]
    for corners in outlines:
        at = np.array(corners)[:, axis]
        edges += [at.min(), at.max(), *at[np.abs(at - np.roll(at, 1)) < _STEP_MM]]
    places = np.unique(np.round(edges, 9))
    return np.asarray(places[np.append(True, np.diff(places) > _STEP_MM)])


def _counts(planes: Sequence[Real], size_mm: float, most: int) -> list[Whole]:
    """Into how many parts all is cut between planes, along each axis."""
    gaps = [np.diff(at) for at in planes]
    if prod(map(len, gaps)) > most:
        raise OutOfRange(
            f"a virtual specimen of a cell with {' x '.join(str(len(of)) for of in gaps)} faces along x, y and z; "
            "expected a pattern that repeats within a few strips"
        )
    while prod(int(np.ceil(of / size_mm - 1e-6).sum()) for of in gaps) > most:
        size_mm *= _COARSER
    return [np.ceil(of / size_mm - 1e-6).astype(int) for of in gaps]


def _cut(planes: Real, counts: Whole) -> Real:
    """Planes with others between them, nearer to each other towards the given ones [mm]; n parts are among 2n."""
    pairs = zip(pairwise(planes.tolist()), counts.tolist(), strict=True)
    return np.concatenate([planes[:1], *(a + (b - a) * graded(n) for (a, b), n in pairs)])


def _looks(kinds: Whole, axis: int) -> Whole:
    """Numbers of what is between the planes along an axis, the same for what is alike."""
    slices = np.moveaxis(kinds, axis + 1, 0).reshape(kinds.shape[axis + 1], -1)
    return np.unique(slices, axis=0, return_inverse=True)[1].ravel()


def _part(at: Real, looks: Whole) -> Real:
    """The planes of the shortest part that mirrors at its ends repeat, of planes and what is between them [mm]."""
    gaps = np.diff(at)
    if not (np.allclose(gaps, gaps[::-1], rtol=0, atol=_SAME_MM) and np.array_equal(looks, looks[::-1])):
        return at
    middle = float(at[len(gaps) // 2])
    at, looks = at[len(gaps) // 2 :] - middle, looks[len(gaps) // 2 :]
    centre = (at[1:] + at[:-1]) / 2
    away = _INNER * at[-1]
    for end in np.sort(np.append(at[1:], centre)):
        if 4 * end > at[-1]:
            break
        part = np.append(at[at < end - _SAME_MM], end)
        edges, middles = (np.abs((of[of < away] + end) % (2 * end) - end) for of in (at, centre))
        same = looks[np.searchsorted(at, middles) - 1] == looks[centre < away]
        if same.all() and np.abs(edges[:, None] - part).min(1).max() < _SAME_MM:
            return np.asarray(middle + part)
    return np.asarray(middle + at)
