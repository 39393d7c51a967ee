"""Physical constants and the one place where a unit that a user types is converted."""

import re

from sensorgen.errors import BadInput

EPS0_F_PER_M = 8.8541878128e-12  # CODATA 2018, as in the reference values that we test against
M_PER_MM = 1e-3

_MM_PER = {"": 1.0, "mm": 1.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "cm": 10.0, "m": 1000.0}
_LENGTH = re.compile(r"\s*([-+]?[0-9.]+(?:e[-+]?[0-9]+)?)\s*([a-zµμ]*)\s*", re.IGNORECASE)


def length_mm(text: str) -> float:
    """Read a length as typed, in millimetres unless it names its unit [mm].

    >>> length_mm("0.2"), length_mm("200um"), length_mm("10 cm")
    (0.2, 0.2, 100.0)
    """
    match = _LENGTH.fullmatch(text)
    try:
        if match is None:
            raise ValueError
        number, factor = float(match[1]), _MM_PER[match[2].lower()]
    except (ValueError, KeyError):
        raise BadInput(f"{text!r} is not a length: write a number, with mm, um, cm or m if you like") from None
    return number * factor
