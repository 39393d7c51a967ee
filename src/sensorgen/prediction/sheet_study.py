"""Localisation of a load in two dimensions: standard errors by sets of contacts on a sensor read as a sheet."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Any

import numpy as np

from sensorgen.core.document import Cell, Column, Facts, Part, Table, to_json
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM, si
from sensorgen.design.values import ENDS
from sensorgen.models.sensor import Sensor
from sensorgen.models.sheet import impedance, localise
from sensorgen.prediction.sensor_model import SensorModel
from sensorgen.solvers.sheet.parts import Contact, Port, Sheet, SheetPatch
from sensorgen.solvers.sheet.solve import PressErrors, contact_sets, depth_m

PLACES = 7  # along each side
ISOTROPIC = 0.01  # relative difference of resistances along x and y that is no doubt
BOUNDLESS = 1e6  # N or m: a larger error has no meaning
Rectangle = tuple[tuple[float, float], tuple[float, float]]  # x and y, from and to [mm]


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

    def to_json(self) -> str:
        """Study as indented JSON, with maps of the errors, and impedances of the unloaded sheet by port and port."""
        sheet = self.sheet
        return to_json({
            "force_n": self.force_n, "tip_mm": self.press.length_m / M_PER_MM, "noise": self.noise,
            "doubts": self.doubts, "length_m": sheet.length_m, "width_m": sheet.width_m,
            "sheet_resistance_ohm": dict(zip(("top", "bottom"), sheet.sheet_resistance_ohm, strict=True)),
            "capacitance_f_per_m2": float(sheet.capacitances().mean()),
            "capacitance_factor": self.press.capacitance_factor,
            "contacts": {name: self._contact(name, errors) for name, errors in self.bounds.items()},
        })  # fmt: skip

    def _contact(self, name: str, errors: PressErrors) -> dict[str, Any]:
        """Standard errors with one set of contacts by x and y [N], [m], [m]; frequencies also by information."""
        z = impedance(self.sheet, self.ports[name], errors.frequency_hz, cells=errors.cells)
        force, x, y = np.moveaxis(errors.sigma(), -1, 0)
        return {
            "verdict": errors.verdict(), "located": errors.located(), "frequency_hz": errors.frequency_hz.tolist(),
            "best_frequency_hz": [float(errors.frequency_hz[k]) for k in errors.best_tones()], "cells": errors.cells,
            "impedance_ohm": {"re": z.real.tolist(), "im": z.imag.tolist()}, "x_m": errors.x_m.tolist(),
            "y_m": errors.y_m.tolist(), "sigma_force_n": force.tolist(), "sigma_x_m": x.tolist(),
            "sigma_y_m": y.tolist(),
        }  # fmt: skip


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
    (top, bottom), doubts = _per_square(model)
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
    return SheetStudy(sheet, press, ports, bounds, force_n, noise, (*model.doubts, *doubts))


def _per_square(model: SensorModel) -> tuple[list[float], list[str]]:
    """Sheet resistance of both electrodes, the geometric mean of both directions [ohm], and why it is doubtful.

    Stretching one axis makes a sheet of two resistances isotropic, of their geometric mean.
    """
    from sensorgen.models import conduction

    ohms, doubts, scene = list[float](), list[str](), model.body.cells.first()
    (x_mm, y_mm, _), sensor = scene.size_mm, model.sensor
    for end, rho, thickness_m in zip(ENDS, sensor.resistivity_ohm_m, sensor.electrode_m, strict=True):
        along = rho / thickness_m
        across = conduction.electrode_resistance(scene, end, rho, "y").middle() * x_mm / y_mm
        ohms.append(float(np.sqrt(along * across)))
        if abs(across - along) > ISOTROPIC * along:
            doubts.append(
                f"{end} electrode: {si(along, 'ohm')} per square along x, {si(across, 'ohm')} along y: taken as "
                f"isotropic, {si(ohms[-1], 'ohm')}"
            )
    return ohms, doubts


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


def _metres(value_m: float) -> str:
    """A length in mm up to a metre."""
    return f"{value_m / M_PER_MM:.3g} mm" if value_m < 1 else si(value_m, "m", 3)
