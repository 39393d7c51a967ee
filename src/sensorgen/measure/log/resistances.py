"""Parse resistances as people write them: ``650``, ``0.65k``, ``2.3k / 3.8k``, ``4k7``, ``OL``, ``1.1m``."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache

from sensorgen.core.errors import BadInput
from sensorgen.core.records import shown
from sensorgen.measure.immittance import NUMBER, decimal

OVERLOAD = math.inf  # beyond the meter's range [ohm]
SCPI_OVERLOAD_OHM = 9.9e37  # SCPI 1999, 7.2.1.4: what an instrument sends for infinity
MOST_OHM = 1e16  # no meter reads more
LEADS_OHM = 1.0  # typical resistance of leads and contacts
MAX_CHARACTERS = 200
EXPECTED = "a resistance such as 650, 0.65k, 2.3k / 3.8k, 1.2M or OL"

_NUMBER = re.compile(rf"(?P<number>{NUMBER})\s*(?P<prefix>meg|[kmg])?\s*(?:Ω|ω|ohms?|r)?", re.IGNORECASE)
_LETTER_AS_POINT = re.compile(r"([0-9]+)([kKMGR])([0-9]+)")  # IEC 60062: 4k7
_OVERLOAD = re.compile(r"\+?(o\.?l\.?|0\.?l|ovld|ovrld|overload|over ?range|inf(inity)?|∞|open)|>.*", re.IGNORECASE)
_NO_READING = re.compile(r"[-–—]*|n\.?/?a\.?|nan|none|\?+", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[0-9]{1,3},[0-9]{3}")
_SIGNS = str.maketrans({"\u2126": "Ω", "\u2212": "-"})  # the ohm sign apart from omega, the true minus sign
_FACTOR = {"": "1", "k": "1e3", "m": "1e6", "meg": "1e6", "g": "1e9"}


@dataclass(frozen=True)
class Resistances:
    """Readings in a text.

    Attributes
    ----------
    ohm : tuple of float
        In their order [ohm]; ``OVERLOAD`` beyond the meter's range. Empty where nothing was measured: a missing reading
        is never 0.
    doubts : tuple of str
        What was interpreted otherwise than by SI, and what may be a slip.
    mega : tuple of str
        Readings in which a small m was interpreted as mega.
    """

    ohm: tuple[float, ...]
    doubts: tuple[str, ...]
    mega: tuple[str, ...] = ()


@lru_cache(maxsize=1 << 14)
def parse(text: str, *, mega: bool = False) -> Resistances:
    """Parse a cell of a table of resistances, or typed text.

    Parameters
    ----------
    text : str
        Readings with ``/`` or ``;`` between them; in ohms unless they have a unit.
    mega : bool
        Whether a small m is known to mean mega, so that it raises no doubt.

    Raises
    ------
    BadInput
        Not a resistance.

    Examples
    --------
    >>> parse("2.3k / 3.8k").ohm, parse("0,65 kΩ").ohm, parse("OL").ohm, parse("").ohm
    ((2300.0, 3800.0), (650.0,), (inf,), ())
    >>> parse("1.1m").doubts
    ("'1.1m': m read as mega (milli would be below the contact resistance)",)
    """
    if len(text) > MAX_CHARACTERS:
        raise BadInput(f"{shown(text)} has {len(text)} characters; expected {EXPECTED}")
    stripped = text.translate(_SIGNS).strip()
    if _NO_READING.fullmatch(stripped):
        return Resistances((), (f"{shown(stripped)} taken for no reading",) if stripped else ())
    ohm, doubts, small_m = [], [], []
    for part in map(str.strip, re.split("[/;|]", stripped)):
        if _OVERLOAD.fullmatch(part):
            ohm.append(OVERLOAD)
            doubts += [] if part.upper() == "OL" else [f"{shown(part)} taken for overload"]
            continue
        match = _NUMBER.fullmatch(_LETTER_AS_POINT.sub(r"\1.\3\2", part))
        if not match:
            hint = "; between readings write /" if "," in part else ""
            raise BadInput(f"{shown(text)} is no resistance; expected {EXPECTED}{hint}")
        ohm.append(_ohm(match, text))
        doubts += _doubts(part, "" if mega and match["prefix"] == "m" else match["prefix"] or "", ohm[-1])
        small_m += [part] if match["prefix"] == "m" else []
    if len(ohm) > 1:
        doubts.append(f"{len(ohm)} readings: repeats, or several points of contact")
    return Resistances(tuple(ohm), tuple(dict.fromkeys(doubts)), tuple(small_m))


def _ohm(match: re.Match[str], text: str) -> float:
    """The number, rounded once [ohm]."""
    ohm = float(decimal(match["number"]) * Decimal(_FACTOR[(match["prefix"] or "").lower()]))
    if math.isclose(ohm, SCPI_OVERLOAD_OHM):
        return OVERLOAD
    if abs(ohm) > MOST_OHM:
        raise BadInput(f"{shown(text)}: {ohm:g} ohm is more than any meter reads; expected {EXPECTED}")
    return ohm


def _doubts(part: str, prefix: str, ohm: float) -> Iterator[str]:
    written = shown(part)
    if prefix == "m":
        yield f"{written}: m read as mega (milli would be below the contact resistance)"
    if prefix == "K":
        yield f"{written}: upper-case K read as kilo"
    if _THOUSANDS.fullmatch(part):
        yield f"{written}: comma read as the decimal one, {ohm:g} ohm; thousands would be {part.replace(',', '')} ohm"
    if ohm == 0:
        yield "0 ohm: a short circuit, or a reading below the meter's resolution"
    elif ohm < 0:
        yield f"{written}: a resistance below 0"
    elif ohm < LEADS_OHM:
        yield f"{written}: {ohm:g} ohm is less than leads and contacts have; a k lost?"
