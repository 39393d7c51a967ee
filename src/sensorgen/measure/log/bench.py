"""Log recordings of the bench with their files and a summary, and read them again."""

from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from sensorgen.core.errors import BadInput
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log import facts, files, notes
from sensorgen.measure.log.entries import BenchRun, Entry
from sensorgen.measure.log.logbook import Log

if TYPE_CHECKING:
    from sensorgen.measure.recording import Recording, RigLog

_SAME_NAMES: Mapping[str, str] = MappingProxyType({})


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
    from sensorgen.measure.recording.spool import MOST_BYTES

    of, (design_id, design) = notes.specimen(specimen, log), notes.design_fields(specimen, log)
    paths = [recording, *([rig] if rig else [])]
    for path in paths:  # before their SHA-256 is computed
        checked_head(path, MOST_BYTES, "a recording")
    before = [files.raw_file(path) for path in paths]
    rig_log = recordings.rig(rig, rig_columns) if rig else None
    summary = facts.summarised(recordings.parts(recording, columns), dict(columns), rig_log, dict(rig_columns))
    kept = [files.keep(log.files, path) for path in paths]
    if kept != before:
        raise BadInput(f"{str(recording)!r} {files.CHANGED}")
    identity = " ".join(filter(None, (of.specimen, *(file.uid for file in kept), supersedes)))
    run = BenchRun(
        **vars(of), uid=sha256(identity.encode()).hexdigest()[:32], written=specimen, design_id=design_id,
        design=design, source=recording.name, remark=remark, supersedes=supersedes, file=kept[0].uid,
        rig_file=kept[1].uid if rig else "", facts=facts.to_json(summary),
    )  # fmt: skip
    return [row for row in log.add([*kept, run]) if isinstance(row, BenchRun)]


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

    summary = facts.from_json(run.facts)
    parts = recording.parts(log.raw(run.file), summary.columns)
    return parts, recording.rig(log.raw(run.rig_file), summary.rig_columns) if run.rig_file else None
