"""Coupons as bodies on a plate: outlines, slicer settings, 3MF files and a picture of the plate.

The lines of bars and ladders run along x of the bed, without walls, in every layer; bars at an angle are turned.
"""

import html
from collections.abc import Iterator, Mapping, Sequence
from math import cos, pi, radians, sin, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

import shapely
from shapely import affinity

from sensorgen.analysis.characterise.catalogue import (
    ELECTRODE_MM,
    LADDER_MM,
    PAD_DIAMETER_MM,
    PAD_MM,
    PAD_PITCH_MM,
    PADS_IN_ROW,
    PLATE_RADIUS_MM,
    STRIP_MM,
    UPPER_MM,
    Coupon,
    film_radius_mm,
)
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import Design
from sensorgen.design.tower import tower
from sensorgen.export import threemf
from sensorgen.export.slicers import prusa
from sensorgen.export.slicers.loads import loads
from sensorgen.export.threemf.part import part_of
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Body, Prism, box
from sensorgen.workflows.batch.layout import Plate, Rect, packed, room

if TYPE_CHECKING:
    from shapely import Polygon

# Lines side by side along the fill angle in every layer, as PrusaSlicer 2.5 and later print them
ALIGNED = {
    "perimeters": "0", "fill_pattern": "alignedrectilinear", "fill_density": "99%", "fill_angle": "0",
    "top_solid_layers": "0", "bottom_solid_layers": "0",
}  # fmt: skip
LINES_BOX_MM = (76.0, 52.0)
SPACING_MM = 4.0
WALLS, FILMS, COMBS, PITCH_MM, STEP_MM = 4, 4, 3, 2.0, 0.1  # of the piece for lines and shorts
_NOTES = (
    "bars: current through both ends, voltage between the tabs; discs and pads: terminals over both faces",
    "red: terminals of 3 mm across the bar, of the material of your sensors' terminals; strip 1 is the left one",
    "small numbers: films and pads as in the form",
)
_OTHER_COLOUR = "#f2c14e"  # of the dielectric where both materials have the same
_TAB_MM = (2.0, 4.0)  # of a bar for a voltage probe
_CORNERS = 96


def carrier(
    conductor: str, dielectric: str, printer: str, quality: str, tools: Mapping[str, int], folder: Path
) -> Design:
    """A design that gives the plate its printer, layers, tools and profile; names as seen from a folder."""
    from sensorgen.design.design import make, with_own_files

    slots = dict.fromkeys(("film", "dielectric", "isolation"), dielectric)
    slots |= dict.fromkeys(("top_electrode", "bottom_electrode"), conductor)
    data = {"shape": "reference", "materials": slots, "printer": printer, "quality": quality, "tools": dict(tools)}
    return make(with_own_files(data, folder))


def bodies(coupon: Coupon, conductor: str, dielectric: str) -> tuple[Body, ...]:
    """Bodies of a coupon, in coordinates of its own."""
    if coupon.kind == "bar":
        return (Body("bar", conductor, (_bar(coupon),)),)
    if coupon.kind == "ladder":
        length = sum(LADDER_MM) + STRIP_MM * (len(LADDER_MM) + 1)
        return (
            Body("ladder", conductor, (box(0, length, 0, coupon.drawn("width_mm"), 0, coupon.drawn("height_mm")),)),
        )
    if coupon.kind == "plate":
        return _plates(coupon, conductor, dielectric)
    if coupon.kind == "pads":
        pads = []
        for k in range(len(coupon.readings)):
            row, column = divmod(k, PADS_IN_ROW)
            pad = affinity.translate(_circle(PAD_DIAMETER_MM / 2), PAD_PITCH_MM * column, PAD_PITCH_MM * row)
            pads.append(_prism(pad, 0.0, coupon.drawn(f"height_{k + 1}_mm")))
        return (Body("pads", coupon.material, tuple(pads)),)
    disc = _circle(coupon.drawn("diameter_mm") / 2)
    return (Body("disc", coupon.material, (_prism(disc, 0.0, coupon.drawn("height_mm")),)),)


def _bar(coupon: Coupon) -> Prism:
    """A bar of 60 mm with a tab at each voltage tap, turned against the lines."""
    width, apart, half = coupon.drawn("width_mm"), coupon.drawn("taps_mm"), 30.0
    tabs = [shapely.box(x - _TAB_MM[0] / 2, width / 2, x + _TAB_MM[0] / 2, width / 2 + _TAB_MM[1])
            for x in (-apart / 2, apart / 2)]  # fmt: skip
    whole = shapely.union_all([shapely.box(-half, -width / 2, half, width / 2), *tabs])
    return _prism(affinity.rotate(whole, coupon.degrees or 0.0, origin=(0, 0)), 0.0, coupon.drawn("height_mm"))


def _plates(coupon: Coupon, conductor: str, dielectric: str) -> tuple[Body, ...]:
    """Films side by side on one lower electrode with a pad, each under a round electrode."""
    count = len(coupon.readings)
    films = [coupon.drawn(f"film_{k}_on_electrode_mm") for k in range(1, count + 1)]
    rims = [film_radius_mm(top - ELECTRODE_MM) for top in films]
    middles = [PAD_MM + 2 * sum(rims[:k]) + rims[k] for k in range(count)]
    track = shapely.box(0, -PAD_MM / 2, middles[-1], PAD_MM / 2)
    lower = shapely.union_all([track, *(_circle(rim, x) for rim, x in zip(rims, middles, strict=True))])
    return (
        Body("lower", conductor, (_prism(lower, 0.0, ELECTRODE_MM),)),
        Body("film", dielectric, tuple(
            _prism(_circle(rim, x), ELECTRODE_MM, top) for rim, x, top in zip(rims, middles, films, strict=True)
        )),
        Body("upper", conductor, tuple(
            _prism(_circle(PLATE_RADIUS_MM, x), top, top + UPPER_MM) for x, top in zip(middles, films, strict=True)
        )),
    )  # fmt: skip


def lines_bodies(design: Design, conductor: str, dielectric: str) -> tuple[Body, ...]:
    """The piece for lines and shorts: staircase of walls, two verniers, film of 1 to 4 layers, comb of 1 to 3 lines."""
    line, layer = design.machine.line_mm(), design.layers.layer_mm
    walls = [box(5.0 * k, 5.0 * k + (k + 1) * line, 0, 12, 0, 2.0) for k in range(WALLS)]
    first, other = [], []
    for k in range(-5, 6):
        at, slid, half = PITCH_MM * k, (PITCH_MM - STEP_MM) * k, line
        first += [box(40 + at - half, 40 + at + half, 0, 6, 0, 4 * layer)]
        other += [box(40 + slid - half, 40 + slid + half, 6.4, 12.4, 0, 4 * layer)]
        first += [box(56, 62, 24 + at - half, 24 + at + half, 0, 4 * layer)]
        other += [box(62.4, 68.4, 24 + slid - half, 24 + slid + half, 0, 4 * layer)]
    strip = box(0, 44, 16, 24, 0, 4 * layer)
    films = [box(2 + 10 * k, 12 + 10 * k, 15, 25, 4 * layer, (5 + k) * layer) for k in range(FILMS)]
    tops = [box(4 + 10 * k, 10 + 10 * k, 17, 23, (5 + k) * layer, (8 + k) * layer) for k in range(FILMS)]
    tracks, gaps = [], []
    for k in range(COMBS):
        y, gap = 29.0 + 8 * k, (k + 1) * line
        tracks += [box(0, 30, y, y + 2 * line, 0, 4 * layer), box(8, 44, y + 2 * line + gap, y + 4 * line + gap, 0,
                                                                   4 * layer)]  # fmt: skip
        gaps += [box(8, 30, y + 2 * line, y + 2 * line + gap, 0, 4 * layer)]
    return (
        Body("conductor", conductor, (*walls, *first, strip, *tops, *tracks)),
        Body("dielectric", dielectric, (*other, *films, *gaps)),
    )


def _circle(radius: float, x: float = 0.0) -> "Polygon":
    """A polygon of the circle's area."""
    larger = radius * sqrt(2 * pi / _CORNERS / sin(2 * pi / _CORNERS))
    angles = [radians(360 * k / _CORNERS) for k in range(_CORNERS)]
    return shapely.Polygon([(x + larger * cos(a), larger * sin(a)) for a in angles])


def _prism(outline: "Polygon", bottom: float, top: float) -> Prism:
    corners = tuple((round(x, 9), round(y, 9)) for x, y in outline.exterior.coords[:-1])
    return Prism("z", corners, bottom, round(top, 9))


def arranged(coupons: Sequence[Coupon], design: Design) -> Plate:
    """Places on the bed, of the coupons in their order and of the piece for lines and shorts after them.

    Raises
    ------
    OutOfRange
        They need more than one plate.
    """
    sizes = [*(coupon.box_mm for coupon in coupons), LINES_BOX_MM]
    plates = packed(sizes, room(design.machine, design.layers, 2, SPACING_MM, 0.0))
    if len(plates) > 1:
        raise OutOfRange(f"{len(sizes)} coupons need {len(plates)} plates of {design.machine.name}; ask for fewer")
    return plates[0]


def threemfs(
    name: str, coupons: Sequence[Coupon], design: Design, plate: Plate, names: tuple[str, str]
) -> Iterator[tuple[str, bytes]]:
    """File name and content of the plate's 3MF, for each family of slicers.

    Parameters
    ----------
    name : str
        Of the plate.
    coupons : sequence of Coupon
        In the order of the plate.
    design : Design
        See :func:`carrier`.
    plate : mapping of int to Rect
        Their places.
    names : (str, str)
        Conductor and dielectric.
    """
    parts: list[threemf.Part] = []
    for number, place in plate.items():
        own = number < len(coupons)
        pieces = bodies(coupons[number], *names) if own else lines_bodies(design, *names)
        aligned = ALIGNED if own and coupons[number].degrees is not None else {}
        made = []
        for body in pieces:
            part = part_of(design, body.name, body.material, meshes.mesh(body))
            made.append(threemf.Part(**{**vars(part), "settings": {**part.settings, **aligned}}))
        parts += threemf.placed(made, place.centre_mm, coupons[number].name if own else "lines")
    (x, y), (wide, deep) = design.machine.bed_centre_mm(), design.machine.bed_mm
    found = loads(design)
    primed, profile = tower(design.machine, design.layers, 2), prusa.profile(design.machine, design.layers, found)
    for family in threemf.FAMILIES:
        content = threemf.plate(family, name, parts, (x - wide / 2, y - deep / 2), primed, profile)
        yield f"{name}.{family}.3mf", content


def _marks(coupon: Coupon, pieces: Sequence[Body], shift: tuple[float, float]) -> list[str]:
    """Where terminals of a ladder are to be made, and the numbers of films and pads."""
    if coupon.kind == "ladder":
        starts = [sum(LADDER_MM[:k]) + STRIP_MM * k for k in range(len(LADDER_MM) + 1)]
        high = coupon.drawn("width_mm")
        return [
            f'<rect x="{u + shift[0]:.4g}" y="{shift[1] - high:.4g}" width="{STRIP_MM}" height="{high:g}" '
            'fill="none" stroke="#b00" stroke-dasharray="1 .5"/>'
            for u in starts
        ]
    if coupon.kind not in ("plate", "pads"):
        return []
    middles = [[sum(piece.span(axis)) / 2 for axis in "xy"] for piece in pieces[-1].pieces]
    return [
        f'<text x="{u + shift[0]:.4g}" y="{shift[1] - v + 4:.4g}" font-size="3" text-anchor="middle">{k}</text>'
        for k, (u, v) in enumerate(middles, 1)
    ]


def picture(
    name: str, coupons: Sequence[Coupon], design: Design, plate: Plate, names: tuple[str, str]
) -> str:  # fmt: skip
    """The plate from above with every coupon's outlines and name, as SVG in millimetres."""
    (x, y), (wide, deep) = design.machine.bed_centre_mm(), design.machine.bed_mm
    bed = Rect(x - wide / 2, y - deep / 2, x + wide / 2, y + deep / 2)
    colour = {material: design.material(material).colour for material in names}
    if len(set(colour.values())) < len(names):
        colour[names[1]] = _OTHER_COLOUR
    shown, legend = [], []
    for order, (number, place) in enumerate(sorted(plate.items()), 1):
        own = number < len(coupons)
        pieces = bodies(coupons[number], *names) if own else lines_bodies(design, *names)
        spans = [[p.span(axis) for body in pieces for p in body.pieces] for axis in "xy"]
        middle = [(min(a for a, _ in span) + max(b for _, b in span)) / 2 for span in spans]
        shift = place.centre_mm[0] - middle[0] - bed.x0, bed.y1 - place.centre_mm[1] + middle[1]
        outlines = [(piece.cut("z", piece.span("z")[0])[0], body.material) for body in pieces for piece in body.pieces]
        for outline, material in outlines:
            points = " ".join(f"{u + shift[0]:.4g},{shift[1] - v:.4g}" for u, v in outline)
            shown.append(f'<polygon points="{points}" fill="{colour[material]}" fill-opacity=".55"/>')
        shown += _marks(coupons[number], pieces, shift) if own else []
        x_label, y_label = place.centre_mm[0] - bed.x0, bed.y1 - place.centre_mm[1] + 1.6
        shown.append(f'<text x="{x_label:.4g}" y="{y_label:.4g}" font-size="4.6" text-anchor="middle">{order}</text>')
        column, row = divmod(order - 1, 4)
        label = html.escape(coupons[number].name if own else "lines and shorts")
        legend.append(f'<text x="{column * 60 + 2}" y="{deep + 6 + 6 * row:g}" font-size="4">{order}: {label}</text>')
    shown += [
        *legend,
        *(f'<text x="2" y="{deep + 32 + 6 * k:g}" font-size="4">{note}</text>' for k, note in enumerate(_NOTES)),
    ]
    title = html.escape(f"{name}: {len(plate)} coupons on {design.machine.title}")
    size = f'width="{wide + 8:g}mm" height="{deep + 60:g}mm"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-4 -12 {wide + 8:g} {deep + 60:g}" {size}>\n'
        "<style>text { font-family: sans-serif; fill: #111; stroke: #fff; stroke-width: .8; paint-order: stroke } "
        "polygon { stroke: #222; stroke-width: .15 }</style>\n"
        f'<rect x="-4" y="-12" width="{wide + 8:g}" height="{deep + 60:g}" fill="#fff"/>\n'
        f'<rect x="0" y="0" width="{wide:g}" height="{deep:g}" fill="none" stroke="#555" stroke-width=".3"/>\n'
        f'<text x="0" y="-4" font-size="5">{title}: x to the right, y up; lines of bars run along x</text>\n'
        + "\n".join(shown)
        + "\n</svg>\n"
    )
