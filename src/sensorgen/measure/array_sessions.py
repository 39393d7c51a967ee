"""Sessions that calibrate an array: readings of its elements, and references by bladder, press or force plate.

CSV: ``time_s``, a column for each element, and the load: ``pressure_kpa`` of all elements (a bladder);
``element`` with ``force_n`` or ``pressure_kpa`` of a press on it alone; else ``force_n`` of all (a person on a plate).
``rest`` is 1 without load, ``day`` counts days. NPZ and HDF5: ``reading`` (frames, elements), or of an array with a
design its frames, and the same names; ``element`` by number from 1, ``area_mm2`` of one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.errors import BadInput, within
from sensorgen.core.files import reading
from sensorgen.measure import csv_table
from sensorgen.measure.array_frames import BINARY, REFERENCES, marked, numbers, read, refuse_repeated, rising
from sensorgen.prediction.array.elements import ArraySession
from sensorgen.prediction.array.frames import at_rest, missing
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout

_OTHER = ("time_s", "rest", "frequency_hz", *REFERENCES)
_WORDS: Mapping[str, Callable[[Sequence[str]], np.ndarray]] = {"rest": marked, "element": np.array}
_AREA_MM2 = 100.0
_MOST = 0.5  # of the presses on a track
_N_PER_KPA_MM2 = 1e-3


def session(
    path: Path, number: float, *, area_mm2: float = _AREA_MM2, values: "Real | None" = None, names: Sequence[str] = ()
) -> ArraySession:  # fmt: skip
    """A session of a file.

    Parameters
    ----------
    path : Path
        CSV, NPZ or HDF5.
    number : float
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
        if values.ndim < 2 or not values.size:
            raise BadInput(
                f"readings of {values.ndim} dimensions; expected a row for each frame, elements side by side"
            )
        values = values.reshape(len(values), -1)
        return _session(path.stem, data, values, names, (number, area_mm2))


def of_frames(paths: Sequence[Path], model: ArrayModel, frequency_hz: "float | None" = None) -> list[ArraySession]:
    """Sessions of frames of an array with a design: C/C0 - 1 of its crossings, by the network where that counts.

    Raises
    ------
    BadInput
        As :func:`session`; no frame at rest; no frequency in a file, where none is given [Hz].
    """
    m, n = model.here.shape
    names, found = [f"r{i + 1}c{j + 1}" for i, j in np.ndindex(m, n)], []
    for k, path in enumerate(paths):
        frames = read(path, (m, n), frequency_hz)
        inverter = at_rest(model, ArrayReadout(frequency_hz=(frames.frequency_hz,)), frames.siemens[frames.rest])
        ratio, _, _ = inverter.planned(missing(frames.siemens))
        ratio = np.where(inverter.alive, ratio, np.nan).reshape(len(ratio), -1)
        one = session(path, k, area_mm2=model.pitch_area_m2 * 1e6, values=ratio - 1, names=names)
        carried = model.carried(np.nan_to_num(one.pressure_kpa)).reshape(one.pressure_kpa.shape)
        found.append(replace(one, pressure_kpa=np.where(np.isfinite(one.pressure_kpa), carried, np.nan)))
        refuse_swapped(found[-1], (m, n))
    return found


def refuse_swapped(of: ArraySession, shape: tuple[int, int]) -> None:
    """Refuse presses that most of the time are read by another row, or column, than the pressed one.

    Raises
    ------
    BadInput
        Wires are swapped; they are named.
    """
    known = np.isfinite(of.pressure_kpa)
    pressed = (known.sum(1) == 1) & (known & np.isfinite(of.reading)).any(1)  # a press on a dead one tells nothing
    if not pressed.any():
        return
    true, largest = (
        np.stack(np.unravel_index(np.nan_to_num(each[pressed], nan=-np.inf).argmax(1), shape))
        for each in (of.pressure_kpa, of.reading)
    )
    if words := swapped(true, largest):
        raise BadInput(f"{of.name}: {words}")


def swapped(pressed: Whole, largest: Whole) -> str:
    """Wires that are swapped, by presses that another row or column reads most of the time, in words; or "".

    Parameters
    ----------
    pressed, largest : (2, k) array
        Row and column of each press, and of its largest reading, from 0.
    """
    for letter, own, read_at in zip("rc", pressed, largest, strict=True):
        for track in np.unique(own[own != read_at]).tolist():
            at = read_at[own == track]
            other = int(np.bincount(at).argmax())
            if other != track and np.mean(at == other) > _MOST:
                return (
                    f"presses on {letter}{track + 1} are read at {letter}{other + 1}: wires swapped; "
                    "exchange them, or name the press right"
                )
    return ""


def _session(
    name: str, data: Mapping[str, np.ndarray], values: Real, names: Sequence[str], default: tuple[float, float]
) -> ArraySession:  # fmt: skip
    count = len(values)
    nothing = np.full(count, np.nan)

    def each(key: str, otherwise: Real) -> Real:
        found = np.asarray(data.get(key, otherwise))
        if found.shape[:1] != (count,) or (found.size != count and key != "pressure_kpa"):
            raise BadInput(f"{key} has {found.size} values; expected one for each of {count} frames")
        return found if key == "pressure_kpa" else found.reshape(count)

    if "time_s" not in data:
        raise BadInput("no time_s; expected the seconds of each frame: tare, memory and drift are by time")
    time_s = rising(each("time_s", nothing).astype(float))
    area, day = (_one(data, key, usual) for key, usual in (("area_mm2", default[1]), ("day", default[0])))
    if not 0 < area < np.inf:
        raise BadInput(f"area_mm2 is {area:g}; expected the area of an element, above 0")
    force, pressure = each("force_n", nothing).astype(float), each("pressure_kpa", nothing).astype(float)
    if "element" in data:
        of = _numbers_of(each("element", nothing), names, values.shape[1])
        known = np.where(np.isfinite(force), force / (area * _N_PER_KPA_MM2), pressure)
        free = np.where((of < 0) & (known == 0), 0.0, np.nan)  # a cover spreads a press: others are not known
        pressure = np.where(np.arange(values.shape[1]) == of[:, None], known[:, None], free[:, None])
        force = nothing
    if pressure.size not in (count, values.size):
        raise BadInput(f"pressure_kpa has {pressure.size} values; expected one for each frame, or for each element too")
    pressure = np.broadcast_to(pressure.reshape(count, -1), values.shape)
    rest = np.nan_to_num(each("rest", np.zeros(count)).astype(float)) != 0
    return ArraySession(name, day, time_s, values, rest, np.array(pressure), force, area, tuple(names))


def _one(data: Mapping[str, np.ndarray], key: str, usual: float) -> float:
    """A number of the whole session: the first that is one."""
    values = np.ravel(np.asarray(data.get(key, usual), float))
    values = values[np.isfinite(values)]
    return float(values[0]) if values.size else usual


def _numbers_of(words: np.ndarray, names: Sequence[str], count: int) -> np.ndarray:
    """Number of the pressed element of each frame, from 0 on; -1 of none."""
    known = {"": -1, "0": -1} | {str(k + 1): k for k in range(count)} | {name: k for k, name in enumerate(names)}
    found = [f"{word:g}" if isinstance(word, float) else str(word).strip() for word in words.tolist()]
    unknown = next((word for word in found if word not in known and word != "nan"), None)
    if unknown is not None:
        raise BadInput(f"element {unknown!r:.40}; expected a name of a column, or 1 to {count}")
    return np.array([known.get(word, -1) for word in found])


def _of_csv(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns of a table, and the names of its elements."""
    with csv_table.opened(str(path)) as table:
        refuse_repeated(table.names, {})
        names = [name for name in table.names if name and name not in _OTHER]
        if not names:
            raise BadInput("no readings; expected a column for each element")
        beside = [*({*table.names} & {*_OTHER} - {*_WORDS})]
        text = [*({*table.names} & {*_WORDS})]
        at = table.names.index
        blocks = list(table.blocks([*map(at, names), *map(at, beside)], [*map(at, text)]))
    values = np.concatenate([block.numbers for block in blocks])
    data = {"reading": values[:, : len(names)], **dict(zip(beside, values[:, len(names) :].T, strict=True))}
    for k, name in enumerate(text):
        data[name] = _WORDS[name]([row[k] for block in blocks for row in block.text])
    return data, names
