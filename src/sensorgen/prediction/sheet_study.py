"""Localisation of a load in two dimensions: standard errors by sets of contacts on a sensor read as a sheet."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.document import Cell, Column, Facts, Part, Table, to_json
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM, si
from sensorgen.models.sensor import Sensor
from sensorgen.models.sheet import (
    Contact,
    Port,
    PressErrors,
    Sheet,
    SheetPatch,
    contact_sets,
    depth_m,
    impedance,
    localise,
)
from sensorgen.prediction.sensor_model import SensorModel

PLACES = 7  # along each side
BOUNDLESS = 1e6  # N or m: a larger error has no meaning
Map = tuple[tuple[float, ...], ...]
Rectangle = tuple[tuple[float, float], tuple[float, float]]  # x and y, from and to [mm]


@dataclass(frozen=True)
class Parts:
    """Impedances by frequency, port and port: real and imaginary parts [ohm]."""

    re: tuple[Map, ...]
    im: tuple[Map, ...]


@dataclass(frozen=True)
class ContactRecord:
    """Standard errors with one set of contacts, as JSON has them; null where undefined.

    Attributes
    ----------
    verdict : str
        Whether it locates a load.
    located : float
        Share of the sheet where it does [-].
    frequency_hz, best_frequency_hz : tuple of float
        All frequencies, and the same by information [Hz].
    cells : int
        Resolution of the grid [-].
    impedance_ohm : Parts
        Of the unloaded sheet.
    x_m, y_m : tuple of float
        Places of the load [m].
    sigma_force_n, sigma_x_m, sigma_y_m : tuple of tuple of float
        By x and y [N], [m], [m].
    """

    verdict: str
    located: float
    frequency_hz: tuple[float, ...]
    best_frequency_hz: tuple[float, ...]
    cells: int
    impedance_ohm: Parts
    x_m: tuple[float, ...]
    y_m: tuple[float, ...]
    sigma_force_n: Map
    sigma_x_m: Map
    sigma_y_m: Map


@dataclass(frozen=True)
class SheetRecord:
    """A study of a sheet, as JSON has it.

    Attributes
    ----------
    force_n, tip_mm, noise : float
        The load, the side of its square tip, and the noise of a reading relative to abs(Z) [N], [mm], [-].
    doubts : tuple of str
        Why the numbers are uncertain.
    length_m, width_m : float
        Of the sheet [m].
    sheet_resistance_ohm : dict of str to float
        Of each electrode [ohm].
    capacitance_f_per_m2 : float
        Unloaded [F/m2].
    capacitance_factor : float
        Rise of the capacitance under the tip [-].
    contacts : dict of str to ContactRecord
        By set of contacts.
    """

    force_n: float
    tip_mm: float
    noise: float
    doubts: tuple[str, ...]
    length_m: float
    width_m: float
    sheet_resistance_ohm: dict[str, float]
    capacitance_f_per_m2: float
    capacitance_factor: float
    contacts: dict[str, ContactRecord]


@dataclass(frozen=True, eq=False)
class SheetStudy:
    """Bounds of force and place of a load, for sets of contacts.

    Attributes
    ----------
    sheet : Sheet
        The film and its electrodes.
    press : SheetPatch
        Size of the tip, and its factors at the force.
    ports : mapping of str to tuple of Port
        Contacts of each set.
    bounds : mapping of str to PressErrors
        With each set.
    force_n, noise : float
        The force [N], the noise of a reading relative to abs(Z) [-].
    doubts : tuple of str
        Why the numbers are uncertain.
    """

    sheet: Sheet
    press: SheetPatch
    ports: Mapping[str, tuple[Port, ...]]
    bounds: Mapping[str, PressErrors]
    force_n: float
    noise: float
    doubts: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """Sheet, load, a table of standard errors, and a verdict on each set."""
        sheet, tip_mm = self.sheet, self.press.length_m / M_PER_MM
        top, bottom = (si(ohm, "ohm") for ohm in sheet.sheet_resistance_ohm)
        size = f"{sheet.length_m / M_PER_MM:g} x {sheet.width_m / M_PER_MM:g} mm"
        tones = next(iter(self.bounds.values())).frequency_hz
        reach = (
            f"{_metres(depth_m(sheet, f, self.press))} at {si(f, 'Hz')}"
            for f in dict.fromkeys((float(tones[0]), float(tones[-1])))
        )
        yield Facts((
            ("sheet", f"{size}, {top} and {bottom} per square, {si(float(sheet.capacitances().mean()), 'F')}/m2"),
            (
                "load", f"{self.force_n:g} N on {tip_mm:g} x {tip_mm:g} mm: capacitance there "
                f"{self.press.capacitance_factor - 1:+.2%}; noise {self.noise:g} of |Z|",
            ),
            ("current reaches", ", ".join(reach)),
            *(("doubt", doubt) for doubt in self.doubts),
        ))  # fmt: skip
        yield ""
        columns = (
            Column("contacts", key="contacts"), Column("sigma F", "N", key="sigma_force_n", si=True, digits=3),
            Column("sigma x", "m", key="sigma_x_m", si=True, digits=3),
            Column("sigma y", "m", key="sigma_y_m", si=True, digits=3), Column("located", "%", key="located_percent"),
            Column("best frequencies", key="best_frequencies"),
        )  # fmt: skip
        rows: list[tuple[Cell, ...]] = []
        for name, errors_of in self.bounds.items():
            errors = (float(np.median(errors_of.sigma()[..., k])) for k in range(3))
            best = ", ".join(si(float(errors_of.frequency_hz[k]), "Hz") for k in errors_of.best_tones()[:2])
            located = round(100 * errors_of.located())
            rows.append((name, *(e if e < BOUNDLESS else inf for e in errors), located, best))
        yield Table("contacts", "", columns, tuple(rows))
        yield ""
        yield (
            "Medians over the sheet of the smallest standard errors; located: twice as well as a uniform distribution, "
            "in x and in y."
        )
        yield Facts(tuple((name, errors_of.verdict()) for name, errors_of in self.bounds.items()))

    def record(self) -> SheetRecord:
        """All of it with maps of the errors and impedances of the unloaded sheet."""
        return SheetRecord(
            self.force_n, self.press.length_m / M_PER_MM, self.noise, self.doubts, self.sheet.length_m,
            self.sheet.width_m, dict(zip(("top", "bottom"), self.sheet.sheet_resistance_ohm, strict=True)),
            float(self.sheet.capacitances().mean()), self.press.capacitance_factor,
            {name: self._contact(name, errors) for name, errors in self.bounds.items()},
        )  # fmt: skip

    def _contact(self, name: str, errors: PressErrors) -> ContactRecord:
        z = impedance(self.sheet, self.ports[name], errors.frequency_hz, cells=errors.cells)
        force, x, y = np.moveaxis(errors.sigma(), -1, 0)
        return ContactRecord(
            errors.verdict(), errors.located(), tuple(errors.frequency_hz.tolist()),
            tuple(float(errors.frequency_hz[k]) for k in errors.best_tones()), errors.cells,
            Parts(tuple(map(_map, z.real)), tuple(map(_map, z.imag))), tuple(errors.x_m.tolist()),
            tuple(errors.y_m.tolist()), _map(force), _map(x), _map(y),
        )  # fmt: skip

    def to_json(self) -> str:
        """The record as indented JSON."""
        return to_json(self.record())


def study(
    model: SensorModel, frequency_hz: Sequence[float], force_n: float, tip_m: float, noise: float, *,
    step: Callable[[str, int], None], contacts: str = "all", pads: Sequence[Rectangle] = (),
) -> SheetStudy:  # fmt: skip
    """Bounds of force and place for sets of contacts.

    Parameters
    ----------
    model : SensorModel
        Whose film and electrodes the sheet has.
    frequency_hz : sequence of float
        That are read [Hz].
    force_n, tip_m : float
        Of the load [N], side of its square tip [m].
    noise : float
        Standard error of R and of X, relative to abs(Z) [-].
    step : callable
        Called before each place with the set and the number of places done.
    contacts : str
        One set by its name, "all", or "" for the pads alone.
    pads : sequence of Rectangle
        Contacts at the same place on top and on the bottom, as a set of their own.

    Raises
    ------
    OutOfRange
        A tip that leaves no place to find; as :func:`sensorgen.models.sheet.localise`.
    """
    sensor = model.sensor
    top, bottom = (rho / h for rho, h in zip(sensor.resistivity_ohm_m, sensor.electrode_m, strict=True))
    sheet = Sheet(
        sensor.length_m, sensor.width_m, (top, bottom), sensor.capacitance_f_per_m / sensor.width_m,
        sensor.leak_s_per_m / sensor.width_m, sensor.tan_delta,
    )  # fmt: skip
    press, per_newton = _press(sensor, tip_m, force_n)
    ports: dict[str, tuple[Port, ...]] = {}
    if pads:
        x_y = [[(start * M_PER_MM, stop * M_PER_MM) for start, stop in pad] for pad in pads]
        ports["pads"] = tuple((Contact("top", x, y), Contact("bottom", x, y)) for x, y in x_y)
    ports |= {name: pairs for name, pairs in contact_sets(sheet).items() if contacts in (name, "all")}
    bounds = {
        name: localise(sheet, pairs, frequency_hz, press, per_newton, noise, PLACES, partial(step, name))
        for name, pairs in ports.items()
    }
    return SheetStudy(sheet, press, ports, bounds, force_n, noise, model.doubts)


def _press(sensor: Sensor, tip_m: float, force_n: float) -> tuple[SheetPatch, dict[str, float]]:
    """Effect of a force under the tip, and its derivatives by the force."""
    shorter = min(sensor.length_m, sensor.width_m)
    if not 0 < tip_m < shorter:
        raise OutOfRange(
            f"a tip of {tip_m / M_PER_MM:g} mm on a sheet {shorter / M_PER_MM:g} mm wide leaves no place to find: take "
            "a smaller --tip or a wider sensor, as with --size 100x100 (for strips: `sensorgen predict`)"
        )
    area = tip_m**2
    stress = np.asarray(force_n / area)
    strain, slope = (float(value) for value in sensor.compression.capacitive_strain(stress))
    sensor.check_tracks(stress)
    rises = [rise / area for rise in sensor.piezoresistance_per_pa]
    factor = 1 / (1 - strain)
    top, bottom = (1 + rise * force_n for rise in rises)
    per_newton = {"capacitance_factor": factor**2 * slope / area}
    per_newton |= {f"{end}_resistance_factor": rise for end, rise in zip(("top", "bottom"), rises, strict=True)}
    return SheetPatch(0.0, 0.0, tip_m, tip_m, factor, (top, bottom)), per_newton


def _map(values: NDArray[np.float64]) -> Map:
    return tuple(tuple(row) for row in values.tolist())


def _metres(value_m: float) -> str:
    """A length in mm up to a metre."""
    return f"{value_m / M_PER_MM:.3g} mm" if value_m < 1 else si(value_m, "m", 3)
