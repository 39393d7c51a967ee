"""A sensor cut to an outline in plan, and which share of its cells lies inside."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely

from sensorgen.scene.layers import outlines
from sensorgen.scene.scene import SLIVER_MM, Body, Piece, Point, Prism, Scene, seen_from_above
from sensorgen.scene.sections import square_to

_MOST = 1000  # cells each way
_FINE = 400  # strips in which a direction without pattern is cut


@dataclass(frozen=True)
class Share:
    """Share of a rectangular sensor that an outline leaves.

    Attributes
    ----------
    area : float
        Of its plan [-].
    error : float
        By how much the share of its capacitance may differ, relative to ``area``: cells that the outline cuts may have
        nothing of it, or all, as a part of a cell never has more than the whole [-].
    """

    area: float
    error: float


def cut(scene: Scene, region: shapely.Polygon) -> Scene:
    """The part of a scene inside an outline in plan [mm]."""
    shapely.prepare(region)
    bodies = (
        replace(body, pieces=tuple(part for p in body.pieces for part in _inside(p, region))) for body in scene.bodies
    )
    return replace(scene, bodies=tuple(bodies))


def _inside(piece: Piece, region: shapely.Polygon) -> Iterator[Piece]:
    """The parts of a piece inside an outline: prisms of upright ones, solids of others."""
    (x0, x1), (y0, y1) = piece.span("x"), piece.span("y")
    box = shapely.box(x0, y0, x1, y1)
    if region.contains(box.buffer(-SLIVER_MM, join_style="mitre")):
        yield piece
        return
    if not region.intersects(box):
        return
    if piece.is_constant("z"):
        low, high = piece.span("z")
        left = shapely.intersection(region, shapely.Polygon(seen_from_above(piece)), grid_size=1e-9)
        for outline in outlines(left):
            yield Prism("z", outline, low, high)
        return
    from sensorgen.scene.geometry.meshes import mesh
    from sensorgen.scene.geometry.surfaces import pieces, shells_of

    low, high = piece.span("z")
    tool = [Prism("z", outline, low - 1, high + 1) for outline in outlines(region)]
    solid = mesh(Body("piece", "", (piece,))).solid()
    for prism in tool:
        left = solid ^ mesh(Body("border", "", (prism,))).solid()
        if left.volume() > SLIVER_MM**2 * (high - low):
            yield from pieces(shells_of(left))


def share(scene: Scene, region: shapely.Polygon, cell_mm: Point) -> Share:
    """Share of a whole scene's capacitance that an outline leaves.

    Parameters
    ----------
    scene : Scene
        Not cut.
    region : Polygon
        The outline.
    cell_mm : (float, float)
        Sides of its unit cell; the whole side where nothing repeats [mm].
    """
    counts = []
    for axis, side in enumerate(cell_mm):
        whole = scene.size_mm[axis]
        uniform = len(square_to(scene, "xy"[axis])) == 1
        counts.append(_FINE if uniform else max(1, min(_MOST, round(whole / side))))
    x, y = (np.linspace(0.0, whole, n + 1) for whole, n in zip(scene.size_mm, counts, strict=False))
    boxes = shapely.box(*(v.ravel() for v in (*np.meshgrid(x[:-1], y[:-1]), *np.meshgrid(x[1:], y[1:]))))
    boxes = shapely.buffer(boxes, -SLIVER_MM, join_style="mitre")
    shapely.prepare(region)
    inside = int(shapely.covers(region, boxes).sum())
    touched = int(shapely.intersects(region, boxes).sum())
    area = region.area / (scene.size_mm[0] * scene.size_mm[1])
    ends = np.array([inside, touched]) / len(boxes)
    return Share(area, float(abs(ends / area - 1).max()))
