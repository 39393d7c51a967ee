"""Sessions that calibrate an array: readings of its elements, and references by bladder, press or force plate.

CSV: ``time_s``, a column for each element, and what is known of the load: ``pressure_kpa`` of all elements (a bladder);
``element`` with ``force_n`` or ``pressure_kpa`` of a press on it alone; else ``force_n`` of all (a person on a plate).
``rest`` is 1 without load, ``day`` counts days. NPZ and HDF5: ``reading`` (frames, elements), or of an array with a
design its frames, and the same names; ``element`` by number from 1, ``area_mm2`` of one.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, within
from sensorgen.core.files import reading
from sensorgen.measure.array_frames import BINARY, REFERENCES, column, marked, numbers, table
from sensorgen.prediction.array.elements import Session

_OTHER = ("time_s", "rest", *REFERENCES)
_WORDS: Mapping[str, Callable[[Sequence[str]], np.ndarray]] = {"rest": marked, "element": np.array}
_AREA_MM2 = 100.0
_N_PER_KPA_MM2 = 1e-3


def session(
    path: Path, number: int, *, area_mm2: float = _AREA_MM2, values: "Real | None" = None, names: Sequence[str] = ()
) -> Session:  # fmt: skip
    """A session of a file.

    Parameters
    ----------
    path : Path
        CSV, NPZ or HDF5.
    number : int
        Of the session: its day where the file has none.
    area_mm2 : float
        Of an element, where the file has none [mm2].
    values : (k, n) array, optional
        In place of the file's readings, as C/C0 - 1 of frames; ``names`` are those of its elements.

    Raises
    ------
    BadInput
        No readings, or a reference that does not fit them.
    """
    with reading(path), within(str(path)):
        if path.suffix in BINARY:
            data = numbers(path)[0]
        else:
            data, own = _of_csv(path)
            names = names or own
        if values is None:
            if "reading" not in data:
                raise BadInput("no readings; expected a column for each element, or 'reading' (frames, elements)")
            values = np.asarray(data["reading"], float)
        values = values.reshape(len(values), -1)
        return _session(path.stem, data, values, names, (number, area_mm2))


def _session(
    name: str, data: Mapping[str, np.ndarray], values: Real, names: Sequence[str], default: tuple[int, float]
) -> Session:  # fmt: skip
    count = len(values)

    def each(key: str, otherwise: Real) -> Real:
        found = np.asarray(data.get(key, otherwise))
        if found.shape[:1] != (count,):
            raise BadInput(f"{key} has {len(np.atleast_1d(found))} values; expected one for each of {count} frames")
        return found

    time_s = each("time_s", np.arange(float(count))).astype(float)
    if not (np.diff(time_s) > 0).all():
        raise BadInput("time_s does not rise from each frame to the next; expected seconds of one session")
    area = float(np.ravel(data.get("area_mm2", default[1]))[0])
    nothing = np.full(count, np.nan)
    force, pressure = each("force_n", nothing).astype(float), each("pressure_kpa", nothing).astype(float)
    if "element" in data:
        of = _numbers_of(each("element", nothing), names, values.shape[1])
        known = np.where(np.isfinite(force), force / (area * _N_PER_KPA_MM2), pressure)
        others = np.where((of < 0) & (known != 0), np.nan, 0.0)
        pressure = np.where(np.arange(values.shape[1]) == of[:, None], known[:, None], others[:, None])
        force = nothing
    pressure = np.broadcast_to(pressure.reshape(count, -1), values.shape)
    day = float(np.ravel(data.get("day", default[0]))[0])
    return Session(
        name, day, time_s, values, each("rest", np.zeros(count)).astype(bool), np.array(pressure), force, area
    )


def _numbers_of(words: np.ndarray, names: Sequence[str], count: int) -> np.ndarray:
    """Number of the pressed element of each frame, from 0 on; -1 of none."""
    known = {name: k for k, name in enumerate(names)} | {str(k + 1): k for k in range(count)} | {"": -1, "0": -1}
    found = [f"{word:g}" if isinstance(word, float) else str(word).strip() for word in words.tolist()]
    unknown = next((word for word in found if word not in known and word != "nan"), None)
    if unknown is not None:
        raise BadInput(f"element {unknown!r:.40}; expected a name of a column, or 1 to {count}")
    return np.array([known.get(word, -1) for word in found])


def _of_csv(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns of a table, and the names of its elements."""
    words = table(path)
    names = [name for name in words if name and name not in _OTHER]
    if not names:
        raise BadInput("no readings; expected a column for each element")
    data: dict[str, np.ndarray] = {"reading": np.stack([column(words[name], path) for name in names], 1)}
    for key in words.keys() & set(_OTHER):
        data[key] = _WORDS[key](words[key]) if key in _WORDS else column(words[key], path)
    return data, names
