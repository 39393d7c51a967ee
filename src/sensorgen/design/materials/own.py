"""Where sources of the user's own are: a YAML file each, named as the source."""

import os
import re
from pathlib import Path

from sensorgen.core import paths as places

PLACE = "SENSORGEN_MATERIALS"  # environment variable with another folder
NAME = re.compile(r"[a-z0-9][a-z0-9.-]*")


def place() -> Path:
    """The folder: what SENSORGEN_MATERIALS says, or the system's place for a user's data."""
    return places.data(PLACE, "materials")


def path(source: str) -> Path:
    """The file of a source."""
    return place() / f"{source}.yaml"


def names() -> list[str]:
    """Names of the sources that are there."""
    try:
        files = [entry.name for entry in os.scandir(place()) if entry.name.endswith(".yaml")]
    except OSError:
        return []
    return sorted(name for name in (file.removesuffix(".yaml") for file in files) if NAME.fullmatch(name))
