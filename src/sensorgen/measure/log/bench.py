"""Recordings of the bench into the log: what is counted when they come in, and their files kept whole."""

import json
import math
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput
from sensorgen.measure.log import files
from sensorgen.measure.log.entries import BenchRun, Entry
from sensorgen.measure.log.logbook import Log
from sensorgen.measure.log.words import design_of_name, named

if TYPE_CHECKING:
    from sensorgen.measure.recording import Joined, Recording, RigLog


Columns = Mapping[str, str]
_NONE: Columns = MappingProxyType({})


def take(
    log: Log,
    specimen: str,
    recording: Path,
    rig: Path | None = None,
    *,
    columns: Columns = _NONE,
    rig_columns: Columns = _NONE,
    remark: str = "",
    supersedes: str = "",
) -> list[Entry]:
    """Log a recording of one specimen.

    Parameters
    ----------
    log : Log
        An open one.
    specimen : str
        The specimen's name.
    recording, rig : Path
        The impedance analyser's file, and the rig's, if there is one.
    columns, rig_columns : mapping
        What the files call their columns, to what we call them, where they are CSV; kept, to read them again.
    remark : str
        In anybody's words.
    supersedes : str
        ``uid`` of the recording that this one corrects, "" if it corrects none.

    Returns
    -------
    list of Entry
        What is new; nothing where the log has the same files of the same specimen.

    Raises
    ------
    BadInput
        A name or a file that cannot be read. Nothing is logged or kept then.
    """
    told, name = named(specimen)
    for path in filter(None, (recording, rig)):
        _check_size(path)
    before = [files.raw_file(path) for path in (recording, rig) if path]
    facts = _facts((recording, columns), (rig, rig_columns))
    kept = [files.keep(log.files, path) for path in (recording, rig) if path]
    if kept != before:
        raise BadInput(f"{str(recording)!r} {files.CHANGES}")
    design_id, design = design_of_name(name)
    run = BenchRun(
        uid=_uid(str(told["specimen"]), *(file.uid for file in kept), supersedes),
        **told,  # type: ignore[arg-type]
        written=specimen, design_id=design_id, design=design, source=recording.name, remark=remark,
        supersedes=supersedes, file=kept[0].uid, rig_file=kept[1].uid if rig else "",
        facts=json.dumps(facts, sort_keys=True, allow_nan=False),
    )  # fmt: skip
    return [row for row in log.add([*kept, run]) if isinstance(row, BenchRun)]


def _check_size(path: Path) -> None:
    """Refuse what no reader takes before all of it is read for its SHA-256."""
    from sensorgen.measure.recording.matfive import MOST_BYTES

    if path.is_file() and (size := path.stat().st_size) > MOST_BYTES:
        raise BadInput(f"{str(path)!r}: {size / 2**30:.3g} GB; expected up to {MOST_BYTES >> 30} GB: split the run")


def _uid(*says: str) -> str:
    """A name for life: of the specimen and its files, and of the row that is corrected, if one is."""
    return sha256(" ".join(filter(None, says)).encode()).hexdigest()[:32]


def reopened(log: Log, run: BenchRun) -> "tuple[tuple[Recording, ...], RigLog | None]":
    """What was logged, read again from the raw files, by the columns that were told then.

    Parameters
    ----------
    log : Log
        An open one.
    run : BenchRun
        One of its recordings.

    Returns
    -------
    tuple of Recording, RigLog or None
        Every lock-in, and the rig's log if there is one.

    Raises
    ------
    BadInput
        A raw file that is missing or damaged.
    """
    from sensorgen.measure import recording

    facts = json.loads(run.facts)
    found = recording.read_all(log.raw(run.file), facts.get("columns"))
    return found, recording.rig(log.raw(run.rig_file), facts.get("rig_columns")) if run.rig_file else None


def _facts(lcr: tuple[Path, Columns], rig: tuple[Path | None, Columns]) -> dict[str, Any]:
    """What is counted in a recording and in the rig's log, and how their clocks differ, as plain data."""
    from sensorgen.measure import recording

    found = recording.read_all(*lcr)
    facts: dict[str, Any] = {"columns": dict(lcr[1]), "lockins": [_of_recording(r) for r in found]}
    if rig[0]:
        log = recording.rig(rig[0], rig[1])
        joined = recording.joined_all(found, log)
        facts["rig_columns"] = dict(rig[1])
        facts["rig"] = {**log.counts(), **_of_joined(joined[0])}
        for said, one in zip(facts["lockins"], joined, strict=True):
            said["counts"] = one.recording.counts()
    return facts


def _of_recording(r: "Recording") -> dict[str, Any]:
    source = {name: _plain(value) for name, value in vars(r.source).items() if name != "file"}
    tones = [float(tone) for tone in r.tones_hz]
    return {
        "tones_hz": tones,
        "counts": r.counts(),
        "seconds": float(r.time_s[-1]),
        "epoch_s": _plain(r.epoch_s),
        **source,
    }


def _of_joined(joined: "Joined") -> dict[str, Any]:
    names = ("offset_s", "offset_error_s", "skew", "skew_error", "explained")
    numbers = {name: _plain(getattr(joined, name)) for name in names}
    samples = joined.recording.counts()["rig error"]
    return {"clocks": joined.words(), "notes": list(joined.notes), "samples": samples} | numbers


def _plain(value: Any) -> Any:
    """A value as JSON has it: no nan, no tuples."""
    if isinstance(value, tuple):
        return list(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value
