"""A scene as slabs between heights: what every body covers at all heights of a slab, and what it covers at some."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

from sensorgen.scene.scene import SLIVER_MM, Body, Piece, Prism, Scene, area_mm2, between, seen_from_above, shadow
from sensorgen.scene.sections import distinct

if TYPE_CHECKING:  # a stored answer loads no numbers
    import shapely

    from sensorgen.core.arrays import Real
    from sensorgen.scene.layers import Region

CUTS = 8  # slabs of a body that is slanted or curved in elevation
_COVERS = 0.99  # of the plan: between round beads there may be holes


@dataclass(frozen=True)
class Slab:
    """Slab of a scene between two heights.

    Attributes
    ----------
    low_mm, high_mm : float
        The heights [mm].
    inner, outer : dict of Body to Region
        What a body covers at all heights between them, and at any.
    """

    low_mm: float
    high_mm: float
    inner: "dict[Body, Region]"
    outer: "dict[Body, Region]"


@lru_cache(maxsize=8)
def slabs(scene: Scene, cuts: int = CUTS) -> tuple[Slab, ...]:
    """Slabs of a scene from below; bodies that are no upright prisms in so many at least.

    Curved faces are those of the bodies' meshes, chords within 0.01 mm.
    """
    import shapely

    pieces = sorted(scene.pieces, key=lambda own: not own[1].is_constant("z"))  # upright ones first
    faces = [None if piece.is_constant("z") else _faces(piece) for _, piece in pieces]
    cut_slabs = []
    for low, high in pairwise(_levels(scene, cuts)):
        inner, outer = defaultdict[Body, "list[Region]"](list), defaultdict[Body, "list[Region]"](list)
        for (body, piece), triangles in zip(pieces, faces, strict=True):
            if piece.span("z")[0] < (low + high) / 2 < piece.span("z")[1]:
                least, most = _between(piece, triangles, low, high)
                inner[body].append(least)
                outer[body].append(most)
        united = [{b: shapely.union_all(own) for b, own in some.items()} for some in (inner, outer)]
        cut_slabs.append(Slab(low, high, united[0], united[1]))
    return tuple(cut_slabs)


def _levels(scene: Scene, cuts: int) -> list[float]:
    """Heights at which upright pieces begin and end, and others are cut [mm]."""
    import numpy as np

    heights: list[float] = []
    for _, piece in scene.pieces:
        upright = piece.is_constant("z")
        heights += piece.span("z") if upright else (*np.linspace(*piece.span("z"), cuts + 1), *piece.levels_mm())
    return distinct(np.array(heights).round(9).tolist(), SLIVER_MM)


def covered(scene: Scene, terminal: str) -> bool:
    """True where an electrode covers the whole plan of a scene, seen from above."""
    whole = _COVERS * scene.size_mm[0] * scene.size_mm[1]
    prisms = [p for b in scene.bodies if b.terminal == terminal for p in b.pieces if isinstance(p, Prism)]
    if any(abs(area_mm2(shadow(prism, "z"))) >= whole for prism in prisms):
        return True
    import shapely

    own = [region for slab in slabs(scene) for body, region in slab.outer.items() if body.terminal == terminal]
    return bool(shapely.union_all(own).area >= whole)


def is_open(scene: Scene) -> bool:
    """True where one of the two electrodes does not cover the whole plan, so that the field leaves the sensor."""
    ends = {body.terminal for body in scene.bodies} & {"top", "bottom"}
    return not all(covered(scene, end) for end in sorted(ends))


def _faces(piece: Piece) -> "Real":
    """Triangles of its surface (n, 3, 3) [mm]."""
    from sensorgen.scene.geometry.meshes import mesh

    return mesh(Body("", "", (piece,))).corners_mm()


def _between(piece: Piece, faces: "Real | None", low_mm: float, high_mm: float) -> "tuple[Region, Region]":
    """Regions that a piece covers at all heights between two, and at any: where they differ, its faces decide."""
    import shapely

    from sensorgen.scene.layers import EMPTY

    if faces is None:  # upright
        plan = shapely.Polygon(seen_from_above(piece))
        return plan, plan
    ends = [
        shapely.union_all([shapely.Polygon(outline) for outline in piece.cut("z", at)])
        for at in (low_mm + SLIVER_MM, high_mm - SLIVER_MM)
    ]
    near = faces[(faces[:, :, 2].min(1) < high_mm) & (faces[:, :, 2].max(1) > low_mm)]
    surface = shapely.union_all(list(_projected(near, low_mm, high_mm)) or [EMPTY])
    inner = shapely.difference(shapely.intersection(*ends), surface)
    return inner, shapely.union_all([*ends, surface])


def _projected(faces: "Real", low_mm: float, high_mm: float) -> "Iterator[shapely.Polygon]":
    """The parts of triangles between two heights, seen from above."""
    import shapely

    for triangle in faces.tolist():
        corners = between(triangle, 2, low_mm, high_mm)
        if len(corners) > 2:
            outline = shapely.Polygon([corner[:2] for corner in corners])
            if outline.area > SLIVER_MM**2:
                yield outline
