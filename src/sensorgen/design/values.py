"""Values of a design's materials, each with its source: permittivities, moduli, piezoresistance."""

from dataclasses import dataclass
from math import log

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.design.materials import PIEZORESISTANCE, Material

ENDS = ("top", "bottom")  # electrodes
LN_SPREAD = {"resistivity_ohm_m": 0.5, "relative_permittivity": 0.1, "youngs_modulus_pa": 0.25}
"""Standard deviations of ln of a material's value from one print to another, where its source gives no range: sources
of resistivity differ by a factor of 12 (etpu.yaml), those of permittivity from 4.68 to 6.33 (x60.yaml); moduli of
printed elastomers vary by some 25 %."""
_RANGE = 2 * 1.959963984540054  # standard deviations in a source's range: it holds 95 %


@dataclass(frozen=True)
class MaterialValue:
    """A material's value and its source.

    Attributes
    ----------
    material, quantity : str
        Names, as ``x60`` and ``relative_permittivity``; the quantity's name carries the unit.
    value : float
        In that unit.
    source : str
        Name of the publication or fit, or ``set by the user``.
    """

    material: str
    quantity: str
    value: float
    source: str


def material_value(material: Material, source: str, quantity: str) -> MaterialValue:
    """The value of one quantity by a source, "" for the default; raises MissingValue where no source gives it."""
    value = material.value(quantity, source)
    return MaterialValue(material.name, quantity, value.value, value.source)


def ln_spread(material: Material, source: str, quantity: str) -> tuple[float, float]:
    """Mean and standard deviation of ln of what a print has of a quantity, over the value by a source [-].

    Of a source with a range they are those of the normal distribution with 95 % in it; else 0 and ``LN_SPREAD``.
    """
    value = material.value(quantity, source)
    if value.low and value.high and value.low < value.high:
        return log(value.low * value.high) / 2 - log(value.value), log(value.high / value.low) / _RANGE
    return 0.0, LN_SPREAD[quantity]


def dielectrics(design: Design) -> set[str]:
    """Names of the materials in the sensor that do not conduct."""
    return {b.material for b in design.in_use.bodies if not b.terminal and not design.conducts(b.material)}


def permittivities(design: Design) -> list[MaterialValue]:
    """Relative permittivity of every dielectric in the sensor, and of air; raises MissingValue."""
    used = design.used() | {"air": ""}
    names = dielectrics(design) | {"air"}
    return [material_value(design.material(name), used[name], "relative_permittivity") for name in sorted(names)]


def of_all_materials(design: Design, quantity: str) -> dict[str, MaterialValue]:
    """A quantity of every material in the sensor, by material; raises MissingValue."""
    used, names = design.used(), sorted({body.material for body in design.in_use.bodies})
    return {name: material_value(design.material(name), used[name], quantity) for name in names}


def resistivities(design: Design) -> dict[str, MaterialValue]:
    """Resistivity of the electrodes [ohm m], by ``ENDS``; raises MissingValue."""
    return {end: material_value(*design.slot(f"{end}_electrode"), "resistivity_ohm_m") for end in ENDS}


def piezoresistance(design: Design) -> dict[str, MaterialValue]:
    """Relative rise of resistivity with pressure [1/Pa], of those ``ENDS`` whose electrode has a value.

    No source that ships gives one: without a value of the user's own, resistivity under the tip is as elsewhere.
    """
    found = {}
    for end in ENDS:
        try:
            found[end] = material_value(*design.slot(f"{end}_electrode"), PIEZORESISTANCE)
        except MissingValue:
            continue
    return found


def film(design: Design) -> str:
    """Name of the material between the electrodes."""
    return design.materials.dielectric.partition("@")[0]
