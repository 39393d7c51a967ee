"""Recordings of the bench: instrument files, their clocks and marks, and the rig's log joined with them.

The format of a file is recognised by its first bytes, whatever its name.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, within
from sensorgen.core.files import reading
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.recording import samples
from sensorgen.measure.recording.rig import Joined, RigLog, joined_all, rig
from sensorgen.measure.recording.samples import MOST_TONES, MOST_VALUES, Recording, RecordingClock, Source
from sensorgen.measure.recording.spool import MOST_BYTES, FileSpool

if TYPE_CHECKING:
    from sensorgen.measure.readings import Readings

__all__ = ["Joined", "Recording", "RecordingClock", "RigLog", "Source", "joined_all", "parts", "rig"]

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
    from sensorgen.measure.readings import readings

    with readings(str(path), columns, (TIME, STAMP, CLIPPED, VALID)) as file:
        if not {TIME, STAMP} & set(file.numbers):
            message = f"no column {TIME} and none {STAMP} (seconds since 1970); --column {TIME}=NAME says which it is"
            raise BadInput(f"{path}: {message}")
        if len(file.frequency_hz) > MOST_TONES:
            raise BadInput(f"{path}: {len(file.frequency_hz)} frequencies; expected up to {MOST_TONES}")
        most, blocks, count = MOST_VALUES // (len(file.frequency_hz) + 2), [], 0
        for block in file.blocks():
            blocks.append((block.impedance_ohm, block.numbers))
            count += len(block.rows)
            if count >= most:
                yield (_stretch(path, file, blocks),)
                blocks, count = [], 0
        if blocks:
            yield (_stretch(path, file, blocks),)


def _stretch(path: Path, file: "Readings", blocks: list[tuple[Complex, Real]]) -> Recording:
    impedance = np.concatenate([z for z, _ in blocks])
    beside = dict(zip(file.numbers, np.concatenate([numbers for _, numbers in blocks]).T, strict=True))
    blocks.clear()
    marks = {"clipped": beside[CLIPPED] == 1} if CLIPPED in beside else {}
    marks |= {"invalid": beside[VALID] != 1} if VALID in beside else {}
    with within(str(path)):
        return Recording.rebuilt(
            impedance, file.frequency_hz, beside.get(TIME), beside.get(STAMP), Source(path.name, "CSV"), **marks
        )


_HDF = b"\x89HDF\r\n\x1a\n"
_HDF_PLACES = (0, 512, 1024, 2048)


def parts(path: Path | str, columns: Mapping[str, str] | None = None) -> Iterator[tuple[Recording, ...]]:
    """Read the recordings of all lock-ins in a file, part after part; the format is recognised by the first bytes.

    A part ends at a pause, and where it is as long as memory should hold, so that a file of any length is read in
    little memory: filters and laws of drift hold within a part.

    Parameters
    ----------
    path : Path or str
        TiePieLCR's .mat (MATLAB 5, either byte order, or 7.3), an HDF5 file with the same variables, or CSV.
    columns : mapping of str to str, optional
        For CSV only: from the file's column names to sensorgen's, as ``time_s`` and ``stamp_s``.

    Yields
    ------
    tuple of Recording
        Of each lock-in.

    Raises
    ------
    BadInput
        A file that is missing, empty, damaged, truncated, too large or of another format, with the place in the file.
    MissingValue
        HDF5 without h5py.
    """
    path = Path(path)
    head = checked_head(path, MOST_BYTES, "a recording as .mat, HDF5 or CSV")
    matlab = head.startswith(b"MATLAB")
    file_format = "MATLAB 5" if matlab or head[126:128] in (b"IM", b"MI") else "CSV"
    if any(head[at : at + len(_HDF)] == _HDF for at in _HDF_PLACES):
        file_format = "MATLAB 7.3" if matlab else "HDF5"
    spool = FileSpool()
    stretches = recordings(path, columns or {}) if file_format == "CSV" else _stretches(path, file_format, spool)
    with reading(path):
        yield from samples.numbered(_relieved(path, stretches, spool))


def _stretches(path: Path, file_format: str, spool: FileSpool) -> Iterator[tuple[Recording, ...]]:
    from sensorgen.measure.recording import hdf, matfive, tiepie

    with within(str(path)):
        if file_format == "MATLAB 5":
            tree = matfive.variables(spool.file(path), tiepie.WANTED, spool)
        else:
            tree = hdf.variables(path, tiepie.WANTED, spool)
        yield from tiepie.recordings(tree, Source(path.name, file_format))


def _relieved(
    path: Path, stretches: Iterable[tuple[Recording, ...]], spool: FileSpool
) -> Iterator[tuple[Recording, ...]]:
    for stretch in stretches:
        spool.relieve()
        with within(str(path)):
            cut = samples.at_pauses(stretch)
        del stretch
        while cut:
            yield cut.pop(0)
