"""Sources of the user's own: a YAML file each, named as the source, in a pack of the user's."""

import os
from pathlib import Path

from sensorgen.core import paths as places
from sensorgen.design import packs

PLACE = packs.SOURCES  # environment variable with another folder


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
