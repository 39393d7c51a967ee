"""Rows of a log for people and for JSON: listed, and one by one with everything about them."""

import difflib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import isinf
from typing import Any

from sensorgen.core.document import Cell, Column, Facts, Part, Table
from sensorgen.core.lazy import by_key
from sensorgen.core.units import frequency_text, si
from sensorgen.measure.immittance import shown_value
from sensorgen.measure.log import bench
from sensorgen.measure.log.entries import BenchRun, Entry, Prediction, Print, Reading, Withdrawal, word
from sensorgen.measure.log.logbook import Log, conflict

_REMARK = 20  # letters of a remark in a list
_READING = (
    Column("no."), Column("specimen"), Column("Y", "ohm", right=True), Column("Z", "ohm", right=True), Column("remark"),
)  # fmt: skip
_OTHER = (  # of a recording, a print or a prediction
    "file", "rig_file", "remark", "design", "design_id", "printed", "batch", "batch_uid", "of", "reason", "head",
)  # fmt: skip
_RECORDING = tuple(map(Column, ("no.", "specimen", "recording", "remark")))


@dataclass(frozen=True)
class Listing:
    """The latest readings and recordings of a log; ``notes`` has the numbers of all rows, and the log's file."""

    readings: tuple[Reading, ...]
    recordings: tuple[BenchRun, ...]
    notes: tuple[str, ...]

    def to_json(self) -> str:
        """Readings and recordings with all their fields."""
        return _json({"readings": _plain(self.readings), "recordings": _plain(self.recordings)})

    def document(self) -> Iterator[Part]:
        """A line for each row, "?" where something is to be doubted."""
        if self.readings:
            ac = any(r.quantity for r in self.readings)
            rows: Iterator[tuple[Cell, ...]] = (
                (r.number, r.specimen, short(r.y_ohm), short(r.z_ohm), *([_ac(r)] if ac else []),
                 ("? " if r.doubts else "") + _remark(r))
                for r in self.readings
            )  # fmt: skip
            columns = (*_READING[:-1], *([Column("AC")] if ac else []), _READING[-1])
            yield Table("readings", "", columns, tuple(rows))
        if self.recordings:
            runs = ((run.number, run.specimen, run.file[:12], run.remark) for run in self.recordings)
            yield Table("recordings", "", _RECORDING, tuple(runs))
        yield from self.notes


def listing(log: Log, iteration: int | None = None, last: int | None = None) -> Listing:
    """Readings and recordings, the latest last; those that a later one corrects are left out.

    Parameters
    ----------
    log : Log
        An open log.
    iteration : int, optional
        Of this iteration only.
    last : int, optional
        At most so many of each [-].
    """
    wanted: dict[str, Any] = {} if iteration is None else {"iteration": iteration}
    readings, recordings = log.readings(last=last, **wanted), log.recordings(last=last, **wanted)
    names = {Reading: "readings", BenchRun: "recordings", Prediction: "predictions"}
    total = ", ".join(f"{log.count(kind)} {name}" for kind, name in names.items())
    cut = last is not None and max(len(readings), len(recordings)) >= last
    more = [f"the latest {last} are shown; --all shows all"] if cut else []
    records, head = log.head()
    chain = [f"{records} records, head {head[:16]}"] if records else []
    return Listing(readings, recordings, (*log.conflicts(), total, *more, *chain, str(log.path)))


@dataclass(frozen=True)
class Detail:
    """A row, and remarks on it: which row it corrects, or which one corrects it."""

    entry: Entry
    remarks: tuple[tuple[str, str], ...] = ()

    def document(self) -> Iterator[Part]:
        """Everything about it."""
        yield _title(self.entry)
        yield Facts(tuple((f"  {name}", fact) for name, fact in (*_facts(self.entry), *self.remarks) if fact))


def _title(row: Entry) -> str:
    name = f"{word(type(row))} {row.number}: {getattr(row, 'specimen', '')}".rstrip()
    return f"{name}, written {row.written!r}" if isinstance(row, Reading) and row.written != row.specimen else name


def _facts(row: Entry) -> Iterator[tuple[str, str]]:
    """Names and values of all that a row has, "" where it lacks one."""
    yield from _of_reading(row) if isinstance(row, Reading) else ((name, getattr(row, name, "")) for name in _OTHER)
    yield "logged", row.logged_at
    yield "claimed", row.claimed_at
    yield from (("doubtful", doubt) for doubt in getattr(row, "doubts", ()))
    if isinstance(row, BenchRun):
        yield from bench.from_json(row.facts).words()


def _of_reading(r: Reading) -> tuple[tuple[str, str], ...]:
    return (
        ("Y", _ohms(r.y_words, r.y_ohm)),
        ("Z", _ohms(r.z_words, r.z_ohm)),
        *(("" if k else "AC", line) for k, line in enumerate(_ac_lines(r))),
        ("baked", {None: "", True: "yes", False: "no"}[r.baked]),
        ("remark", r.remark),
        ("measured", r.measured_at),
        ("instrument", " by ".join(filter(None, (f"{r.wires} wires" if r.wires else "", r.instrument)))),
        ("air", ", ".join(_air(r))),
        ("defects", ", ".join(r.defects)),
        ("photo", r.photo),
        ("file", r.file),
        ("design", f"{r.design} ({r.design_id})" if r.design_id else ""),
        ("batch", r.batch),
        ("source", r.source + (f", row {r.source_row}" if r.source_row is not None else "")),
    )


def _air(r: Reading) -> Iterator[str]:
    if r.temperature_c is not None:
        yield f"{r.temperature_c:g} °C"
    if r.humidity_percent is not None:
        yield f"{r.humidity_percent:g} % relative humidity"


def _ac_lines(r: Reading) -> list[str]:
    """AC quantities of a reading, repeats side by side, as ``Cp 24.9 pF / 25.1 pF at 10kHz``."""
    rows = zip(r.quantity, r.frequency_hz, r.value, r.uncertainty or (0.0,) * len(r.value), strict=True)
    repeats = by_key(
        ((name, f), shown_value(name, value) + (f" ± {shown_value(name, stated)}" if stated else ""))
        for name, f, value, stated in rows
    )
    return [f"{name} {' / '.join(values)} at {frequency_text(f)}" for (name, f), values in repeats.items()]


def _ac(r: Reading) -> str:
    first, *more = _ac_lines(r) or ["-"]
    return f"{first}, {len(more)} more" if more else first


@dataclass(frozen=True)
class Details:
    """Some rows with everything about them; ``empty`` is what to say where there is none."""

    rows: tuple[Detail, ...]
    empty: str = ""

    def to_json(self) -> str:
        """The rows with all their fields."""
        return _json(_plain(row.entry for row in self.rows))

    def document(self) -> Iterator[Part]:
        """Row by row."""
        for row in self.rows:
            yield from row.document()
        if not self.rows:
            yield self.empty


def details(log: Log, entries: Iterable[Entry]) -> Details:
    """Rows of an open log with their corrections."""
    return Details(tuple(Detail(entry, tuple(_corrections(entry, log))) for entry in entries))


def logged(log: Log, entries: Iterable[Entry], known: str) -> Details:
    """New rows with hints; ``known`` is what to say where the log had all of them."""
    rows = (Detail(entry, (*_corrections(entry, log), *_near(entry, log))) for entry in entries)
    return Details(tuple(rows), known)


def _near(entry: Entry, log: Log) -> Iterator[tuple[str, str]]:
    """A hint where a specimen is on no print bed of its iteration, and another with nearly its name is."""
    if isinstance(entry, Reading) and not entry.batch and not log.bound(entry.specimen):
        names = [printed.specimen for printed in log.entries(Print, iteration=entry.iteration)]
        for near in difflib.get_close_matches(entry.specimen, names, n=1, cutoff=0.8):
            hint = f"no print bed here has {entry.specimen!r}; near is {near!r}: --corrects {entry.number}, if meant"
            yield "hint", hint


def _corrections(entry: Entry, log: Log) -> Iterator[tuple[str, str]]:
    if isinstance(entry, Reading | BenchRun) and entry.supersedes:
        for old in log.entries(type(entry), superseded=True, uid=entry.supersedes):
            yield "corrects", f"{word(type(old))} {old.number} of {old.specimen}"
    for new in log.superseding(entry):
        yield ("withdrawn", new.reason) if isinstance(new, Withdrawal) else ("corrected", f"by row {new.number}")
    if rival := log.rival(entry):
        yield "conflict", conflict(rival)
    sequence, key = log.record_of(entry)
    yield "record", f"{sequence}, {key[:16]}"


def short(values: Sequence[float]) -> str:
    """Readings for a list, as people write them [ohm]; below 1 ohm without a prefix, for m would be taken for mega.

    >>> short((0.8, 650.0, 2300.0, 1.1e6, float("inf"))), short(())
    ('0.8 / 650 / 2.3k / 1.1M / OL', '-')
    """
    words = (
        "OL" if isinf(value) else f"{value:g}" if abs(value) < 1 else si(value, "").replace(" ", "") for value in values
    )
    return " / ".join(words) or "-"


def _ohms(words: str, values: Sequence[float]) -> str:
    shown = ", ".join("OL" if isinf(value) else si(value, "ohm") for value in values) or "-"
    return f"{shown}, written {words!r}" if words else ""


def _remark(r: Reading) -> str:
    state = {None: "", True: "baked; ", False: "" if "bake" in r.remark else "not baked; "}[r.baked]
    remark = (state + r.remark).removesuffix("; ")
    return remark if len(remark) <= _REMARK else remark[: _REMARK - 1] + "…"


def _plain(entries: Iterable[Entry]) -> list[dict[str, object]]:
    """Rows for JSON, which has no infinity: an overload is "OL"."""
    return [{name: _cell(value) for name, value in asdict(entry).items()} for entry in entries]


def _cell(value: object) -> object:
    if isinstance(value, tuple):
        return [_cell(item) for item in value]
    return "OL" if isinstance(value, float) and isinf(value) else value


def _json(data: object) -> str:
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"
