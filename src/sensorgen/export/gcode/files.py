"""Files of G-code from strangers: opened as text, or refused with the reason."""

import re
from collections.abc import Iterable
from pathlib import Path

from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading

_MAGIC = {
    b"GCDE": "binary G-code of Prusa's; export it as plain text (in PrusaSlicer: Preferences, Supports binary G-code)",
    b"PK\x03\x04": "a zip archive, perhaps a 3MF; take the .gcode file out of it",
    b"\x1f\x8b": "packed by gzip; unpack it",
    b"\xff\xfe": "text as UTF-16; save it as UTF-8",
    b"\xfe\xff": "text as UTF-16; save it as UTF-8",
}
_MARK = b"\xef\xbb\xbf"  # of UTF-8, which some editors write first
_PEEK = 1 << 16
_COMMAND = re.compile(rb"^[ \t]*(?:N[0-9]+[ \t]*)?[GMT]-?[0-9]", re.MULTILINE | re.IGNORECASE)


Source = Path | bytes | Iterable[str]


def text_of(source: Source) -> bytes:
    r"""Text of a file of G-code, or of lines; every line ends with a line feed, whatever ended it before.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The file, its content, or its lines with or without their ends; lone surrogates stand for bytes that are no
        UTF-8.

    Raises
    ------
    BadInput
        It cannot be read, is empty, or holds something else than text.

    Examples
    --------
    >>> text_of(["G28", "G1 X1\n"])
    b'G28\nG1 X1\n'
    """
    if isinstance(source, bytes):
        return _one_end(source)
    if not isinstance(source, Path):
        return b"".join(_one_end(line.encode("utf-8", "surrogateescape") or b"\n") for line in source)
    with reading(source):
        text = source.read_bytes()
    _refuse(source, text[:_PEEK])
    text = _one_end(text.removeprefix(_MARK))
    if not _COMMAND.search(text):
        first = text.strip().partition(b"\n")[0].decode("utf-8", "replace")
        raise BadInput(f"{str(source)!r} is no G-code: no line has a command; the first says {first[:60]!r}")
    return text


def _one_end(text: bytes) -> bytes:
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return text if text.endswith(b"\n") or not text else text + b"\n"


def _refuse(path: Path, head: bytes) -> None:
    for magic, what in _MAGIC.items():
        if head.startswith(magic):
            raise BadInput(f"{str(path)!r} is {what}")
    if not head.strip():
        raise BadInput(f"{str(path)!r} is empty; expected G-code")
    if b"\0" in head:
        raise BadInput(f"{str(path)!r} is no text: byte {head.index(0) + 1} is 0; expected G-code as plain text")
