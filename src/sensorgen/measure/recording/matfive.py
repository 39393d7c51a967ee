"""MATLAB 5 files, either byte order, as plain lists, dicts and arrays.

A reader of its own because the file is a stranger's: nothing is allocated that the file's own bytes do not fill,
nothing is run, variables that nobody asked for are passed over, and what is wrong is said with its place. Struct arrays
come as lists of dicts and cell arrays as lists, both in MATLAB's order, also where they have one element only.
"""

import struct
import zlib
from collections.abc import Collection, Iterator
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput

MOST_BYTES = 1 << 31  # of a file, and of what it unpacks to
_HEADER = 128
_DEEPEST = 12
_MATRIX, _PACKED, _UTF8 = 14, 15, 16
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "latin-1", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _STRUCT, _OBJECT, _CHAR, _FIRST_NUMBER, _LAST_NUMBER = 1, 2, 3, 4, 6, 15
_COMPLEX, _LOGICAL = 0x0800, 0x0200


class _Element(NamedTuple):
    """A tagged piece of the file: its type, its bytes, and where they begin."""

    type: int
    data: memoryview
    place: int


def variables(content: bytes, wanted: Collection[str]) -> dict[str, Any]:
    """The variables of a file by their names.

    Parameters
    ----------
    content : bytes
        The whole file.
    wanted : collection of str
        Names; other variables are passed over unread.

    Returns
    -------
    dict
        Those of ``wanted`` that are there: numbers as arrays in MATLAB's shape, text as str, struct arrays as lists of
        dicts, cells as lists.

    Raises
    ------
    BadInput
        No MATLAB 5 file, or one that is cut off or damaged, with the byte at which that shows.
    """
    order = _byte_order(content)
    found: dict[str, Any] = {}
    for element in _elements(memoryview(content)[_HEADER:], order, _HEADER):
        reader, whole = _Matrix(order), element
        if element.type == _PACKED:
            whole = _unpacked(element, order)
        if whole.type != _MATRIX:
            raise _damaged(f"an array was expected, not data of type {whole.type}", element.place)
        with_place = f"inside the packed array at byte {element.place}" if element.type == _PACKED else ""
        try:
            name = reader.name(whole)
            if name in wanted:
                found[name] = reader.value(whole)
        except BadInput as error:
            raise error.within(with_place) from None
    return found


def _byte_order(content: bytes) -> str:
    if len(content) < _HEADER:
        raise BadInput(f"cut off within the header: {len(content)} bytes, where a MATLAB 5 file begins with {_HEADER}")
    mark = content[126:128]
    order = {b"IM": "<", b"MI": ">"}.get(mark)
    if order is None:
        raise BadInput(f"byte 126: {mark!r} is no byte order of a MATLAB 5 file; expected b'IM' or b'MI'")
    (version,) = struct.unpack(order + "H", content[124:126])
    if version != 0x0100:
        raise BadInput(f"byte 124: version {version:#06x} is not MATLAB 5 (0x0100); save with -v7 or -v7.3")
    return order


def _damaged(what: str, place: int) -> BadInput:
    return BadInput(f"byte {place}: the file is damaged or cut off: {what}")


def _elements(data: memoryview, order: str, place: int) -> Iterator[_Element]:
    """The tagged pieces of some bytes, one after the other."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise _damaged(f"{len(data) - at} bytes are left where a piece needs 8", place + at)
        kind, size = struct.unpack_from(order + "II", data, at)
        if kind >> 16:  # a short piece has its length beside its type, and its data within the tag
            kind, size, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
            if size > 4:
                raise _damaged(f"a short piece of {size} bytes; expected 4 at most", place + at)
        else:
            start = at + 8
            after = start + size if kind == _PACKED else start + (size + 7) // 8 * 8
        if start + size > len(data):
            raise _damaged(f"a piece of {size} bytes where {len(data) - start} are left", place + at)
        yield _Element(kind, data[start : start + size], place + start)
        at = after


def _unpacked(element: _Element, order: str) -> _Element:
    unpacker = zlib.decompressobj()
    try:
        content = unpacker.decompress(element.data, MOST_BYTES)
    except zlib.error as error:
        raise _damaged(f"a packed array does not unpack ({error})", element.place) from None
    if not unpacker.eof:
        if len(content) >= MOST_BYTES:
            raise BadInput(f"byte {element.place}: a packed array of more than {MOST_BYTES >> 30} GB; export a part")
        raise _damaged("a packed array ends too early", element.place)
    inside = next(_elements(memoryview(content), order, 0), None)
    if inside is None:
        raise _damaged("a packed array is empty", element.place)
    return inside


class _Matrix:
    """Arrays out of their pieces."""

    def __init__(self, order: str) -> None:
        self._order = order

    def name(self, element: _Element) -> str:
        """The variable's name; "" for kinds of data that keep it elsewhere."""
        pieces = list(zip(range(3), _elements(element.data, self._order, element.place), strict=False))
        return self._text(pieces[2][1]) if len(pieces) == 3 and pieces[2][1].type in _TEXTS else ""

    def value(self, element: _Element, depth: int = 0) -> Any:
        """What an array holds."""
        if not len(element.data):
            return np.empty((0, 0))
        if depth > _DEEPEST:
            raise _damaged(f"more than {_DEEPEST} arrays within each other", element.place)
        pieces = _elements(element.data, self._order, element.place)
        flags = self._numbers(self._next(pieces, element))
        if len(flags) < 1:
            raise _damaged("an array without flags", element.place)
        shape = self._shape(self._next(pieces, element))
        self._next(pieces, element)  # the name
        kind = int(flags[0]) & 0xFF
        if kind == _CELL:
            return self._members(pieces, prod(shape), element, depth)
        if kind in (_STRUCT, _OBJECT):
            return self._struct(pieces, prod(shape), element, depth, kind)
        if kind == _CHAR:
            return self._rows(self._next(pieces, element), shape)
        if not _FIRST_NUMBER <= kind <= _LAST_NUMBER:
            raise BadInput(f"byte {element.place}: an array of MATLAB class {kind}; expected numbers, text or structs")
        return self._array(pieces, element, shape, bool(int(flags[0]) & _COMPLEX))

    def _next(self, pieces: Iterator[_Element], element: _Element) -> _Element:
        found = next(pieces, None)
        if found is None:
            raise _damaged("an array lacks a part", element.place)
        return found

    def _shape(self, piece: _Element) -> tuple[int, ...]:
        shape = tuple(int(n) for n in self._numbers(piece))
        if len(shape) < 2 or min(shape) < 0:
            raise _damaged(f"an array of shape {shape}", piece.place)
        return shape

    def _numbers(self, piece: _Element) -> NDArray[Any]:
        name = _NUMBERS.get(piece.type)
        if name is None:
            raise _damaged(f"numbers were expected, not data of type {piece.type}", piece.place)
        kind = np.dtype(self._order + name)
        if len(piece.data) % kind.itemsize:
            raise _damaged(f"{len(piece.data)} bytes are no whole count of numbers", piece.place)
        return np.frombuffer(piece.data, kind)

    def _array(
        self, pieces: Iterator[_Element], element: _Element, shape: tuple[int, ...], is_complex: bool
    ) -> NDArray[Any]:
        parts = [self._numbers(self._next(pieces, element)) for _ in range(1 + is_complex)]
        for part in parts:
            if len(part) != prod(shape):
                told = " x ".join(map(str, shape))
                raise _damaged(f"an array of {told} with {len(part)} numbers", element.place)
        if not is_complex:
            return parts[0].reshape(shape, order="F")
        found = np.empty(shape, np.complex128, order="F")
        found.real, found.imag = (part.reshape(shape, order="F") for part in parts)
        return found

    def _members(self, pieces: Iterator[_Element], count: int, element: _Element, depth: int) -> list[Any]:
        found = []
        for _ in range(count):  # a count that is a lie runs out of pieces
            piece = self._next(pieces, element)
            if piece.type != _MATRIX:
                raise _damaged(f"an array was expected, not data of type {piece.type}", piece.place)
            found.append(self.value(piece, depth + 1))
        return found

    def _struct(
        self, pieces: Iterator[_Element], count: int, element: _Element, depth: int, kind: int
    ) -> list[dict[str, Any]]:
        if kind == _OBJECT:
            self._next(pieces, element)  # the class's name
        width = self._numbers(self._next(pieces, element))
        if len(width) != 1 or not 0 < int(width[0]) <= 64:
            raise _damaged("a struct whose field names have no length", element.place)
        listed, step = bytes(self._next(pieces, element).data), int(width[0])
        names = [listed[i : i + step].split(b"\0")[0].decode("latin-1") for i in range(0, len(listed), step)]
        if not names:  # fields are what fills the file: without them any count would pass
            return [{}]
        values = self._members(pieces, count * len(names), element, depth)
        return [dict(zip(names, values[i : i + len(names)], strict=True)) for i in range(0, len(values), len(names))]

    def _text(self, piece: _Element) -> str:
        """Text of any encoding; what does not decode shows as a replacement character."""
        encoding = _TEXTS[piece.type]
        if piece.type > _UTF8:
            encoding += "-le" if self._order == "<" else "-be"
        return bytes(piece.data).decode(encoding, "replace")

    def _rows(self, piece: _Element, shape: tuple[int, ...]) -> str:
        """Text, its rows one below the other."""
        if piece.type in _NUMBERS and piece.type > 2:
            text = "".join(chr(int(c)) if 0 <= c < 0xD800 else "\ufffd" for c in self._numbers(piece))
        elif piece.type in _TEXTS:
            text = self._text(piece)
        else:
            raise _damaged(f"text was expected, not data of type {piece.type}", piece.place)
        return "\n".join(text[i :: shape[0]] for i in range(shape[0])) if 1 < shape[0] <= len(text) else text
