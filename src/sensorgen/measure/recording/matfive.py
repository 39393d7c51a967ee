"""Read MATLAB 5 files, either byte order, as lists, dicts and arrays.

The reader is our own because recordings come from other people's machines: ``scipy.io.loadmat`` crashed the interpreter
(segmentation fault) on mutations of a real recording. Here nothing is allocated that the file's own bytes do not fill,
nothing is run, variables that were not asked for stay packed, and every error names the byte. Struct arrays are lists
of dicts and cell arrays are lists, both in MATLAB's order, also with one element only.
"""

import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import chain, islice
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput, within
from sensorgen.measure.recording.spool import FileSpool

_HEADER = 128
_DEEPEST = 12
_MOST_ARRAYS = 20_000  # of a file: each takes memory of its own, also an empty one
_MOST_TEXT = 1 << 20  # bytes of a text, or of the names of a struct's fields
_MOST_AXES = 32
_NAMED_WITHIN = 4096  # bytes of a packed array in which its name comes
_BLOCK = 1 << 20
_MATRIX, _PACKED, _UTF8 = 14, 15, 16
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "latin-1", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CELL, _STRUCT, _OBJECT, _CHAR, _FIRST_NUMBER, _LAST_NUMBER = 1, 2, 3, 4, 6, 15
_COMPLEX, _LOGICAL = 0x0800, 0x0200


@dataclass(frozen=True, eq=False)
class Split:
    """A complex array whose two parts lie apart in the file.

    Attributes
    ----------
    real, imag : array
        Parts, of one shape.
    """

    real: NDArray[Any]
    imag: NDArray[Any]
    dtype = np.dtype(np.complex128)

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each axis."""
        return self.real.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.real.ndim

    @property
    def size(self) -> int:
        """Number of values."""
        return self.real.size


class _Element(NamedTuple):
    """A tagged data element of the file: type, content, and position of the content."""

    type: int
    data: memoryview
    offset: int


def variables(content: bytes | memoryview, wanted: Collection[str], spool: FileSpool) -> dict[str, Any]:
    """Read variables of a file.

    Parameters
    ----------
    content : bytes
        The whole file.
    wanted : collection of str
        Names of variables; others are skipped unread.
    spool : FileSpool
        Where packed variables are unpacked to.

    Returns
    -------
    dict
        Variables of ``wanted`` in the file: numbers as arrays in MATLAB's shape, complex ones as :class:`Split`, text
        as str, struct arrays as lists of dicts, cells as lists.

    Raises
    ------
    BadInput
        No MATLAB 5 file, or a truncated or damaged one, with the byte; one that unpacks to more than memory and disk
        should hold.
    """
    order = _byte_order(bytes(content[:_HEADER]))
    values: dict[str, Any] = {}
    budget = iter(range(_MOST_ARRAYS))
    for element in _elements(memoryview(content)[_HEADER:], order, _HEADER):
        packed = element.type == _PACKED
        if packed and (_packed_name(element, order) or next(iter(wanted))) not in wanted:
            continue
        array = _unpacked(element, order, spool) if packed else element
        if array.type != _MATRIX:
            raise _damaged(f"an array was expected, not data of type {array.type}", element.offset)
        with within(f"inside the packed array at byte {element.offset}" if packed else ""):
            name = _name(array.data, order, array.offset)
            if name in wanted:
                values[name] = _Array(array, order, budget).value()
    return values


def _name(data: memoryview, order: str, offset: int) -> str:
    """Name of an array; "" where it is stored elsewhere, as some classes do."""
    pieces = list(islice(_elements(data, order, offset), 3))
    return _text(pieces[2], order) if len(pieces) == 3 and pieces[2].type in _TEXTS else ""


def _packed_name(element: _Element, order: str) -> str:
    """Name of a packed array by its first bytes; "" where they do not say."""
    try:
        begin = zlib.decompressobj().decompress(element.data[:_NAMED_WITHIN], _NAMED_WITHIN)
        return _name(memoryview(begin)[8:], order, 0) if begin[:4] == struct.pack(order + "I", _MATRIX) else ""
    except (zlib.error, BadInput):
        return ""


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


def _damaged(what: str, offset: int) -> BadInput:
    return BadInput(f"byte {offset}: the file is damaged or cut off: {what}")


def _elements(data: memoryview, order: str, offset: int) -> Iterator[_Element]:
    """Tagged data elements, one after the other."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise _damaged(f"{len(data) - at} bytes are left where an element needs 8", offset + at)
        kind, size = struct.unpack_from(order + "II", data, at)
        if kind >> 16:  # a short element has its length beside its type, and its data within the tag
            kind, size, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
            if size > 4:
                raise _damaged(f"a short element of {size} bytes; expected 4 at most", offset + at)
        else:
            start = at + 8
            after = start + size if kind == _PACKED else start + (size + 7) // 8 * 8
        if start + size > len(data):
            raise _damaged(f"an element of {size} bytes where {len(data) - start} are left", offset + at)
        yield _Element(kind, data[start : start + size], offset + start)
        at = after


def _unpacked(element: _Element, order: str, spool: FileSpool) -> _Element:
    blocks = _inflated(element)
    begin = next(blocks, b"")
    if len(begin) < 8:
        raise _damaged("a packed array is empty" if not begin else "a packed array ends too early", element.offset)
    kind, size = struct.unpack_from(order + "II", begin)
    declared = 8 if kind >> 16 else 8 + size
    with within(f"byte {element.offset}"):
        spool.declare(declared, len(element.data))
    content = spool.held(_as_declared(begin, blocks, declared, element.offset))
    return next(_elements(content, order, 0))


def _inflated(element: _Element) -> Iterator[bytes]:
    """Content of a packed array, block by block."""
    unpacker = zlib.decompressobj()
    try:
        for at in range(0, len(element.data), _BLOCK):
            packed: bytes | memoryview = element.data[at : at + _BLOCK]
            while len(packed) and not unpacker.eof:
                if block := unpacker.decompress(packed, _BLOCK):
                    yield block
                packed = unpacker.unconsumed_tail
    except zlib.error as error:
        raise _damaged(f"a packed array does not unpack ({error})", element.offset) from None
    if not unpacker.eof:
        raise _damaged("a packed array ends too early", element.offset)


def _as_declared(begin: bytes, blocks: Iterator[bytes], declared: int, offset: int) -> Iterator[bytes]:
    """Blocks up to the size that the array declares, and a block more, so that its checksum is read."""
    size = 0
    for block in chain([begin], blocks):
        size += len(block)
        if size > declared + _BLOCK:
            raise _damaged(f"a packed array unpacks to more than the {declared} bytes that it declares", offset)
        yield block


def _text(piece: _Element, order: str) -> str:
    """Text of any encoding, with replacement characters where it does not decode."""
    encoding = _TEXTS[piece.type]
    if piece.type > _UTF8:
        encoding += "-le" if order == "<" else "-be"
    return bytes(piece.data).decode(encoding, "replace")


def characters(codes: NDArray[Any]) -> str:
    """Text of numbers, with replacement characters where they are none."""
    return "".join(chr(int(c)) if 0 <= c < 0xD800 else "\ufffd" for c in codes)


class _Array:
    """An array element and its sub-elements, read one after the other."""

    def __init__(self, element: _Element, order: str, budget: Iterator[int], depth: int = 0) -> None:
        self._element, self._order, self._budget, self._depth = element, order, budget, depth
        self._pieces = _elements(element.data, order, element.offset)

    def value(self) -> Any:
        """Content of the array."""
        if next(self._budget, None) is None:
            raise BadInput(f"byte {self._element.offset}: more than {_MOST_ARRAYS} arrays; expected a recording")
        if not len(self._element.data):
            return np.empty((0, 0))
        if self._depth > _DEEPEST:
            raise self._damaged(f"more than {_DEEPEST} arrays within each other")
        flags, shape = self._head()
        kind = int(flags[0]) & 0xFF
        if kind == _CELL:
            return self._members(prod(shape))
        if kind in (_STRUCT, _OBJECT):
            return self._struct(prod(shape), kind)
        if kind == _CHAR:
            return self._characters(shape[0])
        if not _FIRST_NUMBER <= kind <= _LAST_NUMBER:
            place = f"byte {self._element.offset}"
            raise BadInput(f"{place}: an array of MATLAB class {kind}; expected numbers, text or structs")
        real = self._matrix(shape)
        return Split(real, self._matrix(shape)) if int(flags[0]) & _COMPLEX else real

    def _head(self) -> tuple[Any, tuple[int, ...]]:
        """Flags and shape of the array, whose name is passed over."""
        flags = self._numbers()
        if len(flags) < 1:
            raise self._damaged("an array without flags")
        shape = tuple(int(n) for n in self._numbers()[: _MOST_AXES + 1])
        if not 2 <= len(shape) <= _MOST_AXES or min(shape) < 0:
            raise self._damaged(f"an array of shape {shape}")
        self._next()  # the name
        return flags, shape

    def _damaged(self, what: str) -> BadInput:
        return _damaged(what, self._element.offset)

    def _next(self) -> _Element:
        piece = next(self._pieces, None)
        if piece is None:
            raise self._damaged("an array lacks a part")
        return piece

    def _numbers(self, piece: _Element | None = None) -> NDArray[Any]:
        piece = piece or self._next()
        name = _NUMBERS.get(piece.type)
        if name is None:
            raise _damaged(f"numbers were expected, not data of type {piece.type}", piece.offset)
        kind = np.dtype(self._order + name)
        if len(piece.data) % kind.itemsize:
            raise _damaged(f"{len(piece.data)} bytes are no whole count of numbers", piece.offset)
        return np.frombuffer(piece.data, kind)

    def _matrix(self, shape: tuple[int, ...]) -> NDArray[Any]:
        numbers = self._numbers()
        if len(numbers) != prod(shape):
            raise self._damaged(f"an array of {' x '.join(map(str, shape))} with {len(numbers)} numbers")
        return numbers.reshape(shape, order="F")

    def _short(self, piece: _Element) -> memoryview:
        if len(piece.data) > _MOST_TEXT:
            raise BadInput(f"byte {piece.offset}: a text of {len(piece.data)} bytes; expected up to {_MOST_TEXT}")
        return piece.data

    def _members(self, count: int) -> list[Any]:
        members = []
        for _ in range(count):  # a false count runs out of elements
            piece = self._next()
            if piece.type != _MATRIX:
                raise _damaged(f"an array was expected, not data of type {piece.type}", piece.offset)
            members.append(_Array(piece, self._order, self._budget, self._depth + 1).value())
        return members

    def _struct(self, count: int, kind: int) -> list[dict[str, Any]]:
        if kind == _OBJECT:
            self._next()  # the class's name
        width = self._numbers()
        if len(width) != 1 or not 0 < int(width[0]) <= 64:
            raise self._damaged("a struct whose field names have no length")
        piece, step = self._next(), int(width[0])
        listed = bytes(self._short(piece))
        names = [listed[i : i + step].split(b"\0")[0].decode("latin-1") for i in range(0, len(listed), step)]
        if not names:  # only fields take bytes of the file: without them any count would pass
            return [{}]
        values = self._members(count * len(names))
        return [dict(zip(names, values[i : i + len(names)], strict=True)) for i in range(0, len(values), len(names))]

    def _characters(self, rows: int) -> str:
        """Text; the rows of a matrix of characters one below the other."""
        piece = self._next()
        self._short(piece)
        if piece.type in _NUMBERS and piece.type > 2:
            text = characters(self._numbers(piece))
        elif piece.type in _TEXTS:
            text = _text(piece, self._order)
        else:
            raise _damaged(f"text was expected, not data of type {piece.type}", piece.offset)
        return "\n".join(text[i::rows] for i in range(rows)) if 1 < rows <= len(text) else text
