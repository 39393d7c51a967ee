"""Dimension lines: arrows or, where there is no room for them, oblique strokes; extension lines; values."""

from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise

from sensorgen.scene.drawing.paper import ViewFrame, ViewPanel, line, number, seen, spread, text, width
from sensorgen.scene.drawing.view import Gap, Measure
from sensorgen.scene.scene import Point

ROW = 5.6  # from one row of dimensions to the next [mm]
ARROWS = 5.0  # two arrow heads and something between them [mm]
CLEAR = 1.7  # from the middle of a value to a line [mm]
NARROW = 3.0  # what is shorter on paper gets no dimension in a row [mm]


def lane_width(lane: Sequence[Measure]) -> float:
    """Room for a vertical lane of measures [mm]."""
    return max(width(number(m.value_mm)) for m in lane) + 4.5


def beside(frame: ViewFrame, lanes: Sequence[Sequence[Measure]]) -> Iterator[str]:
    """Lanes of vertical measures, left of a view."""
    places = accumulate((-lane_width(lane) for lane in lanes[:-1]), initial=frame.left - 4.0)
    lanes_at = list(zip(places, lanes, strict=True))
    for x, lane in lanes_at:  # before the values, which keep clear of what is under them
        for z in _ends(lane):
            yield line("thin", frame.left - 1, frame.y(z), x - 1, frame.y(z))
    for k, (x, lane) in enumerate(lanes_at):
        passing = [frame.y(z) for further in lanes[k + 1 :] for z in _ends(further)]
        falling = [(m, frame.y(m.low_mm), frame.y(m.high_mm)) for m in lane[::-1]]  # the page counts downwards
        wanted = [_beside_lines((low + high) / 2, passing) for _, low, high in falling]
        values = spread(wanted, [2.8] * len(lane), frame.top - 6, frame.bed + 6)
        for (m, low, high), place in zip(falling, values, strict=True):
            yield _distance((x, low), (x, high))
            outside = not high <= place <= low
            if outside:
                yield line("thin", x, (low + high) / 2, x - 2.2, place)
            yield text("end halo", x - (2.5 if outside else 1.2), place + 0.9, number(m.value_mm))


def _ends(row: Sequence[Measure]) -> dict[float, float]:
    """Where the ends of measures are on their axis, and on the other one [mm]."""
    return {end: at for m in row for end, at in zip((m.low_mm, m.high_mm), m.ends_mm, strict=True)}


def _beside_lines(middle: float, passing: Sequence[float]) -> float:
    """The place itself, or one just aside if a line passes through it [mm]."""
    near = min(passing, key=lambda y: abs(y - middle), default=middle + CLEAR)
    return middle if abs(near - middle) >= CLEAR else near + (CLEAR if middle >= near else -CLEAR)


def rows(frame: ViewFrame, measures: Sequence[Sequence[Measure]], start: float, step: float) -> Iterator[str]:
    """Rows of horizontal measures from ``start`` outwards; ``step`` is negative above a view [mm]."""
    rows_at = [(start + k * step, row) for k, row in enumerate(row for row in measures if _fits(frame, row))]
    beyond = 1.0 if step > 0 else -1.0
    for y, row in rows_at:
        for u, z in sorted(_ends(row).items()):
            yield seen("thin", frame.x(u), frame.y(z), frame.x(u), y + beyond)
    for y, row in rows_at:
        sizes = [width(number(m.value_mm)) for m in row]
        middles = [frame.x((m.low_mm + m.high_mm) / 2) for m in row]
        pitch = [0.0, *((a + b) / 2 + 0.8 for a, b in pairwise(sizes))]
        for m, place in zip(row, spread(middles, pitch, frame.left, frame.right + 20), strict=True):
            yield _distance((frame.x(m.low_mm), y), (frame.x(m.high_mm), y))
            yield text("middle halo", place, y - 0.8, number(m.value_mm))


def _fits(frame: ViewFrame, row: Sequence[Measure]) -> bool:
    """True where a row can be read: its values are no longer than itself."""
    length = sum(m.value_mm for m in row) * frame.per_mm
    return length >= NARROW if len(row) == 1 else sum(width(number(m.value_mm)) for m in row) < length


def _distance(a: Point, b: Point) -> str:
    length = abs(a[0] - b[0]) + abs(a[1] - b[1])
    return line("dim" if length >= ARROWS else "tick", *a, *b)


def gap(panel: ViewPanel, measured: Gap) -> tuple[str, list[Point]]:
    """The electrode gap in its view, and the room on the page that it takes."""
    (x0, y0), (x1, y1) = panel.place(measured.near), panel.place(measured.far)
    words = f"gap {number(measured.value_mm)}" if measured.value_mm > 1e-6 else "gap 0: short"
    room = width(words) * 1.08
    sides, frame = (max(x0, x1) + 1.4, min(x0, x1) - 1.4 - room), panel.frame
    x = next((x for x in sides if frame.left <= x and x + room <= frame.right), frame.right + 1.4)
    y = (y0 + y1) / 2 + 0.9
    marks = seen("gap", x0, y0, x1, y1) + text("gaptext halo", x, y, words)
    return marks, [(x + share * room, y - 0.9) for share in (0.0, 0.35, 0.7, 1.0)]
