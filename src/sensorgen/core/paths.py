"""Where files of the user's own are on this system, unless an environment variable names another place."""

import os
import sys
from pathlib import Path


def data(variable: str, name: str) -> Path:
    """Place of what is to last, as the log.

    Parameters
    ----------
    variable : str
        The environment variable with another place.
    name : str
        Of the file or folder, below the system's own place: XDG's, Apple's or Microsoft's.
    """
    return _own(variable) or _below("XDG_DATA_HOME", ".local/share", "Application Support") / "sensorgen" / name


def config(variable: str, name: str) -> Path:
    """Place of what the user writes by hand, as packs; parameters as :func:`data`."""
    return _own(variable) or _below("XDG_CONFIG_HOME", ".config", "Application Support") / "sensorgen" / name


def cache(variable: str) -> Path:
    """Place of what may be deleted; parameters as :func:`data`."""
    return _own(variable) or _below("XDG_CACHE_HOME", ".cache", "Caches") / "sensorgen"


def _own(variable: str) -> Path | None:
    given = os.environ.get(variable)
    return Path(given) if given else None


def _below(xdg: str, usual: str, apple: str) -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / apple
    given = os.environ.get(xdg, "")
    return Path(given) if Path(given).is_absolute() else Path.home() / usual  # XDG ignores relative paths
