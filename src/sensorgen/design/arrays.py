"""Rows under columns: tracks that cross at cells of another shape, each with a lead to one edge.

Rows run along x at the bottom, columns along y at the top; every crossing is one cell of the shape that ``cell:``
names. Seen from above (3 rows, 4 columns; leads of rows turn down beside the columns)::

    +---------- r3  |  |  |  |
    | +-------- r2  |  |  |  |
    | | +------ r1  |  |  |  |
    | | |           c1 c2 c3 c4
    # # #           #  #  #  #    pads, open from above

With ``pads: left`` the print is exchanged in x and y.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import ceil
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.effects import TipData
from sensorgen.design.tip import EVEN
from sensorgen.scene.lettering import LINE_DOTS, runs
from sensorgen.scene.scene import (
    SLIVER_MM,
    Body,
    Envelope,
    Fill,
    Move,
    Piece,
    Point,
    Prism,
    Scene,
    box,
    choice,
    parameter,
    rounded,
)

if TYPE_CHECKING:
    import shapely


MOST_CROSSINGS = 10_000  # the mat of Tekscan has 8448
LABEL_MM = 0.2  # by which letters are raised or engraved
DOT_MM = 0.5  # side of the dots of letters: wider than a line of a 0.4 mm nozzle
WALL_MM = 0.9  # two lines: least material around a hole
ENVELOPE = ("length_mm", "width_mm", "electrode_mm", "isolation_mm")  # that the array gives to its cell
_WHOLE = 1e-6
_TRACK, _PERIOD_MM = 0.8, 2.0  # most of a track's width over its pitch, and its step, if not given: cells repeat


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of an array of crossing tracks."""

    length_mm: float = parameter(60.0, "Length of the sensing area, along the rows.", 1.0, 1000.0)
    width_mm: float = parameter(60.0, "Width of the sensing area, along the columns.", 1.0, 1000.0)
    isolation_mm: float = parameter(0.4, "Cover over the columns; 0 leaves it out.", 0.0, 10.0)
    pitch_x_mm: float = parameter(10.0, "Distance from column to column.", 0.5, 200.0)
    pitch_y_mm: float = parameter(10.0, "Distance from row to row.", 0.5, 200.0)
    columns: float = parameter(0.0, "Number of columns, evenly spread; 0: by pitch_x.", 0.0, 1000.0, count=True)
    rows: float = parameter(0.0, "Number of rows, evenly spread; 0: by pitch_y.", 0.0, 1000.0, count=True)
    column_mm: float = parameter(0.0, "Width of a column; 0: four fifths of the pitch, in steps of 2 mm.", 0.0, 200.0)
    row_mm: float = parameter(0.0, "Width of a row; 0: four fifths of the pitch, in steps of 2 mm.", 0.0, 200.0)
    base_mm: float = parameter(0.4, "Isolation under the rows; 0 leaves it out.", 0.0, 10.0)
    connector_mm: float = parameter(2.54, "Distance of the pads, and of the leads.", 0.5, 50.0)
    lead_mm: float = parameter(1.8, "Width of leads and pads.", 0.2, 50.0)
    pad_mm: float = parameter(6.0, "Length of the pads.", 1.0, 50.0)
    margin_mm: float = parameter(2.5, "Edge around tracks and leads.", 0.2, 50.0)
    cover_mm: float = parameter(
        0.0, "Thickness of a sheet that lies on the print and is not printed; 0: none.", 0.0, 50.0
    )
    cover_mpa: float = parameter(3.0, "Young's modulus of that sheet [MPa].", 0.001, 1e5)
    between: str = choice(
        "dielectric", "Between columns above the film: solid dielectric, or air that carries no load.",
        "dielectric", "air",
    )  # fmt: skip
    labels: str = choice(
        "none", "Names of the tracks on their leads: raised, engraved into the cover, or none.",
        "none", "raised", "engraved",
    )  # fmt: skip
    hole_mm: float = parameter(0.0, "Side of two square holes for pins beside the pads; 0 leaves them out.", 0.0, 20.0)
    pads: str = choice(
        "bottom", "Edge of the pads; at the left the print is exchanged in x and y, so that rows run along y.",
        "bottom", "left",
    )  # fmt: skip
    seams: str = choice(
        "none", "Ends without a margin, where the next tile follows: of the rows, of the columns, or both.",
        "none", "rows", "columns", "both",
    )  # fmt: skip
    seam_mm: float = parameter(
        0.0, "Width of the base that reaches under the next tile, at the end of the columns.", 0.0, 50.0
    )
    tile: float = parameter(0.0, "Number of a tile, before the names on its leads.", 0.0, 999.0, count=True)

    def __post_init__(self) -> None:
        """Fill in widths; refuse tracks that touch, too many crossings, and what the cover or the base lacks."""
        for name, pitch_mm in zip(("column_mm", "row_mm"), self.pitch, strict=True):
            usual_mm = _TRACK * pitch_mm
            whole_mm = _PERIOD_MM * int(usual_mm / _PERIOD_MM + _WHOLE)
            object.__setattr__(self, name, getattr(self, name) or whole_mm or usual_mm)
        self._refuse_tracks()
        if self.labels == "engraved" and self.isolation_mm < LABEL_MM + SLIVER_MM:
            raise OutOfRange(
                f"labels engraved {LABEL_MM:g} mm into an isolation of {self.isolation_mm:g} mm; expected a thicker "
                "one, or labels: raised"
            )
        if self.ledge_mm and not self.base_mm:
            raise OutOfRange("seam_mm: base_mm is 0, so that nothing reaches under the next tile; expected a base")
        m, n = self.counts
        if min(m, n) < 1:
            raise OutOfRange(
                f"{self.length_mm:g} x {self.width_mm:g} mm has room for {m} rows and {n} columns; expected at least "
                "one of each: use a shorter pitch or a larger area"
            )
        if m * n > MOST_CROSSINGS:
            raise OutOfRange(f"{m} x {n} crossings; expected at most {MOST_CROSSINGS}: use a longer pitch")

    def _refuse_tracks(self) -> None:
        """Refuse tracks and leads that touch, and numbers of them that are not whole."""
        for side, pitch, track in (("column", self.pitch[0], self.column_mm), ("row", self.pitch[1], self.row_mm)):
            if track >= pitch - SLIVER_MM:
                raise OutOfRange(
                    f"{side}_mm {track:g} leaves no space between {side}s at a pitch of {pitch:.6g} mm; expected less"
                )
        if self.lead_mm >= self.connector_mm:
            raise OutOfRange(
                f"lead_mm {self.lead_mm:g} leaves no space between leads at connector_mm {self.connector_mm:g}; "
                "expected less"
            )
        for key in ("rows", "columns"):
            if getattr(self, key) != round(getattr(self, key)):
                raise OutOfRange(f"{key} is {getattr(self, key):g}; expected a whole number")

    @property
    def counts(self) -> tuple[int, int]:
        """Rows and columns of the rectangle."""
        along = (self.columns, self.length_mm, self.pitch_x_mm), (self.rows, self.width_mm, self.pitch_y_mm)
        n, m = (int(count) or int(size / pitch + _WHOLE) for count, size, pitch in along)
        return m, n

    @property
    def pitch(self) -> Point:
        """Distance of the columns, and of the rows [mm]."""
        return (
            self.length_mm / self.columns if self.columns else self.pitch_x_mm,
            self.width_mm / self.rows if self.rows else self.pitch_y_mm,
        )

    def edge(self, ends: str) -> float:
        """Margin at the ends of the rows or of the columns: none where the next tile follows [mm]."""
        return 0.0 if self.seams in (ends, "both") else self.margin_mm

    @property
    def ledge_mm(self) -> float:
        """Width of the base that reaches under the next tile [mm]."""
        return 0.0 if self.edge("columns") else self.seam_mm

    def cells(self) -> float:
        """Number of crossings [-]."""
        m, n = self.counts
        return float(m * n)


@dataclass(frozen=True)
class ArrayTrack:
    """A row or column with its lead.

    Attributes
    ----------
    name : str
        ``r1`` is the row nearest to the pads, ``c1`` the leftmost column.
    first, last : int
        Crossings that it spans, from 0.
    body : (float, float, float, float)
        The track, x and y from and to [mm].
    lead : tuple of (float, float)
        Middle line of its lead, from the end of the track to the end of the pad [mm].
    pad : (float, float, float, float)
        The pad [mm].
    """

    name: str
    first: int
    last: int
    body: tuple[float, float, float, float]
    lead: tuple[Point, ...]
    pad: tuple[float, float, float, float]

    @property
    def lead_length_mm(self) -> float:
        """Length of the lead to the middle of the pad [mm]."""
        ways = zip(self.lead, self.lead[1:], strict=False)
        return sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in ways) - (self.pad[3] - self.pad[2]) / 2


@dataclass(frozen=True)
class ArrayLayout:
    """Tracks of an array in plan, in the coordinates of its scene.

    Attributes
    ----------
    params : Params
        Of the array.
    rows, columns : tuple of ArrayTrack
        From below, from the left.
    x_mm, y_mm : tuple of float
        Middles of all columns and rows [mm].
    size_mm : (float, float)
        Of the print in plan [mm].
    here : tuple of tuple of bool
        Crossings that the outline has, by row and column.
    """

    params: Params
    rows: tuple[ArrayTrack, ...]
    columns: tuple[ArrayTrack, ...]
    x_mm: tuple[float, ...]
    y_mm: tuple[float, ...]
    size_mm: Point
    here: tuple[tuple[bool, ...], ...]

    @cached_property
    def regions(self) -> "tuple[shapely.Geometry, shapely.Geometry]":
        """Rows and columns with leads and pads [mm]."""
        import shapely

        rows, columns = ([self.plan(track) for track in tracks] for tracks in (self.rows, self.columns))
        return shapely.union_all(rows), shapely.union_all(columns)

    def plan(self, track: ArrayTrack) -> "shapely.Geometry":
        """One track with its lead and pad [mm]."""
        import shapely

        x0, x1, y0, y1 = track.body
        half = self.params.lead_mm / 2
        ways = [_way(a, b, half) for a, b in zip(track.lead, track.lead[1:], strict=False)]
        return shapely.union_all([shapely.box(x0, y0, x1, y1), *ways])

    @cached_property
    def pads(self) -> "tuple[shapely.Geometry, shapely.Geometry]":
        """Pads of the rows and of the columns [mm]."""
        import shapely

        def united(tracks: tuple[ArrayTrack, ...]) -> "shapely.Geometry":
            return shapely.union_all([shapely.box(t.pad[0], t.pad[2], t.pad[1], t.pad[3]) for t in tracks])

        return united(self.rows), united(self.columns)

    @cached_property
    def sensing(self) -> "shapely.Geometry":
        """Squares of the crossings [mm]."""
        import shapely

        px, py = (side / 2 for side in self.params.pitch)
        squares = [
            shapely.box(x - px, y - py, x + px, y + py)
            for y, row in zip(self.y_mm, self.here, strict=True)
            for x, is_here in zip(self.x_mm, row, strict=True) if is_here
        ]  # fmt: skip
        return shapely.set_precision(shapely.union_all(squares), 1e-6)

    @cached_property
    def open_air(self) -> "shapely.Geometry":
        """Grooves along the columns, closed at their ends: no roof spans more than the space between two [mm]."""
        import shapely

        half, ends = self.params.pitch[0] / 2, [(t.body, (t.body[0] + t.body[1]) / 2) for t in self.columns]
        grooves = [shapely.box(x - half, body[2], x + half, body[3]) for body, x in ends]
        return shapely.set_precision(shapely.union_all(grooves), 1e-6)

    @cached_property
    def footprint(self) -> "shapely.Geometry":
        """The print [mm]: of an outline squares, tracks and leads with their edge, narrow notches filled.

        Along the pads it is straight: in the inner corner of a strip as wide as the edge infill piles up.
        """
        import shapely

        p, (rows, columns) = self.params, self.regions
        if all(map(all, self.here)):
            return shapely.box(0.0, 0.0, *self.size_mm)
        beside = max(p.margin_mm, p.hole_mm + 2 * WALL_MM + DOT_MM if p.hole_mm else 0.0)
        leads = max(x for t in self.columns for x, _ in t.lead) + p.lead_mm / 2 + p.margin_mm
        field = shapely.box(0.0, 0.0, max(leads, max(t.pad[1] for t in self.columns) + beside), p.pad_mm)
        grown = shapely.union_all([self.sensing, rows, columns]).buffer(p.margin_mm, join_style="mitre") | field
        closed = grown.buffer(p.connector_mm, join_style="mitre").buffer(-p.connector_mm, join_style="mitre")
        whole = shapely.box(0.0, 0.0, *self.size_mm)
        return shapely.set_precision(shapely.intersection(closed, whole), 1e-6)

    @cached_property
    def ledge(self) -> "shapely.Geometry":
        """Part of the base that reaches under the next tile [mm]."""
        import shapely

        right, top = self.size_mm
        left = self.x_mm[0] - self.params.pitch[0] / 2
        return shapely.box(left, top, right, rounded(top + self.params.ledge_mm))

    @cached_property
    def holes(self) -> "shapely.Geometry":
        """Square holes for pins: between the pads of rows and columns, and right of all pads [mm].

        Raises
        ------
        OutOfRange
            No room beside the leads.
        """
        import shapely

        side = self.params.hole_mm
        if not side:
            return shapely.MultiPolygon()
        first, last = min(t.pad[0] for t in self.columns), max(t.pad[1] for t in self.columns)
        left = self._square(side, max(t.pad[1] for t in self.rows), first)
        right = self._square(side, last, self.size_mm[0], -1)
        if left is None or right is None:
            raise OutOfRange(
                f"hole_mm {side:g}: no room beside the leads; expected a smaller hole, pad_mm above "
                f"{side + 2 * WALL_MM:.3g}, or a wider margin_mm"
            )
        return shapely.MultiPolygon([left, right])

    def _square(self, side: float, low: float, high: float, order: int = 1) -> "shapely.Polygon | None":
        """First square, or last, between two places along the pads with a wall around it beside all tracks [mm]."""
        import shapely

        tracks = shapely.union_all(self.regions).buffer(WALL_MM, join_style="mitre")
        room = self.footprint.buffer(-WALL_MM, join_style="mitre") - tracks
        count = max(0, int((high - low - 2 * WALL_MM - side) / DOT_MM + 1))
        places = [rounded(low + WALL_MM + k * DOT_MM) for k in range(count)][::order]
        squares = (shapely.box(x, WALL_MM, rounded(x + side), rounded(WALL_MM + side)) for x in places)
        return next((square for square in squares if room.covers(square)), None)

    @cached_property
    def letters(self) -> "shapely.Geometry":
        """Names of the tracks along their leads, of every so many that letters have room, the last one's too [mm]."""
        import shapely

        p, lettering = self.params, list[shapely.Polygon]()
        every = ceil((LINE_DOTS + 1) * DOT_MM / p.connector_mm - _WHOLE)
        for tracks in (self.rows, self.columns):
            chosen = {*range(0, max(len(tracks) - every, 0), every), len(tracks) - 1}
            lettering += [dots for k in sorted(chosen) for dots in self._name(tracks[k])]
        return shapely.set_precision(shapely.union_all(lettering), 1e-6)

    def _name(self, track: ArrayTrack) -> "Iterator[shapely.Polygon]":
        """Rows of dots of a track's name, turned by a quarter, to be read from the right [mm]."""
        import shapely

        p = self.params
        name = f"{p.tile:g}.{track.name.upper()}" if p.tile else track.name.upper()
        left = (track.pad[0] + track.pad[1]) / 2 - LINE_DOTS * DOT_MM / 2
        for row in range(LINE_DOTS):
            x = rounded(left + (LINE_DOTS - 1 - row if p.pads == "left" else row) * DOT_MM)
            for start, end in runs(name, row):
                y0, y1 = (rounded(p.pad_mm + (1 + dots) * DOT_MM) for dots in (start, end))
                yield shapely.box(x, y0, rounded(x + DOT_MM), y1)

    def crossing(self, x_mm: float, y_mm: float) -> str:
        """Name of the crossing at a place of the print, as ``r12c5``; "" beside all of them."""
        if self.params.pads == "left":
            x_mm, y_mm = y_mm, x_mm
        px, py = (side / 2 for side in self.params.pitch)
        column = next((j for j, x in enumerate(self.x_mm) if abs(x - x_mm) <= px), None)
        row = next((i for i, y in enumerate(self.y_mm) if abs(y - y_mm) <= py), None)
        if row is None or column is None or not self.here[row][column]:
            return ""
        return f"r{row + 1}c{column + 1}"


def _way(a: Point, b: Point, half: float) -> "shapely.Geometry":
    """A stretch of a lead, with square ends [mm]."""
    import shapely

    low, high = (end(a[0], b[0]) for end in (min, max)), (end(a[1], b[1]) for end in (min, max))
    (x0, x1), (y0, y1) = low, high
    return shapely.box(x0 - half, y0 - (half if y0 == y1 else 0), x1 + half, y1 + (half if x0 != x1 else 0))


@lru_cache(maxsize=16)
def layout(p: Params, outline: str | None = None) -> ArrayLayout:
    """Tracks of an array.

    Parameters
    ----------
    p : Params
        Of the array.
    outline : str, optional
        Its border, POLYGON in mm; the rectangle if not given. Crossings whose square it cuts are left out.

    Raises
    ------
    BadInput
        An outline without room for one crossing.
    """
    m, n = p.counts
    px, py = p.pitch
    here = _inside(p, outline)
    rows = [i for i, row in enumerate(here) if any(row)]
    columns = [j for j, column in enumerate(zip(*here, strict=True)) if any(column)]
    if not rows:
        raise BadInput(
            f"the outline has no room for one crossing of {px:.6g} x {py:.6g} mm; expected a wider one, or a shorter "
            "pitch"
        )
    q, edge = p.connector_mm, p.margin_mm
    fan = ceil(len(columns) / 2) * q if q < px - SLIVER_MM else 0.0
    x0, y0 = rounded(len(rows) * q + 2 * edge), rounded(p.pad_mm + fan + edge)
    x, y = _middles(x0, px, n), _middles(y0, py, m)
    bare = ArrayLayout(p, (), (), x, y, (0.0, 0.0), tuple(map(tuple, here)))
    size = rounded(x[columns[-1]] + px / 2 + p.edge("rows")), rounded(y[rows[-1]] + py / 2 + p.edge("columns"))
    return replace(
        bare,
        rows=tuple(_row(bare, i, order, x0) for order, i in enumerate(rows)),
        columns=tuple(_columns(bare, columns, y0 - edge)),
        size_mm=size,
    )


def _middles(start: float, pitch: float, count: int) -> tuple[float, ...]:
    return tuple(rounded(start + (k + 0.5) * pitch) for k in range(count))


def _inside(p: Params, outline: str | None) -> list[list[bool]]:
    """Crossings whose square lies inside the outline, by row and column."""
    m, n = p.counts
    if outline is None:
        return [[True] * n for _ in range(m)]
    import numpy as np
    import shapely

    from sensorgen.design import borders

    region, (px, py) = borders.region(outline).buffer(_WHOLE), p.pitch
    shapely.prepare(region)
    x, y = (  # in the middle of the outline, so that as much is left at either side
        (high - count * step) / 2 + np.arange(count + 1) * step
        for high, count, step in zip(borders.region(outline).bounds[2:], (n, m), (px, py), strict=True)
    )
    squares = shapely.box(x[None, :-1], y[:-1, None], x[None, 1:], y[1:, None])
    covered: list[list[bool]] = shapely.covers(region, squares).tolist()
    return covered


def _row(of: ArrayLayout, i: int, order: int, x0: float) -> ArrayTrack:
    """A row; its lead turns down to its pad, that of the lowest row nearest to the columns."""
    p, across = of.params, [j for j, is_here in enumerate(of.here[i]) if is_here]
    half, y = p.row_mm / 2, of.y_mm[i]
    left, right = of.x_mm[across[0]] - p.column_mm / 2, of.x_mm[across[-1]] + p.column_mm / 2
    down = x0 - p.margin_mm - (order + 0.5) * p.connector_mm
    lead = tuple((rounded(a), rounded(b)) for a, b in ((left, y), (down, y), (down, 0.0)))
    return ArrayTrack(
        f"r{i + 1}", across[0], across[-1], _rounded(left, right, y - half, y + half), lead,
        _rounded(down - p.lead_mm / 2, down + p.lead_mm / 2, 0.0, p.pad_mm),
    )  # fmt: skip


def _columns(of: ArrayLayout, columns: list[int], top_mm: float) -> Iterator[ArrayTrack]:
    """Columns; where pads are nearer to each other than columns, leads of both halves step towards the middle.

    The innermost steps highest, so that none crosses another.
    """
    p, count = of.params, len(columns)
    px, q = p.pitch[0], p.connector_mm
    middle = (of.x_mm[columns[0]] + of.x_mm[columns[-1]]) / 2
    for order, j in enumerate(columns):
        run = [i for i in range(len(of.y_mm)) if of.here[i][j]]
        x, half = of.x_mm[j], p.column_mm / 2
        bottom, top = of.y_mm[run[0]] - p.row_mm / 2, of.y_mm[run[-1]] + p.row_mm / 2
        at, lead = x, [(x, bottom)]
        if q < px - SLIVER_MM:
            at = middle + (order - (count - 1) / 2) * q
            inwards = (count - 1) // 2 - order if order < count / 2 else order - count // 2
            level = top_mm - (inwards + 0.5) * q
            lead += [(x, level), (at, level)]
        lead += [(at, 0.0)]
        yield ArrayTrack(
            f"c{j + 1}", run[0], run[-1], _rounded(x - half, x + half, bottom, top),
            tuple((rounded(a), rounded(b)) for a, b in lead),
            _rounded(at - p.lead_mm / 2, at + p.lead_mm / 2, 0.0, p.pad_mm),
        )  # fmt: skip


def _rounded(x0: float, x1: float, y0: float, y1: float) -> tuple[float, float, float, float]:
    return rounded(x0), rounded(x1), rounded(y0), rounded(y1)


def cell_parameters(p: Params, shape: str, given: Mapping[str, float | str], layer_mm: float) -> dict[str, float | str]:
    """Parameters of the cell's shape for one crossing; of ``tri`` alone those that print without an error.

    Raises
    ------
    BadInput
        A size in ``cell``, which the array gives.
    """
    for key in ENVELOPE:
        if key in given:
            raise BadInput(f"cell.parameters.{key}: the array gives it; set it, or the width of its tracks, there")
    own = {"length_mm": p.column_mm, "width_mm": p.row_mm, "electrode_mm": p.electrode_mm, "isolation_mm": 0.0}
    usual: dict[str, float | str] = {}
    if shape == "tri" and not given:  # flat tips on layers, no part narrower than a line
        lower_mm, hang_mm = (rounded(ceil(size / layer_mm - _WHOLE) * layer_mm) for size in (0.1, 0.3))
        period_mm = p.column_mm / max(1, int(p.column_mm / 4 + _WHOLE))
        usual = {"period_mm": period_mm, "tip_mm": 0.5, "lower_height_mm": lower_mm, "hang_height_mm": hang_mm}
    return {**usual, **given, **own}


def crossing_tip(p: Params, tip: TipData) -> dict[str, object]:
    """Tip of one crossing: an even pressure on all of it, unless the design has another tip."""
    if tip == TipData():
        return {"width_mm": p.column_mm, "block": EVEN}
    return tip.model_dump() | {"width_mm": min(tip.width_mm, p.column_mm)}


def check_cell(params: Envelope, p: Params) -> None:
    """Refuse cells that the tracks would cut, so that crossings differ or slivers are left.

    Raises
    ------
    OutOfRange
        A track's width, or the distance of the rows, that is no whole number of periods.
    """
    period = getattr(params, "period_mm", None)
    if not period or hasattr(params, "space_mm"):  # lines with a least space are spread evenly, whatever the width
        return
    along = getattr(params, "along", None)
    ways = {"column_mm": (p.column_mm, along in (None, "x", "xy", "yx")), "row_mm": (p.row_mm, along != "x"),
            "pitch_y": (p.pitch[1], along != "x")}  # fmt: skip
    for key, (size, is_periodic) in ways.items():
        count = size / period
        if is_periodic and (abs(count - round(count)) > _WHOLE or count < 1 - _WHOLE):
            near = sorted({max(1, int(count)) * period, ceil(count) * period})
            raise OutOfRange(
                f"{key} {size:.6g} is {count:.4g} periods of the cell, {period:g} mm; expected a whole number, as "
                f"{' or '.join(f'{size:.6g}' for size in near)}, so that all crossings are alike"
            )


def scene(of: ArrayLayout, fill: Fill, strip: Any, params: Envelope) -> Scene:
    """Bodies of an array.

    Parameters
    ----------
    of : ArrayLayout
        Its tracks.
    fill : Fill
        Materials.
    strip : callable
        Scene of the cell's shape, by parameters and materials.
    params : Envelope
        Of the cell's shape, at one crossing.

    Raises
    ------
    BadInput
        A cell whose bottom electrode is no plate, so that rows cannot replace it.
    """
    stack = _GrowingBodies({})
    strips = [_strip(of, track, strip, fill, params) for track in of.columns]
    roof = max(piece.span("z")[1] for own in strips for pieces in own.values() for piece in pieces)
    z = _Levels.of(of.params, roof, getattr(params, "dielectric_mm", 0.0))
    (rows, columns), (row_pads, column_pads) = of.regions, of.pads
    whole, under = of.footprint - of.holes, _united(of.columns)
    stack.plates("base", fill.isolation, whole | of.ledge if of.params.ledge_mm else whole, 0.0, z.rows)
    stack.plates("row_tracks", fill.bottom_electrode, rows, z.rows, z.film, "bottom")
    for own in strips:
        for key, pieces in own.items():
            stack.add(*key, pieces)
    stack.plates(stack.top(), fill.top_electrode, columns - under, z.columns, z.cover)
    beside = whole - row_pads - under
    high = beside - of.open_air if of.params.between == "air" else beside
    name = stack.solid(fill.dielectric)
    stack.plates(name, fill.dielectric, whole - rows, z.rows, z.film)
    stack.plates(name, fill.dielectric, beside, z.film, z.above_film)
    stack.plates(name, fill.dielectric, high, z.above_film, z.columns)
    stack.plates(name, fill.dielectric, high - columns, z.columns, z.cover)
    stack.cover(of, fill.isolation, whole - row_pads - column_pads, z)
    return _laid(of.params, stack.ordered(), (of.size_mm[0], rounded(of.size_mm[1] + of.params.ledge_mm), z.top))


def _laid(p: Params, bodies: tuple[Body, ...], size_mm: tuple[float, float, float]) -> Scene:
    """Scene with its pads at the edge that is asked for."""
    if p.pads == "bottom":
        return Scene(bodies, size_mm)
    length, width, height = size_mm
    exchanged = (replace(body, pieces=tuple(q.moved(Move(exchanges=True)) for q in body.pieces)) for body in bodies)
    return Scene(tuple(exchanged), (width, length, height))


@dataclass(frozen=True)
class _Levels:
    """Heights at which rows, film, what is above it, columns, cover and letters begin, and the top [mm]."""

    rows: float
    film: float
    above_film: float
    columns: float
    cover: float
    face: float
    top: float

    @classmethod
    def of(cls, p: Params, roof: float, film_mm: float) -> "_Levels":
        """By the top of the columns and the thickness of the film [mm]."""
        low = rounded(p.base_mm + p.electrode_mm)
        columns = rounded(roof - p.electrode_mm)
        return cls(
            rounded(p.base_mm), low, min(rounded(low + film_mm), columns), columns, rounded(roof),
            rounded(roof + p.isolation_mm - (LABEL_MM if p.labels == "engraved" else 0)),
            rounded(roof + p.isolation_mm + (LABEL_MM if p.labels == "raised" else 0)),
        )  # fmt: skip


@dataclass(frozen=True)
class _GrowingBodies:
    """Bodies that grow: pieces by name, material and terminal."""

    bodies: dict[str, tuple[str, list[Piece], str]]

    def add(self, name: str, material: str, terminal: str, pieces: Iterable[Piece]) -> None:
        """Add pieces to a body, new or not."""
        self.bodies.setdefault(name, (material, [], terminal))[1].extend(pieces)

    def plates(
        self, name: str, material: str, region: "shapely.Geometry", z0: float, z1: float, terminal: str = ""
    ) -> None:
        """Add a region between two heights."""
        self.add(name, material, terminal, _plates(region, z0, z1))

    def cover(self, of: ArrayLayout, material: str, region: "shapely.Geometry", z: _Levels) -> None:
        """Add the cover with its letters."""
        self.plates("isolation", material, region, z.cover, z.face)
        if of.params.labels == "raised":
            self.plates("isolation", material, of.letters, z.face, z.top)
        if of.params.labels == "engraved":
            self.plates("isolation", material, region - of.letters, z.face, z.top)

    def top(self) -> str:
        """Name of the columns."""
        return next(name for name, (_, _, terminal) in self.bodies.items() if terminal == "top")

    def solid(self, material: str) -> str:
        """Name of the first body of the cells of a material, else of a new one; the others of it join it.

        What lies between the tracks joins it, too: slicers print touching parts of one tool as one.
        """
        first, *others = [
            name
            for name, (own, _, terminal) in self.bodies.items()
            if own == material and not terminal and name != "base"
        ] or ["filler"]
        for name in others:
            self.add(first, material, "", self.bodies.pop(name)[1])
        return first

    def ordered(self) -> tuple[Body, ...]:
        """The bodies, from bottom to top as they were added."""
        items = self.bodies.items()
        return tuple(Body(name, material, tuple(pieces), terminal) for name, (material, pieces, terminal) in items)


def _united(tracks: Iterable[ArrayTrack]) -> "shapely.Geometry":
    """Tracks without leads [mm]."""
    import shapely

    return shapely.union_all([shapely.box(t.body[0], t.body[2], t.body[1], t.body[3]) for t in tracks])


def _strip(
    of: ArrayLayout, track: ArrayTrack, shape_scene: Any, fill: Fill, params: Envelope
) -> Mapping[tuple[str, str, str], list[Piece]]:
    """Pieces of one column above the rows, by name, material and terminal of their body."""
    p, (x0, _, y0, y1) = of.params, track.body
    cell: Scene = shape_scene(replace(params, width_mm=rounded(y1 - y0)), fill)
    pieces: dict[tuple[str, str, str], list[Piece]] = {}
    for body in cell.bodies:
        if body.terminal == "bottom":
            if not all(piece.is_box() and piece.span("z") == (0.0, p.electrode_mm) for piece in body.pieces):
                raise BadInput("cell: its bottom electrode is no plate; expected a shape with one, as tri or reference")
            continue
        if body.terminal not in ("", "top"):
            raise BadInput(f"cell: it has an electrode {body.terminal!r}; expected a shape with a top and a bottom one")
        key = (body.name, body.material, body.terminal)
        pieces[key] = [piece.moved(Move(shift_mm=(x0, y0, p.base_mm))) for piece in body.pieces]
    if all(terminal != "top" for *_, terminal in pieces):
        raise BadInput("cell: it has no top electrode; expected a shape with one, as tri or reference")
    return pieces


def _plates(region: "shapely.Geometry", z0: float, z1: float) -> list[Piece]:
    """Boxes of a rectilinear region between two heights."""
    from sensorgen.scene.layers import outlines

    if z1 - z0 < SLIVER_MM or region.is_empty:
        return []
    plates: list[Piece] = []
    for outline in outlines(region):
        x, y = zip(*outline, strict=True)
        is_box = len(outline) == 4
        plates.append(box(min(x), max(x), min(y), max(y), z0, z1) if is_box else Prism("z", outline, z0, z1))
    return plates
