"""Bumps, cones, pyramids and pillars under pressure: axisymmetric finite elements with contact, and the capacitance.

The cell between four mirrors becomes a round one of the same area, and so does each section of a body. Solved and
checked as press2d does.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from math import atan, ceil, pi, sqrt

import numpy as np
import shapely

from sensorgen.core.errors import BadInput
from sensorgen.models import curved, press2d, refusal
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness, Pressed
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import SLIVER_MM, Piece, Point, Scene
from sensorgen.solvers.contact.cell import AIR, ContactCell, Region, partition
from sensorgen.solvers.contact.mesh import grown
from sensorgen.solvers.electrostatics.bounds import third_conductor
from sensorgen.solvers.electrostatics.round_cell import ProfileEdge, profile

SOURCE = "axisymmetric cell of the same area; " + press2d.SOURCE
COST = 2

USUAL = Fineness(apex_mm=4e-3, corner_mm=0.04, coarse_mm=0.08, growth=0.25)

AREA_ERROR = 0.05  # of displacement and rise by a round cell and sections: at most 4.4 % were seen [-]

_SAME_MM = 1e-6
_BEYOND = 0.12  # of a section, outside a disc of its area: 0.091 of a square [-]
_DIGITS = 9  # of a place [mm]
_BENT = 1e-4  # of a radius, by which a flank may be bent [-]
_TURN = 0.1  # longest chord of an arc that does not end on the axis [rad]
_WANTED = "an axisymmetric cell is needed"


def why_not_applicable(scene: Scene) -> str | None:
    """Why this model does not apply to a scene, or None."""
    return refusal(BadInput, cell, scene)


def press(
    scene: Scene,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    boundary: BoundaryConditions | None = None,
    fineness: Fineness = USUAL,
    step: Callable[[float], None] | None = None,
) -> Pressed:
    """Solve the cell of a scene under pressure on its top.

    Parameters
    ----------
    scene : Scene
        For which :func:`why_not_applicable` is None.
    solids, stress_pa, permittivity, boundary, fineness, step
        As of :func:`sensorgen.models.press2d.press`.

    Raises
    ------
    OutOfRange, MissingValue
        As :func:`sensorgen.models.press2d.press`.
    BadInput
        The scene has no round cell.
    """
    pressed = press2d.press(cell(scene, fineness), solids, stress_pa, permittivity, boundary, fineness, step)
    return replace(pressed, source=SOURCE)


def cell(scene: Scene, fineness: Fineness = USUAL) -> ContactCell:
    """The cell of a scene as a section through its axis; arcs are chords that grow from the axis on.

    Raises
    ------
    BadInput
        Sections of a body, or the cell, are neither nearly square nor nearly round about one axis.
    """
    if reason := third_conductor(scene):
        raise BadInput(f"{_WANTED}: {reason}")
    try:
        window, _ = curved.cell(scene)
    except ValueError as error:
        raise BadInput(f"{_WANTED}: {error}") from None
    (x0, y0, z0), (x1, y1, _) = window.low_mm, window.high_mm
    inner = _inner(scene, (x0, x1), (y0, y1))
    z1 = max(p.span("z")[1] for p in inner)  # of isolation and block, too
    why = ""
    for (x, across), (y, along) in product(*([(a, 2), ((a + b) / 2, 1), (b, 2)] for a, b in ((x0, x1), (y0, y1)))):
        plan = _Plan(shapely.box(x0, y0, x1, y1), (x, y), across * along)
        try:
            whole = _regions(scene, inner, plan, fineness)
        except BadInput as error:
            why = why or str(error)
            continue
        return _whole(whole, shapely.box(*np.round([0.0, z0, plan.radius_mm(plan.box), z1], _DIGITS)))
    raise BadInput(f"{_WANTED}: {why}")


def _inner(scene: Scene, x_mm: Point, y_mm: Point) -> list[Piece]:
    """Pieces that have a part between two places along x and along y [mm]."""
    ends = {"x": x_mm, "y": y_mm}
    shared = [min(min(p.span(n)[1], b) - max(p.span(n)[0], a) for n, (a, b) in ends.items()) for _, p in scene.pieces]
    return [p for (_, p), of in zip(scene.pieces, shared, strict=True) if of > SLIVER_MM]


def _whole(regions: dict[Region, shapely.Geometry], box: shapely.Polygon) -> ContactCell:
    """A cell of regions in a box, whose electrodes reach its end."""
    if any(box.bounds[2] - of.bounds[2] > _SAME_MM for region, of in regions.items() if region.terminal):
        raise BadInput(f"{_WANTED}: an electrode ends before the cell does")
    return partition(regions, box, turned=True)


@dataclass(frozen=True)
class _Plan:
    """A cell in plan [mm], its axis, and how many such parts go around it: 1, 2 or 4."""

    box: shapely.Polygon
    axis: Point
    parts: int

    def radius_mm(self, section: shapely.Geometry) -> float:
        """Radius of a disc as large as all parts of a section in the cell [mm]."""
        return sqrt(self.parts * section.area / pi)


def _regions(scene: Scene, near: Sequence[Piece], plan: _Plan, fineness: Fineness) -> dict[Region, shapely.Geometry]:
    """Regions of a scene's solids in radius and height, of the pieces in its cell [mm]."""
    outlines: dict[Region, list[shapely.Polygon]] = {}
    for body in scene.bodies:
        pieces = [piece for piece in body.pieces if piece in near]
        if pieces and body.material != AIR:
            own = outlines.setdefault(Region(body.material, body.terminal), [])
            own += [shapely.Polygon(np.round(o, _DIGITS)) for o in _outlines(pieces, plan, fineness)]
    return {region: shapely.union_all(own) for region, own in outlines.items()}


def _outlines(pieces: Sequence[Piece], plan: _Plan, fineness: Fineness) -> list[list[Point]]:
    """Outlines of a body in radius and height [mm]."""
    outlines: list[list[Point]] = []
    flat: list[Piece] = []
    for piece in pieces:
        if not isinstance(piece, Revolved):
            flat.append(piece)
            continue
        corners = [place for edge in profile(piece) for place in _chords(edge, fineness)]
        axis, reach = shapely.Point(piece.x_mm, piece.y_mm), max(corners)[0]
        start, end = np.array(plan.box.bounds).reshape(2, 2)
        room = np.maximum(end - plan.axis, plan.axis - start).min()
        if axis.distance(shapely.Point(plan.axis)) > _SAME_MM or reach > room + _SAME_MM:
            raise BadInput("a body of revolution is not about the cell's axis, or reaches beyond it")
        outlines.append(corners)
    return [*outlines, *_frusta(flat, plan)]


def _frusta(pieces: Sequence[Piece], plan: _Plan) -> Iterator[list[Point]]:
    """Outlines of bodies with flat faces, as wide at each height as round ones of their area [mm]."""
    for low, high in pairwise(sorted({z for piece in pieces for z in piece.levels_mm()})):
        first, middle, last = (_radius(pieces, plan, low + share * (high - low)) for share in (0.25, 0.5, 0.75))
        if abs(first + last - 2 * middle) > _BENT * middle:
            raise BadInput("a body's flanks are not straight")
        if middle:
            a, b = (middle + end * (last - first) for end in (-1, 1))
            yield [(0.0, low), (a, low), (b, high), (0.0, high)]


def _radius(pieces: Sequence[Piece], plan: _Plan, z_mm: float) -> float:
    """Radius of a disc as large as a body's section at a height [mm]."""
    section = shapely.union_all([shapely.Polygon(o) for piece in pieces for o in piece.cut("z", z_mm)]) & plan.box
    radius = plan.radius_mm(section)
    if radius < _SAME_MM:
        return 0.0
    if (section - shapely.Point(plan.axis).buffer(radius, 64)).area > _BEYOND * section.area:
        raise BadInput("a body or the cell is neither nearly square nor nearly round about one axis")
    return radius


def _chords(edge: ProfileEdge, fineness: Fineness) -> list[Point]:
    """Places along an edge of a profile without its last, closest at an end on the axis [mm]."""
    if not edge.bulge:
        return [edge.start]
    (_, radius), turn = edge.circle(), 4 * abs(atan(edge.bulge))
    from_axis = grown(turn * radius, fineness.apex_mm, fineness) / (turn * radius)
    if edge.start[0] < _SAME_MM:
        shares = np.append(0.0, from_axis[:-1])
    elif edge.end[0] < _SAME_MM:
        shares = 1 - from_axis[::-1]
    else:
        shares = np.linspace(0, 1, ceil(turn / _TURN) + 1)[:-1]
    return [(r, z) for r, z in edge.at(shares).tolist()]
