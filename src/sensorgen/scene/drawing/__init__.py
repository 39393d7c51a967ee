"""A dimensioned drawing of a sensor: its sections with the layer grid over them, and the findings in place.

One page, A4 landscape, as SVG::

    +----------------------------------------------------------+
    | detail: one or two sections at one true scale            |
    |   heights | section ... | section ... | layers           |
    | overview: the whole length, height exaggerated           |
    | findings, numbered                  | legend             |
    |                                     | title block        |
    +----------------------------------------------------------+

It reads the scene alone and knows no shapes. The same input gives the same bytes.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import chain
from math import cos, hypot, pi, sin

from sensorgen.core.findings import Finding, counted, counts, grouped
from sensorgen.scene.drawing import panels, paper
from sensorgen.scene.drawing.panels import GUTTER, Colours, Room, colour, scale_words
from sensorgen.scene.drawing.paper import (
    ARROWS,
    ViewFrame,
    ViewPanel,
    box,
    clean,
    element,
    escaped,
    fitted,
    line,
    number,
    spread,
    text,
    wrapped,
)
from sensorgen.scene.drawing.view import Gap, Measure, heights, nearest, views, widths
from sensorgen.scene.scene import AXES, Point, Scene

RADIUS, CLEAR = 2.1, 4.5  # of a marker; from one marker's centre to the next [mm]
LINE, INDENT, COLUMNS_APART = 2.95, 6.0, 5.0  # of the list [mm]
DISTANCES, ANGLES = (5.0, 7.5, 10.0, 13.0, 17.0, 22.0), 16
_NUMBER = re.compile(r"[0-9.]+")


@dataclass(frozen=True)
class Marked:
    """A finding with its number on the page."""

    number: int
    finding: Finding

    @property
    def kind(self) -> str:
        """Class of its colour."""
        return "waived" if self.finding.waiver else self.finding.severity


@dataclass(frozen=True)
class MarkerEntry:
    """A finding in the list: its lines with their classes, and where they begin on the page [mm]."""

    mark: Marked
    x: float
    y: float
    rows: list[tuple[str, str]]


def ranked(findings: Sequence[Finding]) -> list[Marked]:
    """Findings numbered from the most severe to the least, waived ones last; each sentence once."""
    return [Marked(k, f) for k, f in enumerate(grouped(findings), start=1)]


def height_mm(finding: Finding, boundaries_mm: Sequence[float]) -> float | None:
    """Height over the bed at which a finding shows: of its place or, without one, the middle of its layer [mm]."""
    if finding.place_mm is not None:
        return finding.place_mm[2]
    if finding.layer is not None and 1 <= finding.layer < len(boundaries_mm):
        return (boundaries_mm[finding.layer - 1] + boundaries_mm[finding.layer]) / 2
    return None


def along_mm(finding: Finding, panel: ViewPanel) -> float | None:
    """Where along a view a finding is; None without a place or outside of the view [mm]."""
    if finding.place_mm is None:
        return None
    along = finding.place_mm[AXES.index(panel.view.section.across)]
    return along if panel.view.start_mm <= along <= panel.view.end_mm else None


def panel_of(finding: Finding, panels: Sequence[ViewPanel]) -> int:
    """Number of the panel that shows a finding: one whose window holds it, cut as near to it as can be."""

    def far(k: int) -> tuple[bool, float]:
        view = panels[k].view
        if finding.place_mm is None:
            return (True, -k)  # the last one stands beside the layers' numbers
        aside = abs(finding.place_mm[AXES.index(view.normal)] - view.section.at_mm)
        return (along_mm(finding, panels[k]) is None, aside)

    return min(range(len(panels)), key=far)


def on_detail(
    marked: Sequence[Marked], panels: Sequence[ViewPanel], boundaries_mm: Sequence[float], taken: list[Point]
) -> Iterator[str]:
    """Markers on the detail views, as many as fit clear of ``taken``; those without a place at the right edge."""
    edges: dict[int, list[tuple[Point, Marked]]] = {}
    for mark in marked:
        z = height_mm(mark.finding, boundaries_mm)
        if z is None:
            continue
        k = panel_of(mark.finding, panels)
        along = along_mm(mark.finding, panels[k])
        spot = _spot(panels[k], along, z)
        if along is None:
            edges.setdefault(k, []).append((spot, mark))
        elif place := _free(spot, panels[k], taken):
            taken += [spot, place]
            yield _marker(mark, spot, place)
    for k, edge in sorted(edges.items()):
        frame = panels[k].frame
        fitting = sorted(edge[: int((frame.bed - frame.top + 14) // CLEAR)], key=lambda at: (at[0][1], at[1].number))
        heights = spread([spot[1] for spot, _ in fitting], [CLEAR] * len(fitting), frame.top - 8, frame.bed + 6)
        for (spot, mark), y in zip(fitting, heights, strict=True):
            yield _marker(mark, spot, (frame.right + GUTTER / 2 + 0.6, y))


def _spot(panel: ViewPanel, along: float | None, z: float) -> Point:
    """Place of a finding on the page; the right edge where it has none, and never off the view [mm]."""
    x, y = panel.place((panel.view.end_mm if along is None else along, z))
    return x, min(max(y, panel.frame.top), panel.frame.bed)


def on_overview(marked: Sequence[Marked], details: Sequence[ViewPanel], wholes: Sequence[ViewPanel]) -> Iterator[str]:
    """Markers on the overview strips, for those that lie outside of the detail views."""
    for k, (detail, whole) in enumerate(zip(details, wholes, strict=True)):
        far = []
        for mark in marked:
            at, along = mark.finding.place_mm, along_mm(mark.finding, whole)
            hidden = at and along_mm(mark.finding, detail) is None and panel_of(mark.finding, details) == k
            if at and hidden and along is not None:
                far.append((_spot(whole, along, at[2]), mark))
        far.sort(key=lambda pair: (pair[0], pair[1].number))
        places = spread([spot[0] for spot, _ in far], [CLEAR] * len(far), whole.frame.left, whole.frame.right)
        for (spot, mark), x in zip(far, places, strict=True):
            yield _marker(mark, spot, (x, whole.frame.top - 3.2))


def _free(spot: Point, panel: ViewPanel, taken: Sequence[Point]) -> Point | None:
    """A place for a marker near its spot that covers nothing else; None where there is none."""
    frame = panel.frame
    for distance in DISTANCES:
        for k in range(ANGLES):
            angle = pi / 4 + (k // 2 if k % 2 else -k // 2) * 2 * pi / ANGLES
            x, y = spot[0] + distance * cos(angle), spot[1] - distance * sin(angle)
            inside = frame.left + RADIUS <= x <= frame.right - RADIUS and frame.top + RADIUS <= y <= frame.bed - RADIUS
            if inside and all(hypot(x - p[0], y - p[1]) >= CLEAR for p in taken):
                return x, y
    return None


def _marker(mark: Marked, spot: Point, place: Point) -> str:
    parts = [
        line(f"leader {mark.kind}", *spot, *place),
        element("circle", f"spot {mark.kind}", cx=spot[0], cy=spot[1], r=0.7),
        _balloon(mark, *place),
    ]
    return element("g", "marker", "".join(parts), data_number=str(mark.number))


def _balloon(mark: Marked, x: float, y: float) -> str:
    ink = "count dark" if mark.kind == "warning" else "count"
    return element("circle", f"balloon {mark.kind}", cx=x, cy=y, r=RADIUS) + text(ink, x, y + 0.85, str(mark.number))


def placed(marked: Sequence[Marked], letters: Mapping[str, str], room: Room) -> list[MarkerEntry]:
    """As many findings, each with its whole text, as there is room for on the page, in two columns.

    Only a text longer than a column is cut.
    """
    left, top, right, bottom = room
    wide = (right - left - COLUMNS_APART) / 2
    entries: list[MarkerEntry] = []
    x, y = left, top
    for mark in marked:
        rows = _rows(mark, letters, wide - INDENT, int((bottom - top) / LINE) + 1)
        if y + (len(rows) - 1) * LINE > bottom:
            x, y = x + wide + COLUMNS_APART, top
        if x > right - wide + 1e-9:
            break
        entries.append(MarkerEntry(mark, x, y, rows))
        y += len(rows) * LINE + 0.6
    return entries


def listed(
    entries: Sequence[MarkerEntry], marked: Sequence[Marked], left: float, top: float, room: float
) -> Iterator[str]:
    """The list of findings under its heading [mm on the page]."""
    words = counted(counts([mark.finding for mark in marked]))
    rest = f"; {len(marked) - len(entries)} not shown: sensorgen check lists all" if len(entries) < len(marked) else ""
    yield text("heading", left, top, fitted(f"Findings: {words}{rest}", room, 3.2))
    for entry in entries:
        rows = (text(kind, entry.x + INDENT, entry.y + k * LINE, row) for k, (kind, row) in enumerate(entry.rows))
        inside = _balloon(entry.mark, entry.x + RADIUS, entry.y + 0.6) + "".join(rows)
        yield element("g", "entry", inside, data_number=str(entry.mark.number))


def _rows(mark: Marked, letters: Mapping[str, str], room: float, most: int) -> list[tuple[str, str]]:
    """Class and text of one finding's lines: what and where, then what to do."""
    f = mark.finding
    what = f"{f.rule}{_where(f, letters)}: {f.message}"
    advice = f"waived: {f.waiver}" if f.waiver else f.advice
    rows = wrapped(what, room, most)
    further = wrapped(advice, room, most - len(rows)) if advice and len(rows) < most else []
    return [("faint" if f.waiver else "", row) for row in rows] + [("faint", row) for row in further]


def _where(f: Finding, letters: Mapping[str, str]) -> str:
    """Body, layers and places of a finding in brackets, or ""."""
    where = [" / ".join(letters.get(name, name) for name in f.body.split(" / "))] if f.body else []
    if f.layer is not None:
        where.append(f"layer {f.layer}" if f.last_layer is None else f"layers {f.layer} to {f.last_layer}")
    if f.count > 1:
        where.append(f"{f.count} places")
    elif f.layer is not None and f.place_mm is not None:
        where.append(f"at x {f.place_mm[0]:g}, y {f.place_mm[1]:g}")
    return f" ({', '.join(where)})" if where else ""


ROW = 3.6
MOST, MOST_NOTES = 7, 2


def legend(
    scene: Scene, letters: Mapping[str, str], colours: Colours, left: float, top: float, room: float
) -> Iterator[str]:
    """Letter, colour, name and material of every body, and what the lines mean [mm on the page]."""
    y = top
    for body in scene.bodies[:MOST]:
        title = colours.get(body.material, ("no title", ""))[0]
        yield box("body", left, y - 2.5, 5.5, 3.0, fill=colour(colours, body.material), data_legend=body.name)
        yield text("bold", left + 7, y, letters[body.name])
        yield text("", left + 11, y, fitted(f"{body.name}: {body.material}, {title}", room - 11))
        y += ROW
    if len(scene.bodies) > MOST:
        yield text("faint", left + 11, y, f"… and {len(scene.bodies) - MOST} bodies more")
        y += ROW
    yield box("body", left, y - 2.5, 5.5, 3.0, fill="#ffffff") + text("", left + 11, y, "air")
    for kind, x, words in (("grid", 24, "layer boundary"), ("mid", 58, "sampled height")):
        yield line(kind, left + x, y - 0.9, left + x + 7, y - 0.9) + text("", left + x + 8.5, y, words)


def block(title: str, rows: Sequence[str], left: float, bottom: float, room: float) -> Iterator[str]:
    """Title and what holds for the whole page, upwards from ``bottom`` [mm on the page]."""
    lines = wrapped(title, room * 0.95, 2, 4.4)
    y = bottom - ROW * (len(rows) - 1) - 5.0 * len(lines)
    for words in lines:
        yield text("title", left, y, words)
        y += 5.0
    for words in rows:
        yield text("", left, y, fitted(clean(words), room))
        y += ROW


def title_rows(
    scene: Scene, frame: ViewFrame, grid: Sequence[float], gap: Gap | None, notes: Sequence[str]
) -> list[str]:
    """Lines of the title block."""
    size = " × ".join(number(s) for s in scene.size_mm)
    between = [] if gap is None else [f"electrode gap {number(gap.value_mm)} mm in the sections drawn"]
    return [
        f"{size} mm (x × y × z), all dimensions in mm",
        f"detail {scale_words(frame.per_mm)}, {paper.words(frame, grid)}",
        *between,
        *notes[:MOST_NOTES],
        "sensorgen",
    ]


WIDTH, HEIGHT = 297.0, 210.0
LEFT, RIGHT = 9.0, 288.0
DETAIL, OVERVIEW, FOOT, BOTTOM = 8.0, 109.0, 143.0, 204.0  # where the parts of the page begin, and the end
SPLIT = 192.0  # between findings and legend
NAMES = "AB"  # of the sections
Lanes = Sequence[Sequence[Measure]]


def svg(
    scene: Scene,
    title: str,
    boundaries_mm: Sequence[float],
    findings: Sequence[Finding],
    materials: Colours,
    notes: Sequence[str] = (),
    printed: Scene | None = None,
) -> str:
    """Draw a scene as it is printed.

    Parameters
    ----------
    scene : Scene
        The sensor on the bed, turned over if it is printed so.
    title : str
        What the page is about; any text.
    boundaries_mm : sequence of float
        Heights of the layer boundaries, from 0 at the bed [mm].
    findings : sequence of Finding
        What the checks say of this scene, on this bed.
    materials : mapping
        Display title and colour (``#rrggbb``) of each material by its name.
    notes : sequence of str
        Further lines for the title block.
    printed : Scene, optional
        As printed, in boxes, to be outlined over the sections.

    Returns
    -------
    str
        The SVG file's text.
    """
    grid = list(boundaries_mm) or [0.0, scene.size_mm[2]]
    lanes, details = _details(scene, grid)
    wholes = panels.arrange_wholes(details, scene.size_mm[2], LEFT, RIGHT, OVERVIEW + 10)
    letters, marked = panels.letters(scene.bodies), ranked(findings)
    entries = placed(marked, letters, (LEFT + 2, FOOT + 8.5, SPLIT - 3, BOTTOM - 2))
    shown = [entry.mark for entry in entries]
    gap = _nearest(details)
    taken = list[Point](chain.from_iterable(panels.letter_places(panel).values() for panel in details))
    left, room = SPLIT + 3, RIGHT - SPLIT - 3
    rows = title_rows(scene, details[0].frame, grid, gap[0] if gap else None, notes)
    mark = ""
    if gap and gap[1].view.start_mm <= gap[0].near[0] <= gap[1].view.end_mm:  # in the view that shows it smallest
        mark, space = panels.gap(gap[1], gap[0])
        taken += space
    parts = [
        *_sections(details, lanes, grid, materials),
        *(part for panel in details for part in panels.lettered(panel, letters, materials, printed)),
        mark,
        *on_detail(shown, details, grid, taken),
        *_overview(scene, details, wholes, materials),
        *on_overview(shown, details, wholes),
        *listed(entries, marked, LEFT + 2, FOOT + 3.5, SPLIT - LEFT - 5),
        line("frame", 6, FOOT - 2, WIDTH - 6, FOOT - 2) + line("frame", SPLIT, FOOT - 2, SPLIT, HEIGHT - 6),
        *legend(scene, letters, materials, left, FOOT + 3, room),
        *block(title, rows, left, BOTTOM - 3.5, room),
    ]
    return _page(title, parts)


def _details(scene: Scene, grid: Sequence[float]) -> tuple[Lanes, list[ViewPanel]]:
    """The lanes of heights and the detail views between them and the layers' numbers."""
    height = scene.size_mm[2]
    seen = views(scene)
    lanes = heights(seen, height)
    above, below = (max(len(widths(view)[side]) for view in seen) for side in (0, 1))
    left = LEFT + 2 + sum(map(panels.lane_width, lanes)) + 2
    top = DETAIL + 7 + panels.ROW * above
    bottom = OVERVIEW - 5 - panels.ROW * below
    return lanes, panels.arrange(seen, max(grid[-1], height), height, (left, top, RIGHT - paper.WIDTH, bottom))


def _nearest(details: Sequence[ViewPanel]) -> tuple[Gap, ViewPanel] | None:
    """Smallest gap of two terminals in any view, and the view that shows it."""
    gaps = [(measured, panel) for panel in details if (measured := nearest(panel.view))]
    return min(gaps, key=lambda pair: round(pair[0].value_mm, 6), default=None)


def _overview(
    scene: Scene, details: Sequence[ViewPanel], wholes: Sequence[ViewPanel], colours: Colours
) -> Iterator[str]:
    """The whole length of each section."""
    for detail, whole, name in zip(details, wholes, NAMES, strict=False):
        yield from panels.draw_whole(detail, whole, name, scene, colours)


def _sections(details: Sequence[ViewPanel], lanes: Lanes, grid: Sequence[float], colours: Colours) -> Iterator[str]:
    """The sections with layer grid, dimensions and captions."""
    first, right = details[0].frame, details[-1].frame.right
    yield box("bed", first.left - 2, first.bed, right - first.left + 4, 0.9)
    for panel in details:
        inside = "".join(panels.materials(panel, colours))
        yield element("g", "view", inside, data_across=panel.view.section.across, data_scale=repr(panel.frame.per_mm))
    yield from paper.grid(first, grid, right + panels.GUTTER)
    yield from paper.labels(first, grid, right + panels.GUTTER)
    yield from panels.beside(first, lanes)
    for panel, name in zip(details, NAMES, strict=False):
        above, below = widths(panel.view)
        over = panel.frame.top - 3
        yield panels.caption(panel, name, min(over - panels.ROW * len(above) - 1.5, panel.frame.top - 5.8))
        yield from panels.rows(panel.frame, above, over, -panels.ROW)
        yield from panels.rows(panel.frame, below, panel.frame.bed + 5.4, panels.ROW)
        yield panels.broken(panel)


def _page(title: str, parts: Sequence[str]) -> str:
    style = "\n" + (resources.files("sensorgen.scene.drawing") / "style.css").read_text("utf-8")
    head = [
        element("title", "", escaped(title)), element("style", "", style), element("defs", "", ARROWS),
        box("", 0, 0, WIDTH, HEIGHT, fill="#ffffff"), box("frame", 6, 6, WIDTH - 12, HEIGHT - 12),
    ]  # fmt: skip
    size = {"width": "297mm", "height": "210mm", "viewBox": "0 0 297 210"}
    inside = "\n".join(["", *head, *(p for p in parts if p), ""])
    return element("svg", "", inside, xmlns="http://www.w3.org/2000/svg", **size) + "\n"
