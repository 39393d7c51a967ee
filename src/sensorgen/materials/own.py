"""Where sources of the user's own are: a YAML file each, named as the source."""

import os
import re
import sys
from pathlib import Path

PLACE = "SENSORGEN_MATERIALS"  # environment variable with another folder
NAME = re.compile(r"[a-z0-9][a-z0-9.-]*")


def place() -> Path:
    """The folder: what SENSORGEN_MATERIALS says, or the system's place for a user's data."""
    given = os.environ.get(PLACE)
    return Path(given) if given else _system_place() / "sensorgen" / "materials"


def _system_place() -> Path:
    """The folder for data: XDG's, Apple's or Microsoft's."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support"
    given = os.environ.get("XDG_DATA_HOME", "")
    return Path(given) if Path(given).is_absolute() else Path.home() / ".local" / "share"


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
