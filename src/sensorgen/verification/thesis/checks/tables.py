"""Tables of the thesis, against the files of materials, printers and qualities, and the defaults of designs."""

import numpy as np

from sensorgen.core.errors import MissingValue
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design import materials, printer
from sensorgen.design.shapes import reference
from sensorgen.prediction.query import TIP_M, TONES_HZ
from sensorgen.verification.thesis.checks._columns import FILM_MM
from sensorgen.verification.thesis.verdicts import Part

_UNITS = {"_pa": "Pa", "_kg_m3": "kg/m3", "_c": "°C", "_percent": "%"}  # by the ending of a quantity
_PRINTER = "diabase-h5"
_SIEMENS = "S/m"

Printed = dict[str, float]


def _named(material: str, quantity: str) -> tuple[str, str]:
    """What a quantity of a material is called, and its unit."""
    ending = next((end for end in _UNITS if quantity.endswith(end)), "")
    return f"{material}: {quantity.removesuffix(ending).replace('_', ' ')}", _UNITS.get(ending, "")


def _of_source(material: str, quantity: str, source: str) -> float:
    """The value that a material's file keeps under a source."""
    loaded = materials.load(material)
    values = loaded.properties.get(quantity, []) + loaded.print.get(quantity, [])
    return next((v.value for v in values if v.source == source), np.nan)


def of_source(source: str, **said: Printed) -> list[Part]:
    """Values by material and quantity, against what is kept of that source."""
    return [
        Part(*_named(material, quantity), _of_source(material, quantity, source), value)
        for material, values in said.items()
        for quantity, value in values.items()
    ]


def _conductivity(material: str, source: str = "") -> float:
    """What a prediction takes [S/m]: none where the files have no value for it to take."""
    try:
        return 1 / materials.load(material).value("resistivity_ohm_m", source).value
    except MissingValue:
        return 0.0


def simulated(conductivity: Printed, **said: Printed) -> list[Part]:
    """Table 3.2: its materials; and X60, which as printed conducts better than the electrodes."""
    return [
        *of_source("thesis-3.2", **said),
        Part("etpu: conductivity", _SIEMENS, _conductivity("etpu", "thesis-3.2"), conductivity["etpu"]),
        Part("x60: conductivity", _SIEMENS, _conductivity("x60"), conductivity["x60"], 0.0, scale=1.0),
        Part("air: conductivity", _SIEMENS, _conductivity("air", "thesis-3.2"), conductivity["air"], scale=1.0),
    ]


def plate(sizes: Printed, relative_permittivity: list[float], tones_hz: list[float], **said: Printed) -> list[Part]:
    """Table 3.1: sizes of the plain plate, tones, and a pair of permittivities in the wrong order."""
    ours = [materials.load(name).value("relative_permittivity").value for name in ("etpu", "x60")]
    plain = reference.Params()
    return [
        *(Part(name.removesuffix("_mm"), "mm", float(getattr(plain, name)), value) for name, value in sizes.items()),
        Part("relative permittivity of (electrodes, dielectric)", "", ours, relative_permittivity,
             relative_permittivity[::-1]),
        Part("tones", "Hz", TONES_HZ, tones_hz),
        *of_source("thesis-3.1", **said),
    ]  # fmt: skip


def cell(shape: str, **said: float) -> list[Part]:
    """Figures 2.12, 2.14 and 3.5: sizes of a cell as the text has them [mm]."""
    params = designs.make({"shape": shape, "parameters": {"dielectric_mm": FILM_MM}}).params
    return [Part(n.removesuffix("_mm").replace("_", " "), "mm", float(getattr(params, n)), v) for n, v in said.items()]


def tones(frequency_hz: list[float], corrected_hz: list[float]) -> list[Part]:
    """Table 5.1: the tones, one of them ten times too low."""
    return [Part("tones", "Hz", TONES_HZ, frequency_hz, corrected_hz)]


def settings(
    layer_mm: list[float], nozzle_mm: float, line_mm: float, multiplier: float, **said: Printed
) -> list[Part]:  # fmt: skip
    """Table 4.2: layers, nozzle and lines; and what is set by material."""
    machine = printer.load_printer(_PRINTER)
    flow = [_of_source(name, "flow_percent", "thesis-4.2") / 100 for name in ("etpu", "x60")]
    return [
        Part("layer heights", "mm", [printer.load_quality(q).layer_mm for q in ("fine", "extrafine")], layer_mm),
        Part("nozzle", "mm", machine.nozzle_mm, nozzle_mm),
        Part("extrusion width", "mm", machine.line_mm(), line_mm),
        Part("extrusion multiplier", "", flow, [multiplier] * 2),
        *of_source("thesis-4.2", **said),
    ]


def earlier(tip_mm: float, resistivity_ohm_m: Printed, **said: Printed) -> list[Part]:
    """Table C.1: materials of the earlier sensor, and its tip."""
    return [
        Part("length of the tip", "mm", TIP_M / M_PER_MM, tip_mm),
        *(
            Part(f"resistivity of the {end} electrode", "ohm m",
                 _of_source("etpu", "resistivity_ohm_m", f"thesis-c.1-{end}"), value)
            for end, value in resistivity_ohm_m.items()
        ),
        *of_source("thesis-c.1", **said),
    ]  # fmt: skip
