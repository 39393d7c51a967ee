"""Log recordings of the bench with their files, and read them again.

The field ``facts`` has a summary as JSON: samples, marks, frequencies and clocks.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput
from sensorgen.core.units import si
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log import files
from sensorgen.measure.log.entries import BenchRun, Entry
from sensorgen.measure.log.logbook import Log

if TYPE_CHECKING:
    from sensorgen.measure.recording import Joined, Recording, RigLog


@dataclass(frozen=True)
class LockIn:
    """Recording of one lock-in.

    Attributes
    ----------
    tones_hz : tuple of float
        Frequencies [Hz].
    counts : dict of str to int
        Samples, valid samples, and samples with each mark.
    seconds : float
        Time of the last sample [s].
    format, program, lockin, rate_hz, bandwidth_hz, notes
        As in :class:`sensorgen.measure.recording.Source`; None for nan.
    epoch_s : float or None
        Real time at time 0, in seconds since 1970 [s].
    """

    tones_hz: tuple[float, ...]
    counts: dict[str, int]
    seconds: float
    format: str
    program: str = ""
    lockin: int = 1
    rate_hz: float | None = None
    bandwidth_hz: float | None = None
    epoch_s: float | None = None
    notes: tuple[str, ...] = ()

    def words(self) -> Iterator[tuple[str, str]]:
        """Samples and marks, then frequencies and time, for people."""
        marks = ", ".join(f"{n} {mark}" for mark, n in self.counts.items() if n and mark not in ("samples", "valid"))
        counts = f"{self.counts['samples']} samples, {self.counts['valid']} of them sound; {marks or 'no marks'}"
        yield f"lock-in {self.lockin}", counts
        frequencies = ", ".join(si(tone, "Hz") for tone in self.tones_hz)
        yield "", f"{frequencies}; {self.seconds:.5g} s by {self.program or self.format}"


@dataclass(frozen=True)
class RigDay:
    """Log of the rig beside a recording.

    Attributes
    ----------
    rows, errors : int
        Rows, and rows with an error.
    samples : int
        Samples of the recording without a sound row beside them.
    clocks : str
        Offset of the clocks as text.
    offset_s, offset_error_s, skew, skew_error, explained
        As in :class:`sensorgen.measure.recording.Joined`; None for nan.
    notes : tuple of str
        Remarks.
    """

    rows: int
    errors: int
    samples: int = 0
    clocks: str = ""
    offset_s: float | None = None
    offset_error_s: float | None = None
    skew: float | None = None
    skew_error: float | None = None
    explained: float | None = None
    notes: tuple[str, ...] = ()

    def words(self) -> Iterator[tuple[str, str]]:
        """Rows and errors, then clocks and remarks, for people."""
        marked = f"; {self.samples} samples beside them, or while it was silent" if self.samples else ""
        yield "rig", f"{self.rows} rows, {self.errors} with errors{marked}"
        yield from (("", line) for line in (self.clocks, *self.notes) if line)


@dataclass(frozen=True)
class RecordingFacts:
    """Summary of a recording.

    Attributes
    ----------
    lockins : tuple of LockIn
        Every lock-in of the file.
    columns, rig_columns : dict of str to str
        From the columns of the files to sensorgen's, to read the files again.
    rig : RigDay or None
        None without a log of the rig.
    """

    lockins: tuple[LockIn, ...] = ()
    columns: dict[str, str] = field(default_factory=dict)
    rig_columns: dict[str, str] = field(default_factory=dict)
    rig: RigDay | None = None

    def words(self) -> Iterator[tuple[str, str]]:
        """Lock-ins and rig, for people."""
        for one in self.lockins:
            yield from one.words()
        if self.rig:
            yield from self.rig.words()


_SAME_NAMES: Mapping[str, str] = MappingProxyType({})
_CLOCK = ("offset_s", "offset_error_s", "skew", "skew_error", "explained")


def to_json(facts: RecordingFacts) -> str:
    """Facts as JSON."""
    from sensorgen.core.records import adapter

    return adapter(RecordingFacts).dump_json(facts, exclude_none=facts.rig is None).decode()


def from_json(text: str) -> RecordingFacts:
    """Facts of a logged recording.

    Raises
    ------
    BadInput
        Not the JSON that :func:`to_json` writes.
    """
    from pydantic import ValidationError

    from sensorgen.core.records import adapter, problem

    try:
        facts: RecordingFacts = adapter(RecordingFacts).validate_json(text)
    except ValidationError as error:
        raise BadInput(f"the facts of a recording are damaged: {problem(error, _plain(text))}") from None
    return facts


def _plain(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def summarised(
    parts: "Iterable[tuple[Recording, ...]]", columns: dict[str, str], rig: "RigLog | None", rig_columns: dict[str, str]
) -> RecordingFacts:
    """Facts of recordings, part after part, joined with the rig's log if there is one and the recording shows how."""
    from sensorgen.measure.recording import joined_all

    lockins: dict[int, LockIn] = {}
    beside, faults = None, list[BadInput]()
    for recordings in parts:
        marked = recordings
        if rig:
            try:
                joined = joined_all(recordings, rig)
            except BadInput as error:
                faults.append(error)
            else:
                marked = tuple(one.recording for one in joined)  # joining marks the rig's errors
                beside = _with_rig(beside, joined[0], rig)
        for one in map(lockin, marked):
            lockins[one.lockin] = _longer(lockins.get(one.lockin), one)
    if rig and beside is None and faults:  # as of a sensor with a hole, which does not respond to the force
        beside = RigDay(len(rig.time_s), int(rig.error.sum()), clocks=f"not joined with the rig: {faults[0]}")
    return RecordingFacts(tuple(lockins.values()), dict(columns), dict(rig_columns), beside)


def _longer(before: LockIn | None, part: LockIn) -> LockIn:
    """Summary with one more part."""
    if before is None:
        return part
    counts = {name: count + part.counts[name] for name, count in before.counts.items()}
    return replace(before, counts=counts, seconds=part.seconds, notes=(*before.notes, *part.notes))


def _with_rig(before: RigDay | None, first: "Joined", rig: "RigLog") -> RigDay:
    samples = first.recording.counts()["rig error"]
    if before:
        return replace(before, samples=before.samples + samples)
    numbers: dict[str, Any] = {name: _known(getattr(first.clocks, name)) for name in _CLOCK}
    return RigDay(**rig.counts(), samples=samples, clocks=first.clocks.words(), notes=first.notes, **numbers)


def lockin(recording: "Recording") -> LockIn:
    """Summary of the recording of one lock-in."""
    source = recording.source
    return LockIn(
        tuple(recording.tones_hz.tolist()), recording.counts(), float(recording.time_s[-1]), source.format,
        source.program, source.lockin, _known(source.rate_hz), _known(source.bandwidth_hz),
        _known(recording.clock.epoch_s), source.notes,
    )  # fmt: skip


def _known(value: float) -> float | None:
    """The number, or None for nan and infinity, which JSON lacks."""
    return value if math.isfinite(value) else None


def log_recording(
    log: Log,
    specimen: str,
    recording: Path,
    rig: Path | None = None,
    *,
    columns: Mapping[str, str] = _SAME_NAMES,
    rig_columns: Mapping[str, str] = _SAME_NAMES,
    remark: str = "",
    supersedes: str = "",
) -> list[Entry]:
    """Log a recording of one specimen.

    Parameters
    ----------
    log : Log
        An open log.
    specimen : str
        Name of the specimen.
    recording, rig : Path
        Files of the impedance analyser and of the rig, if there is one.
    columns, rig_columns : mapping
        For CSV files, from their column names to sensorgen's; logged, to read the files again.
    remark : str
        Any text.
    supersedes : str
        ``uid`` of the recording that this one corrects, "" if it corrects none.

    Returns
    -------
    list of Entry
        The new row; none where the log has the same files of the same specimen.

    Raises
    ------
    BadInput
        A name or a file that cannot be read. Nothing is logged or kept then.
    """
    from sensorgen.measure import recording as recordings
    from sensorgen.measure.log import notes
    from sensorgen.measure.recording.spool import MOST_BYTES

    of = notes.named(specimen, log)
    paths = [recording, *([rig] if rig else [])]
    for path in paths:  # before their SHA-256 is computed
        checked_head(path, MOST_BYTES, "a recording")
    before = [files.raw_file(path) for path in paths]
    rig_log = recordings.rig(rig, rig_columns) if rig else None
    summary = summarised(recordings.parts(recording, columns), dict(columns), rig_log, dict(rig_columns))
    raw_files = [files.keep(log.files, path) for path in paths]
    if raw_files != before:
        raise BadInput(f"{str(recording)!r} {files.CHANGED}")
    uids = [file.uid for file in raw_files]
    identity = " ".join(filter(None, (of.specimen.specimen, *uids, supersedes)))
    file, rig_file = (*uids, "")[:2]
    run = BenchRun(
        **vars(of.specimen), uid=sha256(identity.encode()).hexdigest()[:32], written=specimen,
        design_id=of.design_id, design=of.design, source=recording.name, remark=remark, supersedes=supersedes,
        file=file, rig_file=rig_file, facts=to_json(summary),
    )  # fmt: skip
    return [row for row in log.add([*raw_files, run]) if isinstance(row, BenchRun)]


def read_again(log: Log, run: BenchRun) -> "tuple[Iterator[tuple[Recording, ...]], RigLog | None]":
    """Read a logged recording from its raw files, with the column names that were logged.

    Parameters
    ----------
    log : Log
        An open log.
    run : BenchRun
        One of its recordings.

    Returns
    -------
    iterator of tuple of Recording, RigLog or None
        Every lock-in, part after part; the rig's log if there is one.

    Raises
    ------
    BadInput
        A raw file that is missing or damaged.
    """
    from sensorgen.measure import recording

    summary = from_json(run.facts)
    parts = recording.parts(log.raw(run.file), summary.columns)
    return parts, recording.rig(log.raw(run.rig_file), summary.rig_columns) if run.rig_file else None
