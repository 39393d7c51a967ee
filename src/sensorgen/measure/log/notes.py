"""Transcribe notes of a measurement to a row of the log: names, resistances as ``0.65k``, and a list of doubts."""

import dataclasses
import math
import re
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.records import shown
from sensorgen.core.units import frequency_text
from sensorgen.design import specimen_name
from sensorgen.design.design import Design
from sensorgen.measure import immittance
from sensorgen.measure.immittance import NO_VALUE, NUMBER, decimal
from sensorgen.measure.log.entries import SPECIMEN_COLUMNS, Reading, Specimen
from sensorgen.measure.log.logbook import Log

OVERLOAD = math.inf  # beyond the meter's range [ohm]
RANGE_OHM = 10e6  # that every multimeter reads; a lower bound from here on is an overload
MOST_OHM = 1e16  # no meter reads more
LEADS_OHM = 1.0  # typical resistance of leads and contacts
MOST_RATIO = 100  # of readings of one specimen
MAX_CHARACTERS = 200
EXPECTED = "a resistance such as 650, 0.65k, 2.3k / 3.8k, 1.2M or OL"

_NUMBER = re.compile(rf"(?P<above>>)?\s*(?P<number>{NUMBER})\s*(?P<prefix>meg|[kmg])?\s*(Ω|ohms?|r)?", re.IGNORECASE)
_LETTER_AS_POINT = re.compile(r"([0-9]+)([kKMGR])([0-9]+)")  # IEC 60062: 4k7
_OVERLOAD = re.compile(r"\+?(o\.?l\.?|0\.?l|ovld|ovrld|overload|over ?range|inf(inity)?|∞|open)", re.IGNORECASE)
_NO_READING = re.compile(r"[-–—]*|n\.?/?a\.?|nan|none|\?+", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[0-9]{1,3},[0-9]{3}")
_POINTS = re.compile(r"(?:^|[/|])\s*([1-9][0-9]{0,2}\.[0-9]{3})\s*(?=$|[/|])")  # in a table with decimal commas
_BARE = re.compile(rf"((?:^|[/;|])\s*>?\s*{NUMBER})\s*(?=$|[/;|])")
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
    parts = [_parsed(part.strip(), text, mega=mega) for part in re.split("[/;|]", stripped)]
    ohm, doubts, small_m = zip(*parts, strict=True)
    repeats = [f"{len(ohm)} readings: repeats, or several points of contact"] if len(ohm) > 1 else []
    finite = sorted({*map(abs, ohm)} - {0.0, OVERLOAD})
    if finite and finite[-1] > MOST_RATIO * finite[0]:
        repeats.append(f"{shown(stripped)}: more than {MOST_RATIO} times apart; a k lost?")
    return Resistances(ohm, tuple(dict.fromkeys(chain(*doubts, repeats))), tuple(filter(None, small_m)))


def _parsed(part: str, text: str, *, mega: bool) -> tuple[float, Sequence[str], str]:
    """A reading of a text [ohm], doubts about it, and its word where a small m stands for mega."""
    if _OVERLOAD.fullmatch(part):
        return OVERLOAD, [] if part.upper() == "OL" else [f"{shown(part)} taken for overload"], ""
    match = _NUMBER.fullmatch(_LETTER_AS_POINT.sub(r"\1.\3\2", part))
    if not match:
        hint = "; between readings write /" if "," in part else ""
        raise BadInput(f"{shown(text)} is no resistance; expected {EXPECTED}{hint}")
    ohm, prefix = _ohm(match, text), match["prefix"] or ""
    doubts = list(_doubts(part, "" if mega and prefix == "m" else prefix, ohm))
    return ohm, doubts, part if prefix == "m" else ""


def _ohm(match: re.Match[str], text: str) -> float:
    """The number, rounded once [ohm]."""
    number = decimal(match["number"])
    if math.isclose(number, NO_VALUE):
        return OVERLOAD
    ohm = float(number * Decimal(_FACTOR[(match["prefix"] or "").lower()]))
    if abs(ohm) > MOST_OHM:
        raise BadInput(f"{shown(text)}: {ohm:g} ohm is more than any meter reads; expected {EXPECTED}")
    if match["above"] and ohm < RANGE_OHM:
        raise BadInput(f"{shown(text)}: a lower bound; expected what the meter showed, or OL beyond its range")
    return OVERLOAD if match["above"] else ohm


def _doubts(part: str, prefix: str, ohm: float) -> Iterator[str]:
    written = shown(part)
    if prefix == "m":
        yield f"{written}: m read as mega (milli would be below the contact resistance)"
    if part.startswith(">"):
        yield f"{written} taken for overload"
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


MAX_REMARK = 10_000  # characters
FIRST_WITH_FILMS = 22  # iteration from which on the thesis writes films into names
_UNBAKED = re.compile(r"\b(not|un|never)[\s-]*baked\b|\bbefore (the )?bak(e|ing)\b", re.IGNORECASE)


class NamedSpecimen(NamedTuple):
    """A specimen by its name.

    Attributes
    ----------
    specimen : Specimen
        The specimen.
    design_id, design : str
        Identity and name of the design that the name is bound to or stands for; "" where there is none.
    doubts : tuple of str
        Assumptions about a name that is bound to no design.
    """

    specimen: Specimen
    design_id: str
    design: str
    doubts: tuple[str, ...] = ()


def named(written: str, log: Log | None = None) -> NamedSpecimen:
    """Specimen by its name.

    Parameters
    ----------
    written : str
        Name as written.
    log : Log, optional
        Where names are bound to designs; any other name must be one that stands for a design.

    Raises
    ------
    BadInput
        The name is bound to two designs; or to none, and it cannot be parsed.
    """
    bound = log.bound(" ".join(written.split())) if log else None
    if bound:
        of = Specimen(**{key: getattr(bound, key) for key in SPECIMEN_COLUMNS})
        return NamedSpecimen(of, bound.design_id, bound.design)
    try:
        return _by_name(written)
    except BadInput as error:
        raise BadInput(f"{error}; or bind it to its design: sensorgen log specimen NAME --design FILE") from None


def asked(log: Log, iteration: int | None, written: Sequence[str]) -> tuple[str, ...]:
    """Specimens of a question, each once; BadInput where it names an iteration beside them."""
    if written and iteration is not None:
        raise BadInput(f"iteration {iteration} beside specimens; expected one of the two")
    return tuple(dict.fromkeys(named(name, log).specimen.specimen for name in written))


def reading(
    written: str, y_words: str = "", z_words: str = "", *, remark: str = "", baked: bool | None = None,
    measured_at: str = "", instrument: str = "", source: str = "typed", source_row: int | None = None,
    supersedes: str = "", uid: str = "", separator: str = "", mega: bool = False, log: Log | None = None,
) -> Reading:  # fmt: skip
    """Reading of the multimeter, from text.

    Parameters
    ----------
    written : str
        Name of the specimen as written.
    y_words, z_words : str
        Resistance along an electrode and between the electrodes, as written; "" if not measured.
    remark : str
        Any text; "not baked" in it counts unless ``baked`` is given.
    baked : bool or None
        Whether the specimen had been baked; None if unknown.
    measured_at, instrument, source, source_row, supersedes
        As in :class:`Reading`.
    uid : str
        Identity of the row; random if not given.
    separator : str
        Separator of the table that the text comes from, where a blank beside a reading may be an overload, and with ";"
        a point that of thousands; "" if it comes from none.
    mega : bool
        Whether a small m is known to mean mega, so that it raises no doubt.
    log : Log, optional
        As of :func:`named`.

    Raises
    ------
    BadInput
        A name or a resistance that cannot be parsed; the message names the column.

    Examples
    --------
    >>> r = reading("23 triY .1mm xfine", "75k", "1.1m", remark="not baked")
    >>> r.specimen, r.y_ohm, r.z_ohm, r.baked
    ('23 triY .1mm xfine', (75000.0,), (1100000.0,), False)
    """
    if len(remark) > MAX_REMARK:
        raise BadInput(f"a remark of {len(remark)} characters; expected at most {MAX_REMARK}")
    if "\0" in "".join((remark, written, y_words, z_words)):
        raise BadInput("a zero byte in a name, a value or a remark; expected text")
    of = named(written, log)
    y, z = resistance("y", y_words, mega=mega), resistance("z", z_words, mega=mega)
    doubts = [*of.doubts]
    doubts += [f"{axis}: {doubt}" for axis, parsed in (("y", y), ("z", z)) for doubt in parsed.doubts]
    doubts += [*_blanks(y, z), *_points(separator, f"{y_words}/{z_words}")] if separator else []
    if _UNBAKED.search(remark):
        doubts += ["baked, but the remark says that it is not"] if baked else []
        baked = bool(baked)
    return Reading(
        **vars(of.specimen), uid=uid or uuid.uuid4().hex, design_id=of.design_id, design=of.design, written=written,
        y_words=y_words, z_words=z_words, y_ohm=y.ohm, z_ohm=z.ohm, remark=remark, doubts=tuple(doubts),
        baked=baked, measured_at=measured_at, instrument=instrument,
        source=source, source_row=source_row, supersedes=supersedes,
    )  # fmt: skip


def _blanks(y: Resistances, z: Resistances) -> list[str]:
    """Doubt about a row of a table without one of its readings, or both."""
    if not (y.ohm or z.ohm):
        return ["no measurement"]
    return [] if y.ohm and z.ohm else [f"{'z' if y.ohm else 'y'} blank: not measured, or an overload"]


def _points(separator: str, words: str) -> list[str]:
    """Doubts about numbers such as 1.300 in a table with decimal commas."""
    numbers = _POINTS.findall(words) if separator == ";" else []
    return [f"{n}: point read as the decimal one; thousands would be {n.replace('.', '')} ohm" for n in numbers]


def with_ac(of: Reading, typed: Mapping[str, Sequence[str]]) -> Reading:
    """Reading with AC quantities between the electrodes.

    Parameters
    ----------
    of : Reading
        Of the same specimen and time.
    typed : mapping of str to sequence of str
        Texts as :func:`sensorgen.measure.immittance.parse` reads them, by quantity.

    Raises
    ------
    BadInput
        A text that cannot be parsed; the message names the quantity.

    Examples
    --------
    >>> found = with_ac(reading("23 triX"), {"Cp": ["63pF@1kHz"], "D": ["0.02@1kHz", "0.01@10kHz"]})
    >>> found.quantity, found.frequency_hz
    (('Cp', 'D', 'D'), (1000.0, 1000.0, 10000.0))
    """
    return with_readings(of, [a for name, texts in typed.items() for t in texts for a in immittance.parse(name, t)])


def with_readings(of: Reading, every: Sequence[immittance.AcReading], most: int | None = None) -> Reading:
    """Reading with AC readings, and doubts about the implausible ones, ``most`` of them."""
    stated = tuple(one.uncertainty for one in every)
    return dataclasses.replace(
        of, quantity=tuple(one.quantity for one in every), value=tuple(one.value for one in every),
        frequency_hz=tuple(one.frequency_hz for one in every), uncertainty=stated if any(stated) else (),
        doubts=(*of.doubts, *implausible(every)[:most]),
    )  # fmt: skip


def implausible(every: Iterable[immittance.AcReading]) -> tuple[str, ...]:
    """AC readings that no passive specimen has, in words."""
    return tuple(
        f"{one.quantity} {immittance.shown_value(one.quantity, one.value)} at {frequency_text(one.frequency_hz)}: "
        "below 0, as no passive specimen; check contacts and open/short compensation"
        for one in every
        if one.value < 0 and one.quantity in immittance.NEVER_NEGATIVE
    )


def with_prefix(text: str, prefix: str) -> str:
    """Text of a cell, its numbers with the prefix of their column where they have no unit of their own.

    >>> with_prefix("2.3 / 3.8M", "k"), with_prefix("OL", "k")
    ('2.3k/ 3.8M', 'OL')
    """
    return _BARE.sub(rf"\1{prefix}", text)


def resistance(axis: str, text: str, *, mega: bool = False) -> Resistances:
    """Parse a resistance in ``y`` or ``z``.

    Raises
    ------
    BadInput
        Not a resistance; the message names the axis.
    """
    try:  # of a hundred thousand cells: a context manager would take longer than they
        return parse(text, mega=mega)
    except BadInput as error:
        raise error.within(f"resistance in {axis.upper()}") from None


def design_of(written: str) -> Design | None:
    """Design that a specimen's name stands for, or None."""
    return _design(specimen_name.parse(written))


def _design(name: specimen_name.SpecimenName) -> Design | None:
    return _design_of(dataclasses.replace(name, iteration=None, replicate=None, place="", raw="", assumed=()))


@lru_cache(maxsize=256)
def _design_of(kind: specimen_name.SpecimenName) -> Design | None:
    """Design of the part of a name that decides it."""
    try:
        return specimen_name.design_of(kind)
    except SensorgenError:  # a film that no design may have
        return None


@lru_cache(maxsize=1 << 14)
def _by_name(written: str) -> NamedSpecimen:
    """Specimen by a name that is bound to no design; one without a film is usual in early iterations only."""
    name = specimen_name.parse(written)
    of = Specimen(specimen=name.name, **{key: getattr(name, key) for key in SPECIMEN_COLUMNS[1:]})
    design, film_expected = _design(name), (name.iteration or 0) < FIRST_WITH_FILMS
    doubts = tuple(doubt for doubt in name.assumed if doubt != specimen_name.NO_FILM or film_expected)
    return NamedSpecimen(of, design.id() if design else "", design.name if design else "", doubts)
