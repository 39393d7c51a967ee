"""Cells that enclose another one: capacitance rises where permittivity does, and where conductors grow.

A flux of a cell whose conductors and permittivities are nowhere above the true ones gives a lower bound, a potential of
one in which they are nowhere below an upper bound. So outlines may be rounded, and those of layers far from the other
conductors drawn together, with nothing lost but width.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import shapely

from sensorgen.solvers.electrostatics.bounds import Unsolved
from sensorgen.solvers.electrostatics.prisms import MITRE, LayerCell, beyond

_MARGIN = 1.5  # of the grid: rounding moves outlines by 0.71 of its pitch, and slivers may go to the wrong side
_FULL = 1e-9  # share of the plan that rounding may leave out of a region that fills it

Levels = list[Any]  # regions: each conductor, then what has at least each permittivity, from the highest


def enclosing(cell: LayerCell, grid_mm: float, far_mm: float, loose_mm: float, *, outwards: bool) -> LayerCell:
    """A cell with outlines moved in or out, so that they may be rounded.

    Parameters
    ----------
    cell : LayerCell
        Of polygons.
    grid_mm : float
        To which its corners will be rounded [mm].
    far_mm : float
        Height from other conductors beyond which a layer is far from them [mm].
    loose_mm : float
        By which outlines of far layers are moved and simplified; neighbours that are this near become one [mm].
    outwards : bool
        Conductors and higher permittivities grow; else they shrink.

    Raises
    ------
    Unsolved
        Two conductors touch when they have grown.
    """
    order = np.argsort(cell.permittivity, kind="stable")[::-1]
    levels_of = [_levels(cell, own, order) for own in cell.regions]
    far = [*_far(cell, far_mm), False]
    moved: list[Levels] = []
    k = 0
    while k < len(levels_of):
        group, more = levels_of[k], k + 1
        while far[k] and far[more]:
            wider = _together(group, levels_of[more], outwards, 2 * loose_mm)
            if not wider:
                break
            group, more = wider, more + 1
        loose = loose_mm if far[k] else 0.0
        by = (_MARGIN * grid_mm + loose) * (1 if outwards else -1)
        one = [_moved(region, cell, by, loose) for region in group]
        moved += [one] * (more - k)
        k = more
    return replace(cell, regions=[_regions(cell, levels, order) for levels in moved], encloses=True)


def _levels(cell: LayerCell, own: dict[int, Any], order: Any) -> Levels:
    """Of one layer."""
    last = cell.conductors + len(cell.permittivity) - 1
    own = {kind: shapely.union_all(region) for kind, region in own.items()}
    rest = shapely.difference(shapely.box(0.0, 0.0, *cell.size_mm), shapely.union_all(list(own.values())))
    own[last] = shapely.union_all([rest, own.get(last, rest)])
    empty = shapely.Polygon()
    levels = [own.get(kind, empty) for kind in range(cell.conductors)]
    so_far = shapely.union_all(levels)
    for kind in order[:-1].tolist():
        so_far = shapely.union_all([so_far, own.get(cell.conductors + kind, empty)])
        levels.append(so_far)
    return levels


def _regions(cell: LayerCell, levels: Levels, order: Any) -> dict[int, Any]:
    """Fillings of a layer, from its levels."""
    metal = [k for k in range(cell.conductors) if not levels[k].is_empty]
    if any(shapely.intersects(levels[a], levels[b]) for a, b in combinations(metal, 2)):
        raise Unsolved("conductors are nearer than the grid that outlines are rounded to")
    filled = {k: levels[k] for k in metal}
    inside = shapely.union_all([levels[k] for k in metal])
    steps = [*levels[cell.conductors :], shapely.box(0.0, 0.0, *cell.size_mm)]
    for kind, level in zip(order.tolist(), steps, strict=True):
        part, inside = shapely.difference(level, inside), shapely.union_all([inside, level])
        if kind < len(cell.permittivity) - 1 and not part.is_empty:
            filled[cell.conductors + kind] = part
    return filled


def _far(cell: LayerCell, far_mm: float) -> list[bool]:
    """Mask of the layers that are far, and no plates."""
    low, high = cell.heights_mm[:-1], cell.heights_mm[1:]
    areas = np.array(
        [[shapely.area(own[k]) if k in own else np.nan for own in cell.regions] for k in range(cell.conductors)]
    )
    holds = ~np.isnan(areas)  # conductors by layers
    bottom = np.where(holds, low, np.inf).min(axis=1, keepdims=True)
    top = np.where(holds, high, -np.inf).max(axis=1, keepdims=True)
    apart = np.where(holds, np.inf, np.maximum(low - top, bottom - high)).min(axis=0)
    plate = np.nansum(areas, axis=0) > (1 - _FULL) * cell.size_mm[0] * cell.size_mm[1]
    far: list[bool] = ((holds.sum(axis=0) == 1) & ~plate & (apart > far_mm)).tolist()
    return far


def _together(one: Levels, next_one: Levels, outwards: bool, near_mm: float) -> Levels:
    """Levels that stand for those of two layers; none where outlines of the two are not near each other."""
    wider, other = ([_both(pair, way) for pair in zip(one, next_one, strict=True)] for way in (outwards, not outwards))
    pairs = zip(wider, other, strict=True)
    return wider if all(shapely.equals(a, b) or _near(a, b, outwards, near_mm) for a, b in pairs) else []


def _both(pair: Sequence[Any], outwards: bool) -> Any:
    return shapely.union(*pair) if outwards else shapely.intersection(*pair)


def _near(wider: Any, other: Any, outwards: bool, by_mm: float) -> bool:
    """Test whether the union of some layers is within a distance of what they share."""
    union, shared = (wider, other) if outwards else (other, wider)
    return bool(shapely.covers(shapely.buffer(shared, by_mm), union))


def _moved(region: Any, cell: LayerCell, by_mm: float, loose_mm: float) -> Any:
    """A region grown by a distance, or shrunk, inside the cell; its outline simplified to the same side."""
    area = cell.size_mm[0] * cell.size_mm[1]
    if region.is_empty or region.area > (1 - _FULL) * area:
        return region
    whole = beyond(region, cell.size_mm, cell.periodic, 4 * abs(by_mm) + 4 * loose_mm)
    wide = shapely.buffer(whole, by_mm, join_style="mitre", mitre_limit=MITRE)
    if loose_mm:
        wide = shapely.simplify(wide, loose_mm * (1 - 1e-9))
    return shapely.clip_by_rect(wide, 0.0, 0.0, *cell.size_mm)
