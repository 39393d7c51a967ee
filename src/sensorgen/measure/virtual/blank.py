"""A body with the values of its design, solved once: capacitance, its rise under pressure, the tracks' resistances."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from hashlib import sha256
from math import exp, log
from pathlib import Path

import numpy as np

from sensorgen.asprinted.film import thicker
from sensorgen.core import cache as answers
from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import film, of_all_materials, resistivities
from sensorgen.measure.virtual.cell import AIR, Grid, Raster, Solid, capacitance, conductance, pressed
from sensorgen.measure.virtual.section import FINE_MM, raster, section_of
from sensorgen.scene.scene import Scene

PRESSURES_PA = tuple(1e3 * p for p in (0, 2.5, 5, 10, 20, 35, 60, 100, 150, 200, 300, 400))
_LN_PERMITTIVITY = (-0.4, 0.0, 0.4)
_LN_MODULUS = (-0.7, 0.0, 0.7)  # of the dielectric alone
_ORDER = 4 / 3  # of convergence: energy of a field at a corner of 270 degrees
_POISSON = 0.4999  # of rubber, where no source gives it


@dataclass(frozen=True)
class Blank:
    """What follows from the body and the design's values.

    Attributes
    ----------
    table_f_per_m : (3, 3, k) nested tuples
        By ln of the dielectric's modulus, of its permittivity, and pressure over the modulus' factor [F/m].
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
        found = np.exp(_between(_between(ln, _LN_MODULUS, ln_modulus), _LN_PERMITTIVITY, ln_permittivity))
        pressure = np.array(PRESSURES_PA)
        return pressure * exp(ln_modulus), np.concatenate([[0.0], found])


def _between(values: Real, at: tuple[float, ...], x: float) -> Real:
    """The parabola through three values along the first axis."""
    found = 0.0
    for k in range(3):
        i, j = (n for n in range(3) if n != k)
        found = found + values[k] * (x - at[i]) * (x - at[j]) / ((at[k] - at[i]) * (at[k] - at[j]))
    return np.asarray(found)


def blank(design: Design, fine_mm: float = FINE_MM) -> Blank:
    """The body of a design as printed, solved; kept in memory and on disk.

    Parameters
    ----------
    design : Design
        What is printed.
    fine_mm : float
        Edge of the finer raster's elements; the coarser one's are twice as long [mm].

    Raises
    ------
    OutOfRange
        Its cell has no single cross-section.
    MissingValue
        A material without modulus, permittivity or resistivity.
    """
    key = design.id(), design.machine.tool_height_error_mm, fine_mm
    if key not in _SOLVED:
        _SOLVED[key] = _stored(design, fine_mm)
    return _SOLVED[key]


_SOLVED: dict[tuple[str, float, float], Blank] = {}


def _stored(design: Design, fine_mm: float) -> Blank:
    question = {
        "what": "virtual blank", "design": design.id(), "fine_mm": fine_mm, "source": _source(),
        "film_mm": design.machine.tool_height_error_mm,
    }  # fmt: skip
    found = answers.answer(question, lambda: asdict(_solved(design, fine_mm)))
    table = tuple(tuple(tuple(row) for row in of) for of in found["table_f_per_m"])
    top, bottom = found["track_ohm_per_m"]
    return Blank(table, (top, bottom), found["by_film_per_mm"])


@cache
def _source() -> str:
    """Of the code that decides: a new version solves anew."""
    here = Path(__file__)
    files = (here, here.with_name("cell.py"), here.with_name("section.py"))
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()


def _solved(design: Design, fine_mm: float) -> Blank:
    from sensorgen.asprinted import printed

    cell = printed.body(design).cell
    section = section_of(cell.scene)
    depth_m, length_m = section.depth_mm * M_PER_MM, design.params.length_mm * M_PER_MM
    per_length = depth_m * cell.count / length_m
    coarse = _table(design, cell.scene, 2 * fine_mm, _LN_MODULUS, _LN_PERMITTIVITY)
    middle, fine = coarse[1, 1], _table(design, cell.scene, fine_mm, (0.0,), (0.0,))[0, 0]
    exact = _extrapolated(middle, fine)
    finer = (exact[1:] / exact[0] - 1) / (middle[1:] / middle[0] - 1)
    rest = _extrapolated(*(_at_rest(design, cell.scene, size) for size in (2 * fine_mm, fine_mm)))
    rise = coarse / coarse[:, :, :1] - 1
    rise[:, :, 1:] *= finer  # as of the design's values: others change both rasters alike
    table = per_length * rest[:, None] * (1 + rise)
    by_film = _by_film(design, cell.scene)
    return Blank(tuple(tuple(map(tuple, of)) for of in table.tolist()), tracks(design, fine_mm), by_film)


def tracks(design: Design, fine_mm: float = FINE_MM) -> tuple[float, float]:
    """Resistance per length of the top and the bottom electrode as printed [ohm/m]; errors as :func:`blank`."""
    from sensorgen.asprinted import printed

    cell = printed.body(design).cell
    section, rho = section_of(cell.scene), resistivities(design)
    grid, length_m = _raster(design, cell.scene, fine_mm), design.params.length_mm * M_PER_MM
    top, bottom = (
        rho[end].value
        / _conductor_m2(grid, number, section.depth_mm * M_PER_MM, cell.count, length_m, along=section.across == "x")
        for end, number in (("top", 2), ("bottom", 1))
    )
    return top, bottom


def _raster(design: Design, scene: Scene, fine_mm: float) -> Raster:
    return raster(scene, {name: k + 1 for k, name in enumerate(_solids(design))}, fine_mm)


def _extrapolated(coarse: Real, fine: Real) -> Real:
    """To a raster without size, by Richardson."""
    return fine + (fine - coarse) / (2**_ORDER - 1)


def _at_rest(design: Design, scene: Scene, fine_mm: float) -> Real:
    """Capacitances per depth of a cell at rest, by ln of permittivity [F/m]."""
    used, grid = _solids(design), _raster(design, scene, fine_mm)
    number, at = list(used).index(film(design)), Grid(grid).at_m
    solids = list(used.values())
    return np.array([capacitance(grid, _permittivities(solids, number, ln), at) for ln in _LN_PERMITTIVITY])


def _table(
    design: Design, scene: Scene, fine_mm: float, ln_moduli: Sequence[float], ln_permittivities: Sequence[float]
) -> Real:
    """Capacitances per depth of a cell on one raster, by ln of modulus, of permittivity, and pressure [F/m]."""
    used, grid = _solids(design), _raster(design, scene, fine_mm)
    number = list(used).index(film(design))
    found = []
    for ln_modulus in ln_moduli:
        solids = list(used.values())
        solids[number] = replace(solids[number], modulus_pa=solids[number].modulus_pa * exp(ln_modulus))
        loads = [p * exp(ln_modulus) for p in PRESSURES_PA]
        places = pressed(grid, [AIR, *solids], loads).place_m
        found.append([
            [capacitance(grid, _permittivities(solids, number, ln), place) for place in places]
            for ln in ln_permittivities
        ])  # fmt: skip
    return np.array(found)


def _permittivities(solids: Sequence[Solid], number: int, ln: float) -> list[float]:
    """Of air and all materials, that of one times a factor."""
    return [AIR.permittivity, *(s.permittivity * (exp(ln) if k == number else 1.0) for k, s in enumerate(solids))]


def _by_film(design: Design, scene: Scene) -> float:
    """Derivative of ln C by the film's thickness [1/mm]; 0 where no film lies between the electrodes."""
    by = design.machine.tool_height_error_mm
    scenes = [thicker(scene, more) for more in (by, -by)]
    if not by or None in scenes:
        return 0.0
    solids = list(_solids(design).values())
    grids = [_raster(design, one, 2 * FINE_MM) for one in scenes if one]
    ends = [capacitance(grid, _permittivities(solids, 0, 0.0), Grid(grid).at_m) for grid in grids]
    return log(ends[0] / ends[1]) / (2 * by)


def _conductor_m2(grid: Raster, electrode: int, depth_m: float, count: float, length_m: float, *, along: bool) -> float:
    """Cross-section of a plain track of the same resistance [m2]."""
    period = float(grid.x_m[-1] - grid.x_m[0])
    if along:
        across = count * period / length_m  # cells side by side
        return conductance(grid, electrode) * period * depth_m * across
    z = (grid.z_m[:, 1:] + grid.z_m[:, :-1]) / 2
    area = (np.diff(z, axis=0) * np.diff(grid.x_m))[grid.electrode == electrode].sum()
    return float(area * count * depth_m / length_m)


def _solids(design: Design) -> Mapping[str, Solid]:
    """By material."""
    found = {}
    for name, modulus in of_all_materials(design, "youngs_modulus_pa").items():
        material = design.material(name)
        eps = material.value("relative_permittivity", design.used()[name]).value if not material.conductor else 1.0
        nu = material.properties.get("poisson_ratio")
        poisson = material.value("poisson_ratio", design.used()[name]).value if nu else _POISSON
        found[name] = Solid(modulus.value, poisson, eps)
    return found
