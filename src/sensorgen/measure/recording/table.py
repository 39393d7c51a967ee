"""Recordings from CSV: impedance columns with a time, a time stamp or both beside them."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from sensorgen.core.errors import BadInput, within
from sensorgen.measure.readings import Readings, readings
from sensorgen.measure.recording import clock
from sensorgen.measure.recording.samples import (
    MOST_TONES,
    MOST_VALUES,
    Complex,
    Real,
    Recording,
    Source,
    blank,
    rate_hz,
    sifted,
)

TIME, STAMP, CLIPPED, VALID = "time_s", "stamp_s", "clipped", "valid"


def recordings(path: Path, columns: Mapping[str, str]) -> Iterator[tuple[Recording]]:
    """Read a recording from a CSV file, one stretch after the other.

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
        if not {TIME, STAMP} & set(file.numbers):
            message = f"no column {TIME} and none {STAMP} (seconds since 1970); name it with a map of columns"
            raise BadInput(f"{path}: {message}")
        if len(file.frequency_hz) > MOST_TONES:
            raise BadInput(f"{path}: {len(file.frequency_hz)} frequencies; expected up to {MOST_TONES}")
        most, held, count = MOST_VALUES // (len(file.frequency_hz) + 2), [], 0
        for block in file.blocks():
            held.append((block.impedance_ohm, block.numbers))
            count += len(block.rows)
            if count >= most:
                yield (_stretch(path, file, held),)
                held, count = [], 0
        if held:
            yield (_stretch(path, file, held),)


def _stretch(path: Path, file: Readings, held: list[tuple[Complex, Real]]) -> Recording:
    impedance = np.concatenate([z for z, _ in held])
    beside = dict(zip(file.numbers, np.concatenate([numbers for _, numbers in held]).T, strict=True))
    held.clear()
    with within(str(path)):
        rebuilt = clock.rebuilt(len(impedance), beside.get(TIME), beside.get(STAMP))
    marks = blank(len(impedance)) | rebuilt.marks | sifted(impedance)
    if CLIPPED in beside:
        marks["clipped"] = beside[CLIPPED] == 1
    if VALID in beside:
        marks["invalid"] = beside[VALID] != 1
    source = Source(path.name, "CSV", rate_hz=rate_hz(rebuilt.time_s), notes=rebuilt.notes)
    return Recording(rebuilt.time_s, file.frequency_hz, impedance, marks, rebuilt.clock, source)
