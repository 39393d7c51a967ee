"""A body with the values of its design, solved once: capacitance, its rise under pressure, the tracks' resistances."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from hashlib import sha256
from math import exp, log
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.asprinted.film import thicker
from sensorgen.core import cache as answers
from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design, Slots
from sensorgen.design.values import film, material_value, of_all_materials, resistivities
from sensorgen.measure.virtual.cell import AIR, CellBricks, SectionRaster, Solid, capacitance, conductance, pressed
from sensorgen.measure.virtual.section import FINE_MM, bricks, raster, section_of
from sensorgen.scene.scene import Scene

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import PrintCell

PRESSURES_PA = tuple(1e3 * p for p in (0, 2.5, 5, 10, 20, 35, 60, 100, 150, 200, 300, 400))
_LN_PERMITTIVITY = (-0.4, 0.0, 0.4)
_LN_MODULUS = (-0.7, 0.0, 0.7)  # of the dielectric alone
_ORDER = 4 / 3  # of convergence: energy of a field at a corner of 270 degrees
_FEWEST = 6  # pressures that a cell has to bear: up to 35 kPa
_PRESSED, _AT_REST = (0.175, 500), (0.07, 5500)  # longest edge [mm] and number of the coarser bricks


@dataclass(frozen=True)
class Blank:
    """Quantities that follow from the body and the design's values.

    Attributes
    ----------
    table_f_per_m : (3, 3, k) nested tuples
        By ln of the dielectric's modulus, of its permittivity, and pressure over the modulus' factor, up to the highest
        at which all were solved [F/m].
    track_ohm_per_m : (float, float)
        Of the top and the bottom electrode [ohm/m].
    by_film_per_mm : float
        Derivative of ln C by the thickness of the film [1/mm].
    """

    table_f_per_m: tuple[tuple[tuple[float, ...], ...], ...]
    track_ohm_per_m: tuple[float, float]
    by_film_per_mm: float

    @property
    def _table(self) -> Real:
        return np.array(self.table_f_per_m)

    def capacitance_f_per_m(self, ln_permittivity: float) -> float:
        """At rest, of a dielectric with another permittivity [F/m]."""
        return exp(float(_between(np.log(self._table[1, :, 0]), _LN_PERMITTIVITY, ln_permittivity)))

    def rise(self, ln_permittivity: float, ln_modulus: float) -> tuple[Real, Real]:
        """Pressures [Pa], and the relative rise of C under each, of a dielectric with other values."""
        # a modulus that all materials share scales the pressure exactly; the table holds what their ratio does beside
        ln = np.log(np.maximum(self._table[:, :, 1:] / self._table[:, :, :1] - 1, 1e-12))
        ratio = np.exp(_between(_between(ln, _LN_MODULUS, ln_modulus), _LN_PERMITTIVITY, ln_permittivity))
        pressure = np.array(PRESSURES_PA[: self._table.shape[-1]])
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
    return Blank(tuple(tuple(map(tuple, of)) for of in table), tracks(design), by_film_per_mm)


@cache
def _source() -> str:
    """Of the code that decides: a new version solves anew."""
    here = Path(__file__)
    files = (here, *(here.with_name(f"{name}.py") for name in ("cell", "section")))
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()


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


def _grids(
    design: Design, scene: Scene, of: tuple[float, int]
) -> tuple[SectionRaster | CellBricks, SectionRaster | CellBricks]:
    """A coarse grid of a cell and one of half its elements' size, bricks of a size and number."""
    numbers = {name: k + 1 for k, name in enumerate(_solids(design))}
    if section_of(scene):
        return raster(scene, numbers, 2 * FINE_MM), raster(scene, numbers, FINE_MM)
    return bricks(scene, numbers, *of), bricks(scene, numbers, *of, parts=2)


def _per_length(design: Design, cell: "PrintCell", grid: SectionRaster | CellBricks) -> float:
    """Depth of all sections of a sensor over its length [-], or number of cells as of bricks per length [1/m]."""
    x_mm, y_mm, _ = cell.scene.size_mm
    plan_m2, of_grid = x_mm * y_mm * M_PER_MM**2, float(grid.grid.top_m.sum())
    return plan_m2 / of_grid * cell.count / (design.params.length_mm * M_PER_MM)


def _extrapolated(coarse: Real | float, fine: Real | float) -> Real:
    """To a grid without size, by Richardson."""
    return np.asarray(fine + (np.asarray(fine) - coarse) / (2**_ORDER - 1))


def _at_rest(design: Design, scene: Scene, ln_permittivities: Sequence[float]) -> Real:
    """Capacitances of a grid's cell at rest, by ln of permittivity [F/m] or [F]."""
    used = _solids(design)
    number, solids = list(used).index(film(design)), list(used.values())
    return _extrapolated(*(
        np.array([capacitance(of, _permittivities(solids, number, ln), of.grid.at_m) for ln in ln_permittivities])
        for of in _grids(design, scene, _AT_REST)
    ))  # fmt: skip


def _table(
    design: Design, grid: SectionRaster | CellBricks, ln_moduli: Sequence[float], ln_permittivities: Sequence[float],
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
        places = pressed(grid, [AIR, *solids], loads, _FEWEST).place_m
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


def _as_track(grid: SectionRaster | CellBricks, electrode: int, *, along: bool) -> float:
    """Volume of a plain track that resists as an electrode of the grid's cell: per depth [m2], or of bricks [m3]."""
    period = float(grid.x_m[-1] - grid.x_m[0])
    if along or isinstance(grid, CellBricks):
        return conductance(grid, electrode) * period**2
    z = (grid.z_m[:, 1:] + grid.z_m[:, :-1]) / 2
    return float((np.diff(z, axis=0) * np.diff(grid.x_m))[grid.electrode == electrode].sum())


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
