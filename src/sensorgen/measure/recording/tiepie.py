"""Recordings from the variables of a TiePieLCR file, for any number of lock-ins and frequencies.

Whether a variable is a scalar, a vector, a cell or a struct array depends on the number of lock-ins and frequencies and
on the program that wrote the file, so that everything is flattened first.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np

from sensorgen.core.errors import BadInput, within
from sensorgen.measure.recording import clock
from sensorgen.measure.recording.samples import Bools, Complex, Real, Recording, Source, blank, sifted

WANTED = ("impedance_data", "impedance_time", "timestamps", "settings", "ref_offset", "sig_offset", "offset_time")
_MARGIN = 0.99  # of a range, as in the program itself
_START_UP = 1.6  # settling time of the demodulator times its bandwidth
_EXPECTED = "expected a recording of TiePieLCR: impedance_data with lockin1, impedance_time and settings.dem_freqs"

Tree = Mapping[str, Any]


def recordings(tree: Tree, source: Source) -> tuple[Recording, ...]:
    """Recordings of all lock-ins.

    Parameters
    ----------
    tree : mapping
        Variables of the file, as :func:`sensorgen.measure.recording.matfive.variables` returns them.
    source : Source
        File and format.

    Raises
    ------
    BadInput
        A variable that is missing, or whose shape contradicts the others, by its name.
    """
    lockins = _lockins(tree)
    count = len(lockins)
    times = _vectors(tree, "impedance_time", count)
    settings = list(_structs(tree.get("settings")))
    if len(settings) != count:
        raise BadInput(f"settings: {len(settings)} structs for {count} lock-ins; expected one each")
    stamps = _vector(tree["timestamps"], "timestamps") if "timestamps" in tree else None
    results: list[Recording] = []
    for k, ((name, raw), own, time) in enumerate(zip(lockins.items(), settings, times, strict=True)):
        clipped = _clipped(tree, k, count, time, own)
        one = _recording(name, raw, own, time, stamps if k == 0 else None, clipped, source)
        if results:  # only the first lock-in is stamped, and all begin together
            one = replace(one, clock=results[0].clock)
        results.append(one)
    return tuple(results)


def _lockins(tree: Tree) -> dict[str, Any]:
    """Raw data by lock-in, ``lockin1`` first."""
    data = tree.get("impedance_data")
    if not isinstance(data, list) or len(data) != 1 or not isinstance(data[0], dict):
        raise BadInput(f"impedance_data is {_described(data)}; {_EXPECTED}")
    names = [name for name in data[0] if name.startswith("lockin") and name[6:].isascii() and name[6:].isdigit()]
    if not names:
        raise BadInput(f"impedance_data has the fields {', '.join(list(data[0])[:8]) or 'none'}; {_EXPECTED}")
    return {name: data[0][name] for name in sorted(names, key=lambda name: int(name[6:]))}


def _described(value: Any) -> str:
    if value is None:
        return "missing"
    if isinstance(value, np.ndarray):
        return f"numbers of shape {' x '.join(map(str, value.shape)) or '1'}"
    return f"a list of {len(value)}" if isinstance(value, list) else f"a {type(value).__name__}"


def _structs(value: Any) -> Iterator[Tree]:
    """Structs inside cells and lists."""
    if isinstance(value, dict):
        yield value
    elif isinstance(value, list):
        for member in value:
            yield from _structs(member)


def _vectors(tree: Tree, name: str, count: int) -> list[Real]:
    """One vector per lock-in: rows of a matrix, or members of a cell where their lengths differ."""
    value = tree.get(name)
    if isinstance(value, list):
        if len(value) != count:
            raise BadInput(f"{name}: {len(value)} vectors for {count} lock-ins; expected one each")
        return [_vector(member, name) for member in value]
    if not isinstance(value, np.ndarray) or value.ndim > 2:
        raise BadInput(f"{name} is {_described(value)}; {_EXPECTED}")
    if count == 1:
        return [_vector(value, name)]
    if value.ndim != 2 or value.shape[0] != count:
        raise BadInput(f"{name} is {_described(value)}; expected a row for each of the {count} lock-ins")
    return [_vector(row, name) for row in value]


def _vector(value: Any, name: str) -> Real:
    numeric = isinstance(value, np.ndarray) and value.dtype.kind in "iufcb"
    if not numeric or value.size != max(value.shape, default=1):
        raise BadInput(f"{name} is {_described(value)}; expected numbers one after the other")
    return np.ascontiguousarray(value.ravel().real, float)


def _number(settings: Tree, name: str) -> float:
    """A setting; nan where it is missing or no number."""
    value = settings.get(name)
    if isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "iufb":
        return float(value.ravel()[0])
    return float("nan")


def _recording(
    name: str, raw: Any, settings: Tree, time: Real, stamps: Real | None, clipped: Bools, source: Source
) -> Recording:
    if "dem_freqs" not in settings:
        raise BadInput(f"settings of {name}: no dem_freqs, so that its frequencies are unknown")
    tones = _vector(settings["dem_freqs"], "settings.dem_freqs")
    if not len(tones) or not (np.isfinite(tones) & (tones > 0)).all():
        raise BadInput(f"settings.dem_freqs of {name}: expected tones above 0 Hz")
    z = _matrix(raw, name, len(tones))
    lengths = [len(z), len(time), *([] if stamps is None else [len(stamps)])]
    count = min(lengths)
    if count == 0:
        raise BadInput(f"impedance_data.{name}: no samples")
    incomplete = max(lengths) - count
    notes = (f"{incomplete} incomplete samples at the end: the run was interrupted",) if incomplete else ()
    z, time, stamps = z[:count], time[:count], None if stamps is None else stamps[:count]
    with within(f"impedance_time of {name}"):
        rebuilt = clock.rebuilt(count, time, stamps)
    rate, bandwidth = clock.rate_hz(rebuilt.time_s), _number(settings, "bandwidth")
    marks = blank(count) | rebuilt.marks | sifted(z) | {"clipped": clipped[:count]}
    if bandwidth > 0 and np.isfinite(rate):  # until the demodulator's filter has settled
        marks["transient"][: ceil(_START_UP / bandwidth * rate)] = True
    version = settings.get("version")
    program = f"TiePieLCR {version[:40].strip()}" if isinstance(version, str) else "TiePieLCR"
    source = replace(
        source, lockin=int(name[6:]), program=program, bandwidth_hz=bandwidth, rate_hz=rate, notes=notes + rebuilt.notes
    )
    return Recording(rebuilt.time_s, tones, z, marks, rebuilt.clock, source)


def _matrix(raw: Any, name: str, tones: int) -> Complex:
    """Impedance with a row per sample and a column per frequency; one frequency may be a row or a column."""
    wrong = BadInput(f"impedance_data.{name} is {_described(raw)}; expected a column for each of its {tones} tones")
    if not isinstance(raw, np.ndarray) or raw.dtype.kind not in "iufcb" or raw.ndim > 2:
        raise wrong
    if tones == 1 and raw.size == max(raw.shape, default=1):
        raw = raw.reshape(-1, 1)
    if raw.ndim == 1 and raw.size == tones:
        raw = raw.reshape(1, -1)
    if raw.ndim != 2 or raw.shape[1] != tones:
        raise wrong
    return np.array(raw, np.complex128, order="C")


def _clipped(tree: Tree, k: int, count: int, time_s: Real, settings: Tree) -> Bools:
    """Samples at which the mean of an input fills the input's range.

    The program detects clipping in its waveforms and displays it, but the file has only the means of the two inputs: a
    mean at the end of the range is clipping. Waveforms that clip symmetrically cannot be detected.
    """
    clipped = np.zeros(len(time_s), bool)
    try:
        at = _vectors(tree, "offset_time", count)[k]
        means = [_vectors(tree, name, count)[k] for name in ("ref_offset", "sig_offset")]
        ranges = _vector(settings["scope_range_list"], "scope_range_list")
        reference, signal = ranges[_vector(settings["scope_ranges"], "scope_ranges").astype(int)]
    except (BadInput, KeyError, IndexError, ValueError):  # the file lacks the means or the ranges
        return clipped
    # the file has the reference as volts times its amplifier's amperes or coulombs per volt, and the signal as volts
    # over the gain before the input; the ranges are those of the inputs themselves
    amplifier, gain = _gain(settings, "reference_gain_list", "reference"), _gain(settings, "gain_list", "gain")
    order = np.argsort(at, kind="stable")
    for mean, limit in zip(means, (float(reference * amplifier), float(signal / gain)), strict=True):
        if len(mean) == len(at) > 0:
            clipped |= np.interp(time_s, at[order], np.abs(mean)[order]) >= _MARGIN * limit
    return clipped


def _gain(settings: Tree, listed: str, chosen: str) -> float:
    """Gain by its number in the calibration's list; 1 where the file lacks it."""
    calibration = next(_structs(settings.get("calibration")), {})
    try:
        gain = abs(float(_vector(calibration[listed], listed)[int(_number(settings, chosen))]))
    except (BadInput, KeyError, IndexError, ValueError):
        return 1.0
    return gain if gain > 0 else 1.0
