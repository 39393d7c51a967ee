"""Arrays larger than the bed, as tiles in one or two columns, all pads outside.

Leads of each tile lie under the next one, as shingles; seen from above (pads #, leads :)::

    # |   3    |:::::::|        right tiles are turned by half a turn
    # |        |   6   | #
    # |::::::::|       | #
    # |   2    |:::::::| #
    # |        |   5   | #
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, product
from math import prod
from typing import Annotated, Any, cast

from sensorgen.checks.widths import TOUCH_MM
from sensorgen.core.document import Column
from sensorgen.core.errors import BadInput
from sensorgen.design.arrays import ArrayLayout, Params, layout
from sensorgen.design.design import Design, make
from sensorgen.scene.scene import rounded

SEAM_MM = 5.0
_MOST_UP = 20
_NARROWEST_MM = 1.0  # pitch of a connector, half of it for a lead


@dataclass(frozen=True)
class Tile:
    """Tile of an array: its place, and which tracks of the array it has.

    Attributes
    ----------
    tile, design : int, str
        Number, and name of its design.
    turned_deg : int
        As it is laid [degree].
    x_mm, y_mm, length_mm, width_mm : float
        Its sensing area in that of the array: lowest corner, and sides [mm].
    columns, rows : int
        Of the array, in it. Rows of a tile lie along y: they are columns of the array.
    """

    tile: Annotated[int, Column("tile")]
    design: Annotated[str, Column("design")]
    turned_deg: Annotated[int, Column("turned", "degree")]
    x_mm: Annotated[float, Column("x", "mm")]
    y_mm: Annotated[float, Column("y", "mm")]
    length_mm: Annotated[float, Column("length", "mm")]
    width_mm: Annotated[float, Column("width", "mm")]
    columns: Annotated[int, Column("columns")]
    rows: Annotated[int, Column("rows")]


def tiles(design: Design) -> tuple[tuple[Tile, Design], ...]:
    """Tiles of an array that the bed does not hold, with their designs; none of any other sensor.

    Raises
    ------
    BadInput
        It has an outline, or its tiles are too large, too.
    """
    p, (bed_x, bed_y) = cast(Params, design.params), design.machine.bed_mm
    if not design.layout or p.tile or _fits(design.layout, design):
        return ()
    if design.border:
        length, width = design.layout.size_mm
        raise BadInput(
            f"{design.name}: {length:g} x {width:g} mm with its leads, the bed {bed_x:g} x {bed_y:g} mm; only "
            f"rectangles are printed as tiles: expected {_narrower(design)}"
        )
    splits = product(range(1, min(p.counts[1], 2) + 1), range(1, min(p.counts[0], _MOST_UP) + 1))
    for across, up in sorted(splits, key=prod):
        places = tuple(_places(design, across, up))
        if all(_fits(layout(Params(**own)), design) for _, own in places):
            base = design.model_dump(mode="json", exclude_defaults=True)
            return tuple((tile, make({**base, "parameters": own, "name": tile.design})) for tile, own in places)
    length, width = design.layout.size_mm
    raise BadInput(
        f"{design.name} is {length:g} x {width:g} mm, the bed {bed_x:g} x {bed_y:g} mm; tiles in two columns are too "
        "large with their leads, too: expected less, or narrower leads (connector_mm, lead_mm)"
    )


def _fits(of: ArrayLayout, design: Design) -> bool:
    """Test whether the bed holds a print of some tracks."""
    p, grown = of.params, 1 / (1 - design.shrinkage)
    size = of.size_mm[0] * grown, (of.size_mm[1] + p.ledge_mm) * grown
    sizes = zip(size if p.pads == "bottom" else size[::-1], design.machine.bed_mm, strict=True)
    return all(side <= bed + TOUCH_MM for side, bed in sizes)


def _narrower(design: Design) -> str:
    """Advice for an outline that the bed does not hold: leads so near to each other that it does, or a smaller one."""
    p = cast(Params, design.params)
    for tenths in range(round(10 * p.connector_mm) - 1, round(10 * _NARROWEST_MM) - 1, -1):
        near = replace(p, connector_mm=tenths / 10, lead_mm=min(p.lead_mm, tenths / 10 - _NARROWEST_MM / 2))
        if _fits(layout(near, design.border), design):
            return f"connector_mm {near.connector_mm:g} or less, lead_mm {near.lead_mm:.3g}"
    return "a smaller outline, or a longer pitch, which has fewer leads"


def _places(design: Design, across: int, up: int) -> Iterator[tuple[Tile, dict[str, Any]]]:
    """Tiles from the lowest left one upwards, then the right ones, and their parameters."""
    p, number = cast(Params, design.params), 0
    (m, n), (px, py) = p.counts, p.pitch
    columns, rows = ([k * count // parts for k in range(parts + 1)] for count, parts in ((n, across), (m, up)))
    for right, (j0, j1) in enumerate(pairwise(columns)):
        for i0, i1 in pairwise(rows):
            number += 1
            last = i0 == 0 if right else i1 == m  # at whose end no tile follows
            seams = {(0, 1): "both", (0, 0): "rows", (1, 1): "columns", (1, 0): "none"}[int(last), int(across == 2)]
            long, wide = rounded((j1 - j0) * px), rounded((i1 - i0) * py)
            own = {
                **design.parameters, "length_mm": wide, "width_mm": long, "pitch_x_mm": py, "pitch_y_mm": px,
                "column_mm": p.row_mm, "row_mm": p.column_mm, "rows": 0.0, "columns": 0.0, "pads": "left",
                "seams": seams, "tile": float(number), "seam_mm": 0.0 if right else p.seam_mm or SEAM_MM,
            }  # fmt: skip
            name = f"{design.name[:90]}-{number}"
            place = rounded(j0 * px), rounded(i0 * py)
            yield Tile(number, name, 180 * right, *place, long, wide, j1 - j0, i1 - i0), own
