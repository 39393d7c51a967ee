"""Through-holes of a printed film: percolation of what its lines leave open, layer by layer.

Lines are stadiums, as round as their layer is high and without squeeze, which a real nozzle does: the figures compare
films, they predict no print.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
import shapely
from shapely import Polygon

from sensorgen.asprinted.beads import Beads, beads
from sensorgen.asprinted.printed import SHIFT_MM
from sensorgen.core.arrays import Real
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.findings import Finding
from sensorgen.design.design import Design
from sensorgen.export.gcode.motion import Paths
from sensorgen.scene.connections import groups
from sensorgen.scene.layers import Region, drawn, parts
from sensorgen.scene.scene import Point

WIDTHS = (1.0, 0.95, 0.9)  # of the lines, of what the file says
_WHOLE = 0.99  # share of the plan that a film covers
_EDGE_MM = 1.0
_LEAST_MM2 = 1e-6  # smaller is rounding
HOLE_MM2 = 4e-4  # 0.02 mm square: smaller is less than 5 % of a line 0.4 mm wide, which no width is known to
MOST_LAYERS = 2  # of a film that a slice is searched for


@dataclass(frozen=True, eq=False)
class CoveredFilm:
    """Layers that dielectrics cover from edge to edge, between electrodes.

    Attributes
    ----------
    plan : Region
        Inside the middle of its outermost lines [mm].
    numbers : tuple of int
        Its layers, from 1 at the bed [-].
    span_mm : (float, float)
        From which height to which.
    lines : tuple of Beads
        Lines of each layer.
    """

    plan: Region
    numbers: tuple[int, ...]
    span_mm: tuple[float, float]
    lines: tuple[Beads, ...]


@dataclass(frozen=True)
class OpenPlaces:
    """Open places of a film at one width of its lines."""

    film: Annotated[str, Column("film")]
    layers: Annotated[int, Column("layers")]
    width: Annotated[float, Column("line width", "", "of what the file says")]
    open_percent: Annotated[float, Column("open", "%", "of the most open layer")]
    through_percent: Annotated[float, Column("through", "%", "open from bottom to top, at the narrowest")]
    holes: Annotated[int, Column("through-holes")]
    edge_percent: Annotated[float | None, Column("at the edge", "%", f"of them within {_EDGE_MM:g} mm")]
    largest_mm2: Annotated[float, Column("largest", "mm2")]
    x_mm: Annotated[float | None, Column("x", "mm", "of the largest, from the sensor's corner")]
    y_mm: Annotated[float | None, Column("y", "mm")]


@dataclass(frozen=True)
class Pinholes:
    """Through-holes of the films of a print, in a model of round lines.

    Attributes
    ----------
    design : str
        Name of the design.
    rows : tuple of OpenPlaces
        By film and width.
    """

    design: str
    rows: tuple[OpenPlaces, ...]

    def document(self) -> Iterator[Part]:
        """The table."""
        if not self.rows:
            yield f"{self.design} has no film between electrodes."
            return
        yield Table.of(
            "pinholes", "Through-holes of the film; round lines without squeeze: to compare films", self.rows
        )


def films(design: Design, lines: Beads) -> list[CoveredFilm]:
    """The films of a print: runs of layers that dielectrics cover, with electrodes of other terminals beyond them."""
    scene = design.printed
    metal = np.array([bool(body.terminal) for body in scene.bodies])[lines.body]
    plates = drawn(scene, design.layers.boundaries_mm(scene.size_mm[2]))
    plan = scene.size_mm[0] * scene.size_mm[1]
    dielectrics = [body.name for body in scene.bodies if not body.terminal]
    whole = [sum(layer.region(name).area for name in dielectrics) > _WHOLE * plan for layer in plates]
    lowest, highest = lines.layer[metal].min(initial=len(plates)), lines.layer[metal].max(initial=-1)
    runs = []
    for run in np.split(np.arange(len(plates)), np.flatnonzero(np.diff(whole)) + 1):
        layers = run.tolist()
        if not whole[layers[0]] or not lowest < layers[0] <= layers[-1] < highest:
            continue
        own = [lines.of((lines.layer == k) & ~metal) for k in layers]
        margin = design.machine.line_mm() / 2
        inside = shapely.box(margin, margin, scene.size_mm[0] - margin, scene.size_mm[1] - margin)
        span = plates[layers[0]].bottom_mm, plates[layers[-1]].top_mm
        runs.append(CoveredFilm(inside, tuple(range(layers[0] + 1, layers[-1] + 2)), span, tuple(own)))
    return runs


def opened(film: CoveredFilm, widths: Sequence[float], shifts_mm: Sequence[Point] = ()) -> list[Region]:
    """Openings of each layer of a film, its lines as wide as a share of what the file says, and shifted [mm]."""
    openings = []
    for k, (lines, width) in enumerate(zip(film.lines, widths, strict=True)):
        shift = np.array(shifts_mm[k] if shifts_mm else (0.0, 0.0))
        ways = shapely.linestrings(np.stack([lines.start_mm + shift, lines.end_mm + shift], axis=1))
        filled = shapely.union_all(shapely.buffer(ways, lines.widths_mm("stadium") * width / 2, quad_segs=4))
        openings.append(shapely.difference(film.plan, filled))
    return openings


def through(layers: Sequence[Region]) -> list[Polygon]:
    """Through-holes: the narrowest places of every path of open places from the lowest to the highest layer.

    Open places of neighbouring layers are connected where they overlap, and a path may run within a layer. Of a
    connected set of them the overlaps between those two layers count where they have the least area together.
    """
    pieces = [[p for p in parts(layer) if p.area > _LEAST_MM2] for layer in layers]
    holes = pieces[0] if len(layers) == 1 else _narrowest(pieces)
    return [hole for hole in holes if hole.area > HOLE_MM2]


def _narrowest(pieces: Sequence[Sequence[Polygon]]) -> list[Polygon]:
    """Narrowest places of every path through the open places of two layers or more."""
    first = np.cumsum([0, *map(len, pieces)])
    throats = []  # between two layers: overlaps, and the open places that each connects
    for k, (lower, upper) in enumerate(pairwise(pieces)):
        below, above = (np.array(some, object) for some in (lower, upper))
        here, there = shapely.STRtree(above).query(below, predicate="intersects")
        over = shapely.intersection(below[here], above[there])
        wide = shapely.area(over) > _LEAST_MM2
        throats.append((over[wide], np.stack([here[wide] + first[k], there[wide] + first[k + 1]])))
    edges = np.concatenate([ends for _, ends in throats], axis=1)
    of = groups(int(first[-1]), *edges)
    holes = []
    for one in set(of[: first[1]].tolist()) & set(of[first[-2] :].tolist()):
        between = [over[of[ends[0]] == one] for over, ends in throats]
        holes += [p for place in min(between, key=lambda over: shapely.area(over).sum()) for p in parts(place)]
    return holes


def pinholes(
    design: Design,
    paths: Paths,
    centre_mm: Point | None = None,
    *,
    widths: Sequence[float] = WIDTHS,
    most_layers: int = 99,
) -> Pinholes:
    """Find the through-holes of the films of a print.

    Parameters
    ----------
    design, paths, centre_mm : Design, Paths, (float, float)
        As of :func:`sensorgen.asprinted.beads.beads`.
    widths : sequence of float
        Widths of the lines to look at, of what the file says [-].
    most_layers : int
        Films of more layers are left out [-].
    """
    return of_lines(design, beads(design, paths, centre_mm), widths=widths, most_layers=most_layers)


def of_lines(design: Design, lines: Beads, *, widths: Sequence[float], most_layers: int) -> Pinholes:
    """Pinholes by the lines of the piece."""
    thin = [film for film in films(design, lines) if len(film.lines) <= most_layers]
    return Pinholes(design.name, tuple(_row(film, width) for film in thin for width in widths))


def _row(film: CoveredFilm, width: float) -> OpenPlaces:
    layers = opened(film, [width] * len(film.lines))
    holes = sorted(through(layers), key=lambda hole: hole.area)
    plan, area = film.plan.area, sum(hole.area for hole in holes)
    edge = [hole for hole in holes if hole.distance(film.plan.exterior) < _EDGE_MM]
    at = shapely.point_on_surface(holes[-1]) if holes else None
    return OpenPlaces(
        f"{film.span_mm[0]:g} to {film.span_mm[1]:g} mm", len(film.lines), width,
        100 * max(layer.area for layer in layers) / plan, 100 * area / plan, len(holes),
        100 * len(edge) / len(holes) if holes else None, holes[-1].area if holes else 0.0,
        round(at.x, 3) if at else None, round(at.y, 3) if at else None,
    )  # fmt: skip


# Severity, head and advice of a finding about a film of one layer, and of more
_SINGLE = "warning", "one layer: ", "make the film two layers or more: the lines of each cross the slits of the other"
_SEVERAL = "info", "", "one layer more, or more overlap of infill and walls"


def findings(pinholes: Pinholes) -> Iterator[Finding]:
    """Rule 10: a film of one layer, and a film that its lines leave open, with place and figures."""
    for row in pinholes.rows:
        if row.width < 1 or not (row.layers == 1 or row.holes):
            continue
        severity, head, advice = _SINGLE if row.layers == 1 else _SEVERAL
        edge = f", {row.edge_percent:.0f} % of them within {_EDGE_MM:g} mm of the edge" if row.holes else ""
        holes = f"{row.holes} through-holes between its round lines, {row.through_percent:.2g} % of its area{edge}"
        yield Finding(
            "10-film", severity, f"film, {row.film}", f"{head}{holes}", advice,
            place_mm=None if row.x_mm is None or row.y_mm is None else (row.x_mm, row.y_mm, float(row.film.split()[0])),
            count=max(row.holes, 1),
        )  # fmt: skip


def draws(film: CoveredFilm, count: int, seed: int = 23) -> Real:
    """Through-holes in prints whose layers differ in width by up to 5 % and are shifted by ``SHIFT_MM``, (count,)."""
    rng = np.random.default_rng(seed)
    counts = []
    for _ in range(count):
        widths = rng.uniform(0.95, 1.05, len(film.lines)).tolist()
        shifts = [(float(x), float(y)) for x, y in rng.uniform(-SHIFT_MM, SHIFT_MM, (len(film.lines), 2))]
        counts.append(len(through(opened(film, widths, shifts))))
    return np.array(counts, float)
