"""The whole sensor under the detail: long, flat, with its height exaggerated."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from sensorgen.scene.drawing import dimensions
from sensorgen.scene.drawing.panels import Colours, ViewPanel, materials
from sensorgen.scene.drawing.paper import ViewFrame, box, fitted, number, text
from sensorgen.scene.drawing.view import Measure
from sensorgen.scene.scene import AXES, Scene

HEIGHT = 9.0  # of the strip on paper [mm]
FINEST = 0.25  # a period that is shorter on paper is not drawn [mm]
MOST_CORNERS = 6000
LEFT, RIGHT = 14.0, 4.0  # room beside a strip [mm]


def arrange(details: Sequence[ViewPanel], height_mm: float, left: float, right: float, top: float) -> list[ViewPanel]:
    """A strip for each detail view, side by side on the page [mm]."""
    each = (right - left) / len(details)
    up = HEIGHT / height_mm
    panels = []
    for k, detail in enumerate(details):
        view = replace(detail.view, end_mm=detail.view.extent_mm)
        along = min((each - LEFT - RIGHT) / view.extent_mm, up)
        start = left + k * each + LEFT
        panels.append(ViewPanel(view, ViewFrame(start, top + HEIGHT, start + view.extent_mm * along, top, along, up)))
    return panels


def draw(detail: ViewPanel, whole: ViewPanel, name: str, scene: Scene, colours: Colours) -> Iterator[str]:
    """The strip with its detail window, its length and its height."""
    frame, view = whole.frame, whole.view
    long, ratio = frame.right - frame.left, frame.per_mm_up / frame.per_mm
    shortened = detail.view.end_mm < view.extent_mm
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
        yield box("fine", frame.left, frame.top, long, HEIGHT)
        yield text("small middle", frame.left + long / 2, frame.top + HEIGHT / 2 + 0.8, fine)
    if shortened:
        window = detail.view.end_mm * frame.per_mm
        yield box("window", frame.left - 0.4, frame.top - 0.6, window + 0.8, HEIGHT + 1.2)
    yield from dimensions.beside(frame, [[Measure(0.0, scene.size_mm[2])]])
    yield from dimensions.rows(frame, [[Measure(0.0, view.extent_mm)]], frame.bed + 4.6, dimensions.ROW)
