"""Check an input file before it is read: a regular file, of a sensible size, of no foreign format."""

from pathlib import Path

from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading

_HEAD = 2056  # bytes: HDF5 may begin at 2048
_FOREIGN = {
    b"PK\x03\x04": "a zip archive, as .xlsx and .npz are",
    b"\x1f\x8b": "packed with gzip",
    b"BZh": "packed with bzip2",
    b"\xfd7zXZ": "packed with xz",
    b"7z\xbc\xaf": "a 7z archive",
    b"\x93NUMPY": "a NumPy file, which may hold pickled objects",
    b"PAR1": "a Parquet file",
    b"SQLite format 3": "a database",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
    **{b"\x80" + bytes([protocol]): "a Python pickle, which could run anything" for protocol in (2, 3, 4, 5)},
}


def checked_head(path: Path, most_bytes: int, expected: str, *, foreign: bool = True) -> bytes:
    """First bytes of a file, after its checks.

    Parameters
    ----------
    path : Path
        The file.
    most_bytes : int
        Largest size [bytes].
    expected : str
        Expected content, for messages, as "a table as CSV".
    foreign : bool
        Whether to refuse formats that are known to be others.

    Raises
    ------
    BadInput
        A folder, a device, a missing, empty or large file, or one of a foreign format.
    """
    with reading(path):
        if path.exists() and not path.is_file():
            raise BadInput(f"{str(path)!r} is {'a folder' if path.is_dir() else 'no file'}; expected {expected}")
        size = path.stat().st_size
        if size > most_bytes:
            raise BadInput(f"{str(path)!r}: {size} bytes; expected at most {most_bytes}: split it")
        with path.open("rb") as file:
            head = file.read(_HEAD)
    if not head:
        raise BadInput(f"{str(path)!r} is empty; expected {expected}")
    for first, what in _FOREIGN.items():
        if foreign and head.startswith(first):
            raise BadInput(f"{str(path)!r} is {what}; expected {expected}")
    return head
