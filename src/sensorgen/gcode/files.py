"""Files of G-code from strangers: opened as text, or refused with the reason."""

from collections.abc import Iterator
from pathlib import Path

from sensorgen.errors import BadInput

_MAGIC = {
    b"GCDE": "binary G-code of Prusa's; export it as plain text (in PrusaSlicer: Preferences, Supports binary G-code)",
    b"PK\x03\x04": "a zip archive, perhaps a 3MF; take the .gcode file out of it",
    b"\x1f\x8b": "packed by gzip; unpack it",
}
_PEEK = 1 << 16


def lines_of(path: Path) -> Iterator[str]:
    """Lines of a file of G-code, whatever ends them; bytes that are no UTF-8 become lone surrogates.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    BadInput
        It cannot be read, is empty, or holds something else than text.
    """
    try:
        with path.open("rb") as file:
            _refuse(path, file.read(_PEEK))
    except OSError as error:
        raise BadInput(f"cannot read {str(path)!r}: {error.strerror or error}") from None
    return _lines(path)


def _lines(path: Path) -> Iterator[str]:
    with path.open(encoding="utf-8", errors="surrogateescape") as file:
        yield from file


def _refuse(path: Path, head: bytes) -> None:
    for magic, what in _MAGIC.items():
        if head.startswith(magic):
            raise BadInput(f"{str(path)!r} is {what}")
    if not head.strip():
        raise BadInput(f"{str(path)!r} is empty; expected G-code")
    if b"\0" in head:
        raise BadInput(f"{str(path)!r} is no text: byte {head.index(0) + 1} is 0; expected G-code as plain text")
