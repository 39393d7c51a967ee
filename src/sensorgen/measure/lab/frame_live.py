"""Array live: frames from a device into a file and a bounded queue, and the page with their maps.

CSV and HDF5 are written at once, NPZ at the end from a file beside it; memory does not grow.

A thread reads and records every frame. Frames that wait for their inversion are few: older ones are dropped for newer
ones, and counted.
"""

import json
import threading
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real, Whole
from sensorgen.core.errors import BadInput, library
from sensorgen.core.files import reading
from sensorgen.measure.array_frames import HDF, swapped
from sensorgen.measure.lab.devices import Clock, DeviceFault, FrameMeter
from sensorgen.measure.lab.live import LiveView

if TYPE_CHECKING:
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.live import LiveMaps
    from sensorgen.prediction.array.model import ArrayModel

PRESS_FRAMES = 20  # under load, by which a known press is compared
_SIGMAS = 5.0  # pressure over its standard error from which on a frame is loaded [-]
_CHUNK = 64  # frames
_COMPLEX = np.complex64  # seven digits, as of the stream


def _part(path: Path) -> Path:
    """File with the frames of an NPZ until it is packed; what a killed run leaves."""
    return path.with_name(path.name + ".part")


def recorder(path: Path, shape: tuple[int, int], frequency_hz: float) -> "FrameFile":
    """A new file of frames, of the kind that its name ends in.

    Raises
    ------
    BadInput
        The file exists, or its name ends otherwise.
    NotInstalled
        HDF5 without h5py.
    """
    if there := [one for one in (path, _part(path)) if one.exists()]:
        raise BadInput(f"{there[0]} exists; expected a new name: recordings are not overwritten")
    kind = _Csv if path.suffix == ".csv" else _Hdf if path.suffix in HDF else _Packed if path.suffix == ".npz" else None
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
        h5py = library("h5py", "HDF5 needs h5py: pip install h5py, or record as .csv or .npz")
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


FrameFile = _Csv | _Hdf | _Packed
REST_S = 1.0  # that a command marks as unloaded
_WAITING = 128  # frames
_IDLE_S = 0.005


@dataclass(eq=False)
class FrameFeed:
    """Frames of a device.

    Attributes
    ----------
    meter : FrameMeter
        Identified.
    clock : Clock
        By which it waits.
    recorder : FrameFile, optional
        Of every frame while ``recording``.
    paused : bool
        True while nothing is inverted and shown; recording goes on.
    unloaded_s : float
        From the next frame on nothing is on the array for so long, as the operator says [s].
    counts : dict
        Frames that came, were lost, damaged, dropped for newer ones, recorded; saturated readings.
    fault : Exception, optional
        That has ended it.
    """

    meter: FrameMeter
    clock: Clock
    recorder: FrameFile | None = None
    unloaded_s: float = 0.0
    recording: bool = True
    paused: bool = False
    fault: "Exception | None" = None
    counts: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys(("frames", "lost", "damaged", "saturated", "dropped", "recorded"), 0)
    )
    _waiting: "deque[tuple[Complex, float, bool]]" = field(default_factory=lambda: deque(maxlen=_WAITING))
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _over: threading.Event = field(default_factory=threading.Event)
    _until_s: float = -np.inf

    def step(self) -> int:
        """Read and record what has come; number of frames."""
        lot = self.meter.read()
        count = len(lot.time_s)
        with self._lock:
            if count and self.unloaded_s:
                self._until_s, self.unloaded_s = lot.time_s[0] + self.unloaded_s, 0.0
            rest = lot.time_s < self._until_s
            recorded = count if self.recorder and self.recording else 0
            if self.recorder and recorded:
                self.recorder.add(lot.siemens, lot.time_s, rest)
            dropped = max(len(self._waiting) + count - _WAITING, 0)
            self._waiting.extend(zip(lot.siemens, lot.time_s.tolist(), rest.tolist(), strict=True))
            for name, more in zip(
                self.counts, (count, lot.lost, lot.damaged, lot.saturated, dropped, recorded), strict=True
            ):
                self.counts[name] += more
        return count

    def taken(self) -> tuple[Complex, Real, Mask]:
        """Frames that wait."""
        with self._lock:
            waiting = list(self._waiting)
            self._waiting.clear()
        siemens, time_s, rest = zip(*waiting, strict=True) if waiting else ((), (), ())
        return np.array(siemens).reshape(-1, *self.meter.shape), np.array(time_s), np.array(rest, bool)

    def obey(self, commands: Iterable[str]) -> None:
        """Carry out commands of the page."""
        for name in commands:
            if name in ("pause", "resume"):
                self.paused = name == "pause"
            elif name == "rest":
                self.unloaded_s = REST_S
            elif name == "record":
                self.recording = not self.recording
            else:
                self.stop()

    def run(self) -> None:
        """Read until it is stopped, or a fault."""
        try:
            while not self._over.is_set():
                if not self.step():
                    self.clock.wait_until(self.clock.now() + _IDLE_S)
        except OSError as error:
            self.fault = DeviceFault(f"recording: {error.strerror or error}; record on another disk")
        except Exception as error:  # raised where the frames are taken
            self.fault = error

    @property
    def over(self) -> bool:
        """True once it is stopped."""
        return self._over.is_set()

    def stop(self) -> None:
        """End :meth:`run`."""
        self._over.set()


@dataclass(eq=False)
class NamedPress:
    """The first press on an array, on a crossing that the operator names: another that reads it shows swapped wires.

    Attributes
    ----------
    at : (int, int)
        Row and column, from 0.
    """

    at: tuple[int, int]
    _read: "list[Whole]" = field(default_factory=list)

    def take(self, maps: "PressureMaps | None") -> None:
        """Take the places of the largest pressures of the first loaded frames."""
        for kpa, sigma in zip(maps.pressure_kpa, maps.sigma_kpa, strict=True) if maps else ():
            peak = np.nan_to_num(kpa, nan=-np.inf)
            place = np.unravel_index(peak.argmax(), peak.shape)
            if len(self._read) < PRESS_FRAMES and peak[place] > _SIGMAS * sigma[place]:
                self._read.append(np.array(place))

    def fault(self) -> str:
        """Wires that are swapped; "" where none are, or before it has been pressed for long enough."""
        if len(self._read) < PRESS_FRAMES:
            return ""
        pressed = np.repeat(np.array(self.at)[:, None], len(self._read), axis=1)
        return swapped(pressed, np.transpose(self._read))

    def words(self) -> str:
        """Wires that are swapped, or that none are; "" before it has been pressed for long enough."""
        done = f"the press on {self._name} is read there" if len(self._read) >= PRESS_FRAMES else ""
        return self.fault() or done

    def shown(self) -> dict[str, Any]:
        """Place, request or result, and whether wires are swapped, for the page."""
        request = f"press {self._name}: {len(self._read)} of {PRESS_FRAMES} frames"
        return {"at": self.at, "words": self.words() or request, "swapped": bool(self.fault())}

    @property
    def _name(self) -> str:
        return f"r{self.at[0] + 1}c{self.at[1] + 1}"


class MapView(LiveView):
    """Live page of an array: map, trace of the centre of pressure, force, regions."""

    names = ("pause", "resume", "rest", "record", "stop")
    page = "map"

    def __init__(self, title: str, model: "ArrayModel") -> None:
        self._model, self._last_map = model, dict[str, Any]()
        super().__init__(title, [])

    def about(self) -> bytes:
        """Title, outline and crossings, in JSON."""
        of = self._model.layout
        corners = [[round(float(v), 2) for v in corner] for corner in of.footprint.exterior.coords]
        return json.dumps({
            "title": self.title, "outline": corners, "x": of.x_mm, "y": of.y_mm, "pitch": of.params.pitch,
            "here": of.here,
        }).encode()  # fmt: skip

    def show(self, time_s: float, maps: "PressureMaps | None", words: dict[str, Any]) -> None:
        """Show the last frame of some maps, if there are any, and the state in words."""
        self.keep(time_s, lambda: self._drawn(maps, words))

    def _drawn(self, maps: "PressureMaps | None", words: dict[str, Any]) -> tuple[str, str]:
        """Row and state of the last frame."""
        row = ""
        if maps:
            cells = maps.table().cells[-1]
            row = json.dumps([cells[k] for k in (0, 1, 3, 4, 5, 6)])
            kpa = [None if v != v else round(v, 2) for v in maps.pressure_kpa[-1].ravel().tolist()]
            regions = maps.regional(len(maps.time_s) - 1).cells if maps.regions else ()
            self._last_map = {"kpa": kpa, "sigma": cells[2], "regions": regions}
        return row, json.dumps(self._last_map | words)


def follow(
    feed: FrameFeed, live: "LiveMaps", view: "MapView | None", clock: Clock, until_s: float,
    press: "NamedPress | None" = None,
) -> None:  # fmt: skip
    """Invert and show what a feed brings, until a time, a command or a fault.

    Raises
    ------
    Exception
        That has ended the feed.
    """
    while clock.now() < until_s and not feed.over:
        feed.obey(view.commands() if view else ())
        frames = feed.taken()
        maps = live.take(*frames) if len(frames[1]) and not feed.paused else None
        if press:
            press.take(maps)
        if view:
            view.show(clock.now(), maps, _words(feed, live, press))
        if feed.fault:
            raise feed.fault
        if not len(frames[1]):
            clock.wait_until(clock.now() + _IDLE_S)


def _words(feed: FrameFeed, live: "LiveMaps", press: "NamedPress | None") -> dict[str, Any]:
    by = live.plan.words() if live.tared else "not tared: unload the array, and press Unloaded"
    recording = None if feed.recorder is None else feed.recording
    return {
        "by": by,
        "press": press.shown() if press else None,
        "paused": feed.paused,
        "recording": recording,
        **feed.counts,
        "skipped": live.dropped,
    }
