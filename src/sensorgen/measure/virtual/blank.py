"""A body with the values of its design, solved once: capacitance, its rise under pressure, the tracks' resistances."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from hashlib import sha256
from math import exp
from pathlib import Path

import numpy as np

from sensorgen.core import cache as answers
from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import film, of_all_materials, resistivities
from sensorgen.measure.virtual.cell import AIR_PERMITTIVITY, Raster, Solid, capacitance, conductance, pressed
from sensorgen.measure.virtual.section import FINE_MM, raster, section_of

PRESSURES_PA = tuple(1e3 * p for p in (0, 2.5, 5, 10, 20, 30, 40, 60, 80, 100, 130, 160, 200, 250, 300, 400))
_LN_PERMITTIVITY = (-0.4, 0.0, 0.4)
_LN_MODULUS = (-0.7, 0.0, 0.7)  # of the dielectric alone
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
    """

    table_f_per_m: tuple[tuple[tuple[float, ...], ...], ...]
    track_ohm_per_m: tuple[float, float]

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
    """The body of a design as printed, solved; kept on disk.

    Raises
    ------
    OutOfRange
        Its cell has no single cross-section.
    MissingValue
        A material without modulus, permittivity or resistivity.
    """
    question = {
        "what": "virtual blank", "design": design.id(), "fine_mm": fine_mm, "source": _source(),
        "at": [*_LN_PERMITTIVITY, *_LN_MODULUS, *PRESSURES_PA],
    }  # fmt: skip
    found = answers.answer(question, lambda: asdict(_solved(design, fine_mm)))
    table = tuple(tuple(tuple(row) for row in of) for of in found["table_f_per_m"])
    return Blank(table, tuple(found["track_ohm_per_m"]))


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
    used, dielectric = _solids(design), film(design)
    names = {name: k + 1 for k, name in enumerate(used)}
    grid = raster(cell.scene, names, fine_mm)
    depth_m = section.depth_mm * M_PER_MM * cell.count
    length_m = design.params.length_mm * M_PER_MM
    table = []
    for ln_modulus in _LN_MODULUS:
        solids = [Solid(0.0, 0.0, AIR_PERMITTIVITY), *used.values()]
        own = used[dielectric]
        solids[names[dielectric]] = Solid(own.modulus_pa * exp(ln_modulus), own.poisson, own.permittivity)
        places = pressed(grid, solids, [p * exp(ln_modulus) for p in PRESSURES_PA]).place_m
        rows = []
        for ln_eps in _LN_PERMITTIVITY:
            eps = [s.permittivity for s in solids]
            eps[names[dielectric]] *= exp(ln_eps)
            rows.append(tuple(capacitance(grid, eps, place) * depth_m / length_m for place in places))
        table.append(tuple(rows))
    along = section.across == "x"
    rho = resistivities(design)
    top, bottom = (
        rho[end].value / _conductor_m2(grid, number, section.depth_mm * M_PER_MM, cell.count, length_m, along=along)
        for end, number in (("top", 2), ("bottom", 1))
    )
    return Blank(tuple(table), (top, bottom))


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
