"""Summary of a recording as it was logged: samples, marks, frequencies and clocks; JSON in the field ``facts``."""

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput
from sensorgen.core.units import si

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


_CLOCK = ("offset_s", "offset_error_s", "skew", "skew_error", "explained")


def to_json(facts: RecordingFacts) -> str:
    """Facts as JSON."""
    return str(_adapter().dump_json(facts, exclude_none=facts.rig is None).decode())


def from_json(text: str) -> RecordingFacts:
    """Facts of a logged recording.

    Raises
    ------
    BadInput
        Not the JSON that :func:`to_json` writes.
    """
    from pydantic import ValidationError

    from sensorgen.core.records import problem

    try:
        facts: RecordingFacts = _adapter().validate_json(text)
    except ValidationError as error:
        raise BadInput(f"the facts of a recording are damaged: {problem(error, _plain(text))}") from None
    return facts


def _plain(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


@cache
def _adapter() -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(RecordingFacts)


def summarised(
    parts: "Iterable[tuple[Recording, ...]]", columns: dict[str, str], rig: "RigLog | None", rig_columns: dict[str, str]
) -> RecordingFacts:
    """Facts of recordings, part after part, joined with the rig's log if there is one and the recording shows how."""
    from sensorgen.measure.recording import joined_all

    lockins: dict[int, LockIn] = {}
    beside, fault = None, None
    for recordings in parts:
        marked = recordings
        if rig:
            try:
                joined = joined_all(recordings, rig)
            except BadInput as error:
                fault = fault or error
            else:
                marked = tuple(one.recording for one in joined)  # joining marks the rig's errors
                beside = _with_rig(beside, joined[0], rig)
        for one in map(lockin, marked):
            lockins[one.lockin] = _longer(lockins[one.lockin], one) if one.lockin in lockins else one
    if rig and beside is None and fault:  # as of a sensor with a hole, which does not respond to the force
        beside = RigDay(len(rig.time_s), int(rig.error.sum()), clocks=f"not joined with the rig: {fault}")
    return RecordingFacts(tuple(lockins.values()), dict(columns), dict(rig_columns), beside)


def _longer(before: LockIn, part: LockIn) -> LockIn:
    """Summary with one more part."""
    counts = {name: count + part.counts[name] for name, count in before.counts.items()}
    return replace(before, counts=counts, seconds=part.seconds, notes=(*before.notes, *part.notes))


def _with_rig(before: RigDay | None, first: "Joined", rig: "RigLog") -> RigDay:
    samples = first.recording.counts()["rig error"]
    if before:
        return replace(before, samples=before.samples + samples)
    numbers: dict[str, Any] = {name: _known(getattr(first, name)) for name in _CLOCK}
    return RigDay(**rig.counts(), samples=samples, clocks=first.clock_text(), notes=first.notes, **numbers)


def lockin(recording: "Recording") -> LockIn:
    """Summary of the recording of one lock-in."""
    source = recording.source
    return LockIn(
        tuple(recording.tones_hz.tolist()), recording.counts(), float(recording.time_s[-1]), source.format,
        source.program, source.lockin, _known(source.rate_hz), _known(source.bandwidth_hz), _known(recording.epoch_s),
        source.notes,
    )  # fmt: skip


def _known(value: float) -> float | None:
    """The number, or None for nan and infinity, which JSON lacks."""
    return value if math.isfinite(value) else None
