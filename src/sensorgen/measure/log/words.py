"""From what somebody wrote down to a row of the log, with everything that is doubtful about it."""

import dataclasses
import re
import uuid
from collections.abc import Iterator
from functools import lru_cache

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.design.design import Design
from sensorgen.design.specimen_name import Specimen as Name
from sensorgen.design.specimen_name import design_of, parse
from sensorgen.measure.log.entries import SPECIMEN_COLUMNS, Reading
from sensorgen.measure.log.values import Resistances, read

MOST_LETTERS = 10_000  # of a remark
NO_FILM = "no film named: none"  # doubtful only where names had no place for a film yet:
FIRST_WITH_FILMS = 22  # iteration; the thesis writes films into names after this one, and in none before
_UNBAKED = re.compile(r"\b(not|un|never)[\s-]*baked\b|\bbefore (the )?bak(e|ing)\b", re.IGNORECASE)


def named(written: str) -> tuple[dict[str, object], Name]:
    """What the name of a specimen tells, as columns of the log, and the name as it was read.

    Raises
    ------
    BadInput
        The name cannot be read.
    """
    name = parse(written)
    return {"specimen": name.name} | {key: getattr(name, key) for key in SPECIMEN_COLUMNS[1:]}, name


def reading(
    written: str,
    y_words: str = "",
    z_words: str = "",
    *,
    remark: str = "",
    baked: bool | None = None,
    table: bool = False,
    mega: bool = False,
    **more: object,
) -> Reading:
    """A reading of the multimeter, from words.

    Parameters
    ----------
    written : str
        The specimen's name as written down.
    y_words, z_words : str
        Resistance along an electrode and between the electrodes, as written; "" where nothing is.
    remark : str
        In anybody's words; "not baked" in it counts unless ``baked`` says otherwise.
    baked : bool or None
        Whether the specimen had been baked; None where nobody says.
    table : bool
        Whether the words are cells of a table, where a blank beside a reading may be an overload.
    mega : bool
        Whether somebody has said that a small m means mega: then that is no doubt.
    **more
        Other fields of :class:`Reading`; a ``uid`` is made up if none is given.

    Raises
    ------
    BadInput
        A name or a resistance that cannot be read; the message names the column.

    Examples
    --------
    >>> r = reading("23 triY .1mm xfine", "75k", "1.1m", remark="not baked")
    >>> r.specimen, r.y_ohm, r.z_ohm, r.baked
    ('23 triY .1mm xfine', (75000.0,), (1100000.0,), False)
    """
    if len(remark) > MOST_LETTERS:
        raise BadInput(f"a remark of {len(remark)} letters; expected at most {MOST_LETTERS}")
    if any("\0" in text for text in (remark, written, y_words, z_words)):
        raise BadInput("a zero byte in a name, a value or a remark; expected text")
    columns, name = named(written)
    said = {axis: resistance(axis, words) for axis, words in (("y", y_words), ("z", z_words))}
    unbaked = bool(_UNBAKED.search(remark))
    doubts = [doubt for doubt in name.assumed if doubt != NO_FILM or (name.iteration or 0) < FIRST_WITH_FILMS]
    for axis, found in said.items():
        doubts += [f"{axis}: {doubt}" for doubt in found.doubts if not (mega and "read as mega" in doubt)]
    doubts += _blanks(*(found.ohm for found in said.values())) if table else []
    if unbaked and baked:
        doubts.append("said to be baked, and the remark says that it is not")
    design_id, design = design_of_name(name)
    return Reading(
        **{"uid": uuid.uuid4().hex, "design_id": design_id, "design": design} | columns | more,  # type: ignore[arg-type]
        written=written,
        y_words=y_words,
        z_words=z_words,
        y_ohm=said["y"].ohm,
        z_ohm=said["z"].ohm,
        baked=False if baked is None and unbaked else baked,
        remark=remark,
        doubts=tuple(doubts),
    )


def resistance(axis: str, words: str) -> Resistances:
    """What words say of one resistance, ``y`` or ``z``.

    Raises
    ------
    BadInput
        Not a resistance; the message names the axis.
    """
    try:
        return read(words)
    except BadInput as error:
        raise error.within(f"resistance in {axis.upper()}") from None


def _blanks(y_ohm: tuple[float, ...], z_ohm: tuple[float, ...]) -> Iterator[str]:
    if not y_ohm and not z_ohm:
        yield "no measurement"
    elif not y_ohm or not z_ohm:
        yield f"{'z' if y_ohm else 'y'} blank: not measured, or an overload"


def design_of_name(name: Name) -> tuple[str, str]:
    """Identity and name of the design that a specimen's name stands for, "" where it does not tell."""
    design = design_like(name)
    return (design.id(), design.name) if design else ("", "")


def design_like(name: Name) -> Design | None:
    """The design that a specimen's name stands for, None where it does not tell."""
    return _design(dataclasses.replace(name, iteration=None, replicate=None, place=""))


@lru_cache(maxsize=256)
def _design(name: Name) -> Design | None:
    try:
        return design_of(name)
    except SensorgenError:  # a film that no design may have
        return None
