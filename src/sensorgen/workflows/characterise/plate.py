"""Coupons as bodies on a plate: outlines, slicer settings, 3MF files and a picture of the plate.

The lines of bars and ladders run along x of the bed, without walls, in every layer; bars at an angle are turned.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import cos, pi, radians, sin, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

import shapely
from shapely import affinity

from sensorgen.analysis import characterise as drawn
from sensorgen.analysis.characterise import Coupon
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import Design
from sensorgen.design.printer import tower
from sensorgen.export import threemf
from sensorgen.export.slicers import prusa
from sensorgen.export.slicers.loads import loads
from sensorgen.export.threemf.core import part_of
from sensorgen.scene.drawing import paper
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Body, Prism, box
from sensorgen.workflows.batch.layout import Plate, bed_of, bed_svg, middle, packed, room

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
_OUTLINE = {"fill_opacity": ".55", "stroke": "#222", "stroke_width": ".15"}
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
        length = sum(drawn.LADDER_MM) + drawn.STRIP_MM * (len(drawn.LADDER_MM) + 1)
        return (
            Body("ladder", conductor, (box(0, length, 0, coupon.drawn("width_mm"), 0, coupon.drawn("height_mm")),)),
        )
    if coupon.kind == "plate":
        return _plates(coupon, conductor, dielectric)
    if coupon.kind == "pads":
        pads = []
        for k in range(len(coupon.readings)):
            row, column = divmod(k, drawn.PADS_IN_ROW)
            pad = affinity.translate(
                _circle(drawn.PAD_DIAMETER_MM / 2), drawn.PAD_PITCH_MM * column, drawn.PAD_PITCH_MM * row
            )
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
    rims = [drawn.film_radius_mm(top - drawn.ELECTRODE_MM) for top in films]
    middles = [drawn.PAD_MM + 2 * sum(rims[:k]) + rims[k] for k in range(count)]
    track = shapely.box(0, -drawn.PAD_MM / 2, middles[-1], drawn.PAD_MM / 2)
    lower = shapely.union_all([track, *(_circle(rim, x) for rim, x in zip(rims, middles, strict=True))])
    return (
        Body("lower", conductor, (_prism(lower, 0.0, drawn.ELECTRODE_MM),)),
        Body("film", dielectric, tuple(
            _prism(_circle(rim, x), drawn.ELECTRODE_MM, top) for rim, x, top in zip(rims, middles, films, strict=True)
        )),
        Body("upper", conductor, tuple(
            _prism(_circle(drawn.PLATE_RADIUS_MM, x), top, top + drawn.UPPER_MM)
            for x, top in zip(middles, films, strict=True)
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
    by_tool = loads(design)
    primed, profile = tower(design.machine, design.layers, 2), prusa.profile(design.machine, design.layers, by_tool)
    for family in threemf.FAMILIES:
        content = threemf.plate(family, name, parts, (x - wide / 2, y - deep / 2), primed, profile)
        yield f"{name}.{family}.3mf", content


def _marks(coupon: Coupon, pieces: Sequence[Body], shift: tuple[float, float]) -> Iterator[str]:
    """Where terminals of a ladder are to be made, and the numbers of films and pads."""
    if coupon.kind == "ladder":
        high = coupon.drawn("width_mm")
        dashed = {"fill": "none", "stroke": "#b00", "stroke_dasharray": "1 .5"}
        for k in range(len(drawn.LADDER_MM) + 1):
            start = sum(drawn.LADDER_MM[:k]) + drawn.STRIP_MM * k
            yield paper.box("", start + shift[0], shift[1] - high, drawn.STRIP_MM, high, **dashed)
    elif coupon.kind in ("plate", "pads"):
        for k, piece in enumerate(pieces[-1].pieces, 1):
            u, v = (sum(piece.span(axis)) / 2 for axis in "xy")
            yield middle(u + shift[0], shift[1] - v + 3, 3.0, str(k), "halo")


def picture(
    name: str, coupons: Sequence[Coupon], design: Design, plate: Plate, names: tuple[str, str]
) -> str:  # fmt: skip
    """The plate from above with every coupon's outlines and name, as SVG in millimetres."""
    bed, fills = bed_of(design.machine), {material: design.material(material).colour for material in names}
    if len(set(fills.values())) < len(names):
        fills[names[1]] = _OTHER_COLOUR
    shapes, listed = [], []
    for order, (number, place) in enumerate(sorted(plate.items()), 1):
        coupon = coupons[number] if number < len(coupons) else None
        pieces = bodies(coupon, *names) if coupon else lines_bodies(design, *names)
        x, y = place.centre_mm[0] - bed.x0, bed.y1 - place.centre_mm[1]
        shift = _shift(pieces, x, y)
        shapes += [*_outlines(pieces, shift, fills), *(_marks(coupon, pieces, shift) if coupon else ())]
        shapes.append(middle(x, y, 4.6, str(order), "halo"))
        listed.append(f"{order}: {coupon.name if coupon else 'lines and shorts'}")
    heading = f"{name}: {len(plate)} coupons on {design.machine.title}"
    return bed_svg(bed, heading, "x to the right, y up; lines of bars run along x", shapes, listed, _NOTES)


def _shift(pieces: Sequence[Body], x: float, y: float) -> tuple[float, float]:
    """Shift of bodies whose middle comes to a place [mm]."""
    spans = [[p.span(axis) for body in pieces for p in body.pieces] for axis in "xy"]
    centre = [(min(a for a, _ in span) + max(b for _, b in span)) / 2 for span in spans]
    return x - centre[0], y + centre[1]


def _outlines(pieces: Sequence[Body], shift: tuple[float, float], fills: Mapping[str, str]) -> Iterator[str]:
    frame = paper.ViewFrame(*shift, 0.0, 0.0, 1.0, 1.0)
    for body in pieces:
        path = "".join(frame.outline(piece.cut("z", piece.span("z")[0])[0]) for piece in body.pieces)
        yield paper.element("path", d=path, fill=fills[body.material], **_OUTLINE)
