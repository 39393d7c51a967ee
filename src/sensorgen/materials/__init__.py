"""Materials: every published value under its source, because the sources disagree.

A material is a YAML file beside this one; see ``etpu.yaml``. A design names a material and, if it
likes, the source to take: ``x60`` or ``x60@thesis-4.1``.
"""

from functools import cache
from importlib import resources
from typing import Annotated

from pydantic import Field

from sensorgen import yamlfile
from sensorgen.errors import BadInput, MissingValue, UnknownName
from sensorgen.records import Strict, checked


class Value(Strict):
    """One number as one source gives it; the property's name carries the unit."""

    value: float
    source: str
    default: bool = False
    implausible: bool = False
    note: str = ""
    low: float | None = None
    high: float | None = None


class Material(Strict):
    """A material with every value that its sources give."""

    name: str
    title: str
    about: str
    colour: Annotated[str, Field(pattern="^#[0-9a-f]{6}$")]
    conductor: bool
    properties: dict[str, list[Value]]
    print: dict[str, list[Value]] = Field(default={})
    drying: str = ""

    def sources(self) -> set[str]:
        """Names of all sources that this material quotes."""
        return {v.source for group in (self.properties, self.print) for values in group.values() for v in values}

    def value(self, quantity: str, source: str = "") -> Value:
        """The value of a quantity from ``source``, or the default where that source is silent.

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
        chosen = [v for v in values if v.source == source] or [v for v in values if v.default]
        if not chosen:
            named = ", ".join(sorted(v.source for v in values))
            raise MissingValue(
                f"{self.name} has no default {quantity}"
                + (f"; name one of its sources: {named}" if named else ": no source gives it")
            )
        return chosen[0]


def names() -> list[str]:
    """Names of the materials that ship with sensorgen."""
    files = resources.files(__name__).iterdir()
    return sorted(f.name.removesuffix(".yaml") for f in files if f.name.endswith(".yaml") and f.name != "sources.yaml")


@cache
def load(name: str) -> Material:
    """Read a material by name.

    Raises
    ------
    UnknownName
        No material goes by that name.
    """
    if name not in names():
        raise UnknownName("material", name, names())
    file = f"{name}.yaml"
    data = yamlfile.parse((resources.files(__name__) / file).read_text("utf-8"), file)
    try:
        return checked(Material, {**data, "name": name})
    except BadInput as error:
        raise error.within(file) from None


@cache
def citations() -> dict[str, str]:
    """What each source's name stands for."""
    text = (resources.files(__name__) / "sources.yaml").read_text("utf-8")
    data = yamlfile.parse(text, "sources.yaml")
    theses = {str(name): f"{data['thesis']}: {where}" for name, where in data["sources"].items()}
    return theses | {str(name): str(what) for name, what in data["others"].items()}
