"""Outlines from SVG and DXF files, as regions in plan.

The files may be of strangers: XML may define no entities, sizes and numbers of curves are limited.
"""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

import numpy as np
import shapely

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading
from sensorgen.scene.connections import groups

if TYPE_CHECKING:
    from svgelements import PathSegment

FLAT_MM = 0.005  # how far straight edges may lie from arcs and splines
JOINED_MM = 1e-3  # ends of curves nearer than this are one
MOST_BYTES = 20_000_000
_MOST_CURVES = 20_000
_MOST_PARTS = 1 << 10  # straight edges of one arc or spline
_PX_PER_MM = 96.0 / 25.4
_LEAST_MM, _MOST_MM = 1.0, 1000.0


def read(path: Path) -> shapely.Polygon:
    """The one closed outline of a file, its lowest corner at the origin [mm]; outlines inside it are holes.

    Raises
    ------
    BadInput
        No such file, or one that holds no closed outline, several, or one that crosses itself; of no unit; larger or
        smaller than a sensor can be.
    """
    with reading(path):
        size = path.stat().st_size
    kinds = {".svg": _of_svg, ".dxf": _of_dxf}
    if not path.is_file() or path.suffix.lower() not in kinds:
        raise BadInput(f"{path}: expected an outline in a file .svg or .dxf")
    if not 0 < size <= MOST_BYTES:
        raise BadInput(f"{path}: {size} bytes; expected an outline of 1 to {MOST_BYTES} bytes")
    lines = [line for line in islice(kinds[path.suffix.lower()](path), _MOST_CURVES) if len(line) > 1]
    try:
        region = _region(lines)
        low, high = np.array(region.bounds).reshape(2, 2)
        if not ((high - low >= _LEAST_MM).all() and (high - low <= _MOST_MM).all()):
            shown = " x ".join(f"{side:.6g}" for side in high - low)
            raise BadInput(
                f"the outline is {shown} mm; expected {_LEAST_MM:g} to {_MOST_MM:g} mm each way: look at its unit"
            )
    except BadInput as error:
        raise error.within(str(path)) from None
    moved = shapely.transform(region, lambda points: (points - low).round(4) + 0.0)
    return shapely.Polygon(moved.exterior, moved.interiors)


def _rings(lines: list[Real]) -> list[shapely.Polygon]:
    """Closed curves from pieces of curves whose ends meet, the largest first; raises BadInput where one is open."""
    from scipy.spatial import cKDTree

    ends = np.array([line[k] for line in lines for k in (0, -1)])
    label = groups(len(ends), *cKDTree(ends).query_pairs(JOINED_MM, output_type="ndarray").T)
    _, first = np.unique(label, return_index=True)
    joined = ends[first][label].reshape(-1, 2, 2)
    whole = [np.concatenate([[a], line[1:-1], [b]]) for line, (a, b) in zip(lines, joined, strict=True)]
    distinct = {shapely.normalize(line).wkb: line for line in map(shapely.LineString, whole) if line.length > JOINED_MM}
    merged = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(list(distinct.values()))))
    for line in merged:
        if not line.is_closed:
            (xa, ya), (xb, yb) = line.coords[0], line.coords[-1]
            raise BadInput(
                f"the outline is open: a curve ends at ({xa:.6g}, {ya:.6g}) and ({xb:.6g}, {yb:.6g}) mm; close it"
            )
    return sorted((shapely.Polygon(line) for line in merged), key=lambda ring: -abs(ring.area))


def _region(lines: list[Real]) -> shapely.Polygon:
    """The region in closed lines, from pieces of curves."""
    if not lines:
        raise BadInput("no outline in it; expected one closed curve")
    rings = _rings(lines)
    for ring in rings:
        if not ring.is_valid:
            raise BadInput(f"the outline crosses itself: {shapely.is_valid_reason(ring)} mm; draw it anew there")
    outer, *holes = rings
    beside = [ring for ring in holes if not outer.contains(ring)]
    if beside:
        raise BadInput(f"{len(beside) + 1} outlines side by side, or touching; expected one, with holes inside it")
    region = shapely.Polygon(outer.exterior, [hole.exterior for hole in holes])
    if not region.is_valid:
        raise BadInput(f"its holes overlap: {shapely.is_valid_reason(region)} mm; expected holes apart from each other")
    return region


def _of_svg(path: Path) -> Iterator[Real]:
    """Curves of an SVG file, y upwards [mm]."""
    _refuse_entities(path)
    from svgelements import SVG, Path, Shape

    try:
        drawing = SVG.parse(str(path), reify=True, ppi=25.4 * _PX_PER_MM)
    except Exception as error:  # whatever a damaged file makes of it
        raise BadInput(f"{path}: not an SVG: {error or type(error).__name__}") from None
    scale = np.array([1.0, -1.0]) / _PX_PER_MM
    for shape in drawing.elements():
        if isinstance(shape, Shape):
            for part in Path(shape).as_subpaths():
                points = [point for segment in part for point in _flattened(segment)]
                line = np.array(points, float).reshape(-1, 2) * scale
                yield line[np.append(True, np.hypot(*np.diff(line, axis=0).T) > 1e-9)] if len(line) else line


def _flattened(segment: "PathSegment") -> list[tuple[float, float]]:
    """Points on a segment, within ``FLAT_MM`` of it [px]; its start is the end of the one before."""
    from svgelements import Close, Line, Move

    if isinstance(segment, Move | Line | Close):
        return [(segment.end.x, segment.end.y)] if segment.end is not None else []
    flat, parts = FLAT_MM * _PX_PER_MM, 4
    while parts < _MOST_PARTS:
        points = np.array([(p.x, p.y) for p in (segment.point(k / (2 * parts)) for k in range(2 * parts + 1))])
        chord = points[2::2] - points[:-2:2]
        off = points[1::2] - points[:-2:2]
        length = np.maximum(np.hypot(*chord.T), 1e-12)
        if (abs(chord[:, 0] * off[:, 1] - chord[:, 1] * off[:, 0]) / length).max() < flat:
            break
        parts *= 2
    return [(p.x, p.y) for p in (segment.point(k / parts) for k in range(1, parts + 1))]


def _refuse_entities(path: Path) -> None:
    """Refuse XML that defines entities; a document type that only names SVG's own is harmless."""
    parser = expat.ParserCreate()

    def refuse(*_: object) -> int:
        raise BadInput(f"{path}: it defines entities of its own, which no outline needs: it is refused")

    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(path.read_bytes(), True)
    except (expat.ExpatError, ValueError) as error:
        raise BadInput(f"{path}: not an SVG: {error}") from None


def _of_dxf(path: Path) -> Iterator[Real]:
    """Curves of a DXF file's model space [mm]."""
    import ezdxf
    from ezdxf import disassemble, recover, units
    from ezdxf.path import make_path

    try:
        drawing, _ = recover.readfile(path)
    except (ezdxf.DXFError, OSError, ValueError, IndexError, KeyError) as error:
        raise BadInput(f"{path}: not a DXF: {error or type(error).__name__}") from None
    if not drawing.units:
        raise BadInput(f"{path}: it states no unit ($INSUNITS is 0); set it in CAD, as to millimetres")
    scale = units.conversion_factor(drawing.units, units.MM)
    for entity in islice(disassemble.recursive_decompose(drawing.modelspace()), _MOST_CURVES):
        if entity.dxftype() in ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE"):
            curve = make_path(entity)
            yield np.array([(p.x, p.y) for p in curve.flattening(FLAT_MM / scale)], float).reshape(-1, 2) * scale
