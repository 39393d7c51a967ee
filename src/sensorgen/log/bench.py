"""Recordings of the bench into the log: what is counted when they come in, and their files kept whole."""

import json
import uuid
from hashlib import sha256
from pathlib import Path
from typing import Any

from sensorgen.errors import BadInput
from sensorgen.log import files
from sensorgen.log.entries import BenchRun, Entry, RawFile
from sensorgen.log.logbook import Log
from sensorgen.log.words import design_of_name, named


def take(log: Log, specimen: str, recording: Path, rig: Path | None = None, remark: str = "") -> list[Entry]:
    """Log a recording of one specimen.

    Parameters
    ----------
    log : Log
        An open one.
    specimen : str
        The specimen's name.
    recording, rig : Path
        The impedance analyser's file, and the rig's, if there is one.
    remark : str
        In anybody's words.

    Returns
    -------
    list of Entry
        What is new; nothing where the log has the same files of the same specimen.

    Raises
    ------
    BadInput
        A name or a file that cannot be read. Nothing is logged or kept then.
    """
    columns, name = named(specimen)
    before = [files.raw_file(path) for path in (recording, rig) if path]
    facts = _facts(recording, rig)
    kept = [files.keep(log.files, path) for path in (recording, rig) if path]
    if kept != before:
        raise BadInput(f"{str(recording)!r} changes while it is read; log it when it is complete")
    design_id, design = design_of_name(name)
    run = BenchRun(
        uid=sha256(" ".join([str(columns["specimen"]), *(file.uid for file in kept)]).encode()).hexdigest()[:32],
        **columns,  # type: ignore[arg-type]
        written=specimen, design_id=design_id, design=design, remark=remark, source=recording.name,
        file=kept[0].uid, rig_file=kept[1].uid if rig else "",
        facts=json.dumps(facts, sort_keys=True, allow_nan=False),
    )  # fmt: skip
    return [row for row in log.add([*kept, run]) if isinstance(row, BenchRun)]


def _facts(recording: Path, rig: Path | None) -> dict[str, Any]:
    """What is counted in a recording, as plain data."""
    return {}
