"""Legend and title block, in the lower right corner."""

from collections.abc import Iterator, Mapping, Sequence

from sensorgen.scene.drawing import layers
from sensorgen.scene.drawing.panels import Colours, colour, scale_words
from sensorgen.scene.drawing.paper import ViewFrame, box, clean, fitted, line, number, text, wrapped
from sensorgen.scene.drawing.view import Gap
from sensorgen.scene.scene import Scene

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


def rows(scene: Scene, frame: ViewFrame, grid: Sequence[float], gap: Gap | None, notes: Sequence[str]) -> list[str]:
    """Lines of the title block."""
    size = " × ".join(number(s) for s in scene.size_mm)
    between = [] if gap is None else [f"electrode gap {number(gap.value_mm)} mm in the sections drawn"]
    return [
        f"{size} mm (x × y × z), all dimensions in mm",
        f"detail {scale_words(frame.per_mm)}, {layers.words(frame, grid)}",
        *between,
        *notes[:MOST_NOTES],
        "sensorgen",
    ]
