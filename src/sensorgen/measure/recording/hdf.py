"""HDF5 files, MATLAB's 7.3 among them, as the same lists, dicts and arrays that MATLAB 5 files come as.

Only what lies in the file itself is read: links to other files are refused, and objects of other programs, which may be
pickles, are no numbers. MATLAB's arrays are turned back to MATLAB's shape.
"""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.measure.recording.matfive import MOST_BYTES

_DEEPEST = 12
_MOST_ITEMS = 2_000
_CLASS = "MATLAB_class"
_BROKEN = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError, OverflowError, MemoryError)


def variables(path: Path, wanted: Collection[str]) -> dict[str, Any]:
    """The variables of a file by their names.

    Parameters
    ----------
    path : Path
        The file.
    wanted : collection of str
        Names; others are passed over unread.

    Raises
    ------
    MissingValue
        h5py is not installed.
    BadInput
        A file that is damaged, links to other files, or holds something that is neither numbers nor text.
    """
    with _opened(path) as file:
        reader = _Reader(file)
        return {name: reader.member(file, name, 0) for name in wanted if name in file}


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        import h5py
    except ImportError:
        raise MissingValue("HDF5 and MATLAB 7.3 files need h5py: pip install h5py, or save with -v7") from None
    try:
        with h5py.File(path, "r") as file:
            yield file
    except _BROKEN as error:
        said = " ".join(str(error).split())[:200]
        raise BadInput(f"the HDF5 file is damaged or cut off: {said}") from None


class _Reader:
    """What groups and datasets hold."""

    def __init__(self, file: Any) -> None:
        import h5py

        self._h5, self._file, self._left = h5py, file, _MOST_ITEMS

    def member(self, group: Any, name: str, depth: int) -> Any:
        """What a group has under a name, which may be a link."""
        where = f"{group.name.rstrip('/')}/{name}"
        if isinstance(group.get(name, getlink=True), self._h5.ExternalLink):
            raise BadInput(f"{where}: a link to another file; expected the data itself")
        return self._item(group[name], depth)

    def _item(self, item: Any, depth: int) -> Any:
        self._left -= 1
        if depth > _DEEPEST or self._left < 0:
            raise BadInput(f"{item.name}: groups within each other without end; expected a recording")
        if isinstance(item, self._h5.Group):
            return self._struct(item, depth)
        if not isinstance(item, self._h5.Dataset):
            raise BadInput(f"{item.name}: neither a group nor a dataset")
        _check_size(item)
        if self._refers(item):
            # HDF5 has the axes the other way round: its rows one after the other are MATLAB's columns
            return [self._item(self._file[ref], depth + 1) for ref in np.asarray(item[()]).ravel() if ref]
        if item.attrs.get("MATLAB_empty"):
            return np.empty((0, 0))
        return self._numbers(item)

    def _refers(self, item: Any) -> bool:
        return isinstance(item, self._h5.Dataset) and self._h5.check_ref_dtype(item.dtype) is self._h5.Reference

    def _struct(self, group: Any, depth: int) -> list[dict[str, Any]]:
        """A struct; an array of them is a group whose every field is a list of references without a class."""
        fields = {name: self.member(group, name, depth + 1) for name in group}
        members = [group[name] for name in group]
        if members and all(self._refers(item) and _CLASS not in item.attrs for item in members):
            count = min(map(len, fields.values()))
            return [{name: values[i] for name, values in fields.items()} for i in range(count)]
        return [fields | {name: _attribute(v) for name, v in group.attrs.items() if not name.startswith("MATLAB_")}]

    def _numbers(self, item: Any) -> Any:
        names = item.dtype.names
        if names and {n.lower() for n in names} in ({"real", "imag"}, {"r", "i"}):
            raw = item[()]
            found = np.empty(raw.shape, np.complex128)
            found.real, found.imag = (raw[n] for n in sorted(names, key=str.lower, reverse=True))
        elif self._h5.check_string_dtype(item.dtype):
            return _text(item)
        elif item.dtype.kind in "iufcb":
            found = np.asarray(item[()])
        else:
            raise BadInput(f"{item.name}: data of type {item.dtype}; expected numbers, complex numbers or text")
        if _CLASS not in item.attrs:
            return found
        if item.attrs[_CLASS] in (b"char", "char"):
            return "".join(chr(int(c)) if 0 <= c < 0xD800 else "\ufffd" for c in found.ravel())
        return found.T


def _attribute(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else np.atleast_2d(np.asarray(value))


def _check_size(item: Any) -> None:
    if item.is_virtual or item.external:
        raise BadInput(f"{item.name}: its data lie in another file; expected them in this one")
    size = (item.size or 0) * item.dtype.itemsize
    if size > MOST_BYTES:
        raise BadInput(f"{item.name}: {size / 2**30:.3g} GB; expected up to {MOST_BYTES >> 30} GB")


def _text(item: Any) -> str:
    raw = np.asarray(item[()]).ravel()
    if len(raw) != 1:
        raise BadInput(f"{item.name}: {len(raw)} texts; expected one text, or numbers")
    return raw[0].decode("utf-8", "replace") if isinstance(raw[0], bytes) else str(raw[0])
