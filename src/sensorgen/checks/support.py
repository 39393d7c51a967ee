"""Rule 9: parts whose lines would lie over nothing, since the layer below is empty there."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.core.findings import Finding
from sensorgen.scene.layers import LayerRegions, narrow_mm, parts

RULE = "9-support"
_OPEN, _ALONE = 0.8, 0.8  # share of a part over nothing, and share of a body's parts in a layer


def findings(layers: Sequence[LayerRegions], line_mm: float) -> Iterator[Finding]:
    """Bodies of which most lines of a layer lie over an empty layer, with length and share.

    Parameters
    ----------
    layers : sequence of LayerRegions
        As printed.
    line_mm : float
        Width of a line; wider parts are bridges, of rule 9.
    """
    for number, (below, layer) in enumerate(pairwise(layers), 2):
        under = np.array([part for region in below.regions.values() for part in parts(region)], object)
        tree = shapely.STRtree(under)
        for body, region in layer.regions.items():
            plan = parts(region)
            widths, middles = narrow_mm(plan), _middles(plan)
            line, part = tree.query(middles, predicate="intersects")
            met = shapely.length(shapely.intersection(middles[line], under[part]))
            share = 1 - np.bincount(line, met, len(plan)) / shapely.length(middles)
            alone = (share > _OPEN) & (widths < 2 * line_mm)
            lengths = shapely.area(plan) / widths
            length, whole = float(lengths[alone].sum()), float(lengths.sum())
            if length > _ALONE * whole:
                at = plan[int(alone.argmax())].centroid
                yield Finding(
                    RULE, "warning", body,
                    f"{length:.0f} mm of its lines ({length / whole:.0%}) lie over an empty layer",
                    "print what lies below: increase period_mm, or use other walls or thinner layers",
                    place_mm=(round(at.x, 3), round(at.y, 3), layer.bottom_mm), layer=number, count=int(alone.sum()),
                )  # fmt: skip


def _middles(plan: Sequence[shapely.Polygon]) -> NDArray[np.object_]:
    """Middle of each part along the longer side of the box around it, as a line."""
    x0, y0, x1, y1 = shapely.bounds(np.array(plan, object)).T
    along = x1 - x0 > y1 - y0
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    start = np.column_stack([np.where(along, x0, x), np.where(along, y, y0)])
    end = np.column_stack([np.where(along, x1, x), np.where(along, y, y1)])
    return np.asarray(shapely.linestrings(np.stack([start, end], axis=1)))
