"""Numbers of the thesis by the place where they are printed: its tables are compared with each other."""

from typing import Any

from sensorgen.verification.thesis.items import chapter


def table(number: str) -> dict[str, Any]:
    """Values of a table of the thesis, as the chapters keep it."""
    return next(item.given for item in chapter(number.partition(".")[0]).tables if item.number == number)
