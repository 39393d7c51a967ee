"""Recognise the format of a recording by its first bytes, whatever its name, and read it."""

from collections.abc import Mapping
from pathlib import Path

from sensorgen.core.errors import BadInput, within
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.recording import hdf, matfive, table, tiepie
from sensorgen.measure.recording.matfive import MOST_BYTES
from sensorgen.measure.recording.samples import Recording, Source

_HDF = b"\x89HDF\r\n\x1a\n"
_HDF_PLACES = (0, 512, 1024, 2048)


def read(path: Path | str, columns: Mapping[str, str] | None = None) -> Recording:
    """Read a file of one recording.

    Parameters, errors and formats as :func:`read_all`; several lock-ins are refused as well.
    """
    recordings = read_all(path, columns)
    if len(recordings) > 1:
        raise BadInput(f"{path}: {len(recordings)} lock-ins; expected one: choose among those of read_all")
    return recordings[0]


def read_all(path: Path | str, columns: Mapping[str, str] | None = None) -> tuple[Recording, ...]:
    """Read the recordings of all lock-ins in a file; the format is recognised by the file's first bytes.

    Parameters
    ----------
    path : Path or str
        TiePieLCR's .mat (MATLAB 5, either byte order, or 7.3), an HDF5 file with the same variables, or CSV.
    columns : mapping of str to str, optional
        For CSV only: from the file's column names to sensorgen's, see :mod:`sensorgen.measure.recording.table`.

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
    try:
        if file_format == "CSV":
            return (table.recording(path, columns or {}),)
        with within(str(path)):
            if file_format == "MATLAB 5":
                tree = matfive.variables(path.read_bytes(), tiepie.WANTED)
            else:
                tree = hdf.variables(path, tiepie.WANTED)
            return tiepie.recordings(tree, Source(path.name, file_format))
    except OSError as error:
        raise BadInput(f"cannot read {str(path)!r}: {error.strerror or error}") from None
