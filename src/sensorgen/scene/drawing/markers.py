"""Findings: numbered markers at their places, and the list that the numbers lead to."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin

from sensorgen.core.findings import SEVERITIES, Finding
from sensorgen.scene.drawing.panels import GUTTER, Panel, Room
from sensorgen.scene.drawing.paper import Frame, clean, element, fitted, line, spread, text, wrapped
from sensorgen.scene.scene import AXES, Point

MOST, FEW = 10, 6  # findings in the list; up to so many have room for longer words
RADIUS, CLEAR = 2.1, 4.5  # of a marker; from one marker's centre to the next [mm]
LINE, INDENT, COLUMNS_APART = 2.95, 6.0, 5.0  # of the list [mm]
DISTANCES, ANGLES = (5.0, 7.5, 10.0, 13.0, 17.0, 22.0), 16


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
class Entry:
    """A finding in the list: its lines with their classes, and where they begin on the page [mm]."""

    mark: Marked
    x: float
    y: float
    rows: list[tuple[str, str]]


def ranked(findings: Sequence[Finding]) -> list[Marked]:
    """All findings numbered from the most severe to the least, waived ones last."""
    order = sorted(findings, key=lambda f: (bool(f.waiver), SEVERITIES.index(f.severity)))
    return [Marked(k, finding) for k, finding in enumerate(order, start=1)]


def height_mm(finding: Finding, boundaries_mm: Sequence[float]) -> float | None:
    """Height over the bed at which a finding shows: of its place or, without one, the middle of its layer [mm]."""
    if finding.place_mm is not None:
        return finding.place_mm[2]
    if finding.layer is not None and 1 <= finding.layer < len(boundaries_mm):
        return (boundaries_mm[finding.layer - 1] + boundaries_mm[finding.layer]) / 2
    return None


def along_mm(finding: Finding, panel: Panel) -> float | None:
    """Where along a view a finding is; None without a place or outside of the view [mm]."""
    if finding.place_mm is None:
        return None
    along = finding.place_mm[AXES.index(panel.view.section.across)]
    return along if 0 <= along <= panel.view.end_mm else None


def panel_of(finding: Finding, panels: Sequence[Panel]) -> int:
    """Number of the panel that shows a finding: one whose window holds it, cut as near to it as can be."""

    def far(k: int) -> tuple[bool, float]:
        view = panels[k].view
        if finding.place_mm is None:
            return (True, -k)  # the last one stands beside the layers' numbers
        aside = abs(finding.place_mm[AXES.index(view.normal)] - view.section.at_mm)
        return (along_mm(finding, panels[k]) is None, aside)

    return min(range(len(panels)), key=far)


def on_detail(
    marked: Sequence[Marked], panels: Sequence[Panel], boundaries_mm: Sequence[float], taken: list[Point]
) -> Iterator[str]:
    """Markers on the detail views, clear of the points ``taken``; what lies elsewhere stands at the right edge."""
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
        else:
            taken.append(spot)
            yield _marker(mark, spot, _free(spot, panels[k], taken))
    for k, found in sorted(edges.items()):
        yield from _at_edge(found, panels[k].frame)


def _spot(panel: Panel, along: float | None, z: float) -> Point:
    """Place of a finding on the page; the right edge where it has none, and never off the view [mm]."""
    x, y = panel.place((panel.view.end_mm if along is None else along, z))
    return x, min(max(y, panel.frame.top), panel.frame.bed)


def _at_edge(found: list[tuple[Point, Marked]], frame: Frame) -> Iterator[str]:
    found = sorted(found, key=lambda pair: (pair[0][1], pair[1].number))
    heights = spread([spot[1] for spot, _ in found], [CLEAR] * len(found), frame.top - 8, frame.bed + 6)
    for (spot, mark), y in zip(found, heights, strict=True):
        yield _marker(mark, spot, (frame.right + GUTTER / 2 + 0.6, y))


def on_overview(marked: Sequence[Marked], details: Sequence[Panel], wholes: Sequence[Panel]) -> Iterator[str]:
    """Markers on the overview strips, for those that lie outside of the detail views."""
    for k, whole in enumerate(wholes):
        far = [(spot, mark) for mark in marked if (spot := _far_spot(mark.finding, details, k, whole))]
        far.sort(key=lambda pair: (pair[0], pair[1].number))
        places = spread([spot[0] for spot, _ in far], [CLEAR] * len(far), whole.frame.left, whole.frame.right)
        for (spot, mark), x in zip(far, places, strict=True):
            yield _marker(mark, spot, (x, whole.frame.top - 3.2))


def _far_spot(finding: Finding, details: Sequence[Panel], k: int, whole: Panel) -> Point | None:
    """Place on strip k of a finding that the detail views do not hold."""
    along = along_mm(finding, whole)
    if finding.place_mm is None or along is None or panel_of(finding, details) != k:
        return None
    return None if along_mm(finding, details[k]) is not None else _spot(whole, along, finding.place_mm[2])


def _free(spot: Point, panel: Panel, taken: list[Point]) -> Point:
    """A place for a marker near its spot that covers nothing else; it is taken then."""
    frame = panel.frame
    for distance in DISTANCES:
        for k in range(ANGLES):
            angle = pi / 4 + (k // 2 if k % 2 else -k // 2) * 2 * pi / ANGLES
            x, y = spot[0] + distance * cos(angle), spot[1] - distance * sin(angle)
            inside = frame.left + RADIUS <= x <= frame.right - RADIUS and frame.top + RADIUS <= y <= frame.bed - RADIUS
            if inside and all(hypot(x - p[0], y - p[1]) >= CLEAR for p in taken):
                taken.append((x, y))
                return x, y
    return spot


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


def placed(marked: Sequence[Marked], letters: Mapping[str, str], room: Room) -> list[Entry]:
    """As many findings as there is room for on the page, in two columns; fewer may have more words."""
    left, top, right, bottom = room
    lines = 2 if len(marked) > FEW else 4
    wide = (right - left - COLUMNS_APART) / 2
    entries: list[Entry] = []
    x, y = left, top
    for mark in marked[:MOST]:
        rows = _rows(mark, letters, wide - INDENT, lines)
        if y + (len(rows) - 1) * LINE > bottom:
            x, y = x + wide + COLUMNS_APART, top
        if x > right - wide + 1e-9 or y + (len(rows) - 1) * LINE > bottom:
            break
        entries.append(Entry(mark, x, y, rows))
        y += len(rows) * LINE + 0.6
    return entries


def listed(entries: Sequence[Entry], marked: Sequence[Marked], left: float, top: float, room: float) -> Iterator[str]:
    """The list of findings under its heading [mm on the page]."""
    yield text("heading", left, top, fitted(_summary(marked, len(entries)), room, 3.2))
    for entry in entries:
        yield _balloon(entry.mark, entry.x + RADIUS, entry.y + 0.6)
        for k, (kind, words) in enumerate(entry.rows):
            yield text(kind, entry.x + INDENT, entry.y + k * LINE, words)


def _summary(marked: Sequence[Marked], shown: int) -> str:
    if not marked:
        return "Findings: no findings"
    kinds = [mark.kind for mark in marked]
    counts = [(kinds.count(kind), kind) for kind in (*SEVERITIES, "waived")]
    words = ", ".join(f"{n} {_plural(kind, n)}" for n, kind in counts if n)
    return f"Findings: {words}" + (f" … and {len(marked) - shown} more in check.json" if shown < len(marked) else "")


def _plural(kind: str, count: int) -> str:
    return kind if count == 1 or kind in ("info", "waived") else kind + "s"


def _rows(mark: Marked, letters: Mapping[str, str], room: float, lines: int) -> list[tuple[str, str]]:
    """Class and text of one finding's lines: up to ``lines`` for what and where, one for what to do."""
    f = mark.finding
    where = ", ".join(_where(f, letters))
    what = wrapped(f"{f.rule}{f' ({where})' if where else ''}: {f.message}", room, lines)
    advice = f"waived: {f.waiver}" if f.waiver else f.advice
    kind = "faint" if f.waiver else ""
    return [(kind, row) for row in what] + [("faint", fitted(clean(advice), room))] * bool(advice)


def _where(f: Finding, letters: Mapping[str, str]) -> Iterator[str]:
    """Body, by its letter in the legend; layer; number of places, or the one place, which may lie elsewhere."""
    if f.body:
        yield " / ".join(letters.get(name, name) for name in f.body.split(" / "))
    if f.layer is not None:
        yield f"layer {f.layer}"
    if f.count > 1:
        yield f"{f.count} places"
    elif f.layer is not None and f.place_mm is not None:
        yield f"at x {f.place_mm[0]:g}, y {f.place_mm[1]:g}"
