"""Where specimens lie on the plate, never over one another, the tower or the edge; and its picture, as SVG."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from sensorgen.core.errors import OutOfRange
from sensorgen.design.printer import Printer, Quality, tower
from sensorgen.scene.drawing.paper import box, element, fitted, text
from sensorgen.workflows.batch.plan import PrintPiece

EDGE_MM = 5.0  # to the edge of the bed: the skirt runs 3 mm round everything, a line or two wide
TOWER_BRIM_MM = 2.0
_ROUNDING_MM = 1e-6

Size = tuple[float, float]


@dataclass(frozen=True)
class Rect:
    """A rectangle on the bed, in the printer's own coordinates [mm]: front left and back right corner."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def centre_mm(self) -> tuple[float, float]:
        """Middle [mm]."""
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    @property
    def size_mm(self) -> Size:
        """Length along x and width along y [mm]."""
        return self.x1 - self.x0, self.y1 - self.y0

    def meets(self, other: "Rect") -> bool:
        """Test whether the two overlap; a shared edge is none."""
        return (
            min(self.x1, other.x1) - max(self.x0, other.x0) > _ROUNDING_MM
            and min(self.y1, other.y1) - max(self.y0, other.y0) > _ROUNDING_MM
        )

    def holds(self, other: "Rect") -> bool:
        """Test whether the other lies inside."""
        return (
            other.x0 >= self.x0 - _ROUNDING_MM
            and other.y0 >= self.y0 - _ROUNDING_MM
            and other.x1 <= self.x1 + _ROUNDING_MM
            and other.y1 <= self.y1 + _ROUNDING_MM
        )

    def grown(self, by_mm: float) -> "Rect":
        """With all edges moved outwards [mm]."""
        return Rect(self.x0 - by_mm, self.y0 - by_mm, self.x1 + by_mm, self.y1 + by_mm)

    def longer(self, by_mm: float) -> "Rect":
        """With its right and its back edge moved outwards [mm]."""
        return Rect(self.x0, self.y0, self.x1 + by_mm, self.y1 + by_mm)

    def moved(self, x_mm: float, y_mm: float) -> "Rect":
        """Somewhere else."""
        return Rect(self.x0 + x_mm, self.y0 + y_mm, self.x1 + x_mm, self.y1 + y_mm)


@dataclass(frozen=True)
class Room:
    """Room of a plate.

    Attributes
    ----------
    area : Rect
        Where specimens may lie.
    tower : tuple of Rect
        What they must stay clear of: the prime tower with its brim.
    gap_mm : float
        Least distance of neighbours, and of a specimen and the tower [mm].
    """

    area: Rect
    tower: tuple[Rect, ...]
    gap_mm: float

    def free(self, place: Rect) -> bool:
        """Test whether a specimen may lie there, were it alone."""
        around = place.grown(self.gap_mm)
        return self.area.holds(place) and not any(around.meets(k) for k in self.tower)


Plate = dict[int, Rect]  # number in the list of sizes, to place
Layouts = Callable[[Sequence[Size], Room], list[Plate]]


def bed_of(printer: Printer) -> Rect:
    """The bed of a printer."""
    (x, y), (wide, deep) = printer.bed_centre_mm(), printer.bed_mm
    return Rect(x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2)


def room(printer: Printer, quality: Quality, tools: int, spacing_mm: float, brim_mm: float) -> Room:
    """Room of a printer's plate.

    Parameters
    ----------
    printer, quality : Printer, Quality
        Their bed, and the layers that decide how large the tower is.
    tools : int
        How many tools print; one alone has no tower [-].
    spacing_mm, brim_mm : float
        Between neighbours, and round each of them [mm].
    """
    area = bed_of(printer).grown(-EDGE_MM - brim_mm)
    at = tower(printer, quality, tools)
    around = Rect(at.x_mm, at.y_mm, at.x_mm + at.side_mm, at.y_mm + at.side_mm).grown(TOWER_BRIM_MM)
    return Room(area, (around,) if tools > 1 else (), spacing_mm + 2 * brim_mm)


def packed(sizes: Sequence[Size], room: Room) -> list[Plate]:
    """As many as fit on each plate: in their order, or largest first where that takes fewer plates.

    Parameters
    ----------
    sizes : sequence of (float, float)
        Length along x and width along y of each [mm].
    room : Room
        The plate.

    Raises
    ------
    OutOfRange
        One of them fits on no plate.

    Notes
    -----
    Each goes to the free place furthest to the front, then to the left. Nothing is turned: lines and their resistance
    have a direction.
    """
    _refuse_giants(sizes, room, middle=False)
    given = range(len(sizes))
    largest = sorted(given, key=lambda i: (-prod(sizes[i]), -sizes[i][0], i))
    plates = min((_packed(sizes, order, room) for order in (given, largest)), key=len)
    return [_centred(plate, room) for plate in plates]


def _packed(sizes: Sequence[Size], order: Sequence[int], room: Room) -> list[Plate]:
    """Plates filled in an order; each specimen takes its gap along, to the right and the back."""
    opened: list[tuple[Plate, list[Rect]]] = []
    for number in order:
        new: tuple[Plate, list[Rect]] = {}, []
        plate, taken, place = next(
            (plate, taken, place) for plate, taken in (*opened, new) if (place := _place(sizes[number], room, taken))
        )
        if not taken:
            opened.append((plate, taken))
        taken.append(place)
        plate[number] = place.longer(-room.gap_mm)
    return [plate for plate, _ in opened]


def _place(size: Size, room: Room, taken: Sequence[Rect] = ()) -> Rect | None:
    """The place furthest to the front, then to the left, with the gap behind and beside it; None where there is none.

    It begins where the area does, or what is taken ends.
    """
    length, width = (side + room.gap_mm for side in size)
    area, there = room.area.longer(room.gap_mm), [*(tower.longer(room.gap_mm) for tower in room.tower), *taken]
    x0, y0, x1, y1 = np.array([[r.x0, r.y0, r.x1, r.y1] for r in there]).reshape(-1, 4).T
    starts = np.unique([area.x0, *x1])
    starts = starts[(starts >= area.x0) & (starts + length <= area.x1 + _ROUNDING_MM)]
    for y in np.unique([area.y0, *y1]).tolist():
        if area.y0 <= y <= area.y1 + _ROUNDING_MM - width:
            row = (y0 + _ROUNDING_MM < y + width) & (y + _ROUNDING_MM < y1)
            meets = (x0[row] + _ROUNDING_MM < starts[:, None] + length) & (starts[:, None] + _ROUNDING_MM < x1[row])
            for x in starts[~meets.any(1)][:1].tolist():
                return Rect(x, y, x + length, y + width)
    return None


def column(per_column: int) -> Layouts:
    """The layout in columns of at most ``per_column``, in the middle of the plate, as the thesis had its five.

    >>> from sensorgen.design.printer import load_printer, load_quality
    >>> here = room(load_printer("diabase-h5"), load_quality("fine"), tools=2, spacing_mm=5, brim_mm=0)
    >>> column(5)([(100.0, 10.0)] * 5, here)[0][0]
    Rect(x0=-50.0, y0=-35.0, x1=50.0, y1=-25.0)
    """

    def layout(sizes: Sequence[Size], room: Room) -> list[Plate]:
        _refuse_giants(sizes, room, middle=True)
        plates: list[Plate] = []
        columns: list[list[int]] = []
        for group in _columns(sizes, per_column, room):
            wider = _in_columns(sizes, [*columns, group], room)
            if all(map(room.free, wider.values())):
                columns.append(group)
                plates[-1:] = [wider]
            else:
                columns = [group]
                plates.append(_in_columns(sizes, columns, room))
        return plates

    return layout


def _columns(sizes: Sequence[Size], per_column: int, room: Room) -> Iterator[list[int]]:
    """Numbers of the specimens in each column, which is no deeper than lies free in the middle of the plate."""
    group: list[int] = []
    for number in range(len(sizes)):
        longer = _in_columns(sizes, [[*group, number]], room)
        if len(group) == per_column or not all(map(room.free, longer.values())):
            yield group
            group = []
        group.append(number)
    yield group


def _in_columns(sizes: Sequence[Size], columns: Sequence[Sequence[int]], room: Room) -> Plate:
    lengths = [max(sizes[i][0] for i in group) for group in columns]
    x, middle_y = room.area.centre_mm
    x -= (sum(lengths) + room.gap_mm * (len(columns) - 1)) / 2
    plate: Plate = {}
    for group, length in zip(columns, lengths, strict=True):
        y = middle_y - (sum(sizes[i][1] for i in group) + room.gap_mm * (len(group) - 1)) / 2
        for i in group:
            left = x + (length - sizes[i][0]) / 2
            plate[i] = Rect(left, y, left + sizes[i][0], y + sizes[i][1])
            y += sizes[i][1] + room.gap_mm
        x += length + room.gap_mm
    return plate


def _centred(plate: Plate, room: Room) -> Plate:
    """The whole of a plate moved to its middle, where the tower is not in the way."""
    places = plate.values()
    block = Rect(
        min(p.x0 for p in places), min(p.y0 for p in places), max(p.x1 for p in places), max(p.y1 for p in places)
    )
    (x, y), (to_x, to_y) = block.centre_mm, room.area.centre_mm
    for by in ((to_x - x, to_y - y), (to_x - x, 0.0), (0.0, to_y - y)):
        moved = {number: place.moved(*by) for number, place in plate.items()}
        if all(map(room.free, moved.values())):
            return moved
    return plate


def _refuse_giants(sizes: Sequence[Size], room: Room, *, middle: bool) -> None:
    """Refuse what fits on no plate, however empty, or not in its ``middle``."""
    for length, width in dict.fromkeys(sizes):
        if not _place((length, width), room):
            x, y = (max(side, 0.0) for side in room.area.size_mm)
            raise OutOfRange(
                f"a specimen of {length:g} x {width:g} mm fits on no plate of this printer: {x:g} x {y:g} mm are free, "
                "less the prime tower; make it smaller, or keep less room for a brim"
            )
        if middle and not room.free(_in_columns([(length, width)], [[0]], room)[0]):
            raise OutOfRange(
                f"a specimen of {length:g} x {width:g} mm in the middle of the plate reaches the prime tower; "
                "use the layout 'packed'"
            )


COLOURS = ("#cfe3f5", "#f8d9c0", "#d5ecd0", "#e6d8ef", "#f6e7a8", "#d3d3d3", "#f5cfe0", "#c9ebe8")
_ROW_MM, _COLUMN_MM, _WORDS_MM = 5.0, 95.0, 3.6  # of the list: rows, columns, height of letters
_LETTER = 0.62  # width of a letter in font sizes, as sans-serif fonts have it at most on average
_STYLE = (
    "text { font-family: sans-serif; fill: #111 } .thin { fill: none; stroke: #555; stroke-width: .3 } "
    ".halo { stroke: #fff; stroke-width: .8; paint-order: stroke }"
)


def bed_svg(
    bed: Rect, heading: str, note: str, shapes: Iterable[str], listed: Sequence[str], notes: Sequence[str] = ()
) -> str:
    """A bed with shapes from its back left corner downwards, under a heading and a note, over a list and more notes."""
    wide, deep = bed.size_mm
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
        (*(_tower(tower, bed) for tower in room.tower), *_specimens(plate, pieces, bed)), listed,
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
        length, width = place.size_mm
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
    length, width = place.size_mm
    return box("", place.x0 - bed.x0, bed.y1 - place.y1, length, width, **attributes)
