"""Recordings from CSV: tones as everywhere, and a time, a stamp or both beside them."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.readings import Readings, readings
from sensorgen.measure.recording import clock
from sensorgen.measure.recording.samples import Complex, Real, Recording, Source, blank, sifted

TIME, STAMP, CLIPPED, VALID = "time_s", "stamp_s", "clipped", "valid"
OWN = (TIME, STAMP, CLIPPED, VALID)


def recording(path: Path, source: Source, columns: Mapping[str, str]) -> Recording:
    """The recording in a CSV file.

    Parameters
    ----------
    path : Path
        The file.
    source : Source
        File and format.
    columns : mapping of str to str
        What the file calls its columns, to what we call them: ``time_s``, ``stamp_s``, ``clipped``, ``valid`` and
        ``re_ohm_1.1kHz``, ``im_ohm_1.1kHz`` for every tone.

    Raises
    ------
    BadInput
        As :func:`sensorgen.measure.readings.readings`; no time, or one that does not rise.
    """
    with readings(str(path), columns, OWN) as file:
        impedance, beside = _gathered(file)
    if TIME not in beside and STAMP not in beside:
        raise BadInput(
            f"no {TIME} and no {STAMP} (seconds since 1970) among the columns; if the file calls them otherwise, say "
            "so with a map of columns"
        )
    rebuilt = clock.rebuilt(len(impedance), beside.get(TIME), beside.get(STAMP))
    marks = blank(len(impedance)) | rebuilt.marks | sifted(impedance)
    if CLIPPED in beside:
        marks["clipped"] = beside[CLIPPED] == 1
    if VALID in beside:
        marks["invalid"] = beside[VALID] != 1
    rate = clock.rate_hz(rebuilt.time_s)
    where = replace(source, rate_hz=rate, notes=rebuilt.notes)
    return Recording(rebuilt.time_s, file.frequency_hz, impedance, marks, rebuilt.clock, where)


def _gathered(file: Readings) -> tuple[Complex, dict[str, Real]]:
    blocks = [(block.impedance_ohm, block.numbers) for block in file.blocks()]
    impedance = np.concatenate([z for z, _ in blocks])
    numbers = np.concatenate([values for _, values in blocks])
    return impedance, {name: np.ascontiguousarray(numbers[:, i]) for i, name in enumerate(file.numbers)}
