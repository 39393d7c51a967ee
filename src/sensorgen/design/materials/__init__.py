"""Materials: every published value under its source, because the sources disagree.

A material is a YAML file of a pack (:mod:`sensorgen.design.packs`); see ``etpu.yaml``. A design names a material and,
optionally, the source to take: ``x60`` or ``x60@thesis-4.1``. Sources of the user's own, as a fit to measurements, are
files of packs too; a design that names none of them never sees them, so that its identity is the same for every reader.
"""

import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cache, lru_cache
from importlib import resources
from math import exp, inf, isinf
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import Field, model_validator

from sensorgen.core import files as store
from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, SensorgenError, UnknownName
from sensorgen.core.records import Line, Strict, checked, stated
from sensorgen.design import packs
from sensorgen.design.packs import Kind

FILM_LEAK = "leak_s_per_m2"  # leak of a film per area; a matter of how it was printed: no source that ships gives one
PIEZORESISTANCE = "piezoresistance_per_pa"  # relative rise of an electrode's resistivity with pressure: none either
INTERFACE_GAP = "interface_gap_m"  # air between electrode and dielectric; a fit of none is below 0 as often as above
SD_95 = 1.959963984540054  # standard deviations on either side that hold 95 %
SET = "set by the user"  # source of a value that stands in a design itself
_RANGES = {  # finite ends belong to it; anything else is above 0
    "poisson_ratio": (-1.0, 0.5),
    "relative_permittivity": (1e-9, 1e9),  # far beyond any material; ratios of such values are still numbers
    "loss_tangent": (0.0, 1e6),
    PIEZORESISTANCE: (-inf, inf),
    INTERFACE_GAP: (-inf, inf),
}
_PLAUSIBLE = {  # of any solid, foam or gel, and of any print; what is beyond has another unit
    "resistivity_ohm_m": (1e-8, inf),
    "relative_permittivity": (1.0, 1e5),
    "loss_tangent": (0.0, 100.0),
    "youngs_modulus_pa": (1e2, 2e12),
    "tensile_strength_pa": (1e2, 1e11),
    "density_kg_m3": (1.0, 23e3),
    "interface_gap_m": (-1e-3, 1e-3),
    "elongation_at_break": (0.0, 50.0),
    "hardness_shore_a": (0.0, 100.0),
    "hardness_shore_d": (0.0, 100.0),
    "nozzle_temperature_c": (20.0, 600.0),
    "bed_temperature_c": (0.0, 300.0),
    "speed_mm_s": (0.1, 2000.0),
    "fan_percent": (0.0, 100.0),
    "infill_percent": (0.0, 100.0),
    "wall_lines": (0.0, 1000.0),
    "flow_percent": (10.0, 300.0),
    "max_flow_mm3_s": (0.01, 1000.0),
    "retraction_mm": (0.0, 100.0),
}


class OwnValue(Strict):
    """One number of a source of the user's own, with the range that holds 95 % of prints or their standard deviation.

    A value above 0 with ``sd`` gets ``low`` and ``high`` by it, as of a logarithmic normal distribution.
    """

    value: float
    note: str = ""
    low: float | None = None
    high: float | None = None
    sd: Annotated[float, Field(ge=0)] | None = Field(default=None, exclude=True)

    @model_validator(mode="before")
    @classmethod
    def _ends(cls, data: Any) -> Any:
        if not isinstance(data, dict) or data.get("sd") is None:
            return data
        value, sd = data.get("value"), data["sd"]
        if "low" in data or "high" in data:
            raise ValueError("sd beside low or high; expected one of both")
        if not (isinstance(value, float) and isinstance(sd, float | int) and value > 0):
            return data
        factor = exp(SD_95 * sd / value)
        return {**data, "low": value / factor, "high": value * factor}


class Value(OwnValue):
    """One number as one source gives it; the property's name carries the unit."""

    source: str
    default: bool = False
    implausible: bool = False


class Own(Strict):
    """A source of the user's own: what it is, and its values by material and quantity."""

    about: str
    materials: dict[str, dict[str, OwnValue]]


class Material(Strict):
    """A material with every value that its sources give."""

    name: str
    title: Line
    about: Line
    colour: Annotated[str, Field(pattern="^#[0-9a-f]{6}$")]
    conductor: bool
    properties: dict[str, list[Value]]
    print: dict[str, list[Value]] = Field(default={})
    drying: str = ""
    citations: dict[str, str] = stated({}, "What the names of its sources mean.")

    def sources(self) -> set[str]:
        """Names of all sources that this material quotes."""
        groups = (self.properties, self.print)
        return {v.source for group in groups for values in group.values() for v in values} - {SET}

    def with_values(self, values: Mapping[str, float]) -> "Material":
        """The material with values of the user's own, which go before every source's.

        Parameters
        ----------
        values : mapping of str to float
            Number by quantity, in the unit of the quantity's name.
        """
        own = {key: [Value(value=value, source=SET), *self.properties.get(key, [])] for key, value in values.items()}
        return self.model_copy(update={"properties": self.properties | own})

    def value(self, quantity: str, source: str = "") -> Value:
        """The value of a quantity that the user set, else from ``source``, or the default where that source is silent.

        Parameters
        ----------
        quantity : str
            Name with unit, as in the material's file: ``relative_permittivity``, ``speed_mm_s``.
        source : str
            Name of a source, or "" for the default.

        Raises
        ------
        MissingValue
            No source gives it, or only an implausible one that a design must name to get.
        """
        values = self.properties.get(quantity, []) + self.print.get(quantity, [])
        rank = {source: 1, SET: 0}
        usable = [v for v in values if v.source in rank or v.default]
        if not usable:
            named = ", ".join(sorted(v.source for v in values))
            unnamed = ": no source gives it; set one with --set or material_values"
            raise MissingValue(
                f"{self.name} has no default {quantity}" + (f"; name one of its sources: {named}" if named else unnamed)
            )
        return min(usable, key=lambda v: rank.get(v.source, 2))

    def chosen(self, quantity: str, source: str = "") -> float | None:
        """Number of a quantity as :meth:`value` chooses it; None where it raises."""
        try:
            return self.value(quantity, source).value
        except MissingValue:
            return None

    def print_range(self, quantity: str, around: float) -> tuple[float, float]:
        """Lowest and highest that the sources advise for printing.

        Parameters
        ----------
        quantity : str
            As in ``print`` of the material's file.
        around : float
            Half the range of a source that gives no range, in the unit of the quantity.

        Returns
        -------
        (float, float)
            Its ends; everything where no source gives the quantity.
        """
        values = self.print.get(quantity, [])
        low = [v.value - around if v.low is None else min(v.low, v.value) for v in values]
        high = [v.value + around if v.high is None else max(v.high, v.value) for v in values]
        return min(low, default=-inf), max(high, default=inf)


Texts = Mapping[Kind, Mapping[str, str]]  # files of packs that a design has taken over, by kind and name
NO_TEXTS: Texts = {}


def names() -> list[str]:
    """Names of the materials that ship with sensorgen."""
    return sorted(packs.shipped_names("materials"))


@cache
def quantities() -> list[str]:
    """Names of all quantities that a material can have, those of printing left out."""
    return sorted({quantity for name in names() for quantity in load(name).properties} | {FILM_LEAK, INTERFACE_GAP})


@cache
def print_quantities() -> list[str]:
    """Names of all quantities of printing."""
    return sorted({quantity for name in names() for quantity in load(name).print})


def check_own(name: str, values: Mapping[str, float], texts: Texts = NO_TEXTS) -> None:
    """Refuse values of the user's own that no material can have; ``texts`` as of :func:`load`.

    Raises
    ------
    UnknownName
        No such material, or no such quantity; the nearest one is offered.
    OutOfRange
        A number that the quantity cannot be.
    """
    load(name, texts=texts)
    for quantity, value in values.items():
        if quantity not in (known := sorted({*quantities(), *print_quantities()})):
            raise UnknownName(f"quantity of {name}", quantity, known)
        low, high = _RANGES.get(quantity, (0.0, inf))
        if not low <= value <= high or isinf(value) or (value == 0 and quantity not in _RANGES):
            raise OutOfRange(f"{quantity} of {name} is {value:g}; expected {_said(low, high, 'a number above 0')}")


def _said(low: float, high: float, unsigned: str) -> str:
    """Numbers that a quantity can take, in words."""
    if high < inf:
        return f"{low:g} to {high:g}"
    return unsigned if low == 0 else "a finite number"


def load(name: str, sources: Iterable[str] = (), texts: Texts = NO_TEXTS) -> Material:
    """Read a material by name.

    Parameters
    ----------
    name : str
        Of the material.
    sources : iterable of str
        Sources of the user's own whose values are wanted too; others among them count for nothing.
    texts : mapping
        Files that go before those of packs: a design's :attr:`~sensorgen.design.design.Design.own`.

    Raises
    ------
    UnknownName
        No material goes by that name.
    BadInput
        The file of the material, or of such a source, is damaged.
    """
    material = _of(name, texts)
    for source in sources:
        text = texts.get("sources", {}).get(source)
        if text is not None or source in packs.source_names():
            added = own_source(source, text, texts).materials.get(name, {})
            values = {
                quantity: [*material.properties.get(quantity, []), Value(source=source, **dict(value))]
                for quantity, value in added.items()
            }
            material = material.model_copy(update={"properties": material.properties | values})
    return material


def own_source(source: str, text: str | None = None, texts: Texts = NO_TEXTS) -> Own:
    """A source of the user's own, by its text or its file; ``texts`` as of :func:`load`.

    Raises
    ------
    BadInput
        Its file is damaged, or has the name of a source that ships.
    """
    content = _own(source, text)
    try:
        if source in shipped_citations():
            raise BadInput(f"{source} is the name of a source that ships with sensorgen; expected another name")
        for name, values in content.materials.items():
            _check_values(name, {key: value.value for key, value in values.items()}, texts)
            for quantity, value in values.items():
                if wrong := disorder(value, advised=quantity in print_quantities()):
                    raise OutOfRange(f"{quantity} of {name} {wrong}")
    except (BadInput, UnknownName, OutOfRange) as error:
        raise error.within(f"{source}.yaml") from None
    return content


def _own(source: str, text: str | None) -> Own:
    """A source of the user's own, its values not checked yet."""
    file = f"{source}.yaml" if text is not None else str(source_path(source))
    try:
        return checked(Own, yamlfile.parse(_source_text(source) if text is None else text, file))
    except BadInput as error:
        raise error.within(file) from None


class SourceValue(NamedTuple):
    """Value of a quantity with its interval, in the unit of the quantity's name."""

    quantity: str
    value: float
    low: float
    high: float
    note: str = ""

    def row(self) -> str:
        """Line of a source's file."""
        numbers = f"value: {self.value:.6g}, low: {self.low:.6g}, high: {self.high:.6g}"
        return f"    {self.quantity}: {{{numbers}{f', note: {json.dumps(self.note)}' if self.note else ''}}}"


def source_file(about: str, materials: Mapping[str, Iterable[SourceValue]], comments: Iterable[str] = ()) -> str:
    """File of a source of the user's own: values of materials, and comments on what it has not."""
    lines = [f"about: {json.dumps(about)}", "materials:"]
    for material, values in materials.items():
        rows = [value.row() for value in values]
        lines += [f"  {material}:{'' if rows else ' {}'}", *rows]
    return "\n".join((*lines, *(f"# {comment}" for comment in comments))) + "\n"


def source_folder() -> Path:
    """The folder of fits: what SENSORGEN_MATERIALS says, or the system's place for a user's data."""
    return store.data(packs.SOURCES, "materials")


def source_path(source: str) -> Path:
    """The file of a source of the user's own: of the pack that has it, else where a fit is to write it."""
    packed = (pack.path("sources", source) for pack in packs.own())
    return next((file for file in packed if os.path.lexists(file)), source_folder() / f"{source}.yaml")


def _source_text(source: str) -> str:
    """Content of a source's file; raises BadInput where it cannot be read."""
    file = source_path(source)
    pack = next(pack for pack in packs.own() if pack.path("sources", source) == file)
    return packs.File("sources", source, pack).text()


def _check_values(name: str, values: Mapping[str, float], texts: Texts) -> None:
    """Refuse values that are none; quantities may be new ones, which nothing reads."""
    _of(name, texts)
    for quantity, value in values.items():
        low, high = _RANGES.get(quantity, (0.0, inf))
        if not low <= value <= high or isinf(value):
            raise OutOfRange(f"{quantity} of {name} is {value:g}; expected {_said(low, high, 'a number from 0 on')}")


def _of(name: str, texts: Texts) -> Material:
    """A material by the text of its file."""
    if name in packs.shipped_names("materials"):
        return _shipped(name)
    text = texts.get("materials", {}).get(name)
    return parse(name, packs.find("materials", name).text() if text is None else text)


@cache
def _shipped(name: str) -> Material:
    return parse(name, packs.File("materials", name, packs.shipped_names("materials")[name]).text())


@lru_cache(maxsize=256)
def parse(name: str, text: str) -> Material:
    """A material by the text of its file.

    Raises
    ------
    BadInput
        The text is damaged.
    OutOfRange
        A value that no material can have.
    """
    file = f"{name}.yaml"
    try:
        material = checked(Material, {**yamlfile.parse(text, file), "name": name})
    except BadInput as error:
        raise error.within(file) from None
    for group, values in (("properties", material.properties), ("print", material.print)):
        for quantity, several in values.items():
            for k, each in enumerate(several):
                if wrong := fault(quantity, each, advised=group == "print"):
                    line = yamlfile.line(text, (group, quantity, k))
                    raise OutOfRange(f"{file}, line {line}: {quantity} of {each.source} {wrong}")
            if sum(each.default for each in several) > 1:
                raise BadInput(f"{file}: {quantity} has two values with default: true; expected one")
    return material


def first_form(material: Material) -> Material:
    """A material with the values that version 0.1.0 had of it, and those of the user's own."""
    places = resources.files(__name__) / "first" / f"{material.name}.yaml"
    if material.name not in names() or not places.is_file():
        return material
    shipped, then = _shipped(material.name).properties, yamlfile.parse(places.read_text("utf-8"), places.name)
    changed = {}
    for quantity, values in then.items():
        own = [value for value in material.properties[quantity] if value not in shipped[quantity]]
        at = sum(value.source == SET for value in own)
        changed[quantity] = [*own[:at], *(Value(**value) for value in values), *own[at:]]
    return material.model_copy(update={"properties": material.properties | changed})


def fault(quantity: str, given: Value, *, advised: bool = False) -> str:
    """Fault of a value of a material's file, or ""; its range may be ``advised``, as of printing."""
    low, high = _RANGES.get(quantity, (0.0, inf))
    if not low <= given.value <= high or (isinf(given.value) and given.default):
        return f"is {given.value:g}; expected {_said(low, high, 'a number from 0 on')}"
    return disorder(given, advised=advised) or _implausible(quantity, given)


def _implausible(quantity: str, given: Value) -> str:
    """Fault of a value, or an end of its range, that no solid or print has, unless its file says so; or ""."""
    low, high = _PLAUSIBLE.get(quantity, (-inf, inf))
    for number in (given.value, given.low, given.high):
        if number is not None and not low <= number <= high and not given.implausible:
            expected = f"{low:g} to {high:g}" if high < inf else f"{low:g} or more"
            unit = "1 MPa is 1.0e6 Pa" if quantity.endswith("_pa") else "in the unit at the end of its name"
            return f"is {number:g}; expected {expected} ({unit}): convert it, or mark the value 'implausible: true'"
    return ""


def disorder(given: Value | OwnValue, *, advised: bool = False) -> str:
    """Fault of the ends of a value's range, or ""; advice need not be followed."""
    low, high = (-inf if given.low is None else given.low), (inf if given.high is None else given.high)
    if not low <= high:
        return f"has low {low:g} above high {high:g}; exchange them"
    if not advised and not low <= given.value <= high:
        return f"is {given.value:g}, outside its own range of {low:g} to {high:g}; correct one of them"
    return ""


def citations() -> dict[str, str]:
    """References by the name of each source, those of the user's own and of packs too; a damaged material has none."""
    cited = dict[str, str]()
    for file in packs.files("materials"):
        if file.pack.where != "shipped":
            with suppress(SensorgenError):
                cited |= parse(file.name, file.text()).citations
    return cited | shipped_citations() | {name: _own(name, None).about for name in packs.source_names()}


def cited(texts: Texts) -> dict[str, str]:
    """References by the sources of a design's own files."""
    own_materials = (parse(name, text) for name, text in texts.get("materials", {}).items())
    meanings = {key: value for material in own_materials for key, value in material.citations.items()}
    return meanings | {name: _own(name, text).about for name, text in texts.get("sources", {}).items()}


@cache
def shipped_citations() -> dict[str, str]:
    """References by the name of each source, of the materials that ship."""
    text = (resources.files(__name__) / "sources.yaml").read_text("utf-8")
    data = yamlfile.parse(text, "sources.yaml")
    theses = {str(name): f"{data['thesis']}: {where}" for name, where in data["sources"].items()}
    more = {key: meaning for name in names() for key, meaning in _shipped(name).citations.items()}
    return more | theses | {str(name): str(what) for name, what in data["others"].items()}
