"""Plates from above, as SVG in millimetres: bed, what lies on it, and a list of it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from sensorgen.design.printer import Printer
from sensorgen.scene.drawing.paper import box, element, fitted, text
from sensorgen.workflows.batch.layout import Plate, Rect, Room
from sensorgen.workflows.batch.pieces import PrintPiece

COLOURS = ("#cfe3f5", "#f8d9c0", "#d5ecd0", "#e6d8ef", "#f6e7a8", "#d3d3d3", "#f5cfe0", "#c9ebe8")
_ROW_MM, _COLUMN_MM, _WORDS_MM = 5.0, 95.0, 3.6  # of the list: rows, columns, height of letters
_LETTER = 0.62  # width of a letter in font sizes, as sans-serif fonts have it at most on average
_STYLE = (
    "text { font-family: sans-serif; fill: #111 } .thin { fill: none; stroke: #555; stroke-width: .3 } "
    ".halo { stroke: #fff; stroke-width: .8; paint-order: stroke }"
)


def bed_of(printer: Printer) -> Rect:
    """The bed of a printer."""
    (x, y), (wide, deep) = printer.bed_centre_mm(), printer.bed_mm
    return Rect(x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2)


def bed_svg(
    bed: Rect, heading: str, note: str, shapes: Iterable[str], listed: Sequence[str], notes: Sequence[str] = ()
) -> str:
    """A bed with shapes from its back left corner downwards, under a heading and a note, over a list and more notes."""
    wide, deep = bed.x1 - bed.x0, bed.y1 - bed.y0
    columns = max(1, int(wide // _COLUMN_MM))
    rows = -(-len(listed) // columns)
    left, top, width, height = -6.0, -14.0, wide + 12, deep + 22 + (rows + len(notes)) * _ROW_MM
    places = [
        (k // rows * _COLUMN_MM, k % rows, fitted(line, _COLUMN_MM - 2, _WORDS_MM)) for k, line in enumerate(listed)
    ]
    places += [(0.0, rows + k, line) for k, line in enumerate(notes)]
    words = (text("", x, deep + 7 + row * _ROW_MM, line, font_size=_WORDS_MM) for x, row, line in places)
    parts = (
        element("style", inside=_STYLE), box("", left, top, width, height, fill="#fff"),
        box("thin", 0, 0, wide, deep), *shapes, text("", 0, -7, heading, font_size=6),
        text("", 0, -1.8, note, font_size=3.4), *words,
    )  # fmt: skip
    size = {"width": f"{width:g}mm", "height": f"{height:g}mm", "viewBox": f"{left:g} {top:g} {width:g} {height:g}"}
    return element("svg", "", "\n".join(("", *parts, "")), xmlns="http://www.w3.org/2000/svg", **size) + "\n"


def middle(x: float, y: float, size: float, words: str, kind: str = "") -> str:
    """Words around a place on the bed."""
    return text(kind, x, y + 0.36 * size, words, font_size=size, text_anchor="middle")


def svg(title: str, printer: Printer, room: Room, plate: Plate, pieces: Sequence[PrintPiece]) -> str:
    """A plate of specimens, each with its number and name.

    Parameters
    ----------
    title : str
        Name of the batch.
    printer : Printer
        Whose bed it is.
    room : Room
        What the plate had to offer.
    plate : mapping of int to Rect
        Place of each specimen.
    pieces : sequence of PrintPiece
        The specimens, by the same numbers.
    """
    bed = bed_of(printer)
    size = " x ".join(f"{side:g}" for side in printer.bed_mm)
    origin = "the front left corner" if bed.x0 == bed.y0 == 0 else "the middle"
    listed = [f"{k}: {pieces[number].name}, {pieces[number].design.name}" for k, number in enumerate(plate, 1)]
    return bed_svg(
        bed, f"{title}: {len(plate)} specimens on {printer.title}, {size} mm",
        f"y up, x to the right; contacts at the heavy edge; origin of the printer at {origin}",
        (*(_tower(tower, bed) for tower in room.kept), *_specimens(plate, pieces, bed)), listed,
    )  # fmt: skip


def colours(pieces: Sequence[PrintPiece]) -> Mapping[str, str]:
    """Colour of each design, by its hash, in the order of their names."""
    designs = {piece.design_id: piece.design.name for piece in pieces}
    known = sorted(designs, key=lambda key: (designs[key], key))
    return {key: COLOURS[k % len(COLOURS)] for k, key in enumerate(known)}


def _tower(tower: Rect, bed: Rect) -> str:
    """The prime tower."""
    x, y = tower.centre_mm[0] - bed.x0, bed.y1 - tower.centre_mm[1]
    dashed = {"stroke": "#555", "stroke_width": ".3", "stroke_dasharray": "2 1"}
    return _rect(tower, bed, fill="#eee", **dashed) + middle(x, y, 3.4, "tower")


def _specimens(plate: Plate, pieces: Sequence[PrintPiece], bed: Rect) -> Iterator[str]:
    fills = colours(pieces)
    for order, (number, place) in enumerate(plate.items(), 1):
        length, width = place.x1 - place.x0, place.y1 - place.y0
        size = min(5.0, 0.7 * width, 0.9 * length / _LETTER / len(f"{order}"))
        words = f"{order}: {pieces[number].name}"
        if len(words) * _LETTER * size > 0.95 * length:
            words = f"{order}"
        x, y = place.centre_mm[0] - bed.x0, bed.y1 - place.centre_mm[1]
        edge = f"M{x - length / 2:.6g} {y - width / 2:.6g}v{width:.6g}"
        yield (
            _rect(place, bed, fill=fills[pieces[number].design_id], stroke="#333", stroke_width=".25")
            + element("path", d=edge, stroke="#000", stroke_width="1") + middle(x, y, size, words)
        )  # fmt: skip


def _rect(place: Rect, bed: Rect, **attributes: str) -> str:
    return box("", place.x0 - bed.x0, bed.y1 - place.y1, place.x1 - place.x0, place.y1 - place.y0, **attributes)
