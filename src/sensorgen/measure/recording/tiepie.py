"""TiePieLCR's variables to recordings: any number of lock-ins and tones, however the file wraps them.

What is a scalar, a vector, a cell or a struct array in the file depends on how many lock-ins and tones there are and on
who wrote it: everything is laid out flat first.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording import clock
from sensorgen.measure.recording.samples import Bools, Complex, Real, Recording, Source, blank, sifted

WANTED = ("impedance_data", "impedance_time", "timestamps", "settings", "ref_offset", "sig_offset", "offset_time")
_INPUTS = ("ref_offset", "sig_offset")
_MARGIN = 0.99  # of a range, as the program itself has it
_START_UP = 1.6  # of the demodulator, over its bandwidth
_WANTED = "expected a recording of TiePieLCR: impedance_data with lockin1, impedance_time and settings.dem_freqs"

Tree = Mapping[str, Any]
_Offsets = tuple[Real, Mapping[str, Real]]


def recordings(tree: Tree, source: Source) -> tuple[Recording, ...]:
    """Every lock-in of a file.

    Parameters
    ----------
    tree : mapping
        The file's variables, as :func:`sensorgen.measure.recording.matfive.variables` gives them.
    source : Source
        File and format.

    Raises
    ------
    BadInput
        A variable that is missing, or has another shape than the others say, by its name.
    """
    lockins = _lockins(tree)
    count = len(lockins)
    times = _rows(tree, "impedance_time", count)
    settings = _settings(tree, count)
    stamps = _vector(tree["timestamps"], "timestamps") if "timestamps" in tree else None
    offsets = [_offsets(tree, k, count) for k in range(count)]
    found: list[Recording] = []
    for k, ((name, raw), own, time) in enumerate(zip(lockins.items(), settings, times, strict=True)):
        with_name = replace(source, lockin=int(name[6:]), program=_program(own), bandwidth_hz=_number(own, "bandwidth"))
        one = _recording(name, raw, own, time, stamps if k == 0 else None, offsets[k], with_name)
        if found:  # only the first lock-in is stamped, and all begin together
            one = replace(one, clock=found[0].clock)
        found.append(one)
    return tuple(found)


def _lockins(tree: Tree) -> dict[str, Any]:
    data = tree.get("impedance_data")
    if not isinstance(data, list) or len(data) != 1 or not isinstance(data[0], dict):
        raise BadInput(f"impedance_data is {_said(data)}; {_WANTED}")
    names = [name for name in data[0] if name.startswith("lockin") and name[6:].isascii() and name[6:].isdigit()]
    if not names:
        raise BadInput(f"impedance_data has the fields {', '.join(list(data[0])[:8]) or 'none'}; {_WANTED}")
    return {name: data[0][name] for name in sorted(names, key=lambda name: int(name[6:]))}


def _said(value: Any) -> str:
    if value is None:
        return "missing"
    if isinstance(value, np.ndarray):
        return f"numbers of shape {' x '.join(map(str, value.shape)) or '1'}"
    return f"a list of {len(value)}" if isinstance(value, list) else f"a {type(value).__name__}"


def _settings(tree: Tree, count: int) -> list[Tree]:
    found = list(_structs(tree.get("settings")))
    if len(found) != count:
        raise BadInput(f"settings: {len(found)} structs for {count} lock-ins; expected one each")
    return found


def _structs(value: Any) -> Iterator[Tree]:
    """Structs out of the cells and lists that they may be wrapped in."""
    if isinstance(value, dict):
        yield value
    elif isinstance(value, list):
        for member in value:
            yield from _structs(member)


def _rows(tree: Tree, name: str, count: int) -> list[Real]:
    """One vector per lock-in: rows of a matrix, or members of a cell where they are of unequal length."""
    value = tree.get(name)
    if isinstance(value, list):
        if len(value) != count:
            raise BadInput(f"{name}: {len(value)} vectors for {count} lock-ins; expected one each")
        return [_vector(member, name) for member in value]
    if not isinstance(value, np.ndarray) or value.ndim > 2:
        raise BadInput(f"{name} is {_said(value)}; {_WANTED}")
    if count == 1:
        return [_vector(value, name)]
    if value.ndim != 2 or value.shape[0] != count:
        raise BadInput(f"{name} is {_said(value)}; expected a row for each of the {count} lock-ins")
    return [_vector(row, name) for row in value]


def _vector(value: Any, name: str) -> Real:
    if (
        not isinstance(value, np.ndarray)
        or value.size != max(value.shape, default=1)
        or value.dtype.kind not in "iufcb"
    ):
        raise BadInput(f"{name} is {_said(value)}; expected numbers one after the other")
    return np.ascontiguousarray(value.ravel().real, float)


def _number(settings: Tree, name: str) -> float:
    value = settings.get(name)
    if isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "iufb":
        return float(value.ravel()[0])
    return float("nan")


def _program(settings: Tree) -> str:
    version = settings.get("version")
    return f"TiePieLCR {version[:40].strip()}" if isinstance(version, str) else "TiePieLCR"


def _tones(settings: Tree, name: str) -> Real:
    if "dem_freqs" not in settings:
        raise BadInput(f"settings of {name}: no dem_freqs, so that nothing tells its tones")
    tones = _vector(settings["dem_freqs"], "settings.dem_freqs")
    if not len(tones) or not (np.isfinite(tones) & (tones > 0)).all():
        raise BadInput(f"settings.dem_freqs of {name}: expected tones above 0 Hz")
    return tones


def _table(raw: Any, name: str, tones: int) -> Complex:
    """Samples below each other, tones beside each other; one tone may be a vector of any direction."""
    if not isinstance(raw, np.ndarray) or raw.dtype.kind not in "iufcb" or raw.ndim > 2:
        raise BadInput(f"impedance_data.{name} is {_said(raw)}; expected a column for each of its {tones} tones")
    if tones == 1 and raw.size == max(raw.shape, default=1):
        raw = raw.reshape(-1, 1)
    if raw.ndim == 1 and raw.size == tones:
        raw = raw.reshape(1, -1)
    if raw.ndim != 2 or raw.shape[1] != tones:
        raise BadInput(f"impedance_data.{name} is {_said(raw)}; expected a column for each of its {tones} tones")
    return np.array(raw, np.complex128, order="C")


def _recording(
    name: str, raw: Any, settings: Tree, time: Real, stamps: Real | None, offsets: _Offsets, source: Source
) -> Recording:
    tones = _tones(settings, name)
    z = _table(raw, name, len(tones))
    lengths = [len(z), len(time), *([] if stamps is None else [len(stamps)])]
    count, notes = min(lengths), []
    if count == 0:
        raise BadInput(f"impedance_data.{name}: no samples")
    if max(lengths) > count:
        notes.append(f"{max(lengths) - count} samples at the end are not whole: the run stopped half-way")
    z, time, stamps = z[:count], time[:count], None if stamps is None else stamps[:count]
    try:
        rebuilt = clock.rebuilt(count, time, stamps)
    except BadInput as error:
        raise error.within(f"impedance_time of {name}") from None
    rate = clock.rate_hz(rebuilt.time_s)
    marks = blank(count) | rebuilt.marks | sifted(z)
    marks["transient"] = _starting(rebuilt.time_s, rate, source.bandwidth_hz)
    marks["clipped"] = _beyond(time, offsets, settings)
    notes += rebuilt.notes
    return Recording(rebuilt.time_s, tones, z, marks, rebuilt.clock, replace(source, rate_hz=rate, notes=tuple(notes)))


def _starting(time_s: Real, rate: float, bandwidth_hz: float) -> Bools:
    """The first samples, until the demodulator's filter has settled."""
    found = np.zeros(len(time_s), bool)
    if bandwidth_hz > 0 and np.isfinite(rate):
        found[: ceil(_START_UP / bandwidth_hz * rate)] = True
    return found


def _offsets(tree: Tree, k: int, count: int) -> _Offsets:
    """Time and means of the two inputs of a lock-in, where the file has them."""
    try:
        time = _rows(tree, "offset_time", count)[k]
        found = {name: _rows(tree, name, count)[k] for name in _INPUTS}
    except BadInput:
        return np.empty(0), {}
    return time, {name: values for name, values in found.items() if len(values) == len(time) > 0}


def _beyond(time_s: Real, offsets: _Offsets, settings: Tree) -> Bools:
    """Where an input's mean alone fills its range.

    The program sees clipping in its waveforms and shows it, but keeps neither in the file: a mean at the rail is all
    that is left of it. What clips at both rails alike leaves none.
    """
    at, values = offsets
    found, limits = np.zeros(len(time_s), bool), _limits(settings)
    order = np.argsort(at, kind="stable")
    for name in values.keys() & limits.keys():
        found |= np.interp(time_s, at[order], np.abs(values[name])[order]) >= _MARGIN * limits[name]
    return found


def _limits(settings: Tree) -> dict[str, float]:
    """The largest mean that each input can show, in the file's units; none where the file does not say.

    The reference is written down as volts times what its amplifier has in amperes or coulombs per volt, the signal as
    volts over the gain ahead of the input: the ranges are those of the inputs themselves.
    """
    try:
        listed = _vector(settings["scope_range_list"], "scope_range_list")
        reference, signal = listed[_vector(settings["scope_ranges"], "scope_ranges").astype(int)]
    except (BadInput, KeyError, IndexError, ValueError):
        return {}
    scales = _gain(settings, "reference_gain_list", "reference"), _gain(settings, "gain_list", "gain")
    return dict(zip(_INPUTS, (float(reference * scales[0]), float(signal / scales[1])), strict=True))


def _gain(settings: Tree, listed: str, chosen: str) -> float:
    """A gain by its number in the calibration's list; 1 where the file does not say."""
    calibration = next(_structs(settings.get("calibration")), {})
    try:
        gain = abs(float(_vector(calibration[listed], listed)[int(_number(settings, chosen))]))
    except (BadInput, KeyError, IndexError, ValueError):
        return 1.0
    return gain if gain > 0 else 1.0
