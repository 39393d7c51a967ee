"""Resistances as people write them down: ``650``, ``0.65k``, ``2.3k / 3.8k``, ``4k7``, ``OL``, ``1.1m``, or nothing."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

from sensorgen.core.errors import BadInput
from sensorgen.core.records import shown

OVERLOAD = math.inf  # more than the meter's range [ohm]
SCPI_OVERLOAD_OHM = 9.9e37  # SCPI 1999, 7.2.1.4: what an instrument sends for infinity
MOST_OHM = 1e16  # no meter reads more
LEADS_OHM = 1.0  # leads and contacts alone have about as much
MAX_LETTERS = 200
EXPECTED = "a resistance such as 650, 0.65k, 2.3k / 3.8k, 1.2M or OL"

_UNIT = r"\s*(?:Ω|ω|ohms?|r)?"
_PREFIX = r"\s*(?P<prefix>meg|[kmg])?"
_PLAIN = re.compile(
    rf"(?P<number>[-+]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:e[-+]?[0-9]{{1,3}})?){_PREFIX}{_UNIT}", re.IGNORECASE
)
_LETTER_AS_POINT = re.compile(r"([0-9]+)([kKMGR])([0-9]+)")  # IEC 60062: 4k7
_OVER = re.compile(r"\+?(o\.?l\.?|0\.?l|ovld|ovrld|overload|over ?range|inf(inity)?|∞|open)|>.*", re.IGNORECASE)
_NOTHING = re.compile(r"[-–—]*|n\.?/?a\.?|nan|none|\?+", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[0-9]{1,3},[0-9]{3}")
_SIGNS = str.maketrans({"\u2126": "Ω", "\u2212": "-"})  # the ohm sign apart from omega, the true minus sign
_FACTOR = {"": "1", "k": "1e3", "m": "1e6", "meg": "1e6", "g": "1e9"}


@dataclass(frozen=True)
class Resistances:
    """What some words say.

    Attributes
    ----------
    ohm : tuple of float
        Readings in the order in which they stand [ohm]; ``OVERLOAD`` where the meter's range was exceeded. None are
        there where nothing was measured: a missing reading is never 0.
    doubts : tuple of str
        What was read otherwise than SI has it, and what may be a slip.
    mega : tuple of str
        The words in which a small m was read as mega.
    """

    ohm: tuple[float, ...]
    doubts: tuple[str, ...]
    mega: tuple[str, ...] = ()


def read(words: str) -> Resistances:
    """Read one cell of a table of resistances, or what somebody typed.

    Parameters
    ----------
    words : str
        As found; several readings have ``/`` or ``;`` between them. Without a unit, ohms.

    Raises
    ------
    BadInput
        Not a resistance.

    Examples
    --------
    >>> read("2.3k / 3.8k").ohm, read("0,65 kΩ").ohm, read("OL").ohm, read("").ohm
    ((2300.0, 3800.0), (650.0,), (inf,), ())
    >>> read("1.1m").doubts
    ("'1.1m': m read as mega (milli would be below the contact resistance)",)
    """
    if len(words) > MAX_LETTERS:
        raise BadInput(f"{shown(words)} has {len(words)} letters; expected {EXPECTED}")
    plain = words.translate(_SIGNS).strip()
    if _NOTHING.fullmatch(plain):
        return Resistances((), (f"{shown(plain)} taken for no reading",) if plain else ())
    found = [_one(part.strip(), words) for part in re.split("[/;|]", plain)]
    doubts = [doubt for _, said in found for doubt in said]
    if len(found) > 1:
        doubts.append(f"{len(found)} readings: repeats, or several points of contact")
    return Resistances(
        tuple(ohm for ohm, _ in found),
        tuple(dict.fromkeys(doubts)),
        tuple(part.strip() for part in re.split("[/;|]", plain) if _is_milli(part.strip())),
    )


def _one(part: str, words: str) -> tuple[float, list[str]]:
    """One reading [ohm], and what to doubt of it."""
    if _OVER.fullmatch(part):
        return OVERLOAD, [] if part.upper() == "OL" else [f"{shown(part)} taken for overload"]
    match = _PLAIN.fullmatch(_LETTER_AS_POINT.sub(r"\1.\3\2", part))
    if not match:
        hint = "; between readings write /" if "," in part else ""
        raise BadInput(f"{shown(words)} is no resistance; expected {EXPECTED}{hint}")
    ohm = _ohm(match, words)
    return ohm, list(_doubts(part, match["prefix"] or "", ohm))


def _ohm(match: re.Match[str], words: str) -> float:
    """The number, rounded once [ohm]."""
    ohm = float(Decimal(match["number"].replace(",", ".")) * Decimal(_FACTOR[(match["prefix"] or "").lower()]))
    if math.isclose(ohm, SCPI_OVERLOAD_OHM):
        return OVERLOAD
    if abs(ohm) > MOST_OHM:
        raise BadInput(f"{shown(words)}: {ohm:g} ohm is more than any meter reads; expected {EXPECTED}")
    return ohm


def _doubts(part: str, prefix: str, ohm: float) -> Iterator[str]:
    said = shown(part)
    if prefix == "m":
        yield f"{said}: m read as mega (milli would be below the contact resistance)"
    if prefix == "K":
        yield f"{said}: upper-case K read as kilo"
    if _THOUSANDS.fullmatch(part):
        yield f"{said}: comma read as the decimal one, {ohm:g} ohm; thousands would be {part.replace(',', '')} ohm"
    if ohm == 0:
        yield "0 ohm: a short circuit, or a reading below the meter's resolution"
    elif ohm < 0:
        yield f"{said}: a resistance below 0"
    elif ohm < LEADS_OHM:
        yield f"{said}: {ohm:g} ohm is less than leads and contacts have; a k lost?"


def _is_milli(part: str) -> bool:
    match = _PLAIN.fullmatch(part)
    return match is not None and match["prefix"] == "m"
