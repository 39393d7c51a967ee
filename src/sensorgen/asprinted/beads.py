"""Lines of G-code that print a design: where they lie in a file, the body of each, and the polygons that they fill.

A file is known by its tools and its size, wherever it prints on the bed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.checks.estimate import ROUND
from sensorgen.core.arrays import ColumnRecord, Real, Whole, parts_of
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.design.design import Design
from sensorgen.export.gcode.motion import Paths, follow, paths_of
from sensorgen.export.gcode.moves import Motion
from sensorgen.export.gcode.reading import Source
from sensorgen.scene.connections import groups
from sensorgen.scene.layers import LayerRegions, Region, cleaned, drawn, parts
from sensorgen.scene.scene import SLIVER_MM, Point

CONVENTIONS = ("vol", "deposit", "stadium")
FULL = 0.95  # a plate of which this share is filled has no holes but between rounded lines
_CUTS = (-0.37, -0.2, 0.0, 0.17, 0.41)  # places of the cuts, in shares of a tenth of the sensor, from its middle
_OF_AREA, _STEPS = 1e-3, 8  # to which an area is met, and steps that it may take
_MITRE = 5.0  # widths, at which a mitre is cut
_TURNS = [np.array([[c, s], [-s, c]]) for c, s in ((1, 0), (0, 1), (0.5**0.5, 0.5**0.5), (0.5**0.5, -(0.5**0.5)))]
_LOT = 100  # lines that are united at once
_LEVEL_MM = 0.01  # a line belongs to a layer whose top it is this near


@dataclass(frozen=True, eq=False)
class Beads(ColumnRecord):
    """The lines of one piece, from its corner [mm]; ``body`` counts in the bodies of its scene.

    Attributes
    ----------
    start_mm, end_mm : (n, 2) array
        In plan.
    width_mm, height_mm : (n,) array
        Width that keeps the volume in a rectangle of the layer's height, and that height.
    volume_mm3 : (n,) array
        What the line takes.
    layer, body, tool : (n,) array of int
        Layer from 0, body, and the printer's own number of the tool [-].
    number : (n,) array of int
        Line of the file, from 1 [-].
    """

    start_mm: Real
    end_mm: Real
    width_mm: Real
    height_mm: Real
    volume_mm3: Real
    layer: Whole
    body: Whole
    tool: Whole
    number: Whole

    def corners_mm(self, convention: str, longer: float = 1.0) -> Real:
        """Each line as a rectangle in plan, (n, 4, 2): ``longer`` widths longer, wide by a convention [mm]."""
        middle, way = (self.start_mm + self.end_mm) / 2, self.end_mm - self.start_mm
        length = np.hypot(*way.T)
        along = way * ((length + longer * self.width_mm) / (2 * length))[:, None]
        aside = way[:, ::-1] * [-1, 1] * (self.widths_mm(convention) / (2 * length))[:, None]
        corners = (middle + along + aside, middle + along - aside, middle - along - aside, middle - along + aside)
        return np.stack(corners, axis=1)

    def widths_mm(self, convention: str) -> Real:
        """Width of each line by a convention [mm]."""
        return self.width_mm + ROUND * self.height_mm if convention == "stadium" else self.width_mm


def beads(design: Design, paths: "Paths", centre_mm: Point | None = None, *, cut: bool = True) -> Beads:
    """The lines that print a design, each given to the body that it belongs to.

    Parameters
    ----------
    design : Design
        That was sliced.
    paths : Paths
        Lines of the file, with the printer's own tool numbers.
    centre_mm : (float, float), optional
        Middle of the piece on the printer's bed [mm]; the middle of the bed if not given.
    cut : bool
        Cut lines at the piece's outline, since some run on into a tab; else each is of the piece or not, by its
        middle.
    """
    scene, machine = design.printed, design.machine
    corner = np.array(centre_mm or machine.bed_centre_mm()) - np.array(scene.size_mm[:2]) / 2
    model = paths.model()
    ends = [p[:, :2] - corner for p in (model.start_mm, model.end_mm)]
    share = np.ones(len(model.tool))
    if cut:
        ends, share = _inside(ends[0], ends[1], np.array(scene.size_mm[:2]))
    tools = {design.tool(body.material) for body in scene.bodies}
    heights = np.array(design.layers.boundaries_mm(scene.size_mm[2]))
    layer = np.abs(model.end_mm[:, 2, None] - heights[1:]).argmin(1)
    here = np.abs(model.end_mm[:, 2] - heights[1:][layer]) < _LEVEL_MM
    # Lines run half a line inside their body: what touches the piece from outside, as a tab, is half a line away.
    middle, margin = (ends[0] + ends[1]) / 2, machine.line_mm() / 4
    here &= ((middle > -margin) & (middle < np.array(scene.size_mm[:2]) + margin)).all(1)
    here &= np.isin(model.tool, sorted(tools))
    height = np.diff(heights)[layer]
    volume = model.volume_mm3(machine.filament_mm) * share
    here &= share > 0
    width = model.volume_mm3(machine.filament_mm) / (model.length_mm() * height)
    body = _owners(design, model.tool, layer, middle)
    columns = (*ends, width, height, volume, layer, body, model.tool, model.number)
    return Beads(*(c[here] for c in columns))


def _owners(design: Design, tool: Whole, layer: Whole, middle_mm: Real) -> Whole:
    """Body of each line: of its tool's, the one that is drawn nearest to its middle in its layer, or near it."""
    scene = design.printed
    layers = drawn(scene, design.layers.boundaries_mm(scene.size_mm[2]))
    body = np.zeros(len(tool), np.int64)
    for one in {design.tool(body.material) for body in scene.bodies}:
        mine = {body.name: k for k, body in enumerate(scene.bodies) if design.tool(body.material) == one}
        for number in np.unique(layer[tool == one]):
            rows = np.flatnonzero((tool == one) & (layer == number))
            near = sorted(layers, key=lambda each: abs(each.bottom_mm - layers[number].bottom_mm))
            each = next(each for each in near if mine.keys() & each.regions.keys())
            shown = {mine[name]: region for name, region in each.regions.items() if name in mine}
            body[rows] = _nearest(shown, middle_mm[rows])
    return body


def _nearest(regions: Mapping[int, Region], places_mm: Real) -> Whole:
    """Number of the region that is nearest to each place, (n,)."""
    if len(regions) == 1:
        return np.full(len(places_mm), next(iter(regions)))
    pieces = [parts(region) for region in regions.values()]
    owners = np.repeat([*regions], [len(each) for each in pieces])
    return np.asarray(owners[shapely.STRtree([*chain.from_iterable(pieces)]).nearest(shapely.points(places_mm))])


def _inside(start_mm: Real, end_mm: Real, size_mm: Real) -> tuple[list[Real], Real]:
    """Ends of lines cut at a rectangle from the origin, and the share of each that is left (Liang and Barsky, 1984)."""
    way = end_mm - start_mm
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.stack([-start_mm / way, (size_mm - start_mm) / way])
    first = np.nan_to_num(at.min(0), nan=0.0, neginf=0.0, posinf=1.0).max(1).clip(0.0, 1.0)
    last = np.nan_to_num(at.max(0), nan=1.0, neginf=0.0, posinf=1.0).min(1).clip(0.0, 1.0)
    share = (last - first).clip(0.0)
    return [start_mm + first[:, None] * way, start_mm + (first + share)[:, None] * way], share


def layers(
    design: Design,
    lines: Beads,
    convention: str = "vol",
    *,
    electrode_wins: bool = False,
) -> list[LayerRegions]:
    """Regions of every layer of a print.

    Parameters
    ----------
    design : Design
        That was printed.
    lines : Beads
        Its lines.
    convention : str
        How wide a line is: "vol", as a rectangle of its volume; "stadium", at the widest point of a round bead;
        "deposit", lines that overlap pushed apart until their volume has room.
    electrode_wins : bool
        Whether a place that two tools fill goes to the electrode; else to the tool that comes first.

    Raises
    ------
    UnknownName
        No such convention.

    Notes
    -----
    A layer that is drawn as strips is cut across near the middle of the sensor, and the median cut is taken along the
    whole strip. Of any other layer the union of all lines is taken; the outline of each separate part is moved until
    its area is what its lines deposit: round ends of short lines would double a small tip. There "vol" and "deposit"
    are one. Slits are closed that are no wider than a line of the file's width is over one of its volume.
    """
    if convention not in CONVENTIONS:
        raise UnknownName("convention for a line's width", convention, CONVENTIONS)
    scene, printed = design.printed, []
    for number, layer in enumerate(drawn(scene, design.layers.boundaries_mm(scene.size_mm[2]))):
        here, cover = lines.of(lines.layer == number), _strips if layer.along else _union
        bodies, regions = np.unique(here.body).tolist(), dict[str, Region]()
        # As they are printed, tool by tool.
        first = {k: here.number[here.tool == here.tool[here.body == k][0]].min() for k in bodies}
        for k in sorted(bodies, key=lambda k: (electrode_wins and not scene.bodies[k].terminal, first[k], k)):
            name = scene.bodies[k].name
            mine = here.of(here.body == k)
            filled = cover(mine, layer, scene.size_mm, convention)
            if layer.along and len(plan := parts(layer.region(name))) == 1:
                most = max(filled.area, float((mine.volume_mm3 / mine.height_mm).sum()))
                filled = plan[0] if most > FULL * scene.size_mm[0] * scene.size_mm[1] else filled
            regions[name] = _rest(filled, tuple(regions.values()))
        printed.append(layer.mapped(regions))
    return printed


@lru_cache(maxsize=128)
def _rest(region: Region, others: tuple[Region, ...]) -> Region:
    """Region without others; conventions that differ in strips alone ask for the same."""
    if not others:
        return cleaned(region)
    return cleaned(shapely.difference(region, others[0] if len(others) == 1 else shapely.union_all(others)))


def _strips(lines: Beads, layer: LayerRegions, size_mm: Sequence[float], convention: str) -> Region:
    """The median of some cuts near the middle, along the whole sensor."""
    axis, slit = "yx".index(layer.along), ROUND * layer.height_mm
    long, end = size_mm[1 - axis], size_mm[axis]
    cuts = [_cut(lines, axis, long / 2 + share * long / 10, convention, slit).clip(0.0, end) for share in _CUTS]
    low, high = sorted(cuts, key=lambda cut: float(np.diff(cut).sum()))[len(cuts) // 2].T
    return shapely.multipolygons(shapely.box(low, 0.0, high, long) if axis == 0 else shapely.box(0.0, low, long, high))


def _cut(lines: Beads, axis: int, at_mm: float, convention: str, slit_mm: float) -> Real:
    """Runs along an axis, (n, 2), in which a line square to it meets the beads, without slits up to a width [mm]."""
    runs = _merged(_runs(lines.corners_mm(convention), axis, at_mm), slit_mm)
    if convention == "deposit" and len(runs):
        met = _runs(lines.corners_mm(convention, 0.0), axis, at_mm)  # ends that reach over the next line count once
        owner = (np.searchsorted(runs[:, 0], met.mean(1)) - 1).clip(0)
        taken = np.bincount(owner, np.diff(met)[:, 0], len(runs))
        runs = _merged(runs + (taken - np.diff(runs)[:, 0]).clip(0.0)[:, None] / 2 * [-1, 1], slit_mm)
    return runs


def _runs(corners_mm: Real, axis: int, at_mm: float) -> Real:
    """Runs along an axis, (n, 2), in which a line square to it meets rectangles, (m, 4, 2) [mm]."""
    u, v = corners_mm[:, :, axis], corners_mm[:, :, 1 - axis] - at_mm
    u_next, v_next = np.roll(u, -1, axis=1), np.roll(v, -1, axis=1)
    crossed = (v < 0) != (v_next < 0)
    met = u + v / np.where(crossed, v - v_next, 1.0) * (u_next - u)
    hit = crossed.any(1)
    runs = np.stack([np.where(crossed, met, np.inf).min(1), np.where(crossed, met, -np.inf).max(1)], axis=1)
    return np.asarray(runs[hit])


def _merged(runs: Real, slit_mm: float) -> Real:
    """Union of runs, (n, 2), and of the slits between them up to a width [mm]."""
    runs = runs[runs[:, 0].argsort()]
    if not len(runs):
        return runs
    reach = np.maximum.accumulate(runs[:, 1])
    starts = np.flatnonzero(np.append(True, runs[1:, 0] > reach[:-1] + slit_mm))
    return np.column_stack([runs[starts, 0], reach[np.append(starts[1:], len(runs)) - 1]])


def _union(lines: Beads, layer: LayerRegions, size_mm: Sequence[float], convention: str) -> Region:
    """All lines with round ends, slits between touching ones closed, each part as large as its lines' deposit."""
    slit = ROUND * layer.height_mm
    columns = (lines.start_mm, lines.end_mm, lines.width_mm[:, None], (lines.volume_mm3 / lines.height_mm)[:, None])
    whole = _whole(np.hstack(columns).tobytes(), slit, slit / 2 if convention == "stadium" else 0.0)
    return shapely.clip_by_rect(whole, 0.0, 0.0, size_mm[0], size_mm[1])


@lru_cache(maxsize=128)
def _whole(lines: bytes, slit_mm: float, grown_mm: float) -> Region:
    """Union of the parts of one body's lines in a layer, each grown by some length; arguments as of ``_parts``."""
    plans = _parts(lines, slit_mm)
    grown = shapely.buffer(plans, grown_mm, join_style="mitre") if grown_mm else plans
    return grown[0] if len(grown) == 1 else shapely.union_all(grown)


@lru_cache(maxsize=128)
def _parts(lines: bytes, slit_mm: float) -> NDArray[np.object_]:
    """Separate parts of one body's lines in a layer, each as large as its lines' deposit.

    Parameters
    ----------
    lines : bytes
        Of an (n, 6) array: start, end, width [mm] and area of the deposit [mm2]. Layers repeat, and each is asked for
        by every convention.
    slit_mm : float
        Width of slits that are closed [mm].
    """
    start, end, wide, area = np.split(np.frombuffer(lines).reshape(-1, 6), (2, 4, 5), axis=1)
    plans = shapely.buffer(shapely.linestrings(np.stack([start, end], axis=1)), wide[:, 0] / 2 + slit_mm, quad_segs=4)
    pieces = np.array(parts(_narrowed(plans, slit_mm, end - start)), dtype=object)
    middle, owner = shapely.points((start + end) / 2), np.full(len(start), -1)
    inside, line = shapely.STRtree(middle).query(pieces, predicate="intersects")  # far sooner than the nearest piece
    owner[line] = inside
    owner[owner < 0] = shapely.STRtree(pieces).nearest(middle[owner < 0])
    deposit: Real = np.bincount(owner, area[:, 0], len(pieces)).astype(float)
    return _offset(pieces, deposit)


def _narrowed(plans: NDArray[np.object_], by_mm: float, ways_mm: Real) -> Region:
    """Union of plans without holes, its outline moved in: by Clipper, in a tenth of the time of GEOS [mm].

    Plans that are drawn wider by as much touch across slits, which so close: half the time of a union with its slits,
    which is widened and then narrowed. Clipper sweeps along y, in a time that grows with the edges that it meets at
    once: plans are turned by a multiple of 45 degrees, so that most ``ways_mm`` (n, 2), in which they are long, lie
    across, and united in lots.
    """
    from manifold3d import CrossSection, FillRule, JoinType, OpType

    turn = min(_TURNS, key=lambda turn: float(np.abs(ways_mm @ turn[:, 1]).sum()))
    ends = np.cumsum(shapely.get_num_coordinates(plans))[:-1]
    rings = [ring[:-1] for ring in np.split(shapely.get_coordinates(shapely.reverse(plans)) @ turn, ends) if len(ring)]
    lots = [CrossSection(rings[k : k + _LOT], FillRule.NonZero) for k in range(0, len(rings), _LOT)]
    region = CrossSection.batch_boolean(lots, OpType.Add).offset(-by_mm, JoinType.Miter, _MITRE)
    outlines = ([ring @ turn.T for ring in part.to_polygons()] for part in region.decompose())
    return shapely.multipolygons([shapely.Polygon(outer, holes) for outer, *holes in outlines])


def _offset(pieces: NDArray[np.object_], area_mm2: Real) -> NDArray[np.object_]:
    """Polygons with their outlines moved until they have some areas [mm2]."""
    offset, moved = np.zeros(len(pieces)), pieces.copy()
    for _ in range(_STEPS):  # of Newton's method: the length of the outline is the slope of the area
        away = np.abs(shapely.area(moved) - area_mm2) > _OF_AREA * area_mm2
        step = (area_mm2 - shapely.area(moved)) / np.maximum(shapely.length(moved), SLIVER_MM)
        offset[away] += step[away]
        moved[away] = shapely.buffer(pieces[away], offset[away], join_style="mitre")
    return moved


APART_MM = 1.5  # pieces on a plate are further apart; lines of one piece are nearer
_CELL_MM, _FAR_MM = APART_MM / 2, 1000.0
WITHIN_MM = 0.8  # by which a piece may be larger or smaller than the design: walls and seams


@dataclass(frozen=True, eq=False)
class PlacedPiece:
    """A piece of a design in a file, whose lines are turned to the design's own directions.

    Attributes
    ----------
    paths : Paths
        All lines of the file, with the printer's own tool numbers.
    centre_mm : (float, float)
        Middle of the piece among these lines [mm].
    bed_mm : (float, float)
        The same on the bed, as the file has it [mm].
    copies : int
        Pieces of the design's size in the file.
    """

    paths: Paths
    centre_mm: Point
    bed_mm: Point
    copies: int


def placed(design: Design, source: Source) -> PlacedPiece:
    """The first piece of a design in a file of G-code.

    Parameters
    ----------
    design : Design
        That was sliced, by whatever slicer.
    source : Path, bytes or iterable of str
        The file, alone or with others on a plate, as it is or turned by 90 degrees.

    Raises
    ------
    BadInput
        No G-code, or none of this design; see :func:`pieces`.
    """
    return pieces(design, follow(source, design.machine.control.prime_macro))[0]


def pieces(design: Design, motion: Motion) -> list[PlacedPiece]:
    """All pieces of a design in a file of G-code, straight and turned by 90 degrees.

    Parameters
    ----------
    design : Design
        That was sliced, by whatever slicer.
    motion : Motion
        The file.

    Raises
    ------
    BadInput
        Other tools than the design's, or no piece of its size; with the sizes that there are.
    """
    paths = _of_tools(design, motion)
    model = paths.model()
    mine = np.isin(model.tool, _tools(design))
    low, high = (of(model.start_mm[mine, :2], model.end_mm[mine, :2]) for of in (np.minimum, np.maximum))
    group = connected(model.start_mm[mine, :2], model.end_mm[mine, :2])
    boxes = [np.array([low[group == k].min(0), high[group == k].max(0)]) for k in np.unique(group).tolist()]
    size = np.array(design.printed.size_mm[:2]) - design.machine.line_mm()  # lines run half a line inside
    off = np.array([[abs(box[1] - box[0] - wanted).max() for wanted in (size, size[::-1])] for box in boxes])
    fits = (off < WITHIN_MM).any(1) if len(boxes) else np.zeros(0, bool)
    if not fits.any():
        raise _other_sizes(design, boxes, off.min(initial=np.inf))
    straight, count, found = off[:, 0] < WITHIN_MM, int(fits.sum()), []  # a square one counts as straight
    turned = paths if straight[fits].all() else _turned(paths)
    for k in np.flatnonzero(fits).tolist():
        x, y = boxes[k].mean(0).tolist()
        found.append(
            PlacedPiece(paths, (x, y), (x, y), count) if straight[k] else PlacedPiece(turned, (y, -x), (x, y), count)
        )
    return found


def _other_sizes(design: Design, boxes: Sequence[Real], off_mm: float) -> BadInput:
    """Error of a file whose pieces (2, 2) are none of a design's size."""
    line = design.machine.line_mm()
    there = "; ".join(
        f"{w + line:.4g} x {h + line:.4g} mm at x {x:.4g}, y {y:.4g} on the bed"
        for (w, h), (x, y) in sorted({(tuple(b[1] - b[0]), tuple(b.mean(0))) for b in boxes})[:3]
    )
    length, width, _ = design.printed.size_mm
    return BadInput(
        f"no piece of {length:g} x {width:g} mm, as {design.name}, in this G-code; it prints {there}, off by "
        f"{off_mm:.3g} mm at least: was it sliced from this design, straight or turned by 90 degrees?"
    )


def _tools(design: Design) -> list[int]:
    return sorted({design.tool(body.material) for body in design.printed.bodies})


def _of_tools(design: Design, motion: Motion) -> Paths:
    """The file's lines, its tools counted as the printer does, or from 0 as a slicer's own file does."""
    wanted = set(_tools(design))
    used: list[set[int]] = []
    for numbering in ("printer", "slicer"):
        paths = paths_of(motion, design.machine, numbering)
        used.append(set(paths.model().tool.tolist()))
        if wanted <= used[-1]:
            return paths
    raise BadInput(
        f"tools {sorted(used[0])} print in this G-code; expected {sorted(wanted)}, those of {design.name}: --tool "
        "MATERIAL=NUMBER says which tool has a material"
    )


def connected(start_mm: Real, end_mm: Real) -> Whole:
    """Number of the connected group of each line in plan: lines of a group have no gap of ``APART_MM`` between them."""
    start_mm, end_mm = (np.clip(place, -_FAR_MM, _FAR_MM) for place in (start_mm, end_mm))
    way = end_mm - start_mm
    count = np.maximum(np.ceil(np.abs(way).max(1) / _CELL_MM), 1).astype(np.int64) + 1
    which, step = parts_of(count)
    share = step / (count[which] - 1)
    cell = np.floor((start_mm[which] + share[:, None] * way[which]) / _CELL_MM).astype(np.int64)
    x, y = (cell - cell.min(0, initial=0)).T
    column = y.max(initial=0) + 2
    filled, at = np.unique(x * column + y, return_inverse=True)
    beside = filled + np.array([[1], [column - 1], [column], [column + 1]])
    near = np.searchsorted(filled, beside).clip(max=len(filled) - 1)
    touch = filled[near] == beside
    return np.asarray(groups(len(filled), touch.nonzero()[1], near[touch])[at[np.cumsum(count) - count]])


def _turned(paths: Paths) -> Paths:
    """The lines turned by -90 degrees about the origin: x becomes -y."""
    turn: Sequence[Real] = [
        np.column_stack([p[:, 1], -p[:, 0], p[:, 2]]) for p in (paths.start_mm, paths.end_mm)
    ]  # fmt: skip
    return replace(paths, start_mm=turn[0], end_mm=turn[1])
