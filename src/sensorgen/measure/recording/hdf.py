"""Read HDF5 files, MATLAB's 7.3 among them, as the same lists, dicts and arrays as MATLAB 5 files.

Only data in the file itself are read, where they stand: links of any kind are refused, and objects of other programs,
which may be pickles, are not numbers. MATLAB's arrays get MATLAB's shape.
"""

from collections.abc import Collection, Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput, library, within
from sensorgen.measure.recording.matfive import Split, characters
from sensorgen.measure.recording.spool import FileSpool

_DEEPEST = 12
_MOST_ITEMS = 2_000
_MOST_TEXT = 1 << 20  # bytes
_BLOCK = 1 << 20  # bytes of a dataset that are read at once
_MOST_CHUNK = 1 << 26  # bytes: a packed dataset is unpacked by whole chunks
_CLASS = "MATLAB_class"
_BROKEN = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError, OverflowError, MemoryError)


def variables(path: Path, wanted: Collection[str], spool: FileSpool) -> dict[str, Any]:
    """Read variables of a file.

    Parameters
    ----------
    path : Path
        The file.
    wanted : collection of str
        Names of variables; others are skipped unread.
    spool : FileSpool
        Where large arrays are copied to.

    Raises
    ------
    NotInstalled
        h5py is not installed.
    BadInput
        A file that is damaged, has links, has other data than numbers and text, or unpacks to more than memory and
        disk should hold.
    """
    h5py = library("h5py", "HDF5 and MATLAB 7.3 files need h5py: pip install h5py, or save with -v7")
    try:
        with h5py.File(path, "r", rdcc_nbytes=_MOST_CHUNK) as file:
            reader = _Reader(file, spool)
            return {name: reader.member(file, name, 0) for name in wanted if file.get(name, getlink=True)}
    except _BROKEN as error:
        reason = " ".join(str(error).split())[:200]
        raise BadInput(f"the HDF5 file is damaged or cut off: {reason}") from None


class _Reader:
    """Groups and datasets of a file, up to a depth and a number of items."""

    def __init__(self, file: Any, spool: FileSpool) -> None:
        import h5py

        self._h5, self._file, self._spool, self._left = h5py, file, spool, _MOST_ITEMS
        self._known: dict[int, Any] = {}  # by address in the file: many references may lead to one dataset

    def member(self, group: Any, name: str, depth: int) -> Any:
        """Content of a member of a group."""
        if not isinstance(group.get(name, getlink=True), self._h5.HardLink):  # a soft link may lead to an external one
            raise BadInput(f"{group.name.rstrip('/')}/{name}: a link; expected the data itself")
        return self._item(group[name], depth)

    def _item(self, item: Any, depth: int) -> Any:
        self._left -= 1
        if depth > _DEEPEST or self._left < 0:
            raise BadInput(f"{item.name}: groups within each other without end; expected a recording")
        if isinstance(item, self._h5.Group):
            return self._struct(item, depth)
        self._check(item)
        if (place := self._h5.h5o.get_info(item.id).addr) in self._known:
            return self._known[place]
        with within(item.name):
            self._spool.declare((item.size or 0) * item.dtype.itemsize, item.id.get_storage_size())
        if item.chunks and prod(item.chunks) * item.dtype.itemsize > _MOST_CHUNK:
            raise BadInput(f"{item.name}: chunks of {item.chunks} values; expected chunks up to {_MOST_CHUNK >> 20} MB")
        if self._refers(item):
            return self._referred(item, depth)
        self._known[place] = np.empty((0, 0)) if item.attrs.get("MATLAB_empty") else self._array(item)
        return self._known[place]

    def _check(self, item: Any) -> None:
        """Refuse what is no dataset of this file."""
        if not isinstance(item, self._h5.Dataset):
            raise BadInput(f"{item.name}: neither a group nor a dataset")
        if item.is_virtual or item.external:
            raise BadInput(f"{item.name}: its data lie in another file; expected them in this one")

    def _referred(self, item: Any, depth: int) -> list[Any]:
        """Contents that references lead to; HDF5's rows, one after the other, are MATLAB's columns."""
        if item.size > _MOST_ITEMS:
            raise BadInput(f"{item.name}: {item.size} references; expected up to {_MOST_ITEMS}")
        return [self._item(self._file[ref], depth + 1) for ref in np.asarray(item[()]).ravel() if ref]

    def _refers(self, item: Any) -> bool:
        return isinstance(item, self._h5.Dataset) and self._h5.check_ref_dtype(item.dtype) is self._h5.Reference

    def _struct(self, group: Any, depth: int) -> list[dict[str, Any]]:
        """Struct; an array of structs is a group whose fields are lists of references without a class."""
        fields = {name: self.member(group, name, depth + 1) for name in group}
        members = list(group.values())
        if members and all(self._refers(item) and _CLASS not in item.attrs for item in members):
            count = min(map(len, fields.values()))
            return [{name: values[i] for name, values in fields.items()} for i in range(count)]
        return [fields | {name: _attribute(group, name) for name in group.attrs if not name.startswith("MATLAB_")}]

    def _array(self, item: Any) -> Any:
        if self._is_complex(item.dtype):
            raw = self._numbers(item)
            return Split(*(_turned(item, raw[n]) for n in sorted(item.dtype.names, key=str.lower, reverse=True)))
        if self._h5.check_string_dtype(item.dtype):
            if item.size != 1 or item.dtype.itemsize > _MOST_TEXT:
                raise BadInput(f"{item.name}: {item.size} texts; expected one text, or numbers")
            return _decoded(np.asarray(item[()]).ravel()[0])
        if item.dtype.kind not in "iufcb":
            raise BadInput(f"{item.name}: data of type {item.dtype}; expected numbers, complex numbers or text")
        values = self._numbers(item)
        if item.attrs.get(_CLASS) in (b"char", "char"):
            if values.nbytes > _MOST_TEXT:
                raise BadInput(f"{item.name}: a text of {values.nbytes} bytes; expected up to {_MOST_TEXT}")
            return characters(values.ravel())
        return _turned(item, values)

    @staticmethod
    def _is_complex(kind: np.dtype[Any]) -> bool:
        """Test whether numbers have a real and an imaginary part, by their names."""
        names = kind.names or ()
        pair = {name.lower() for name in names} in ({"real", "imag"}, {"r", "i"})
        return pair and all(kind[name].kind in "iuf" for name in names)

    def _numbers(self, item: Any) -> NDArray[Any]:
        """Numbers of a dataset, read block by block."""
        if item.ndim > 3 or (item.ndim == 3 and item.dtype.itemsize * prod(item.shape[1:]) > _BLOCK):
            raise BadInput(f"{item.name}: an array of {item.ndim} axes; expected up to 2, or frames of up to 1 MB")
        if not item.size:
            return np.empty(item.shape, item.dtype)
        content = self._spool.held(np.ascontiguousarray(item[at]).tobytes() for at in _places(item))
        return np.frombuffer(content, item.dtype).reshape(item.shape)


def _turned(item: Any, values: NDArray[Any]) -> NDArray[Any]:
    """Numbers with MATLAB's rows as rows."""
    return values.T if _CLASS in item.attrs else values


def _attribute(group: Any, name: str) -> Any:
    if group.attrs.get_id(name).get_storage_size() > _MOST_TEXT:
        raise BadInput(f"{group.name}: attribute {name!r:.80} is larger than {_MOST_TEXT} bytes")
    value = group.attrs[name]
    return _decoded(value) if isinstance(value, bytes | str) else np.atleast_2d(np.asarray(value))


def _decoded(text: Any) -> str:
    return text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)


def _places(item: Any) -> Iterator[tuple[Any, ...]]:
    """Places in a dataset whose content, one after the other, is all of it: whole rows, or pieces of each row."""
    if item.ndim == 0:
        yield ()
        return
    row = item.dtype.itemsize * prod(item.shape[1:])
    if row <= _BLOCK:
        step = _BLOCK // row
        yield from ((slice(at, at + step),) for at in range(0, item.shape[0], step))
    else:
        step = _BLOCK // item.dtype.itemsize
        yield from ((k, slice(at, at + step)) for k in range(item.shape[0]) for at in range(0, item.shape[1], step))
