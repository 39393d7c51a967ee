"""Values of a design's materials, each with its source: permittivities, moduli, piezoresistance."""

from dataclasses import dataclass

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.design.materials import PIEZORESISTANCE, Material

ENDS = ("top", "bottom")  # electrodes


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
