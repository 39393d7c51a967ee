"""Tables of the thesis, against its other tables, its text and the readings of Table D.1.

What nothing else gives is transcribed: compared with the files of materials, printers and designs, which are copies.
"""

from functools import cache
from statistics import median

import numpy as np

from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design import materials, printer
from sensorgen.design.shapes import reference
from sensorgen.measure.log import exchange as readings
from sensorgen.measure.log.entries import Reading
from sensorgen.measure.signal.verdicts import Evidence, verdict
from sensorgen.prediction import rest_state
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.query import TIP_M, TONES_HZ
from sensorgen.verification.thesis.checks._columns import FILM_MM
from sensorgen.verification.thesis.items import ItemPart, Parts, chapter, table

_UNITS = {"_pa": "Pa", "_kg_m3": "kg/m3", "_c": "°C", "_percent": "%"}  # by the ending of a quantity
_PRINTER = "diabase-h5"
_SENSOR_M2 = 1e-3  # 100 mm by 10 mm

_PA_PER_PSI = 6894.757

Printed = dict[str, float]


@cache
def _prints() -> list[Reading]:
    """Table D.1."""
    return readings.thesis_readings()


def _named(material: str, quantity: str) -> tuple[str, str]:
    """Name of a quantity of a material, and its unit."""
    ending = next((end for end in _UNITS if quantity.endswith(end)), "")
    return f"{material}: {quantity.removesuffix(ending).replace('_', ' ')}", _UNITS.get(ending, "")


def _of_source(material: str, quantity: str, source: str) -> float:
    """The value that a material's file keeps under a source."""
    loaded = materials.load(material)
    values = loaded.properties.get(quantity, []) + loaded.print.get(quantity, [])
    return next((v.value for v in values if v.source == source), np.nan)


def _copied(source: str, printed: dict[str, Printed]) -> Parts:
    """Values by material and quantity, and what is kept of that source."""
    for material, values in printed.items():
        for quantity, value in values.items():
            yield ItemPart(*_named(material, quantity), _of_source(material, quantity, source), value, copied=True)


def beside(other: str, **printed: Printed) -> Parts:
    """Values by material and quantity, against those of another table of the thesis that has them."""
    there = table(other)
    for material, values in printed.items():
        for quantity, value in values.items():
            for name, unit in [_named(material, quantity)]:
                if quantity in there.get(material, {}):
                    yield ItemPart(f"{name} (ours: Table {other})", unit, there[material][quantity], value)


def mat(points: float, per_cm2: float, size_cm: list[float], range_kpa: list[float], range_psi: list[float]) -> Parts:
    """Table 1.1: its count by its density and area, and its pressures, which are round numbers of psi."""
    yield ItemPart("sensing points (ours: density times area)", "", per_cm2 * size_cm[0] * size_cm[1], points, shown=3)
    range_pa = [_PA_PER_PSI * p for p in range_psi]
    yield ItemPart("range (ours: 50 and 160 psi)", "Pa", range_pa, [1e3 * p for p in range_kpa])


def elements(element_mm: float) -> Parts:
    """1.1: an element is a period of the rectangular cell; that of the mat is what its density gives."""
    strip = next(item.given for item in chapter("2").figures if item.number == "2.14")
    period = strip["etpu_width_mm"] + strip["x60_width_mm"] + 2 * strip["air_width_mm"]
    yield ItemPart("element (ours: sum of the strips' widths)", "mm", period, element_mm)
    yield ItemPart("element of the mat", "mm", 10 / table("1.1")["per_cm2"] ** 0.5)


def filaments(ranges_c: dict[str, list[float]], text_c: dict[str, list[float]], **printed: Printed) -> Parts:
    """Table 4.1: against Table 3.2, and its printing temperatures against those of 4.2.5."""
    yield from beside("3.2", **printed)
    for name in text_c:
        yield ItemPart(f"{name}: printing temperatures (ours: 4.2.5)", "°C", text_c[name], ranges_c[name])
    yield from _copied("thesis-4.1", printed)


def simulated(conductivity: Printed, **printed: Printed) -> Parts:
    """Table 3.2: X60, which as printed conducts better than the electrodes, against the least leaky film of D.1."""
    largest_ohm = max(max(r.z_ohm, default=0.0) for r in _prints())
    film = FILM_MM * M_PER_MM / (largest_ohm * _SENSOR_M2)
    yield ItemPart("x60: conductivity (ours: Table D.1, most)", "S/m", film, conductivity["x60"], 0.0, scale=1.0)
    yield from _copied("thesis-3.2", printed)


def plate(sizes: Printed, relative_permittivity: list[float], tones_hz: list[float], **printed: Printed) -> Parts:
    """Table 3.1: a pair of permittivities in the wrong order, and moduli, against Table 3.2."""
    ours = [table("3.2")[name]["relative_permittivity"] for name in ("etpu", "x60")]
    taken = [materials.load(name).value("relative_permittivity").value for name in ("etpu", "x60")]
    plain = reference.Params()
    name, corrected = "relative permittivity of (electrodes, dielectric) (ours: Table 3.2)", relative_permittivity[::-1]
    yield ItemPart(name, "", ours, relative_permittivity, corrected)
    yield from beside("3.2", **printed)
    yield ItemPart("relative permittivities of a prediction", "", taken, corrected, copied=True)
    for name, value in sizes.items():
        yield ItemPart(name.removesuffix("_mm"), "mm", float(getattr(plain, name)), value, copied=True)
    yield ItemPart("tones", "Hz", TONES_HZ, tones_hz, copied=True)
    yield from _copied("thesis-3.1", printed)


def flank(radius_mm: float, **printed: float) -> Parts:
    """Figure 2.12: the flank's length, by which 3.1.2 turns it; its sizes are our defaults [mm]."""
    length = np.hypot(printed["period_mm"] / 4, printed["hang_height_mm"])
    yield ItemPart("length of a flank (ours: by its sides)", "mm", length, radius_mm)
    yield from _sizes("tri", printed)


def strips(half_mm: float, **printed: float) -> Parts:
    """Figures 2.14 and 3.5: four strips make up a period, of which 6.1.2 solves half; their sizes are our defaults."""
    period = printed["etpu_width_mm"] + printed["x60_width_mm"] + 2 * printed["air_width_mm"]
    yield ItemPart("period (ours: sum of the strips' widths)", "mm", period, 2 * half_mm)
    yield from _sizes("rect", printed)


def _sizes(shape: str, printed: Printed) -> Parts:
    params = designs.make({"shape": shape, "parameters": {"dielectric_mm": FILM_MM}}).params
    for n, v in printed.items():
        yield ItemPart(n.removesuffix("_mm").replace("_", " "), "mm", float(getattr(params, n)), v, copied=True)


def tones(frequency_hz: list[float], corrected_hz: list[float], weights: list[float]) -> Parts:
    """Table 5.1: one tone is ten times too low, by Table 3.1 and by weights that fall with the frequency."""
    printed, corrected = ([w for _, w in sorted(zip(f, weights, strict=True))] for f in (frequency_hz, corrected_hz))
    yield ItemPart("tones (ours: Table 3.1)", "Hz", table("3.1")["tones_hz"], frequency_hz, corrected_hz)
    yield ItemPart("weights by rising frequency (ours: falling)", "", sorted(weights, reverse=True), printed, corrected)


def settings(
    layer_mm: list[float], nozzle_mm: float, line_mm: float, multiplier: float, infill_percent: list[float],
    **printed: Printed,
) -> Parts:  # fmt: skip
    """Table 4.2: temperatures within the makers' ranges, infill by the remarks of D.1; the rest is transcribed."""
    machine, least = printer.load_printer(_PRINTER), next(r.remark for r in _prints() if "infill" in r.remark)
    flow = [_of_source(name, "flow_percent", "thesis-4.2") / 100 for name in ("etpu", "x60")]
    ranges = table("4.1")["ranges_c"]
    for name, values in printed.items():
        nozzle_c = values["nozzle_temperature_c"]
        within_c = float(np.clip(nozzle_c, *ranges[name]))
        yield ItemPart(f"{name}: nozzle temperature (ours: nearest within Table 4.1)", "°C", within_c, nozzle_c)
    yield ItemPart("x60: least infill (ours: Table D.1)", "%", float(least.partition("%")[0]), min(infill_percent))
    layers = [printer.load_quality(q).layer_mm for q in ("fine", "extrafine")]
    yield ItemPart("layer heights", "mm", layers, layer_mm, copied=True)
    yield ItemPart("nozzle", "mm", machine.nozzle_mm, nozzle_mm, copied=True)
    yield ItemPart("extrusion width", "mm", machine.line_mm(), line_mm, copied=True)
    yield ItemPart("extrusion multiplier", "", flow, [multiplier] * 2, copied=True)
    yield from _copied("thesis-4.2", printed)


def earlier(
    tip_mm: float, resistivity_ohm_m: Printed, plate_mm: float, size_mm: list[float], **printed: Printed
) -> Parts:
    """Table C.1: the earlier sensor, against Tables 3.1, 3.2 and 4.1."""
    plate = table("3.1")["sizes"]
    transcribed = [_of_source("etpu", "resistivity_ohm_m", f"thesis-c.1-{end}") for end in resistivity_ohm_m]
    for end, value in resistivity_ohm_m.items():
        name, ohm_m = f"resistivity of the {end} electrode", 1 / table("3.2")["conductivity"]["etpu"]
        yield ItemPart(f"{name} (ours: 1/conductivity of Table 3.2)", "ohm m", ohm_m, value)
    yield ItemPart("dielectric (ours: Table 3.1)", "mm", plate["dielectric_mm"], plate_mm)
    yield ItemPart("length and width (ours: Table 3.1)", "mm", [plate["length_mm"], plate["width_mm"]], size_mm)
    yield from beside("4.1", **printed)
    yield ItemPart("length of the tip", "mm", TIP_M / M_PER_MM, tip_mm, copied=True)
    yield ItemPart("resistivities", "ohm m", transcribed, list(resistivity_ohm_m.values()), copied=True)
    yield from _copied("thesis-c.1", printed)


def multimeter(rows: int, y_ohm: dict[str, list[float]], z_ohm: dict[str, list[float]]) -> Parts:
    """Table D.1: its readings, as typed; and cogs along the electrode against cogs across it, by their field.

    Without a film these sensors are shorted: top and bottom electrode are read in parallel.
    """
    prints = _prints()
    orders = [verdict(Evidence(r.written, r.y_ohm, r.z_ohm)).same_order for r in prints]
    both = [order for order in orders if order is not None]
    by_name = {reading.written: reading for reading in prints}
    ours, readings_ohm = np.divide(_shorted_ohm("y"), _shorted_ohm("x")).tolist()
    yield ItemPart("R of 23 triY over 23 triX, medians", "", ours, readings_ohm, shown=3)
    yield ItemPart("rows with both readings, and those whose Z is of Y's order or less", "", [len(both), sum(both)])
    yield ItemPart("rows", "", len(prints), rows, copied=True)
    for name, value in y_ohm.items():
        yield ItemPart(f"{name}, Y", "ohm", by_name[name].y_ohm, value, copied=True)
    for name, value in z_ohm.items():
        yield ItemPart(f"{name}, Z", "ohm", by_name[name].z_ohm, value, copied=True)


def _shorted_ohm(axis: str) -> tuple[float, float]:
    """Both electrodes of 23 tri without a film in parallel, by their field, and the median of its readings [ohm]."""
    design = designs.make({"shape": "tri", "parameters": {"dielectric_mm": 0.0, "along": axis}})
    ours = 1 / sum(1 / r.value for r in rest_state.electrode_resistance(drawn(design)).values())
    return ours, median(r.y_ohm[0] for r in _prints() if r.iteration == 23 and r.design == f"tri{axis}-d0")


def baked() -> Parts:
    """4.2.7: baking lowers an electrode's resistance; by the remarks of Table D.1."""
    raw, done = (
        median(r.y_ohm[0] for r in _prints() if r.y_ohm and (r.remark == "not baked") == unbaked)
        for unbaked in (True, False)
    )
    yield ItemPart("R_Y of baked prints over that of the others, medians", "", done / raw, 1.0, shown=3, limit=True)


def infill(distance_mm: float, least_percent: float) -> Parts:
    """7.2.2, figure 7.2: distance of a grid's lines, of which half of an infill lies each way, as Cura counts it."""
    line_mm = table("4.2")["line_mm"]
    distances = [2 * line_mm * 100 / percent for percent in (100.0, least_percent)]
    for percent, at in zip((100.0, least_percent), distances, strict=True):
        yield ItemPart(f"line distance at {percent:g} % infill", "mm", at, distance_mm, limit=True)
