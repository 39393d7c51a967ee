"""Frames into a file as they come: CSV or HDF5 at once, NPZ at the end from a file beside it; memory does not grow."""

from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.core.files import reading

_HDF = (".h5", ".hdf5", ".hdf")
_CHUNK = 64  # frames
_COMPLEX = np.complex64  # seven digits, as of the stream


class FrameFile(Protocol):
    """File of frames."""

    def add(self, siemens: Complex, time_s: Real, rest: Mask) -> None:
        """Append frames, (k, m, n)."""

    def close(self) -> None:
        """Complete the file."""


def _part(path: Path) -> Path:
    """File with the frames of an NPZ until it is packed; what a killed run leaves."""
    return path.with_name(path.name + ".part")


def recorder(path: Path, shape: tuple[int, int], frequency_hz: float) -> FrameFile:
    """A new file of frames, of the kind that its name ends in.

    Raises
    ------
    BadInput
        The file exists, or its name ends otherwise.
    MissingValue
        HDF5 without h5py.
    """
    if there := [one for one in (path, _part(path)) if one.exists()]:
        raise BadInput(f"{there[0]} exists; expected a new name: recordings are not overwritten")
    kind = (
        _Csv if path.suffix == ".csv" else _Hdf if path.suffix in _HDF else _Packed if path.suffix == ".npz" else None
    )
    if kind is None:
        raise BadInput(f"{path}: expected a name that ends in .csv, .h5 or .npz")
    with reading(path):
        return kind(path, shape, frequency_hz)


class _Csv:
    """CSV of capacitances."""

    def __init__(self, path: Path, shape: tuple[int, int], frequency_hz: float) -> None:
        self._file, self._hertz = path.open("w", encoding="utf-8"), frequency_hz
        names = [f"r{i + 1}c{j + 1}" for i, j in np.ndindex(shape)]
        self._file.write(",".join(["time_s", "rest", "frequency_hz", *names]) + "\n")

    def add(self, siemens: Complex, time_s: Real, rest: Mask) -> None:
        farad = siemens.imag.reshape(len(siemens), -1) / (2 * np.pi * self._hertz)
        for row, t, free in zip(farad.tolist(), time_s.tolist(), rest.tolist(), strict=True):
            words = ("" if value != value else f"{value:.7g}" for value in row)
            self._file.write(",".join([f"{t:.6f}", f"{free:d}", f"{self._hertz:.12g}", *words]) + "\n")
        self._file.flush()

    def close(self) -> None:
        self._file.close()


class _Hdf:
    """HDF5 that grows."""

    def __init__(self, path: Path, shape: tuple[int, int], frequency_hz: float) -> None:
        try:
            import h5py
        except ImportError:
            raise MissingValue("HDF5 needs h5py: pip install h5py, or record as .csv or .npz") from None
        self._file = h5py.File(path, "w")
        self._file["frequency_hz"] = frequency_hz
        for name, dtype, part in (("siemens", _COMPLEX, shape), ("time_s", float, ()), ("rest", np.uint8, ())):
            self._file.create_dataset(name, (0, *part), dtype, maxshape=(None, *part), chunks=(_CHUNK, *part))

    def add(self, siemens: Complex, time_s: Real, rest: Mask) -> None:
        for name, values in (("siemens", siemens), ("time_s", time_s), ("rest", rest)):
            data: Any = self._file[name]
            data.resize(len(data) + len(values), 0)
            data[len(data) - len(values) :] = values
        self._file.flush()

    def close(self) -> None:
        self._file.close()


class _Packed:
    """NPZ, packed at the end; until then frames are in a file beside it."""

    def __init__(self, path: Path, shape: tuple[int, int], frequency_hz: float) -> None:
        self._path, self._part, self._hertz = path, _part(path), frequency_hz
        self._type = np.dtype([("time_s", float), ("rest", np.uint8), ("siemens", _COMPLEX, shape)])
        self._file: IO[bytes] = self._part.open("wb")

    def add(self, siemens: Complex, time_s: Real, rest: Mask) -> None:
        rows = np.empty(len(siemens), self._type)
        rows["time_s"], rows["rest"], rows["siemens"] = time_s, rest, siemens
        self._file.write(rows.tobytes())
        self._file.flush()

    def close(self) -> None:
        if self._file.closed:
            return
        self._file.close()
        if self._part.stat().st_size:
            rows = np.memmap(self._part, self._type, "r")
            fields: dict[str, Any] = {name: rows[name] for name in self._type.names or ()}
            np.savez(self._path, frequency_hz=self._hertz, **fields)
            del rows, fields
        with suppress(OSError):
            self._part.unlink()
