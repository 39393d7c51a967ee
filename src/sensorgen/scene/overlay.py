"""Overlay: the pieces of a scene over which all layers are the same, in cross-section or in plan.

Scenes of one extrusion, or of boxes, fall into columns of their cross-sections. Upright prisms of any outline, as round
or octagonal pillars, are overlaid in plan with shapely: faces between all their edges, exact to rounding.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import shapely

from sensorgen.scene.scene import Body, Piece, Point, Prism, Scene, seen_from_above
from sensorgen.scene.sections import ROUNDING_MM, Layer, SectionColumn, alike, columns, sections


@dataclass(frozen=True)
class OverlayPart:
    """Columns side by side.

    Attributes
    ----------
    depth_mm : float
        Of all columns [mm].
    columns : tuple of SectionColumn
        From left to right in a cross-section; in plan in no order, each 1 mm deep and as wide as that makes its area.
    looks : tuple of int
        Of each column, the number of the first that looks like it.
    in_plan : bool
        Whether they come from a plan.
    """

    depth_mm: float
    columns: tuple[SectionColumn, ...]
    looks: tuple[int, ...]
    in_plan: bool = False


def parts(scene: Scene) -> list[OverlayPart]:
    """The parts that together are the scene.

    Raises
    ------
    ValueError
        Outlines overlap in plan, or are slanted both in plan and in elevation.
    """
    every = [p for body in scene.bodies for p in body.pieces]
    if all((isinstance(p, Prism) and p.axis != "z") or p.is_box() for p in every):
        return [OverlayPart(s.depth_mm, tuple(columns(s)), tuple(alike(s))) for s in sections(scene)]
    patches = _patches(scene)
    return [OverlayPart(1.0, patches, tuple(range(len(patches))), in_plan=True)]


@lru_cache(maxsize=8)
def _patches(scene: Scene) -> tuple[SectionColumn, ...]:
    """Pieces of the plan over which the same layers lie, those of one look as one."""
    pieces = [(body, p) for body in scene.bodies for p in body.pieces]
    slanted = next((body for body, p in pieces if not p.is_constant("z")), None)
    if slanted:
        raise ValueError(f"{slanted.name} is slanted or curved in elevation: no column has constant layers")
    numbers: dict[tuple[str, Point], int] = {}
    kinds = [numbers.setdefault((body.name, p.span("z")), len(numbers)) for body, p in pieces]
    first = {kind: pieces[k] for k, kind in reversed(list(enumerate(kinds)))}
    plans = np.array([_plan(body, p) for body, p in pieces])
    edges = shapely.boundary([*plans, shapely.box(0.0, 0.0, *scene.size_mm[:2])])
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(edges)]))
    places = shapely.point_on_surface(faces)
    over: list[list[int]] = [[] for _ in faces]
    for face, piece in shapely.STRtree(plans).query(places, predicate="within").T.tolist():
        over[face].append(piece)
    areas: dict[tuple[int, ...], float] = defaultdict(float)
    for here, area in zip(over, shapely.area(faces).tolist(), strict=True):
        areas[tuple(sorted(kinds[k] for k in here))] += area
    looks = ((look, area) for look, area in areas.items() if area > ROUNDING_MM**2)
    return tuple(SectionColumn(0.0, area, _layers([first[kind] for kind in look])) for look, area in looks)


def _plan(body: Body, piece: Piece) -> shapely.Polygon:
    """An upright prism seen from above."""
    plan = shapely.Polygon(seen_from_above(piece))
    if not plan.is_valid:
        raise ValueError(f"an outline of {body.name} crosses itself: {shapely.is_valid_reason(plan)} mm")
    return plan


def _layers(pieces: Sequence[tuple[Body, Piece]]) -> tuple[Layer, ...]:
    """Pieces over one place as layers, from bottom to top."""
    spans = sorted(((*p.span("z"), body) for body, p in pieces), key=lambda span: span[:2])
    for (_, top, lower), (bottom, _, upper) in pairwise(spans):
        if bottom < top - ROUNDING_MM:
            raise ValueError(f"outlines overlap in plan: {lower.name} and {upper.name} at z = {bottom:g} mm")
    return tuple(Layer(body, (low, low), (high, high)) for low, high, body in spans)
