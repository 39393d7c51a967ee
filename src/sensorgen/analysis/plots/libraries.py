"""Plotting libraries, which nothing but a plot needs."""

import importlib.util

from sensorgen.core.errors import MissingValue


def needed(*names: str) -> None:
    """Refuse to go on without a library.

    Raises
    ------
    MissingValue
        It is not installed.
    """
    missing = [name for name in names if importlib.util.find_spec(name) is None]
    if missing:
        raise MissingValue(f"plots need {' and '.join(missing)}: pip install {' '.join(missing)}")
