"""Frames of an array in NPZ and CSV files, and sessions that calibrate it by bladder, press or force plate.

Sessions in CSV: ``time_s``, a column for each element, and the load: ``pressure_kpa`` of all elements (a bladder);
``element`` with ``force_n`` or ``pressure_kpa`` of a press on it alone; else ``force_n`` of all (a person on a plate).
``rest`` is 1 without load, ``day`` counts days. NPZ and HDF5: ``reading`` (frames, elements), or of an array with a
design its frames, and the same names; ``element`` by number from 1, ``area_mm2`` of one.
"""

import math
import re
import zipfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real, Whole
from sensorgen.core.errors import BadInput, within
from sensorgen.core.files import reading
from sensorgen.core.units import si
from sensorgen.measure import csv_table
from sensorgen.measure.csv_table import CsvTable
from sensorgen.prediction.array.elements import ArraySession
from sensorgen.prediction.array.frames import at_rest, missing
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.solvers.tracks import Readout

MOST_BYTES = 4_000_000_000
_TIME = re.compile(r"(t|time|timestamp)[ _(\[]*(s|ms|us|ns|min|h)?[)\]]?", re.IGNORECASE)
_CROSSING = re.compile(r"r(\d+)c(\d+)")
_TRUE = ("1", "1.0", "true")
KEYS = ("siemens", "capacitance_f")
REFERENCES = ("pressure_kpa", "force_n", "element", "day", "area_mm2")
_KNOWN = (*KEYS, "reading", "time_s", "rest", "frequency_hz", *REFERENCES)
_BESIDE = ("time_s", "frequency_hz", "day", "rest")
HDF = (".h5", ".hdf5", ".hdf")
BINARY = (".npz", *HDF)


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames of one recording.

    Attributes
    ----------
    siemens : (k, m, n) array
        Readings [S]; nan where one is missing or saturated. Of capacitances alone the real part is nan.
    time_s : (k,) array
        Of each frame; nan where none is known [s].
    rest : (k,) array of bool
        Frames with nothing on the array.
    frequency_hz : float
        Of the readings [Hz].
    pressure_kpa : (k, m, n) array or None
        True pressures, where the array was virtual [kPa].
    unused : tuple of str
        Names in the file that are not read.
    day : float
        Of the recording, as a calibration counts them; nan where none is known [d].
    """

    siemens: Complex
    time_s: Real
    rest: Mask
    frequency_hz: float
    pressure_kpa: "Real | None" = None
    unused: tuple[str, ...] = ()
    day: float = math.nan

    def at_rest(self) -> Complex:
        """Readings of the frames marked at rest; of all where none is marked [S]."""
        return self.siemens[self.rest] if self.rest.any() else self.siemens


def read(path: Path, shape: tuple[int, int], frequency_hz: float | None) -> Frames:
    """Frames of a file.

    Parameters
    ----------
    path : Path
        NPZ or HDF5 with ``siemens`` (frames, rows, columns), complex, or ``capacitance_f``, and perhaps ``time_s``,
        ``rest``, ``frequency_hz``; or CSV with a row per frame, columns ``r1c1`` ... [F], and perhaps the same; "-"
        for that on the standard input.
    shape : (int, int)
        Rows and columns of the array.
    frequency_hz : float, optional
        Of the readings, where the file does not have it; else that which it has to be [Hz].

    Raises
    ------
    BadInput
        A file that is neither, has frames of another size, times that do not rise or are not ``time_s``, or no
        frequency or another.
    """
    if str(path) == "-":
        return _joined(list(lots("-", shape, frequency_hz)))
    with reading(path):
        if path.stat().st_size > MOST_BYTES:
            raise BadInput(f"{path}: {path.stat().st_size / 1e9:.1f} GB; expected at most {MOST_BYTES / 1e9:g} GB")
        if path.suffix not in BINARY:
            return _joined(list(lots(str(path), shape, frequency_hz)))
        found, unused = numbers(path)
    with within(str(path)):
        _refuse_times(unused)
        return replace(_checked(found, shape, frequency_hz), unused=tuple(unused))


def _checked(found: dict[str, np.ndarray], shape: tuple[int, int], frequency_hz: float | None) -> Frames:
    key = next((key for key in KEYS if key in found), None)
    if key is None:
        raise BadInput(f"no readings; expected {' or '.join(KEYS)} by frame, row and column")
    values = found[key]
    if values.ndim != 3 or values.shape[1:] != shape or not len(values):
        sizes = " x ".join(map(str, values.shape))
        raise BadInput(f"{key} is {sizes}; expected frames x {shape[0]} rows x {shape[1]} columns of this array")
    hertz = _frequency(found, frequency_hz)
    if key == "capacitance_f":
        values = 2j * np.pi * hertz * values
        values.real = np.nan
    count = len(values)
    true = found.get("pressure_kpa", np.zeros(0))
    return Frames(
        values.astype(complex), rising(_each(found, "time_s", np.full(count, np.nan)).astype(float)),
        _rest(found, count), hertz, true if true.shape == values.shape else None, day=_one(found, "day", math.nan),
    )  # fmt: skip


def rising(time_s: Real) -> Real:
    """Times of one recording, each later than the one before, or none at all; BadInput of others [s]."""
    if not (np.diff(time_s) > 0).all() and not np.isnan(time_s).all():
        raise BadInput("time_s does not rise from each frame to the next; expected seconds of one session")
    return time_s


def _refuse_times(unused: Sequence[str]) -> None:
    """Refuse columns of time in another unit, or by another name."""
    if wrong := next((name for name in unused if _TIME.fullmatch(name)), None):
        raise BadInput(f"{wrong!r:.40} is not read; expected the time as time_s, in seconds")


def _frequency(found: dict[str, np.ndarray], given: float | None) -> float:
    own = np.ravel(found.get("frequency_hz", np.zeros(1)))
    own = np.unique(own[np.isfinite(own)])
    if own.size > 1:
        first, last = (si(float(own[k]), "Hz") for k in (0, -1))
        raise BadInput(f"frequency_hz is {first} to {last}; expected one frequency in all frames: one file of each")
    hertz = (float(own[0]) if own.size == 1 else 0.0) or given or 0.0
    if given and not math.isclose(hertz, given, rel_tol=1e-6):
        raise BadInput(f"frequency_hz is {si(hertz, 'Hz')}; expected {si(given, 'Hz')}, as given or of the readings")
    if not 0 < hertz < np.inf:
        raise BadInput("no frequency of the readings; expected frequency_hz in the file, or --frequency 10kHz")
    return hertz


def _each(found: Mapping[str, np.ndarray], name: str, default: Real) -> Real:
    """One value for each frame."""
    values = np.asarray(found.get(name, default))
    if values.shape[:1] != default.shape or values.size != default.size:
        raise BadInput(f"{name} has {values.size} values; expected one for each of {default.size} frames")
    return values.reshape(default.shape)


def _rest(found: Mapping[str, np.ndarray], count: int) -> Mask:
    """Frames that are marked at rest."""
    return np.asarray(np.nan_to_num(_each(found, "rest", np.zeros(count)).astype(float)) != 0)


def _one(found: Mapping[str, np.ndarray], name: str, usual: float) -> float:
    """A number of all frames: the first that is one."""
    values = np.ravel(np.asarray(found.get(name, usual), float))
    values = values[np.isfinite(values)]
    return float(values[0]) if values.size else usual


def numbers(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Numbers of an NPZ or HDF5 file by name, and the names that are not read."""
    if path.suffix in HDF:
        return _of_hdf(path)
    try:
        with np.load(path, allow_pickle=False) as data:
            found = {key: data[key] for key in data.files if data[key].dtype.kind in "bifuc"}
            return found, [key for key in data.files if key not in found or key not in _KNOWN]
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise BadInput(f"{path}: no NPZ file of numbers ({str(error)[:80]})") from None


def _of_hdf(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    from sensorgen.measure.recording import hdf
    from sensorgen.measure.recording.matfive import Split
    from sensorgen.measure.recording.spool import FileSpool

    with within(str(path)):
        found = hdf.variables(path, _KNOWN, FileSpool())
    for key, value in found.items():
        values = value.real + 1j * value.imag if isinstance(value, Split) else np.asarray(value)
        if values.dtype.kind not in "bifuc":
            raise BadInput(f"{path}: {key} is {values.dtype}; expected numbers")
        found[key] = values.ravel() if key not in (*KEYS, "reading", "pressure_kpa") else values
    return found, []


def lots(path: str, shape: tuple[int, int], frequency_hz: float | None) -> Iterator[Frames]:
    """Frames of a table as they come, lot by lot; "-" is the standard input. Parameters and errors as :func:`read`."""
    with csv_table.opened(path) as table, within(table.name):
        places = crossings(table.names, shape)
        unused = tuple(sorted({*table.names} - {*places, *_BESIDE, ""}))
        _refuse_times(unused)
        last = np.empty(0)
        for columns in _columns(table, [*places], _BESIDE):
            values = np.full((len(columns["reading"]), *shape), np.nan)
            values[:, *np.transpose(list(places.values()))] = columns["reading"]
            lot = replace(_checked({**columns, "capacitance_f": values}, shape, frequency_hz), unused=unused)
            last, frequency_hz = rising(np.append(last, lot.time_s))[-1:], lot.frequency_hz
            yield lot


def _columns(table: CsvTable, names: Sequence[str], beside: Collection[str]) -> Iterator[dict[str, np.ndarray]]:
    """Columns of a table, lot by lot: readings side by side, and those of other names that it has."""
    text = [name for name in table.names if name in beside and name in _WORDS]
    numbers = [name for name in table.names if name in beside and name not in _WORDS]
    places = [table.names.index(name) for name in (*names, *numbers, *text)]
    count = len(places) - len(text)
    for block in table.blocks(places[:count], places[count:]):
        words = zip(text, zip(*block.text, strict=True), strict=True)
        yield {
            "reading": block.numbers[:, : len(names)],
            **dict(zip(numbers, block.numbers[:, len(names) :].T, strict=True)),
            **{name: _WORDS[name](column) for name, column in words},
        }


def _joined(parts: Sequence[Frames]) -> Frames:
    siemens, time_s, rest = (np.concatenate([getattr(p, key) for p in parts]) for key in ("siemens", "time_s", "rest"))
    return replace(parts[0], siemens=siemens, time_s=time_s, rest=rest)


def marked(words: Sequence[str]) -> Mask:
    """Frames with a mark of 1 or true."""
    return np.array([word.strip().lower() in _TRUE for word in words])


def crossings(names: Sequence[str], shape: tuple[int, int]) -> dict[str, tuple[int, int]]:
    """Row and column of each name of a crossing."""
    found = {name: (int(m[1]) - 1, int(m[2]) - 1) for name in names if (m := _CROSSING.fullmatch(name))}
    refuse_repeated(names, found)
    wrong = [name for name, (i, j) in found.items() if not (0 <= i < shape[0] and 0 <= j < shape[1])]
    if wrong or not found:
        words = ", ".join(wrong[:3]) or "without any crossing"
        raise BadInput(f"columns {words}; expected r1c1 to r{shape[0]}c{shape[1]} of this array")
    return found


def refuse_repeated(names: Sequence[str], found: dict[str, tuple[int, int]]) -> None:
    """Refuse names that repeat, and two of one crossing."""
    times = Counter(found.get(name, name) for name in names if name)
    if repeated := [name for name in names if times[found.get(name, name)] > 1]:
        raise BadInput(f"columns {', '.join(repeated[:3])} repeat; expected each once")


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


def of_frames(
    paths: Sequence[Path], model: ArrayModel, frequency_hz: "float | None" = None, readout: Readout = "guarded",
    input_ohm: float = 50.0,
) -> list[ArraySession]:  # fmt: skip
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
        how = ArrayReadout(readout, input_ohm, (frames.frequency_hz,))
        inverter = at_rest(model, how, frames.siemens[frames.rest])
        ratio, _, _ = inverter.planned(missing(frames.siemens))
        ratio = np.where(inverter.own, ratio, np.nan).reshape(len(ratio), -1)
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
    apart = list[str]()
    for letter, own, read_at in zip("rc", pressed, largest, strict=True):
        for track in np.unique(own[own != read_at]).tolist():
            at = read_at[own == track]
            other = int(np.bincount(at).argmax())
            if other != track and np.mean(at == other) > _MOST:
                apart.append(f"{letter}{track + 1} are read at {letter}{other + 1}")
                break
    return f"presses on {', on '.join(apart)}: wires swapped; exchange them, or name the press right" if apart else ""


def _session(
    name: str, data: Mapping[str, np.ndarray], values: Real, names: Sequence[str], default: tuple[float, float]
) -> ArraySession:  # fmt: skip
    count = len(values)
    nothing = np.full(count, np.nan)
    if "time_s" not in data:
        raise BadInput("no time_s; expected the seconds of each frame: tare, memory and drift are by time")
    time_s = rising(_each(data, "time_s", nothing).astype(float))
    area, day = (_one(data, key, usual) for key, usual in (("area_mm2", default[1]), ("day", default[0])))
    if not 0 < area < np.inf:
        raise BadInput(f"area_mm2 is {area:g}; expected the area of an element, above 0")
    force = _each(data, "force_n", nothing).astype(float)
    pressure = np.asarray(data.get("pressure_kpa", nothing), float)
    if pressure.shape[:1] != (count,) or pressure.size not in (count, values.size):
        raise BadInput(f"pressure_kpa has {pressure.size} values; expected one for each frame, or for each element too")
    if "element" in data:
        of = _numbers_of(_each(data, "element", nothing), names, values.shape[1])
        known = np.where(np.isfinite(force), force / (area * _N_PER_KPA_MM2), pressure)
        free = np.where((of < 0) & (known == 0), 0.0, np.nan)  # a cover spreads a press: others are not known
        pressure = np.where(np.arange(values.shape[1]) == of[:, None], known[:, None], free[:, None])
        force = nothing
    rest = _rest(data, count)
    if "element" not in data and np.isfinite(pressure[rest]).any():
        pressure = pressure - np.nanmean(pressure[rest])  # the gauge's zero
    pressure = np.array(np.broadcast_to(pressure.reshape(count, -1), values.shape))
    return ArraySession(name, day, time_s, values, rest, pressure, force, area, tuple(names))


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
        parts = list(_columns(table, names, _OTHER))
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}, names
