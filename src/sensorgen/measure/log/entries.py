"""What the log holds, row by row; every kind of row has a name of its own for life, its ``uid``.

Nothing in the log is changed or taken out. A row that corrects another names it in ``supersedes``.
"""

from dataclasses import dataclass, fields
from typing import Any, get_type_hints


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Any row.

    Attributes
    ----------
    uid : str
        Its name, the same in every copy of the log: a hash of what an imported row says, else random.
    logged_at : str
        When the log took it, UTC, ISO 8601; "" before that.
    number : int
        Its number among its kind in this log, from 1; 0 before it is logged.
    """

    uid: str
    logged_at: str = ""
    number: int = 0


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """A printed sensor, as its name has it.

    Attributes
    ----------
    specimen : str
        Its name in normal form.
    iteration : int or None
        Of the design.
    shape, axes : str
        As designs call them; "" where the name lacks it.
    film_mm : float or None
        Thickness of the film [mm], 0 for none; None where the name lacks it.
    size_mm : float or None
        A size in the name that is no film [mm].
    replicate : int or None
        Which copy.
    slicing, place : str
        Slicing as written; where on the plate, as it seems.
    """

    specimen: str
    iteration: int | None = None
    shape: str = ""
    axes: str = ""
    film_mm: float | None = None
    size_mm: float | None = None
    replicate: int | None = None
    slicing: str = ""
    place: str = ""


def columns(kind: type[Any]) -> dict[str, Any]:
    """Names of a kind's fields, in order, with their types."""
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


SPECIMEN_COLUMNS = tuple(columns(Specimen))


@dataclass(frozen=True, kw_only=True)
class _OfSpecimen(Specimen, Entry):
    """A row about a specimen.

    Attributes
    ----------
    written : str
        The specimen's name as it was written down.
    design_id, design : str
        Identity and name of the design that it was made from; "" if unknown.
    batch : str
        The batch that it was printed in, "" if unknown.
    remark : str
        In the words of whoever measured.
    source : str
        Where the row comes from: ``typed``, ``thesis Table D.1``, a file's name, an instrument.
    supersedes : str
        The row that this one corrects, "" if it corrects none.
    """

    written: str
    design_id: str = ""
    design: str = ""
    batch: str = ""
    remark: str = ""
    source: str = "typed"
    supersedes: str = ""


@dataclass(frozen=True, kw_only=True)
class Reading(_OfSpecimen):
    """What a multimeter said of a specimen at one sitting.

    Attributes
    ----------
    y_words, z_words : str
        Resistance along an electrode, and between the electrodes, as written down.
    y_ohm, z_ohm : tuple of float
        The readings that the words stand for [ohm]; infinite for an overload, none where nothing was measured.
    baked : bool or None
        Whether the specimen had been baked; None if not stated.
    doubts : tuple of str
        What was read otherwise than written, in the name too, and what remains uncertain.
    measured_at : str
        When, as written down; "" if not stated.
    instrument : str
        What an instrument calls itself; "" for words that a person wrote down.
    source_row : int or None
        Row of the table that it comes from, counted from 1 below its header.
    """

    y_words: str = ""
    z_words: str = ""
    y_ohm: tuple[float, ...] = ()
    z_ohm: tuple[float, ...] = ()
    baked: bool | None = None
    doubts: tuple[str, ...] = ()
    measured_at: str = ""
    instrument: str = ""
    source_row: int | None = None


@dataclass(frozen=True, kw_only=True)
class BenchRun(_OfSpecimen):
    """A recording of the bench, its files kept whole.

    Attributes
    ----------
    file, rig_file : str
        SHA-256 of the impedance's file and of the rig's; the latter "" where there is none.
    facts : str
        What was counted when it came in, as JSON: samples, tones, marks, the offset between the clocks.
    """

    file: str
    rig_file: str = ""
    facts: str = "{}"


@dataclass(frozen=True, kw_only=True)
class Prediction(Entry):
    """What a design was expected to measure, kept from the moment that it was made.

    Attributes
    ----------
    design_id, design : str
        Identity and name of the design.
    version : str
        Of sensorgen, which made it.
    data : str
        The whole prediction, as JSON.
    """

    design_id: str
    design: str
    version: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Batch(Entry):
    """A print bed, its file kept whole.

    Attributes
    ----------
    batch : str
        Its name.
    file : str
        SHA-256 of ``batch.json``.
    """

    batch: str
    file: str


@dataclass(frozen=True, kw_only=True)
class Print(Specimen, Entry):
    """A specimen on a print bed: from then on its rows carry design and batch.

    Attributes
    ----------
    batch_uid : str
        The batch.
    design_id, design : str
        Identity and name of its design.
    """

    batch_uid: str
    design_id: str
    design: str


@dataclass(frozen=True, kw_only=True)
class RawFile(Entry):
    """A file of an instrument, kept whole beside the log.

    Attributes
    ----------
    uid : str
        Its SHA-256.
    name : str
        As it was called.
    size : int
        Its length [bytes].
    """

    name: str
    size: int
