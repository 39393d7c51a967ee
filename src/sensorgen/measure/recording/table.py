"""Recordings from CSV: impedance columns with a time, a time stamp or both beside them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sensorgen.core.errors import BadInput, within
from sensorgen.measure.readings import readings
from sensorgen.measure.recording import clock
from sensorgen.measure.recording.samples import Recording, Source, blank, sifted

TIME, STAMP, CLIPPED, VALID = "time_s", "stamp_s", "clipped", "valid"


def recording(path: Path, columns: Mapping[str, str]) -> Recording:
    """Read a recording from a CSV file.

    Parameters
    ----------
    path : Path
        The file.
    columns : mapping of str to str
        From the file's column names to sensorgen's: ``time_s``, ``stamp_s``, ``clipped``, ``valid``, and
        ``re_ohm_1.1kHz``, ``im_ohm_1.1kHz`` for every frequency.

    Raises
    ------
    BadInput
        As :func:`sensorgen.measure.readings.readings`; no time, or a time that does not rise.
    """
    with readings(str(path), columns, (TIME, STAMP, CLIPPED, VALID)) as file:
        blocks = list(file.blocks())
    impedance = np.concatenate([block.impedance_ohm for block in blocks])
    beside = dict(zip(file.numbers, np.concatenate([block.numbers for block in blocks]).T, strict=True))
    if TIME not in beside and STAMP not in beside:
        raise BadInput(f"{path}: no column {TIME} and none {STAMP} (seconds since 1970); name it with a map of columns")
    with within(str(path)):
        rebuilt = clock.rebuilt(len(impedance), beside.get(TIME), beside.get(STAMP))
    marks = blank(len(impedance)) | rebuilt.marks | sifted(impedance)
    if CLIPPED in beside:
        marks["clipped"] = beside[CLIPPED] == 1
    if VALID in beside:
        marks["invalid"] = beside[VALID] != 1
    source = Source(path.name, "CSV", rate_hz=clock.rate_hz(rebuilt.time_s), notes=rebuilt.notes)
    return Recording(rebuilt.time_s, file.frequency_hz, impedance, marks, rebuilt.clock, source)
