"""The plate from above, as SVG in millimetres: bed, prime tower, and every specimen with its number and name."""

import html
from collections.abc import Mapping, Sequence

from sensorgen.design.printer import Printer
from sensorgen.workflows.batch.layout import Plate, Rect, Room
from sensorgen.workflows.batch.pieces import Piece

COLOURS = ("#cfe3f5", "#f8d9c0", "#d5ecd0", "#e6d8ef", "#f6e7a8", "#d3d3d3", "#f5cfe0", "#c9ebe8")
_ROW_MM = 5.0
_LETTERS = 48  # of a line of the list, which is 95 mm wide
_LETTER = 0.62  # width of a letter in font sizes, as sans-serif fonts have it at most on average
_STYLE = "text { font-family: sans-serif; fill: #111 } .thin { fill: none; stroke: #555; stroke-width: .3 }"


def svg(title: str, printer: Printer, room: Room, plate: Plate, pieces: Sequence[Piece]) -> str:
    """A picture of a plate.

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
    pieces : sequence of Piece
        The specimens, by the same numbers.
    """
    (x, y), (bed_x, bed_y) = printer.bed_centre_mm(), printer.bed_mm
    bed = Rect(x - bed_x / 2, y - bed_y / 2, x + bed_x / 2, y + bed_y / 2)
    columns = max(1, int(bed_x // 95))
    rows = -(-len(plate) // columns)
    height = bed_y + 22 + rows * _ROW_MM
    shapes = [_bed(bed), *(_tower(k, bed) for k in room.kept), *_specimens(plate, pieces, bed)]
    words = [
        _text(0, -7, 6, f"{title}: {len(plate)} specimens on {printer.title}, {bed_x:g} x {bed_y:g} mm"),
        _text(
            0, -1.8, 3.4, f"y up, x to the right; contacts at the heavy edge; origin of the printer at {_origin(bed)}"
        ),
        *_list(plate, pieces, columns, rows, bed_y + 7),
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-6 -14 {bed_x + 12:g} {height:g}" '
        f'width="{bed_x + 12:g}mm" height="{height:g}mm">\n<style>{_STYLE}</style>\n'
        f'<rect x="-6" y="-14" width="{bed_x + 12:g}" height="{height:g}" fill="#fff"/>\n'
        + "\n".join([*shapes, *words])
        + "\n</svg>\n"
    )


def colours(pieces: Sequence[Piece]) -> Mapping[str, str]:
    """Colour of each design, by its hash, in the order of their names."""
    designs = {piece.design_id: piece.design.name for piece in pieces}
    known = sorted(designs, key=lambda key: (designs[key], key))
    return {key: COLOURS[k % len(COLOURS)] for k, key in enumerate(known)}


def _bed(bed: Rect) -> str:
    return f'<rect class="thin" x="0" y="0" width="{bed.x1 - bed.x0:g}" height="{bed.y1 - bed.y0:g}"/>'


def _tower(kept: Rect, bed: Rect) -> str:
    at = _box(kept, bed)
    middle = (kept.x0 + kept.x1) / 2 - bed.x0
    return f'<rect {at} fill="#eee" stroke="#555" stroke-width=".3" stroke-dasharray="2 1"/>' + _text(
        middle, bed.y1 - (kept.y0 + kept.y1) / 2 + 1.2, 3.4, "tower", middle=True
    )


def _specimens(plate: Plate, pieces: Sequence[Piece], bed: Rect) -> list[str]:
    fills = colours(pieces)
    found = []
    for order, (number, place) in enumerate(plate.items(), 1):
        piece = pieces[number]
        x, y = place.x0 - bed.x0, bed.y1 - place.y1
        length, width = place.x1 - place.x0, place.y1 - place.y0
        size = min(5.0, 0.7 * width, 0.9 * length / _LETTER / len(f"{order}"))
        text = f"{order}: {piece.name}"
        if len(text) * _LETTER * size > 0.95 * length:
            text = f"{order}"
        found.append(
            f'<rect {_box(place, bed)} fill="{fills[piece.design_id]}" stroke="#333" stroke-width=".25"/>'
            f'<path d="M{x:.6g} {y:.6g}v{width:.6g}" stroke="#000" stroke-width="1"/>'
            + _text(x + length / 2, y + width / 2 + 0.36 * size, size, text, middle=True)
        )
    return found


def _list(plate: Plate, pieces: Sequence[Piece], columns: int, rows: int, top: float) -> list[str]:
    return [
        _text(
            (order // rows) * 95, top + (order % rows) * _ROW_MM, 3.6,
            _cut(f"{order + 1}: {pieces[number].name}, {pieces[number].design.name}"),
        )
        for order, number in enumerate(plate)
        if order < columns * rows
    ]  # fmt: skip


def _cut(text: str) -> str:
    return text if len(text) <= _LETTERS else text[: _LETTERS - 1] + "…"


def _box(place: Rect, bed: Rect) -> str:
    """Place as SVG has it, from the back left corner of the bed downwards."""
    return (
        f'x="{place.x0 - bed.x0:.6g}" y="{bed.y1 - place.y1:.6g}" '
        f'width="{place.x1 - place.x0:.6g}" height="{place.y1 - place.y0:.6g}"'
    )


def _origin(bed: Rect) -> str:
    return "the front left corner" if bed.x0 == bed.y0 == 0 else "the middle"


def _text(x: float, y: float, size: float, text: str, *, middle: bool = False) -> str:
    anchor = ' text-anchor="middle"' if middle else ""
    return f'<text x="{x:.6g}" y="{y:.6g}" font-size="{size:.4g}"{anchor}>{html.escape(text)}</text>'
