"""Read HDF5 files, MATLAB's 7.3 among them, as the same lists, dicts and arrays as MATLAB 5 files.

Only data in the file itself are read: links to other files are refused, and objects of other programs, which may be
pickles, are not numbers. MATLAB's arrays get MATLAB's shape.
"""

from collections.abc import Collection
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
    """Read variables of a file.

    Parameters
    ----------
    path : Path
        The file.
    wanted : collection of str
        Names of variables; others are skipped unread.

    Raises
    ------
    MissingValue
        h5py is not installed.
    BadInput
        A file that is damaged, links to other files, or has other data than numbers and text.
    """
    try:
        import h5py
    except ImportError:
        raise MissingValue("HDF5 and MATLAB 7.3 files need h5py: pip install h5py, or save with -v7") from None
    try:
        with h5py.File(path, "r") as file:
            reader = _Reader(file)
            return {name: reader.member(file, name, 0) for name in wanted if name in file}
    except _BROKEN as error:
        reason = " ".join(str(error).split())[:200]
        raise BadInput(f"the HDF5 file is damaged or cut off: {reason}") from None


class _Reader:
    """Groups and datasets of a file, up to a depth and a number of items."""

    def __init__(self, file: Any) -> None:
        import h5py

        self._h5, self._file, self._left = h5py, file, _MOST_ITEMS

    def member(self, group: Any, name: str, depth: int) -> Any:
        """Content of a member of a group."""
        if isinstance(group.get(name, getlink=True), self._h5.ExternalLink):
            raise BadInput(f"{group.name.rstrip('/')}/{name}: a link to another file; expected the data itself")
        return self._item(group[name], depth)

    def _item(self, item: Any, depth: int) -> Any:
        self._left -= 1
        if depth > _DEEPEST or self._left < 0:
            raise BadInput(f"{item.name}: groups within each other without end; expected a recording")
        if isinstance(item, self._h5.Group):
            return self._struct(item, depth)
        if not isinstance(item, self._h5.Dataset):
            raise BadInput(f"{item.name}: neither a group nor a dataset")
        if item.is_virtual or item.external:
            raise BadInput(f"{item.name}: its data lie in another file; expected them in this one")
        size = (item.size or 0) * item.dtype.itemsize
        if size > MOST_BYTES:
            raise BadInput(f"{item.name}: {size / 2**30:.3g} GB; expected up to {MOST_BYTES >> 30} GB")
        if self._refers(item):
            # HDF5 has the axes the other way round: its rows one after the other are MATLAB's columns
            return [self._item(self._file[ref], depth + 1) for ref in np.asarray(item[()]).ravel() if ref]
        return np.empty((0, 0)) if item.attrs.get("MATLAB_empty") else self._array(item)

    def _refers(self, item: Any) -> bool:
        return isinstance(item, self._h5.Dataset) and self._h5.check_ref_dtype(item.dtype) is self._h5.Reference

    def _struct(self, group: Any, depth: int) -> list[dict[str, Any]]:
        """Struct; an array of structs is a group whose fields are lists of references without a class."""
        fields = {name: self.member(group, name, depth + 1) for name in group}
        members = [group[name] for name in group]
        if members and all(self._refers(item) and _CLASS not in item.attrs for item in members):
            count = min(map(len, fields.values()))
            return [{name: values[i] for name, values in fields.items()} for i in range(count)]
        for name, value in group.attrs.items():
            if not name.startswith("MATLAB_"):
                text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
                fields[name] = text if isinstance(text, str) else np.atleast_2d(np.asarray(text))
        return [fields]

    def _array(self, item: Any) -> Any:
        names = item.dtype.names
        if names and {n.lower() for n in names} in ({"real", "imag"}, {"r", "i"}):
            raw = item[()]
            values = np.empty(raw.shape, np.complex128)
            values.real, values.imag = (raw[n] for n in sorted(names, key=str.lower, reverse=True))
        elif self._h5.check_string_dtype(item.dtype):
            texts = np.asarray(item[()]).ravel()
            if len(texts) != 1:
                raise BadInput(f"{item.name}: {len(texts)} texts; expected one text, or numbers")
            return texts[0].decode("utf-8", "replace") if isinstance(texts[0], bytes) else str(texts[0])
        elif item.dtype.kind in "iufcb":
            values = np.asarray(item[()])
        else:
            raise BadInput(f"{item.name}: data of type {item.dtype}; expected numbers, complex numbers or text")
        if _CLASS not in item.attrs:
            return values
        if item.attrs[_CLASS] in (b"char", "char"):
            return "".join(chr(int(c)) if 0 <= c < 0xD800 else "\ufffd" for c in values.ravel())
        return values.T
