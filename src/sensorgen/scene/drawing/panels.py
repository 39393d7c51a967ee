"""Views on the page: their scale, room, materials and dimension lines."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from math import floor, log10

from sensorgen.scene.drawing.paper import (
    ViewFrame,
    ViewPanel,
    box,
    element,
    fitted,
    line,
    number,
    seen,
    spread,
    text,
    width,
)
from sensorgen.scene.drawing.view import Gap, Measure, View
from sensorgen.scene.scene import AXES, Body, Point, Scene, clipped

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
        yield from _lane(frame, x, lane, [frame.y(z) for further in lanes[k + 1 :] for z in _ends(further)])


def _lane(frame: ViewFrame, x: float, lane: Sequence[Measure], passing: Sequence[float]) -> Iterator[str]:
    """Vertical measures with their values, which keep clear of lines that pass at some heights [mm on the page]."""
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
        yield from _row(frame, y, row)


def _row(frame: ViewFrame, y: float, row: Sequence[Measure]) -> Iterator[str]:
    """Horizontal measures with their values, which keep apart from one another."""
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


GUTTER = 8.0  # between a view and what is right of it: room for markers [mm]
CAPTION = 78.0  # room for the words over a view [mm]
REPEATS, MOST_REPEATS = 1.7, 60.0
LOWEST = 12.0  # a view that is flatter on paper shows nothing [mm]
LARGER = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
ASIDE = 0.4  # place of a letter across its column: left of the middle, where no line of symmetry runs
SMALLER = (1.0, 2.0, 5.0)  # 1:2 and 1:5 are read at a glance, 1:1.67 is not
STRIP_HEIGHT = 9.0  # of the strip on paper [mm]
FINEST = 0.25  # a period that is shorter on paper is not drawn [mm]
MOST_CORNERS = 6000
STRIP_LEFT, STRIP_RIGHT = 14.0, 4.0  # room beside a strip [mm]

Colours = Mapping[str, tuple[str, str]]
MISSING_COLOUR = "#c8c8c8"


Room = tuple[float, float, float, float]  # left, top, right, bottom on the page [mm]


def arrange(views: Sequence[View], grid_mm: float, height_mm: float, room: Room) -> list[ViewPanel]:
    """Views side by side at one true scale.

    ``grid_mm`` is the height of the highest layer boundary, which may lie over the sensor's ``height_mm``.
    """
    left, top, right, bottom = room
    each = (right - left) / len(views) - GUTTER
    # of each view a period and most of the next or, where nothing repeats, four heights
    lengths = (max(REPEATS * v.repeat_mm(), height_mm) if v.period_mm else 4 * height_mm for v in views)
    wanted = max(
        min(length, view.extent_mm, each / LOWEST * height_mm) for view, length in zip(views, lengths, strict=True)
    )
    scale = round_scale(min((bottom - top) / grid_mm, each / wanted))
    bottom -= (bottom - top - grid_mm * scale) / 2
    panels = []
    for view in views:
        most = min(each / scale, MOST_REPEATS * view.repeat_mm() or each / scale)
        digit = 10.0 ** (floor(log10(most)) - 1)
        end = min(view.extent_mm, round(floor(most / digit + 1e-9) * digit, 12))  # all of it, or a round length
        seen = view.first(end)
        frame = ViewFrame(left, bottom, left + end * scale, bottom - grid_mm * scale, scale, scale, seen.start_mm)
        panels.append(ViewPanel(seen, frame))
        left = max(frame.right + GUTTER, left + CAPTION)
    return panels


def round_scale(most: float) -> float:
    """The largest customary scale up to ``most`` [-].

    >>> round_scale(56.0), round_scale(0.4)
    (50.0, 0.2)
    """
    power = 10.0 ** floor(log10(most) + 1e-12)
    steps = LARGER if most >= 1 else SMALLER
    return round(max(step for step in steps if step <= most / power + 1e-9) * power, 12)


def scale_words(scale: float) -> str:
    """A scale as it is written on a drawing.

    >>> scale_words(50.0), scale_words(0.2)
    ('50:1', '1:5')
    """
    return f"{number(scale)}:1" if scale >= 1 else f"1:{number(1 / scale)}"


def materials(panel: ViewPanel, colours: Colours, kind: str = "body") -> Iterator[str]:
    """Cut bodies, one path for each."""
    paths: dict[str, list[str]] = {}
    bodies: dict[str, Body] = {}
    for body, outline in panel.view.regions:
        bodies[body.name] = body
        paths.setdefault(body.name, []).append(panel.frame.outline(outline))
    for name, path in paths.items():
        material = bodies[name].material
        told = {"data_body": name, "data_material": material}
        yield element("path", kind, "", d="".join(path), fill=colour(colours, material), **told)


def colour(colours: Colours, material: str) -> str:
    """Colour of a material; a grey where it has none."""
    return colours.get(material, ("", MISSING_COLOUR))[1]


def letters(bodies: Iterable[Body]) -> dict[str, str]:
    """A letter for each body's name, in their order from the bed."""
    return {body.name: _letter(k) for k, body in enumerate(bodies)}


def _letter(k: int) -> str:
    return chr(ord("A") + k) if k < 26 else _letter(k // 26 - 1) + _letter(k % 26)


def letter_places(panel: ViewPanel) -> dict[str, Point]:
    """For each body, where its letter has most room on the page [mm]."""
    best: dict[str, tuple[float, Point]] = {}
    for column in panel.view.columns:
        along = column.left_mm + ASIDE * (column.right_mm - column.left_mm)
        for layer in column.layers:
            low, high = (left + ASIDE * (right - left) for left, right in (layer.bottom_mm, layer.top_mm))
            room = round(min(column.right_mm - column.left_mm, high - low), 6)
            if room > best.get(layer.body.name, (0.0,))[0]:
                best[layer.body.name] = (room, panel.place((along, (low + high) / 2)))
    left, right = panel.frame.left + 2, max(panel.frame.right - 2, panel.frame.left + 2)
    return {name: (min(max(x, left), right), y) for name, (_, (x, y)) in best.items()}


def lettered(
    panel: ViewPanel, names: Mapping[str, str], colours: Colours, printed: Scene | None
) -> Iterator[str]:  # fmt: skip
    """Outlines of the print, and over them the bodies' letters, in ink that shows on their colour."""
    yield from _outlined(panel, printed.bodies if printed else ())
    materials_of = {body.name: body.material for body, _ in panel.view.regions}
    for name, (x, y) in letter_places(panel).items():
        fill = colour(colours, materials_of[name])
        red, green, blue = (int(fill[k : k + 2], 16) for k in (1, 3, 5))
        ink = "#ffffff" if 0.3 * red + 0.59 * green + 0.11 * blue < 128 else "#1f2328"
        yield text("bold middle halo", x, y + 0.9, names[name], style=f"fill:{ink};stroke:{fill}")


def caption(panel: ViewPanel, name: str, y: float) -> str:
    """Caption of the view, in one line at ``y`` on the page [mm]."""
    view, scale = panel.view, panel.frame.per_mm
    words = (
        f"Section {name}: {view.normal} = {number(view.section.at_mm)} mm, "
        f"{view.section.across} from {number(view.start_mm)} to {number(view.end_mm)} mm, {scale_words(scale)}"
    )
    room = max(CAPTION - 2, panel.frame.right - panel.frame.left)
    return text("bold", panel.frame.left, y, fitted(words, room / 1.08))


def broken(panel: ViewPanel) -> str:
    """The break lines at the ends where the sensor goes on."""
    view, frame = panel.view, panel.frame
    places = [frame.left] * (view.start_mm > 0) + [frame.right] * (view.end_mm < view.extent_mm)
    highest = max(z for _, outline in view.regions for _, z in outline)
    top, middle, bottom = frame.y(highest) - 2, (frame.y(highest) + frame.bed) / 2 - 2, frame.bed + 2
    zigzag = f"V{number(middle)}l-1.6 .6l3.2 2.8l-1.6 .6V{number(bottom)}"
    path = "".join(f"M{number(x)} {number(top)}{zigzag}" for x in places)
    return element("path", "under", d=path) + element("path", "thin", d=path) if path else ""


def _outlined(panel: ViewPanel, bodies: Sequence[Body]) -> Iterator[str]:
    """Outlines of the printed bodies where a view cuts them, one path for each body."""
    view = panel.view
    for body in bodies:
        seen = (outline for p in body.pieces for outline in p.cut(view.normal, view.section.at_mm))
        path = "".join(panel.frame.outline(part) for o in seen if (part := clipped(o, view.end_mm, view.start_mm)))
        if path:
            yield element("path", "halo-line", "", d=path) + element("path", "printed", "", d=path, data_body=body.name)


def arrange_wholes(
    details: Sequence[ViewPanel], height_mm: float, left: float, right: float, top: float
) -> list[ViewPanel]:
    """A strip for each detail view, side by side on the page [mm]."""
    each = (right - left) / len(details)
    up = STRIP_HEIGHT / height_mm
    panels = []
    for k, detail in enumerate(details):
        view = replace(detail.view, start_mm=0.0, end_mm=detail.view.extent_mm)
        along = min((each - STRIP_LEFT - STRIP_RIGHT) / view.extent_mm, up)
        start = left + k * each + STRIP_LEFT
        panels.append(
            ViewPanel(view, ViewFrame(start, top + STRIP_HEIGHT, start + view.extent_mm * along, top, along, up))
        )
    return panels


def draw_whole(detail: ViewPanel, whole: ViewPanel, name: str, scene: Scene, colours: Colours) -> Iterator[str]:
    """The strip with its detail window, its length and its height."""
    frame, view = whole.frame, whole.view
    long, ratio = frame.right - frame.left, frame.per_mm_up / frame.per_mm
    start, window = frame.x(detail.view.start_mm), (detail.view.end_mm - detail.view.start_mm) * frame.per_mm
    shortened = window < long
    words = [f"Overview {name}: all of {view.section.across}, {number(scene.size_mm[AXES.index(view.normal)])} mm deep"]
    words += [f"period {number(view.repeat_mm())} mm"] if view.period_mm else []
    words.append(f"height × {ratio:.3g}" if ratio > 1.0005 else "true to scale")
    words += ["dashed: the detail above"] if shortened else []
    yield text("bold", frame.left, frame.top - 6.6, "; ".join(words))
    corners = sum(len(outline) for _, outline in view.section.regions)
    if corners <= MOST_CORNERS and not 0 < view.repeat_mm() * frame.per_mm < FINEST:
        yield from materials(whole, colours, "body far")
    else:
        fine = fitted(f"a period of {number(view.repeat_mm())} mm is too fine to be drawn here", long)
        yield box("fine", frame.left, frame.top, long, STRIP_HEIGHT)
        yield text("small middle", frame.left + long / 2, frame.top + STRIP_HEIGHT / 2 + 0.8, fine)
    if shortened:
        yield box("window", start - 0.4, frame.top - 0.6, window + 0.8, STRIP_HEIGHT + 1.2)
    yield from beside(frame, [[Measure(0.0, scene.size_mm[2])]])
    yield from rows(frame, [[Measure(0.0, view.extent_mm)]], frame.bed + 4.6, ROW)
