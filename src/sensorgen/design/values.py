"""Values of a design's materials, each with its source: permittivities, moduli, piezoresistance."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import exp, inf, log

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.design.materials import PIEZORESISTANCE, SD_95, SET, Material

ASSUMED = "assumed: no source gives it"
ENDS = ("top", "bottom")  # electrodes
LN_SPREAD = {"resistivity_ohm_m": 0.5, "relative_permittivity": 0.1, "youngs_modulus_pa": 0.25}
"""Standard deviations of ln of a material's value from one print to another, where its source gives no range: sources
of resistivity differ by a factor of 12 (etpu.yaml), those of permittivity from 4.68 to 6.33 (x60.yaml); moduli of
printed elastomers vary by some 25 %."""
LN_SOURCES = {"resistivity_ohm_m": 1.32, "relative_permittivity": 0.13, "youngs_modulus_pa": 0.69,
              "poisson_ratio": 0.053, "density_kg_m3": 0.12}  # fmt: skip
"""Standard deviations of ln of what sources say of one material, pooled over the materials that ship and have several
sources: by 2, 4 (dielectrics), 9, 2 and 2 degrees of freedom. What one source alone says is as uncertain."""
UNGUARDED_PF, GUARDED_PF = 5.0, 0.1  # most that leads add: air plates of student laboratories 2.6 to 12 pF; a guess
CONTACTS_OHM, METAL_CONTACTS_OHM = 4.3e3, 1.0  # both contacts: strips of direct.mit.edu/view-large/3728479; clips
STATED = 1.1  # factor that a stated lead is known to
_METAL_OHM_M = 1e-4  # resistivity below which a contact is one of metals
_LACKING = {
    "relative_permittivity": (4.5, 2.5, 8.0),  # elastomers that are printed or cast
    "resistivity_ohm_m": (0.26, 0.0055, 12.6),  # mean of ln of the conductive filaments that ship, deviation 1.97
    "youngs_modulus_pa": (27e6, 1.1e6, 4e9),  # mean of ln of the filaments that ship, deviation 1.62; rigid plastics
    "poisson_ratio": (0.48, 0.45, 0.4999),  # of a rubber-like solid
}
_RIGID_PA, _RIGID_RATIO = 500e6, (0.38, 0.30, 0.45)  # modulus above which a plastic is no elastomer
_LN_HARDNESS = 0.88  # of a modulus by hardness: the five filaments that ship and have both
_RUBBER = 0.4999  # Poisson's ratio that no solid exceeds here


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
    """The value of one quantity by a source, "" for the default, assumed where no plausible source gives any.

    Raises
    ------
    MissingValue
        Sources give it, but none of them is the default; or it cannot be assumed.
    """
    try:
        value = material.value(quantity, source)
    except MissingValue:
        if quantity not in _LACKING or any(not v.implausible for v in material.properties.get(quantity, ())):
            raise
        return MaterialValue(material.name, quantity, _lacking(material, quantity)[0], ASSUMED)
    return MaterialValue(material.name, quantity, value.value, value.source)


def _lacking(material: Material, quantity: str) -> tuple[float, float, float]:
    """Value and range of a quantity that no source gives, the modulus by the hardness where that is known.

    Notes
    -----
    Gent (1958), Rubber Chem. Technol. 31, 896: E [MPa] = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S)) of a
    Shore A hardness S.
    """
    shore = material.properties.get("hardness_shore_a")
    if quantity == "youngs_modulus_pa" and shore:
        s, factor = min(shore[0].value, 99.0), exp(SD_95 * _LN_HARDNESS)
        modulus_pa = 1e6 * 0.0981 * (56 + 7.62336 * s) / (0.137505 * (254 - 2.54 * s))
        return modulus_pa, modulus_pa / factor, modulus_pa * factor
    if quantity == "poisson_ratio" and material_value(material, "", "youngs_modulus_pa").value > _RIGID_PA:
        return _RIGID_RATIO
    return _LACKING[quantity]


def spread(design: Design, value: MaterialValue) -> tuple[float, float]:
    """Lowest and highest of a value: 95 % of prints.

    A source's own interval, as from coupons or a fit, counts alone. Else it is what all sources give, and at least
    what prints differ by (``LN_SPREAD``); of one source alone, what sources differ by (``LN_SOURCES``). What the user
    set differs from print to print.
    """
    material, quantity, at = design.material(value.material), value.quantity, value.value
    if value.source == ASSUMED:
        return _lacking(material, quantity)[1:]
    low, high = _own_range(material, value)
    if low is not None and high is not None:
        return min(at, low), max(at, high)
    given = [v.value for v in material.properties.get(quantity, ()) if not v.implausible]
    several = [] if value.source == SET else [at, *given]
    ends = _around(quantity, at, (LN_SOURCES if len(set(several)) == 1 else LN_SPREAD).get(quantity, 0.0))
    return min([*ends, *several]), max([*ends, *several])


def _around(quantity: str, at: float, deviation: float) -> tuple[float, float]:
    """Ends by a deviation of ln: of a permittivity's excess over vacuum, of a ratio up to that of rubber."""
    factor = exp(SD_95 * deviation)
    if quantity == "relative_permittivity" and at > 1:
        return 1 + (at - 1) / factor, 1 + (at - 1) * factor
    most = max(at, _RUBBER) if quantity == "poisson_ratio" else inf
    return at / factor, min(at * factor, most)


def assumed(design: Design, values: Iterable[MaterialValue]) -> Iterator[str]:
    """Each value that no source gives, with its range, in words."""
    for value in values:
        if value.source == ASSUMED:
            low, high = spread(design, value)
            about = f"{value.quantity} of {value.material} {value.value:.3g}"
            yield f"{about} ({low:.3g} to {high:.4g}): no source gives it"


def ln_spread(material: Material, source: str, quantity: str) -> tuple[float, float]:
    """Mean and standard deviation of ln of what a print has of a quantity, over the value by a source [-].

    Of a source with a range they are those of the normal distribution with 95 % in it; else 0 and ``LN_SPREAD``.
    """
    at = material_value(material, source, quantity)
    low, high = _lacking(material, quantity)[1:] if at.source == ASSUMED else _own_range(material, at)
    if low and high and low < high:
        return log(low * high) / 2 - log(at.value), log(high / low) / (2 * SD_95)
    return 0.0, LN_SPREAD[quantity]


def _own_range(material: Material, at: MaterialValue) -> tuple[float | None, float | None]:
    """Ends of the interval that the source of a value gives itself."""
    own = next((v for v in material.properties.get(at.quantity, ()) if v.source == at.source), None)
    return (own.low, own.high) if own else (None, None)


def lead_ranges(design: Design) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Capacitance [F] and resistance [ohm] of leads and contacts: value, least, most.

    What a design states is known to ``STATED``. Else the contacts of a clip or a track's end with a filled polymer are
    anything up to the largest intercept of published printed strips; whole tracks of 0.4 kohm have been measured, so
    that they may be next to nothing too.
    """
    leads = design.leads
    rho = max(value.value for value in resistivities(design).values())
    most_pf = GUARDED_PF if leads.guard == "driven" else UNGUARDED_PF
    most_ohm = CONTACTS_OHM if rho > _METAL_OHM_M else METAL_CONTACTS_OHM
    stated = (leads.capacitance_pf, most_pf, 1e-12), (leads.resistance_ohm, most_ohm, 1.0)
    farad, ohm = (
        (0.0, 0.0, most * unit) if at is None else (at * unit, at * unit / STATED, at * unit * STATED)
        for at, most, unit in stated
    )
    return farad, ohm


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
    by_end = {}
    for end in ENDS:
        try:
            by_end[end] = material_value(*design.slot(f"{end}_electrode"), PIEZORESISTANCE)
        except MissingValue:
            continue
    return by_end


def film(design: Design) -> str:
    """Name of the material between the electrodes."""
    return design.materials.dielectric.partition("@")[0]
