"""Kinds of rows of the log, one dataclass for each, and their fields in JSON and CSV, exact in both directions.

Rows are never changed or deleted. A correction is a new row that names the old one in ``supersedes``; a withdrawal
does so for a row of any kind.

Records hold a row as a JSON object without the fields that have their default. Infinity, which JSON lacks, is written
as 9e999, which Python and SQLite read as one. A cell of CSV is text as it is, nothing for None, and JSON for the rest.
Pydantic is not used here: ``sensorgen log list`` would spend most of its time on the import.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache, lru_cache
from operator import eq
from types import NoneType
from typing import Any, Self, TypeVar, cast, get_args, get_type_hints

from sensorgen.core.errors import BadInput
from sensorgen.measure.immittance import QUANTITIES

DEFECTS = ("misprint", "zits", "hole", "clog", "under-extrusion", "adhesion", "torn")


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Row of any kind.

    Attributes
    ----------
    uid : str
        Identity, the same in every copy of the log: a hash of an imported row's content, else random.
    logged_at : str
        Time of logging in this log, UTC, ISO 8601; "" before.
    claimed_at : str
        For a row out of an export: the time of logging that the export states, which nothing proves; else "".
    number : int
        Number among the rows of its kind in this log, from 1; 0 before.
    """

    uid: str
    logged_at: str = ""
    claimed_at: str = ""
    number: int = 0

    def numbered(self, number: int, logged_at: str) -> Self:
        """The row as the log has it; what makes it a row was checked before, and is not again."""
        return _row(type(self), {**vars(self), "number": number, "logged_at": logged_at})


_Kind = TypeVar("_Kind", bound=Entry)


def _row(kind: type[_Kind], values: Mapping[str, object]) -> _Kind:
    """Row of all its fields: the initialiser of a frozen class sets one after the other, in ten times the time."""
    row = object.__new__(kind)
    vars(row).update(values)
    return row


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """A printed sensor, by its name.

    Attributes
    ----------
    specimen : str
        Any name that is bound to a design, or one that stands for a design, in normal form.
    iteration : int or None
        Iteration of the design.
    shape, axes : str
        As in designs; "" if the name has none.
    film_mm : float or None
        Thickness of the film [mm], 0 for none; None if unknown.
    size_mm : float or None
        Size in the name that is no film [mm].
    replicate : int or None
        Number of the copy.
    slicing, place : str
        Slicing as written; place on the plate, as far as the name has it.
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


SPECIMEN_COLUMNS = tuple(field.name for field in fields(Specimen))


@dataclass(frozen=True, kw_only=True)
class _OfSpecimen(Specimen, Entry):
    """A row about a specimen.

    Attributes
    ----------
    written : str
        Name of the specimen as written.
    design_id, design : str
        Identity and name of its design; "" if unknown.
    batch : str
        Name of the batch in which it was printed; "" if unknown.
    remark : str
        Any text.
    source : str
        Origin: ``typed``, ``thesis Table D.1``, name of a file, address of an instrument.
    supersedes : str
        ``uid`` of the row that this one corrects; "" if it corrects none.
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
    """Readings of a specimen by meters, measured together.

    Version 1 had the fields up to ``source_row``.

    Attributes
    ----------
    y_words, z_words : str
        DC resistance along an electrode and between the electrodes, as written.
    y_ohm, z_ohm : tuple of float
        Readings [ohm]; infinite for an overload, empty if not measured.
    baked : bool or None
        Whether the specimen had been baked; None if unknown.
    doubts : tuple of str
        Assumptions and doubts about name and readings.
    measured_at : str
        Time of the measurement as written; "" if unknown.
    instrument : str
        Identification of the instrument; "" for typed readings.
    source_row : int or None
        Row of the imported table, from 1 below its header.
    quantity : tuple of str
        Quantity of each AC reading between the electrodes, as in :data:`sensorgen.measure.immittance.QUANTITIES`;
        a quantity stands once for each repeat.
    value, frequency_hz : tuple of float
        Each reading in SI units (phase in rad), and its frequency [Hz].
    uncertainty : tuple of float
        Standard uncertainty of each as stated by who measured, 0 where none is; empty if none is stated at all.
    wires : int or None
        Leads of the meter, 2 or 4; None if unknown.
    temperature_c, humidity_percent : float or None
        Of the air [°C], relative [%].
    photo, file : str
        SHA-256 of a photo of the specimen, and of the instrument's export; "" for none.
    defects : tuple of str
        Visible defects, as in :data:`DEFECTS`.
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
    quantity: tuple[str, ...] = ()
    value: tuple[float, ...] = ()
    frequency_hz: tuple[float, ...] = ()
    uncertainty: tuple[float, ...] = ()
    wires: int | None = None
    temperature_c: float | None = None
    humidity_percent: float | None = None
    photo: str = ""
    file: str = ""
    defects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        ac = len(self.quantity)
        if (len(self.value), len(self.frequency_hz)) != (ac, ac) or len(self.uncertainty) not in (0, ac):
            raise BadInput(
                f"a reading of {ac} AC quantities with {len(self.value)} values, {len(self.frequency_hz)} "
                f"frequencies and {len(self.uncertainty)} uncertainties; expected as many of each"
            )
        if not QUANTITIES.issuperset(self.quantity):
            raise BadInput(f"AC quantities {self.quantity!r:.80}; expected some of {', '.join(sorted(QUANTITIES))}")


@dataclass(frozen=True, kw_only=True)
class BenchRun(_OfSpecimen):
    """A recording of the bench.

    Attributes
    ----------
    file, rig_file : str
        SHA-256 of the impedance analyser's file and of the rig's; "" without a rig.
    facts : str
        Summary as JSON, see :mod:`sensorgen.measure.log.bench`.
    """

    file: str
    rig_file: str = ""
    facts: str = "{}"

    @property
    def simulated(self) -> bool:
        """True if ``bench run --simulate`` made it, or its remark begins with that word."""
        return self.remark.partition(";")[0].strip() == "simulated"


@dataclass(frozen=True, kw_only=True)
class Prediction(Entry):
    """Prediction of a design's readings.

    Attributes
    ----------
    design_id, design : str
        Identity and name of the design.
    version : str
        Version of sensorgen.
    data : str
        The prediction as JSON.
    """

    design_id: str
    design: str
    version: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Calibration(_OfSpecimen):
    """Calibration of a specimen.

    Attributes
    ----------
    version : str
        Version of sensorgen.
    data : str
        The calibration as JSON.
    """

    version: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Batch(Entry):
    """A print bed.

    Attributes
    ----------
    batch : str
        Name.
    file : str
        SHA-256 of ``batch.json``.
    """

    batch: str
    file: str


@dataclass(frozen=True, kw_only=True)
class Print(Specimen, Entry):
    """A specimen bound to its design, and to a place on a print bed where that is known.

    Later rows of the specimen get its design and batch. Version 1 had no prints without a batch, and none of another
    name than on the bed.

    Attributes
    ----------
    batch_uid : str
        ``uid`` of the batch; "" if unknown.
    design_id, design : str
        Identity and name of the design.
    printed : str
        Its name on the print bed, if that is another.
    """

    batch_uid: str
    design_id: str
    design: str
    printed: str = ""


@dataclass(frozen=True, kw_only=True)
class RawFile(Entry):
    """A file of an instrument, kept beside the log.

    Attributes
    ----------
    uid : str
        SHA-256.
    name : str
        Original name.
    size : int
        Size [bytes].
    """

    name: str
    size: int


@dataclass(frozen=True, kw_only=True)
class DesignRow(Entry):
    """A design, so that the log explains itself.

    Attributes
    ----------
    uid : str
        Identity of the design.
    design : str
        Its name.
    data : str
        Everything that decides it, as JSON.
    """

    design: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Withdrawal(Entry):
    """Takes a row of any kind out of use, without removing it.

    Attributes
    ----------
    of : str
        Kind of the row, as in :data:`KINDS`.
    supersedes : str
        Its ``uid``.
    reason : str
        Why.
    """

    of: str
    supersedes: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class Anchor(Entry):
    """The head of the log was written to a file outside.

    Attributes
    ----------
    head : str
        Identity of the last record then.
    file : str
        Name of the file.
    """

    head: str
    file: str


@dataclass(frozen=True, kw_only=True)
class Merge(Entry):
    """Records of other machines have joined those of this one."""


@dataclass(frozen=True, kw_only=True)
class Migration(Entry):
    """The log was kept by an older sensorgen: only clocks state the order of its rows.

    Attributes
    ----------
    version : int
        Of the old file.
    rows : int
        Number of its rows, which are the records before this one.
    """

    version: int
    rows: int


KINDS: dict[str, type[Entry]] = {
    "raw_file": RawFile, "batch": Batch, "print": Print, "reading": Reading, "bench_run": BenchRun,
    "prediction": Prediction, "calibration": Calibration, "design": DesignRow, "withdrawal": Withdrawal,
    "anchor": Anchor, "merge": Merge, "migration": Migration,
}  # fmt: skip
VERSIONS = {"reading": 2, "print": 2}  # of the schemas of kinds that have changed; 1 of every other
NAMES = {kind: name for name, kind in KINDS.items()}
ROWS = tuple(kind for kind in KINDS.values() if kind not in (Anchor, Merge, Migration))  # not about the log itself
REFERENCES: dict[type[Entry], dict[str, type[Entry]]] = {
    Batch: {"file": RawFile}, Print: {"batch_uid": Batch}, BenchRun: {"file": RawFile, "rig_file": RawFile},
    Reading: {"photo": RawFile, "file": RawFile},
}  # fmt: skip


Value = str | int | float | bool | tuple[float, ...] | tuple[str, ...] | None
UNHASHED = ("number", "logged_at")  # given by the log, and by the record
INDEXED: dict[str, type] = {"uid": str, "specimen": str, "iteration": int, "design_id": str, "supersedes": str}
COLUMNS: dict[type[Entry], dict[str, Any]] = {kind: get_type_hints(kind) for kind in KINDS.values()}
"""Fields of rows with their types, by kind."""
_Kinds = tuple[bool, Any, frozenset[type]]


@cache
def _kinds(annotation: Any) -> _Kinds:
    """Kinds of a field: True if it may be None, its type in JSON, and the types of its items if that is a list."""
    if annotation == tuple[float, ...]:
        return False, list, frozenset((int, float))
    if annotation == tuple[str, ...]:
        return False, list, frozenset((str,))
    kinds = get_args(annotation) or (annotation,)
    return NoneType in kinds, next(kind for kind in kinds if kind is not NoneType), frozenset()


_ENCODER = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"))
_HELD: dict[type[Entry], dict[str, tuple[_Kinds, object]]] = {  # by a record: types and defaults
    kind: {f.name: (_kinds(of[f.name]), f.default) for f in fields(kind) if f.name not in UNHASHED}
    for kind, of in COLUMNS.items()
}
_USUAL = {kind: {name: usual for name, (_, usual) in held.items()} for kind, held in _HELD.items()}
_OPTIONAL = {kind: {f.name: f.default for f in fields(kind) if f.default is not MISSING} for kind in COLUMNS}
_REQUIRED = {kind: {name for name, (_, usual) in held.items() if usual is MISSING} for kind, held in _HELD.items()}


def content_of(entry: Entry) -> dict[str, Any]:
    """Fields of a row that its record holds: those that are not as usual.

    Raises
    ------
    BadInput
        A value that the field cannot have.
    """
    kind, row = type(entry), vars(entry)
    data = {name: row[name] for name, usual in _USUAL[kind].items() if row[name] != usual}
    _values(kind, data)
    return data


def encoded(data: Mapping[str, Any]) -> str:
    """Text of a record's content."""
    text = _ENCODER.encode(data)
    if "Infinity" not in text:
        return text
    return f"{{{','.join(f'{json.dumps(name)}:{_json(value)}' for name, value in data.items())}}}"


def decode(kind: type[_Kind], content: str, number: int, logged_at: str) -> _Kind:
    """Row of a record.

    Raises
    ------
    BadInput
        Content that no version of sensorgen writes for this kind.
    """
    data, kinds = _object(content), _HELD[kind]
    if data is None:
        raise BadInput(f"a {kind.__name__} of which the content is no JSON object: {content!r:.60}")
    if not (data.keys() <= kinds.keys() and _REQUIRED[kind] <= data.keys()):
        strange, missing = data.keys() - kinds.keys(), [name for name in kinds if name in _REQUIRED[kind] - data.keys()]
        wrong = f"has {min(strange)!r:.40}" if strange else f"lacks {missing[0]!r}"
        raise BadInput(f"a {kind.__name__} {wrong}; expected {', '.join(kinds)}")
    row = _row(kind, {**_OPTIONAL[kind], **_values(kind, data), "number": number, "logged_at": logged_at})
    if isinstance(row, Reading):
        row.__post_init__()
    return row


def indexed(content: str) -> tuple[str | int | None, ...]:
    """Entries of the log's index for a record's content; as :func:`index`, nothing else in what is no JSON object."""
    return index(_object(content) or {})


def index(data: Mapping[str, Any]) -> tuple[str | int | None, ...]:
    """Entries of the log's index for a record's fields: those of ``INDEXED``, None for those that it has not."""
    return tuple([data[name] if type(data.get(name)) is kind else None for name, kind in INDEXED.items()])


@lru_cache(maxsize=1)  # a record is decoded, and then indexed
def _object(content: str) -> dict[str, Any] | None:
    try:
        data = json.loads(content)
    except (ValueError, TypeError, RecursionError):
        return None
    return data if isinstance(data, dict) else None


def _values(kind: type[Entry], data: Mapping[str, Any]) -> dict[str, Value]:
    """Values of a record's fields; BadInput where one cannot have its value."""
    values, held = dict(data), _HELD[kind]
    for name, value in data.items():
        kinds = held[name][0]
        if type(value) is not kinds[1] or kinds[1] in (float, list):
            try:
                values[name] = _value(kinds, value)
            except (TypeError, ValueError):
                raise BadInput(f"column {name} of a {kind.__name__} holds {value!r:.60}") from None
    return values


def word(kind: type[Any]) -> str:
    """Kind of a row in a sentence.

    >>> from sensorgen.measure.log.entries import BenchRun, DesignRow
    >>> word(BenchRun), word(DesignRow)
    ('recording', 'design')
    """
    name = NAMES[kind].replace("_", " ")
    return "recording" if name == "bench run" else name


def to_cell(value: Value) -> str:
    """Value as a cell of CSV; :func:`from_cell` is the inverse."""
    if value is None:
        return ""
    return value if isinstance(value, str) else _json(value)


def _json(value: Value) -> str:
    text = json.dumps(value, ensure_ascii=False)
    texts = isinstance(value, str) or (isinstance(value, tuple) and value and isinstance(value[0], str))
    return text if texts else text.replace("Infinity", "9e999")


def from_cell(annotation: Any, cell: str) -> Value:
    """Value of a cell, by the field's type; ValueError, TypeError or RecursionError for any other cell."""
    optional, kind, _ = _kinds(annotation)
    if cell == "" and optional:
        return None
    return from_json(annotation, cell if kind is str else json.loads(cell))


def from_json(annotation: Any, value: Any) -> Value:
    """Value out of JSON, by the field's type; ValueError or TypeError for any other."""
    return _value(_kinds(annotation), value)


def _value(kinds: _Kinds, value: Any) -> Value:
    optional, kind, items = kinds
    if items:
        return _listed(items, value)
    if value is None and optional:
        return None
    if kind is float and type(value) in (float, int) and math.isfinite(value):
        return float(value)
    if type(value) is not kind or kind is float:
        raise TypeError(f"{value!r:.60} is no {kind.__name__}")
    return cast(Value, value)


def _listed(items: frozenset[type], value: Any) -> Value:
    """Numbers without nan, or texts."""
    if type(value) not in (list, tuple) or not items.issuperset(map(type, value)) or not all(map(eq, value, value)):
        raise ValueError(f"{value!r:.60} is no list of {'texts' if str in items else 'numbers'}")
    return tuple(value) if str in items else tuple(map(float, value))
