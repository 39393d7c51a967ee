"""Curved and slanted bodies under pressure, as upright columns of boxes between four mirrors, solved as press3d does.

Each column is as high as the body is over its area on average. More columns, closer to the places where bodies touch,
come nearer: the error is estimated from two numbers of columns. The checks are those of press2d.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise, product

import numpy as np
import shapely

from sensorgen.core.errors import BadInput
from sensorgen.models import curved, press3d
from sensorgen.models.press3d import BoundaryConditions, Elastic, Pressed
from sensorgen.scene.polyhedra import Loft
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Piece, Prism, Scene, box
from sensorgen.solvers.contact.mapped_field import Orders
from sensorgen.solvers.electrostatics.round_cell import inside

SOURCE = "columns of boxes; " + press3d.SOURCE
COST = 3

_SAMPLES = 7  # places of a column along x and along y
_HEIGHTS = 200  # places of a body along z
_STEPS = 4  # heights of columns that a body has, over the number of columns along an axis
_STEEP = 2.0  # columns under flanks over those elsewhere
_POLE, _FAR = 3.0, 0.1  # columns at the pole of a dome over those far from it, less 1; distance over the cell's side
_LEVEL = 1e-6  # mm

USUAL = 6  # columns along each axis
POINTS = ((0.4, 2.0), (0.3, 6.0), (0.2, 13.0), (0.18, 19.0), (0.15, 45.0))  # error of the rise [-] and seconds of
# 4 to 8 columns, on bumps that touch a film of 0.2 mm; pyramids and cones with blunt tips are nearer


@dataclass(frozen=True)
class Columns:
    """How many columns the cell has along each axis, and the field's orders."""

    columns: int = USUAL
    orders: Orders = field(default_factory=Orders)


def why_not_applicable(scene: Scene) -> str | None:
    """Why this model does not apply to a scene, or None."""
    if all(piece.is_constant("z") for body in scene.bodies for piece in body.pieces):
        return "its bodies are upright prisms"
    try:
        curved.cell(scene)
    except ValueError as error:
        return str(error)
    return None


def press(
    scene: Scene,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    boundary: BoundaryConditions | None = None,
    fineness: Columns | None = None,
    step: Callable[[float], None] | None = None,
) -> Pressed:
    """Solve the cell of a scene under pressure on its top.

    Parameters
    ----------
    scene : Scene
        For which :func:`why_not_applicable` is None.
    fineness : Columns, optional
        Of the mesh.
    solids, stress_pa, permittivity, boundary, step
        As of :func:`sensorgen.models.press3d.press`.

    Raises
    ------
    OutOfRange, BadInput
        As :func:`sensorgen.models.press3d.press`.
    """
    fineness = fineness or Columns()
    bricks = press3d.cell(stairs(scene, fineness.columns))
    pieces = press3d.Pieces(1, 1.0, fineness.orders)
    found = press3d.press(bricks, solids, stress_pa, permittivity, boundary, pieces, step)
    said = f"curved and slanted bodies pressed as {fineness.columns} by {fineness.columns} columns"
    return replace(found, doubts=(said, *found.doubts), source=SOURCE)


def stairs(scene: Scene, columns: int) -> Scene:
    """The cell of a scene, each body of it as columns: a scene of boxes.

    Raises
    ------
    BadInput
        The scene has no cell between mirrors.
    """
    try:
        cell, _, _ = curved.cell(scene)
    except ValueError as error:
        raise BadInput(f"pressing a curved body needs a cell: {error}") from None
    owner = {id(piece): body for body in scene.bodies for piece in body.pieces}
    planes = [_planes([p for p, _ in cell.pieces], axis, cell.low_mm[k], cell.high_mm[k], columns)
              for k, axis in enumerate("xy")]  # fmt: skip
    (x_mm, y_mm, z_mm), whole = cell.low_mm, np.subtract(cell.high_mm, cell.low_mm).tolist()
    found: dict[Body, list[Prism]] = {}
    for piece, _ in cell.pieces:
        boxes, z0, z1 = found.setdefault(owner[id(piece)], []), *piece.span("z")
        areas = [(*x, *y) for x, y in product(*(pairwise(p) for p in planes))]
        filled = {area: high for area in areas if (high := _filled(piece, area, _STEPS * columns)) > _LEVEL}
        short = z1 - z0 - max(filled.values(), default=0.0)  # a tip reaches as far as it does
        hangs = _area(piece, z1 - _LEVEL) >= _area(piece, z0 + _LEVEL)
        for (x0, x1, y0, y1), high in filled.items():
            low, top = (z1 - high - short, z1) if hangs else (z0, z0 + high + short)
            boxes.append(box(x0 - x_mm, x1 - x_mm, y0 - y_mm, y1 - y_mm, low - z_mm, top - z_mm))
    return Scene(tuple(replace(body, pieces=tuple(boxes)) for body, boxes in found.items()), tuple(whole))


def _planes(pieces: Sequence[Piece], axis: str, low: float, high: float, columns: int) -> list[float]:
    """Where columns meet along an axis: at the corners of bodies, and closer under flanks [mm]."""
    k, near = "xy".index(axis), {low, high}
    near |= {(p.x_mm, p.y_mm)[k] for p in pieces if isinstance(p, Revolved)}
    poles = {(p.x_mm, p.y_mm)[k] for p in pieces if isinstance(p, Revolved) and any(p.bulges)}
    for piece in pieces:
        if isinstance(piece, Loft):
            near |= {corner[k] for corner in (*piece.lower, *piece.upper)}
        elif not isinstance(piece, Revolved):
            near |= set(piece.span(axis))
    inner = sorted(v for v in near if low + _LEVEL < v < high - _LEVEL)
    places = [low, *(v for j, v in enumerate(inner) if j == 0 or v - inner[j - 1] > _LEVEL), high]
    flanks = [(min(a[k], b[k]), max(a[k], b[k])) for p in pieces if isinstance(p, Loft)
              for a, b in zip(p.lower, p.upper, strict=True)]  # fmt: skip
    flanks += [p.span(axis) for p in pieces if isinstance(p, Revolved)]
    while len(places) <= columns:
        sides = list(pairwise(places))
        steep = [_STEEP if any(a < (u + v) / 2 < b for a, b in flanks) else 1.0 for u, v in sides]
        off = [min((max(a - t, t - b, 0.0) for t in poles), default=1.0) for a, b in sides]
        close = [1.0 + _POLE / (1.0 + d / (high - low) / _FAR) if poles else 1.0 for d in off]
        widest = int(np.argmax(np.diff(places) * steep * close))
        places.insert(widest + 1, sum(sides[widest]) / 2)
    return places


def _filled(piece: Piece, area: tuple[float, float, float, float], steps: int) -> float:
    """Height that a piece fills of a column on average, in steps of its own height [mm]."""
    x0, x1, y0, y1 = area
    if not all(piece.span(a)[0] < end - _LEVEL and piece.span(a)[1] > start + _LEVEL
               for a, start, end in (("x", x0, x1), ("y", y0, y1))):  # fmt: skip
        return 0.0
    z0, z1 = piece.span("z")
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    z = z0 + (np.arange(_HEIGHTS) + 0.5) / _HEIGHTS * (z1 - z0)
    grid = np.meshgrid(x0 + share * (x1 - x0), y0 + share * (y1 - y0), z, indexing="ij")
    within = inside(piece, np.stack(grid, axis=-1).reshape(-1, 3))
    return round(float(within.mean()) * steps) / steps * (z1 - z0)


def _area(piece: Piece, z_mm: float) -> float:
    """Of a level cut [mm2]."""
    return float(sum(shapely.Polygon(outline).area for outline in piece.cut("z", z_mm)))
