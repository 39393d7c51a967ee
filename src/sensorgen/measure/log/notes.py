"""Transcribe notes of a measurement to a row of the log, with a list of doubts."""

import dataclasses
import re
import uuid
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from sensorgen.core.errors import BadInput, SensorgenError, within
from sensorgen.core.units import frequency_text
from sensorgen.design import specimen_name
from sensorgen.design.design import Design
from sensorgen.measure import immittance
from sensorgen.measure.log import resistances
from sensorgen.measure.log.entries import SPECIMEN_COLUMNS, Print, Reading, Specimen
from sensorgen.measure.log.resistances import Resistances

if TYPE_CHECKING:
    from sensorgen.measure.log.logbook import Log

MAX_REMARK = 10_000  # characters
FIRST_WITH_FILMS = 22  # iteration from which on the thesis writes films into names
_UNBAKED = re.compile(r"\b(not|un|never)[\s-]*baked\b|\bbefore (the )?bak(e|ing)\b", re.IGNORECASE)


def specimen(written: str, log: "Log | None" = None) -> Specimen:
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
    bound = _bound(written, log)
    if bound:
        return Specimen(**{key: getattr(bound, key) for key in SPECIMEN_COLUMNS})
    try:
        return _by_name(written)[0]
    except BadInput as error:
        raise BadInput(f"{error}; or bind it to its design: sensorgen log specimen NAME --design FILE") from None


def _bound(written: str, log: "Log | None") -> Print | None:
    return log.bound(" ".join(written.split())) if log else None


def reading(
    written: str, y_words: str = "", z_words: str = "", *, remark: str = "", baked: bool | None = None,
    measured_at: str = "", instrument: str = "", source: str = "typed", source_row: int | None = None,
    supersedes: str = "", uid: str = "", table: bool = False, mega: bool = False, log: "Log | None" = None,
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
    table : bool
        Whether the text comes from a table, where a blank beside a reading may be an overload.
    mega : bool
        Whether a small m is known to mean mega, so that it raises no doubt.
    log : Log, optional
        As of :func:`specimen`.

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
    if any("\0" in text for text in (remark, written, y_words, z_words)):
        raise BadInput("a zero byte in a name, a value or a remark; expected text")
    of, bound = specimen(written, log), _bound(written, log)
    y, z = resistance("y", y_words, mega=mega), resistance("z", z_words, mega=mega)
    unbaked = bool(_UNBAKED.search(remark))
    film_expected = (of.iteration or 0) < FIRST_WITH_FILMS
    assumed = () if bound else _by_name(written)[2]
    doubts = [doubt for doubt in assumed if doubt != specimen_name.NO_FILM or film_expected]
    doubts += [f"{axis}: {doubt}" for axis, parsed in (("y", y), ("z", z)) for doubt in parsed.doubts]
    if table and not (y.ohm and z.ohm):
        blank = f"{'z' if y.ohm else 'y'} blank: not measured, or an overload"
        doubts.append(blank if y.ohm or z.ohm else "no measurement")
    if unbaked and baked:
        doubts.append("baked, but the remark says that it is not")
    design_id, design = design_fields(written, log)
    return Reading(
        **vars(of), uid=uid or uuid.uuid4().hex, design_id=design_id, design=design, written=written,
        y_words=y_words, z_words=z_words, y_ohm=y.ohm, z_ohm=z.ohm, remark=remark, doubts=tuple(doubts),
        baked=False if baked is None and unbaked else baked, measured_at=measured_at, instrument=instrument,
        source=source, source_row=source_row, supersedes=supersedes,
    )  # fmt: skip


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


def resistance(axis: str, text: str, *, mega: bool = False) -> Resistances:
    """Parse a resistance in ``y`` or ``z``.

    Raises
    ------
    BadInput
        Not a resistance; the message names the axis.
    """
    with within(f"resistance in {axis.upper()}"):
        return resistances.parse(text, mega=mega)


def design_fields(written: str, log: "Log | None" = None) -> tuple[str, str]:
    """Identity and name of the design that a specimen's name is bound to or stands for; "" where there is none."""
    bound = _bound(written, log)
    if bound:
        return bound.design_id, bound.design
    return _by_name(written)[1]


def design_of(written: str) -> Design | None:
    """Design that a specimen's name stands for, or None."""
    return _design(_kind(specimen_name.parse(written)))[0]


def _kind(name: specimen_name.SpecimenName) -> specimen_name.SpecimenName:
    """The part of a name that decides its design."""
    return dataclasses.replace(name, iteration=None, replicate=None, place="", raw="", assumed=())


@lru_cache(maxsize=256)
def _design(name: specimen_name.SpecimenName) -> tuple[Design | None, tuple[str, str]]:
    """Design, and its identity and name."""
    try:
        design = specimen_name.design_of(name)
    except SensorgenError:  # a film that no design may have
        design = None
    return design, (design.id(), design.name) if design else ("", "")


@lru_cache(maxsize=1 << 14)
def _by_name(written: str) -> tuple[Specimen, tuple[str, str], tuple[str, ...]]:
    """Specimen, identity and name of its design, and doubts, by a name that is bound to no design."""
    name = specimen_name.parse(written)
    columns = {key: getattr(name, key) for key in SPECIMEN_COLUMNS[1:]}
    return Specimen(specimen=name.name, **columns), _design(_kind(name))[1], name.assumed
