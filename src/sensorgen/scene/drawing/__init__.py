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

from collections.abc import Iterator, Sequence
from importlib import resources

from sensorgen.core.findings import Finding
from sensorgen.scene.drawing import markers, panels, paper
from sensorgen.scene.drawing.panels import Colours
from sensorgen.scene.drawing.paper import ARROWS, ViewPanel, box, element, escaped, line
from sensorgen.scene.drawing.view import Measure, heights, nearest, views, widths
from sensorgen.scene.scene import Point, Scene

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
    letters, marked = panels.letters(scene.bodies), markers.ranked(findings)
    entries = markers.placed(marked, letters, (LEFT + 2, FOOT + 8.5, SPLIT - 3, BOTTOM - 2))
    shown = [entry.mark for entry in entries]
    gaps = [(measured, panel) for panel in details if (measured := nearest(panel.view))]
    gap = min(gaps, key=lambda pair: round(pair[0].value_mm, 6), default=None)
    taken: list[Point] = [place for panel in details for place in panels.letter_places(panel).values()]
    left, room = SPLIT + 3, RIGHT - SPLIT - 3
    rows = markers.rows(scene, details[0].frame, grid, gap[0] if gap else None, notes)
    marks = []
    if gap and gap[0].near[0] <= gap[1].view.end_mm:  # in the view that shows it smallest
        mark, space = panels.gap(gap[1], gap[0])
        taken += space
        marks.append(mark)
    parts = [
        *_sections(scene, details, lanes, grid, materials),
        *(part for panel in details if printed for part in panels.outlined(panel, printed)),
        *marks,
        *markers.on_detail(shown, details, grid, taken),
        *(
            p
            for d, w, n in zip(details, wholes, NAMES, strict=False)
            for p in panels.draw_whole(d, w, n, scene, materials)
        ),
        *markers.on_overview(shown, details, wholes),
        *markers.listed(entries, marked, LEFT + 2, FOOT + 3.5, SPLIT - LEFT - 5),
        line("frame", 6, FOOT - 2, WIDTH - 6, FOOT - 2) + line("frame", SPLIT, FOOT - 2, SPLIT, HEIGHT - 6),
        *markers.legend(scene, letters, materials, left, FOOT + 3, room),
        *markers.block(title, rows, left, BOTTOM - 3.5, room),
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


def _sections(
    scene: Scene, details: Sequence[ViewPanel], lanes: Lanes, grid: Sequence[float], colours: Colours
) -> Iterator[str]:
    """The sections with layer grid, dimensions, captions and letters."""
    letters = panels.letters(scene.bodies)
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
        yield from panels.lettered(panel, letters, colours)


def _page(title: str, parts: Sequence[str]) -> str:
    style = "\n" + (resources.files("sensorgen.scene.drawing") / "style.css").read_text("utf-8")
    head = [
        element("title", "", escaped(title)), element("style", "", style), element("defs", "", ARROWS),
        box("", 0, 0, WIDTH, HEIGHT, fill="#ffffff"), box("frame", 6, 6, WIDTH - 12, HEIGHT - 12),
    ]  # fmt: skip
    size = {"width": "297mm", "height": "210mm", "viewBox": "0 0 297 210"}
    inside = "\n".join(["", *head, *(p for p in parts if p), ""])
    return element("svg", "", inside, xmlns="http://www.w3.org/2000/svg", **size) + "\n"
