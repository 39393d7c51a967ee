"""Sources of the user's own: a YAML file each, named as the source, in a pack of the user's."""

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from sensorgen.core import files as places
from sensorgen.design import packs

PLACE = packs.SOURCES  # environment variable with another folder


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


def written(about: str, materials: Mapping[str, Iterable[SourceValue]], comments: Iterable[str] = ()) -> str:
    """File of a source: values of materials, and comments on what it has not."""
    lines = [f"about: {json.dumps(about)}", "materials:"]
    for material, values in materials.items():
        rows = [value.row() for value in values]
        lines += [f"  {material}:{'' if rows else ' {}'}", *rows]
    return "\n".join((*lines, *(f"# {comment}" for comment in comments))) + "\n"


def place() -> Path:
    """The folder of fits: what SENSORGEN_MATERIALS says, or the system's place for a user's data."""
    return places.data(PLACE, "materials")


def path(source: str) -> Path:
    """The file of a source: of the pack that has it, else where a fit is to write it."""
    packed = (pack.path("sources", source) for pack in packs.own())
    return next((file for file in packed if os.path.lexists(file)), place() / f"{source}.yaml")


def text(source: str) -> str:
    """Content of a source's file; raises BadInput where it cannot be read."""
    file = path(source)
    pack = next(pack for pack in packs.own() if pack.path("sources", source) == file)
    return packs.File("sources", source, pack).text()


names = packs.source_names
