"""A body with the values of its design, solved once: capacitance, its rise under pressure, the tracks' resistances.

Its cells are rasters of sections, in which every interface, level or sloping, is a line of edges of elements, and
upright prisms as bricks.
"""

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from hashlib import sha256
from itertools import chain, pairwise
from math import exp, log, prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from sensorgen.asprinted.film import thicker
from sensorgen.core import cache as answers
from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design, Slots
from sensorgen.design.values import film, material_value, of_all_materials, resistivities
from sensorgen.measure.virtual.cell import (
    AIR,
    ElementGrid,
    Solid,
    brick_grid,
    capacitance,
    conductance,
    pressed,
    section_grid,
)
from sensorgen.scene.scene import FLOATING, Body, Outline, Point, Scene, is_rectangle, seen_from_above
from sensorgen.scene.sections import Section, SectionColumn, columns, sections

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import PrintCell

FINE_MM = 0.025
_MOST_COLUMNS = 120  # of elements; the width of a cell with a larger one is cut evenly
_GRADED = 0.7  # share of the cosine in the grading of elements
_NONE_MM = 1e-9
TERMINALS = {"bottom": 1, "top": 2, FLOATING: 3}


def section_of(scene: Scene) -> Section | None:
    """The one cross-section of a scene; None where it has none, or several."""
    try:
        sections_ = sections(scene)
    except ValueError:
        return None
    return sections_[0] if len(sections_) == 1 else None


def raster(scene: Scene, materials: Mapping[str, int], fine_mm: float = FINE_MM) -> ElementGrid:
    """A scene's section as elements.

    Parameters
    ----------
    scene : Scene
        With one cross-section.
    materials : mapping of str to int
        Number of each material, from 1 on.
    fine_mm : float
        Largest edge of an element; in wide cells, of those along a height [mm].

    Raises
    ------
    OutOfRange
        The scene has several cross-sections, or one whose interfaces are not the same lines from side to side.
    """
    section = section_of(scene)
    if section is None:
        raise OutOfRange("a raster of a body with several cross-sections; expected one along the sensor or across it")
    across = "xy".index(section.across)
    columns_ = columns(section)
    sides = [columns_[0].left_mm, *(c.right_mm for c in columns_)]
    widest = max(fine_mm, (sides[-1] - sides[0]) / _MOST_COLUMNS)
    lines = _interfaces(columns_)
    highest = np.max([np.diff(of, axis=0) for of in lines], axis=(0, 2))
    rows = np.maximum(np.round(highest / fine_mm), 1).astype(int).tolist()
    pieces = np.maximum(np.ceil(np.diff(sides) / widest - 1e-6), 1).astype(int).tolist() if len(columns_) > 1 else [1]
    shares = np.concatenate([[0.0], *(k + graded(n) for k, n in enumerate(rows))])
    x, z, kinds = [sides[0]], list[Real](), list[Whole]()
    for column, of, n in zip(columns_, lines, pieces, strict=True):
        x += (column.left_mm + (column.right_mm - column.left_mm) * graded(n)).tolist()
        ends = [np.interp(shares, np.arange(len(of)), of[:, side]) for side in (0, 1)]
        at = [0.0, *graded(n).tolist()]
        z += [ends[0] + (ends[1] - ends[0]) * share for share in at[bool(z) :]]
        for share in np.add(at[1:], at[:-1]) / 2:
            kinds.append(_kinds(column, ends, share, materials))
    material, electrode = np.moveaxis(np.array(kinds), 0, 2)
    x_m, z_m = np.array(x) * M_PER_MM, np.array(z).T * M_PER_MM
    return section_grid(x_m, z_m, material, electrode, repeats=scene.repeats[across])


def graded(count: int) -> Real:
    """Ends of parts of 1 that are smaller towards both its ends, where corners are."""
    even = np.arange(1, count + 1) / count
    return np.asarray(_GRADED * (1 - np.cos(np.pi * even)) / 2 + (1 - _GRADED) * even)


def _interfaces(columns_: Sequence[SectionColumn]) -> list[Real]:
    """Heights of the interfaces of all columns at their sides, the same ones from side to side [mm]."""
    ends = [{end for layer in c.layers for end in (layer.bottom_mm, layer.top_mm)} for c in columns_]
    levels = {0.0, *(round(a, 9) for a, b in chain(*ends) if abs(a - b) < _NONE_MM and a > _NONE_MM)}
    lines = [_lines(of, levels) for of in ends]
    if len(set(map(len, lines))) > 1 or not _joined(lines):
        raise OutOfRange(
            "a virtual specimen of a section whose sloping interfaces end inside it; print it: what is printed in "
            "layers has level ones"
        )
    return lines


def _lines(ends: Collection[Point], levels: Collection[float]) -> Real:
    """Heights of all interfaces of a column at its sides, upwards (k, 2) [mm]: its sloping ones and all levels."""
    sloping = [end for end in ends if abs(end[0] - end[1]) >= _NONE_MM]
    return np.array(sorted([*((z, z) for z in levels), *sloping], key=lambda e: (round(sum(e), 9), e)))


def _joined(lines: Sequence[Real]) -> bool:
    """Test whether interfaces of neighbours meet, and none crosses another."""
    meet = all(np.allclose(a[:, 1], b[:, 0], atol=10 * _NONE_MM) for a, b in pairwise(lines))
    return meet and all((np.diff(of, axis=0) >= -10 * _NONE_MM).all() for of in lines)


def _kinds(column: SectionColumn, ends: Sequence[Real], share: float, materials: Mapping[str, int]) -> Whole:
    """Materials and terminals of a column's elements, upwards, at a share of its width (2, n)."""
    z = ends[0] + (ends[1] - ends[0]) * share
    spans = [tuple(e[0] + (e[1] - e[0]) * share for e in (layer.bottom_mm, layer.top_mm)) for layer in column.layers]
    bottoms = [low for low, _ in spans]
    kinds = np.zeros((2, len(z) - 1), int)
    for n, middle in enumerate(((z[1:] + z[:-1]) / 2).tolist()):
        k = bisect_right(bottoms, middle) - 1
        if k >= 0 and middle < spans[k][1]:
            body = column.layers[k].body
            kinds[:, n] = materials[body.material], TERMINALS.get(body.terminal, 0)
    return kinds


_STEP_MM = 1e-6
_SAME_MM = 1e-3  # places of a pattern that differ by less are one, rounded
_COARSER = 1.1
_INNER = 0.9  # share of a pattern that has to repeat; its ends may be cut


def bricks(scene: Scene, materials: Mapping[str, int], size_mm: float, most: int, parts: int = 1) -> ElementGrid:
    """A scene between mirrors as bricks; of a symmetric scene the part in its middle that mirrors repeat.

    The ends of a scene, where the pattern may be cut, are taken to be as its middle. An outline that is not parallel to
    the axes becomes steps around as large an area, the same for all ``parts``.

    Parameters
    ----------
    scene : Scene
        Of upright prisms.
    materials : mapping of str to int
        Number of each material, from 1 on.
    size_mm : float
        Largest edge of a brick before it is cut; longer where there would be too many bricks [mm].
    most : int
        Number of bricks before they are cut.
    parts : int
        Into which each brick is cut along each axis.

    Raises
    ------
    OutOfRange
        The pattern repeats by shifts, a body is no upright prism, or the cell has too many faces.
    """
    pieces = _pieces(scene)
    outlines = [outline for _, outline, _ in pieces]
    levels = np.unique(np.round([0.0, scene.size_mm[2], *(z for _, _, span in pieces for z in span)], 9))
    planes = [*(_edges(outlines, axis, scene.size_mm[axis]) for axis in (0, 1)), levels]
    kinds = _filled(pieces, planes, materials)
    part = [*(_part(planes[axis], _looks(kinds, axis)) for axis in (0, 1)), levels]
    counts = _counts(part, size_mm, most)
    kinds = _filled(pieces, [_cut(at, n) for at, n in zip(part, counts, strict=True)], materials)
    for axis in range(3):
        kinds = kinds.repeat(parts, axis + 1)
    x, y, z = (_cut(at, parts * n) * M_PER_MM for at, n in zip(part, counts, strict=True))
    return brick_grid(x, y, z, *kinds)


def _pieces(scene: Scene) -> list[tuple[Body, Outline, Point]]:
    """Upright prisms of a scene between mirrors: body, outline in plan and heights [mm]."""
    if any(scene.repeats):
        raise OutOfRange("a virtual specimen of a pattern without mirrors; expected strips along or across the sensor")
    try:
        return [(body, seen_from_above(p), p.span("z")) for body in scene.bodies for p in body.pieces]
    except ValueError:
        raise OutOfRange("a virtual specimen of a body that is no upright prism; expected a printed one") from None


def _filled(
    pieces: Sequence[tuple[Body, Outline, Point]], planes: Sequence[Real], materials: Mapping[str, int]
) -> Whole:
    """Materials and terminals of the bricks between planes (2, nx, ny, nz)."""
    x, y, z = planes
    kinds = np.zeros((2, len(x) - 1, len(y) - 1, len(z) - 1), int)
    for body, outline, (low, high) in pieces:
        here = _covered(outline, x, y)[..., None] & (low < (z[1:] + z[:-1]) / 2) & ((z[1:] + z[:-1]) / 2 < high)
        kinds[:, here] = np.array([materials[body.material], TERMINALS.get(body.terminal, 0)])[:, None]
    return kinds


def _covered(outline: Outline, x: Real, y: Real) -> Mask:
    """Bricks that an outline covers, seen from above (nx, ny): most of them, and together as much as it."""
    area = np.outer(np.diff(x), np.diff(y))
    if is_rectangle(outline):
        (x0, y0), (x1, y1) = min(outline), max(outline)
        inside = np.outer(*(np.diff(at.clip(*ends)) for at, ends in ((x, (x0, x1)), (y, (y0, y1)))))
    else:
        plans = shapely.box(x[:-1, None], y[:-1], x[1:, None], y[1:])
        inside = shapely.area(shapely.intersection(shapely.Polygon(outline), plans))
    share = np.round(inside / area, 6)
    least = np.unique(np.append(share[share > 0], 1.0))
    covered = np.array([area[share >= level].sum() for level in least])
    return np.asarray(share >= least[np.abs(covered - inside.sum()).argmin()])


def _edges(outlines: Sequence[Outline], axis: int, size_mm: float) -> Real:
    """Places of the sides of a cell, of its middle, and of the extents and edges of outlines along an axis [mm]."""
    edges = [0.0, size_mm / 2, size_mm]
    for corners in outlines:
        at = np.array(corners)[:, axis]
        edges += [at.min(), at.max(), *at[np.abs(at - np.roll(at, 1)) < _STEP_MM]]
    places = np.unique(np.round(edges, 9))
    return np.asarray(places[np.append(True, np.diff(places) > _STEP_MM)])


def _counts(planes: Sequence[Real], size_mm: float, most: int) -> list[Whole]:
    """Into how many parts all is cut between planes, along each axis."""
    gaps = [np.diff(at) for at in planes]
    if prod(map(len, gaps)) > most:
        raise OutOfRange(
            f"a virtual specimen of a cell with {' x '.join(str(len(of)) for of in gaps)} faces along x, y and z; "
            "expected a pattern that repeats within a few strips"
        )
    while prod(int(np.ceil(of / size_mm - 1e-6).sum()) for of in gaps) > most:
        size_mm *= _COARSER
    return [np.ceil(of / size_mm - 1e-6).astype(int) for of in gaps]


def _cut(planes: Real, counts: Whole) -> Real:
    """Planes with others between them, nearer to each other towards the given ones [mm]; n parts are among 2n."""
    pairs = zip(pairwise(planes.tolist()), counts.tolist(), strict=True)
    return np.concatenate([planes[:1], *(a + (b - a) * graded(n) for (a, b), n in pairs)])


def _looks(kinds: Whole, axis: int) -> Whole:
    """Numbers of what is between the planes along an axis, the same for what is alike."""
    slices = np.moveaxis(kinds, axis + 1, 0).reshape(kinds.shape[axis + 1], -1)
    return np.unique(slices, axis=0, return_inverse=True)[1].ravel()


def _part(at: Real, looks: Whole) -> Real:
    """The planes of the shortest part that mirrors at its ends repeat, of planes and what is between them [mm]."""
    gaps = np.diff(at)
    if not (np.allclose(gaps, gaps[::-1], rtol=0, atol=_SAME_MM) and np.array_equal(looks, looks[::-1])):
        return at
    middle = float(at[len(gaps) // 2])
    at, looks = at[len(gaps) // 2 :] - middle, looks[len(gaps) // 2 :]
    centre = (at[1:] + at[:-1]) / 2
    away = _INNER * at[-1]
    for end in np.sort(np.append(at[1:], centre)):
        if 4 * end > at[-1]:
            break
        part = np.append(at[at < end - _SAME_MM], end)
        edges, middles = (np.abs((of[of < away] + end) % (2 * end) - end) for of in (at, centre))
        same = looks[np.searchsorted(at, middles) - 1] == looks[centre < away]
        if same.all() and np.abs(edges[:, None] - part).min(1).max() < _SAME_MM:
            return np.asarray(middle + part)
    return np.asarray(middle + at)


PRESSURES_PA = tuple(1e3 * p for p in (0, 2.5, 5, 10, 20, 35, 60, 100, 150, 200, 300, 400))
_LN_PERMITTIVITY = (-0.4, 0.0, 0.4)
_LN_MODULUS = (-0.7, 0.0, 0.7)  # of the dielectric alone
_ORDER = 4 / 3  # of convergence: energy of a field at a corner of 270 degrees
_FEWEST = 6  # pressures that a cell has to bear: up to 35 kPa
_PRESSED, _AT_REST = (0.175, 500), (0.07, 5500)  # longest edge [mm] and number of the coarser bricks


@dataclass(frozen=True, eq=False)
class Blank:
    """Quantities that follow from the body and the design's values.

    Attributes
    ----------
    table_f_per_m : (3, 3, k) array
        By ln of the dielectric's modulus, of its permittivity, and pressure over the modulus' factor, up to the highest
        at which all were solved [F/m].
    track_ohm_per_m : (float, float)
        Of the top and the bottom electrode [ohm/m].
    by_film_per_mm : float
        Derivative of ln C by the thickness of the film [1/mm].
    """

    table_f_per_m: Real
    track_ohm_per_m: tuple[float, float]
    by_film_per_mm: float

    def capacitance_f_per_m(self, ln_permittivity: float) -> float:
        """At rest, of a dielectric with another permittivity [F/m]."""
        return exp(float(_between(np.log(self.table_f_per_m[1, :, 0]), _LN_PERMITTIVITY, ln_permittivity)))

    def rise(self, ln_permittivity: float, ln_modulus: float) -> tuple[Real, Real]:
        """Pressures [Pa], and the relative rise of C under each, of a dielectric with other values."""
        # a modulus that all materials share scales the pressure exactly; the table holds what their ratio does beside
        table = self.table_f_per_m
        ln = np.log(np.maximum(table[:, :, 1:] / table[:, :, :1] - 1, 1e-12))
        ratio = np.exp(_between(_between(ln, _LN_MODULUS, ln_modulus), _LN_PERMITTIVITY, ln_permittivity))
        pressure = np.array(PRESSURES_PA[: table.shape[-1]])
        return pressure * exp(ln_modulus), np.concatenate([[0.0], ratio])


def _between(values: Real, at: tuple[float, ...], x: float) -> Real:
    """The parabola through three values along the first axis."""
    from scipy.interpolate import KroghInterpolator

    return np.asarray(KroghInterpolator(at, values)(x))


def blank(design: Design) -> Blank:
    """The body of a design as printed, solved; kept in memory and on disk.

    Raises
    ------
    OutOfRange
        Its cell is neither one cross-section nor a few prisms between mirrors, or bears too little pressure.
    MissingValue
        A material without modulus, permittivity or resistivity.
    """
    key = design.id(), design.machine.tool_height_error_mm
    if key not in _SOLVED:
        _SOLVED[key] = _stored(design)
    return _SOLVED[key]


_SOLVED: dict[tuple[str, float], Blank] = {}


def _stored(design: Design) -> Blank:
    """Solve a design's cell, once for all resistivities of its tracks."""
    names = {part: slot and slot.partition("@")[0] for part, slot in design.materials}
    cell = design.model_copy(update={"materials": Slots(**names), "material_values": {}})
    question = {
        "what": "virtual blank", "design": cell.id(), "source": _source(),
        "solids": {name: asdict(solid) for name, solid in _solids(design).items()},
        "film_mm": design.machine.tool_height_error_mm,
    }  # fmt: skip
    table, by_film_per_mm = answers.answer(question, lambda: _solved(design))
    return Blank(np.array(table), tracks(design), by_film_per_mm)


@cache
def _source() -> str:
    """Of the code that decides: a new version solves anew."""
    here = Path(__file__)
    return sha256(here.read_bytes() + here.with_name("cell.py").read_bytes()).hexdigest()


def _solved(design: Design) -> list[Any]:
    """Table, and derivative by the film's thickness."""
    from sensorgen.asprinted import printed

    cell = printed.body(design).cell
    grids = _grids(design, cell.scene, _PRESSED)
    coarse = _table(design, grids[0], _LN_MODULUS, _LN_PERMITTIVITY)
    fine = _table(design, grids[1], (0.0,), (0.0,), coarse.shape[-1])[0, 0]
    coarse = coarse[..., : len(fine)]
    middle = coarse[1, 1]
    exact = _extrapolated(middle, fine)
    finer = (exact[1:] / exact[0] - 1) / (middle[1:] / middle[0] - 1)
    rise = coarse / coarse[:, :, :1] - 1
    rise[:, :, 1:] *= finer  # as of the design's values: others change both grids alike
    per_length = _per_length(design, cell, grids[0])
    table = per_length * _at_rest(design, cell.scene, _LN_PERMITTIVITY)[:, None] * (1 + rise)
    return [table.tolist(), _by_film(design, cell.scene)]


def tracks(design: Design) -> tuple[float, float]:
    """Resistance per length of the top and the bottom electrode as printed [ohm/m]; errors as :func:`blank`."""
    from sensorgen.asprinted import printed

    cell, rho = printed.body(design).cell, resistivities(design)
    section, grids = section_of(cell.scene), _grids(design, cell.scene, _AT_REST)
    along, per_length = section is None or section.across == "x", _per_length(design, cell, grids[0])
    top, bottom = (
        rho[end].value / (float(_extrapolated(*(_as_track(grid, number, along=along) for grid in grids))) * per_length)
        for end, number in (("top", 2), ("bottom", 1))
    )
    return top, bottom


def _grids(design: Design, scene: Scene, of: tuple[float, int]) -> tuple[ElementGrid, ElementGrid]:
    """A coarse grid of a cell and one of half its elements' size, bricks of a size and number."""
    numbers = {name: k + 1 for k, name in enumerate(_solids(design))}
    if section_of(scene):
        return raster(scene, numbers, 2 * FINE_MM), raster(scene, numbers, FINE_MM)
    return bricks(scene, numbers, *of), bricks(scene, numbers, *of, parts=2)


def _per_length(design: Design, cell: "PrintCell", grid: ElementGrid) -> float:
    """Depth of all sections of a sensor over its length [-], or number of cells as of bricks per length [1/m]."""
    x_mm, y_mm, _ = cell.scene.size_mm
    plan_m2, of_grid = x_mm * y_mm * M_PER_MM**2, float(grid.top_m.sum())
    return plan_m2 / of_grid * cell.count / (design.params.length_mm * M_PER_MM)


def _extrapolated(coarse: Real | float, fine: Real | float) -> Real:
    """To a grid without size, by Richardson."""
    return np.asarray(fine + (np.asarray(fine) - coarse) / (2**_ORDER - 1))


def _at_rest(design: Design, scene: Scene, ln_permittivities: Sequence[float]) -> Real:
    """Capacitances of a grid's cell at rest, by ln of permittivity [F/m] or [F]."""
    used = _solids(design)
    number, solids = list(used).index(film(design)), list(used.values())
    return _extrapolated(*(
        np.array([capacitance(of, _permittivities(solids, number, ln), of.at_m) for ln in ln_permittivities])
        for of in _grids(design, scene, _AT_REST)
    ))  # fmt: skip


def _table(
    design: Design, grid: ElementGrid, ln_moduli: Sequence[float], ln_permittivities: Sequence[float],
    count: int = len(PRESSURES_PA),
) -> Real:  # fmt: skip
    """Capacitances of a grid's cell, by ln of modulus, of permittivity, and pressure, of those all reach."""
    used = _solids(design)
    number = list(used).index(film(design))
    rows = []
    for ln_modulus in ln_moduli:
        solids = list(used.values())
        solids[number] = replace(solids[number], modulus_pa=solids[number].modulus_pa * exp(ln_modulus))
        loads = [p * exp(ln_modulus) for p in PRESSURES_PA[:count]]
        places = pressed(grid, [AIR, *solids], loads, _FEWEST)
        rows.append([
            [capacitance(grid, _permittivities(solids, number, ln), place) for place in places]
            for ln in ln_permittivities
        ])  # fmt: skip
    reached = min(len(of[0]) for of in rows)
    return np.array([[row[:reached] for row in of] for of in rows])


def _permittivities(solids: Sequence[Solid], number: int, ln: float) -> list[float]:
    """Of air and all materials, that of one times a factor."""
    return [AIR.permittivity, *(s.permittivity * (exp(ln) if k == number else 1.0) for k, s in enumerate(solids))]


def _by_film(design: Design, scene: Scene) -> float:
    """Derivative of ln C by the film's thickness [1/mm]; 0 where no film lies between the electrodes."""
    by = design.machine.tool_height_error_mm
    scenes = [thicker(scene, more) for more in (by, -by)]
    if not by or None in scenes:
        return 0.0
    ends = [float(_at_rest(design, one, (0.0,))[0]) for one in scenes if one]
    return log(ends[0] / ends[1]) / (2 * by)


def _as_track(grid: ElementGrid, electrode: int, *, along: bool) -> float:
    """Volume of a plain track that resists as an electrode of the grid's cell: per depth [m2], or of bricks [m3]."""
    if along or grid.at_m.shape[-1] > 2:
        return conductance(grid, electrode) * float(np.ptp(grid.at_m[..., 0])) ** 2
    return float(grid.shapes[1][grid.electrode == electrode].sum())


def _solids(design: Design) -> Mapping[str, Solid]:
    """By material."""
    solids = {}
    for name, modulus in of_all_materials(design, "youngs_modulus_pa").items():
        material = design.material(name)
        eps = 1.0 if material.conductor else _value(design, name, "relative_permittivity")
        solids[name] = Solid(modulus.value, _value(design, name, "poisson_ratio"), eps)
    return solids


def _value(design: Design, name: str, quantity: str) -> float:
    return material_value(design.material(name), design.used()[name], quantity).value
