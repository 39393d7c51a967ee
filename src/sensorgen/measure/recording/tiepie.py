"""Recordings from the variables of a TiePieLCR file, for any number of lock-ins and frequencies.

Whether a variable is a scalar, a vector, a cell or a struct array depends on the number of lock-ins and frequencies and
on the program that wrote the file, so that everything is flattened first.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import zip_longest
from math import ceil
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.errors import BadInput, within
from sensorgen.measure.recording.matfive import Split
from sensorgen.measure.recording.samples import MOST_TONES, Recording, Source, stretches

WANTED = ("impedance_data", "impedance_time", "timestamps", "settings", "ref_offset", "sig_offset", "offset_time")
_MARGIN = 0.99  # of a range, as in the program itself
_START_UP = 1.6  # settling time of the demodulator times its bandwidth
_EXPECTED = "expected a recording of TiePieLCR: impedance_data with lockin1, impedance_time and settings.dem_freqs"

_MOST_MEANS = 1 << 20  # of an input's means; of more, the largest of several

_LOCKIN = re.compile(r"lockin[0-9]+")
Tree = Mapping[str, Any]
Vector = NDArray[Any]
"""Numbers of any type as they are in the file, outside memory."""


def recordings(tree: Tree, source: Source) -> Iterator[tuple[Recording, ...]]:
    """Recordings of all lock-ins, one stretch after the other.

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
    stamps = [_vector(tree["timestamps"], "timestamps") if "timestamps" in tree else None]  # of the first alone
    given = [
        _LockIn.of(tree, k, count, name, raw, own, time, stamp)
        for k, ((name, raw), own, time, stamp) in enumerate(zip_longest(lockins.items(), settings, times, stamps))
    ]
    for at in stretches(max(one.count for one in given), sum(len(one.tones_hz) for one in given)):
        results: list[Recording] = []
        for lockin in given:
            if at.start < lockin.count:
                one = lockin.recording(at, source)
                results.append(replace(one, clock=results[0].clock) if results else one)  # all begin together
        yield tuple(results)


def _lockins(tree: Tree) -> dict[str, Any]:
    """Raw data by lock-in, ``lockin1`` first."""
    data = tree.get("impedance_data")
    if not isinstance(data, list) or len(data) != 1 or not isinstance(data[0], dict):
        raise BadInput(f"impedance_data is {_described(data)}; {_EXPECTED}")
    names = list(filter(_LOCKIN.fullmatch, data[0]))
    if not names:
        raise BadInput(f"impedance_data has the fields {', '.join(list(data[0])[:8]) or 'none'}; {_EXPECTED}")
    return {name: data[0][name] for name in sorted(names, key=lambda name: int(name[6:]))}


def _described(value: Any) -> str:
    if value is None:
        return "missing"
    if isinstance(value, np.ndarray | Split):
        return f"numbers of shape {' x '.join(map(str, value.shape)) or '1'}"
    return f"a list of {len(value)}" if isinstance(value, list) else f"a {type(value).__name__}"


def _structs(value: Any) -> Iterator[Tree]:
    """Structs inside cells and lists."""
    if isinstance(value, dict):
        yield value
    elif isinstance(value, list):
        for member in value:
            yield from _structs(member)


def _vectors(tree: Tree, name: str, count: int) -> list[Vector]:
    """One vector per lock-in: rows of a matrix, or members of a cell where their lengths differ."""
    value = tree.get(name)
    if isinstance(value, list):
        if len(value) != count:
            raise BadInput(f"{name}: {len(value)} vectors for {count} lock-ins; expected one each")
        return [_vector(member, name) for member in value]
    if not isinstance(value, np.ndarray | Split) or value.ndim > 2:
        raise BadInput(f"{name} is {_described(value)}; {_EXPECTED}")
    if count == 1:
        return [_vector(value, name)]
    if value.ndim != 2 or value.shape[0] != count:
        raise BadInput(f"{name} is {_described(value)}; expected a row for each of the {count} lock-ins")
    return [_vector(row, name) for row in value.real]


def _vector(value: Any, name: str) -> Vector:
    """Numbers one after the other, as they are in the file."""
    numeric = isinstance(value, np.ndarray | Split) and value.dtype.kind in "iufcb"
    if not numeric or value.size != max(value.shape, default=1):
        raise BadInput(f"{name} is {_described(value)}; expected numbers one after the other")
    vector: Vector = value.real.reshape(-1)
    return vector


def _few(value: Any, name: str) -> Real:
    """A setting of some numbers."""
    vector = _vector(value, name)
    if len(vector) > MOST_TONES:
        raise BadInput(f"{name}: {len(vector)} numbers; expected up to {MOST_TONES}")
    return np.asarray(vector, float)


def _number(settings: Tree, name: str) -> float:
    """A setting; nan where it is missing or no number."""
    value = settings.get(name)
    if isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "iufb":
        return float(value.ravel()[0])
    return float("nan")


@dataclass(frozen=True, eq=False)
class _LockIn:
    """Variables of one lock-in, as they are in the file.

    Attributes
    ----------
    name : str
        As in "lockin1".
    tones_hz : (m,) array
        Frequencies [Hz].
    parts : tuple of (n, m) arrays
        Real part of the impedance, and the imaginary part if there is one [ohm].
    time_s, stamp_s : (n,) array
        Time, and stamps or None [s].
    count, incomplete : int
        Samples that are whole, and others at the end.
    settings : Tree
        Its settings.
    clipping : callable
        Whether an input was at the end of its range, from times [s].
    """

    name: str
    tones_hz: Real
    parts: tuple[Vector, ...]
    time_s: Vector
    stamp_s: Vector | None
    count: int
    incomplete: int
    settings: Tree
    clipping: Callable[[Real], Mask]

    @classmethod
    def of(
        cls, tree: Tree, k: int, lockins: int, name: str, raw: Any, settings: Tree, time: Vector, stamps: Vector | None
    ) -> Self:
        """Lock-in ``k`` of a file."""
        if "dem_freqs" not in settings:
            raise BadInput(f"settings of {name}: no dem_freqs, so that its frequencies are unknown")
        tones = _few(settings["dem_freqs"], "settings.dem_freqs")
        if not len(tones) or not (np.isfinite(tones) & (tones > 0)).all():
            raise BadInput(f"settings.dem_freqs of {name}: expected tones above 0 Hz")
        parts = _matrix(raw, name, len(tones))
        lengths = [len(parts[0]), len(time), *([] if stamps is None else [len(stamps)])]
        if min(lengths) == 0:
            raise BadInput(f"impedance_data.{name}: no samples")
        clipping = _clipping(tree, k, lockins, settings)
        return cls(name, tones, parts, time, stamps, min(lengths), max(lengths) - min(lengths), settings, clipping)

    def recording(self, at: slice, source: Source) -> Recording:
        """A stretch of it."""
        at = slice(at.start, min(at.stop, self.count))
        time, stamps = (None if v is None else np.array(v[at], float) for v in (self.time_s, self.stamp_s))
        last = at.stop == self.count and self.incomplete
        notes = (f"{self.incomplete} incomplete samples at the end: the run was interrupted",) if last else ()
        z = np.zeros((at.stop - at.start, len(self.tones_hz)), np.complex128)
        for half, part in zip((z.real, z.imag), self.parts, strict=False):
            half[:] = part[at]
        version, bandwidth = self.settings.get("version"), _number(self.settings, "bandwidth")
        program = f"TiePieLCR {version[:40].strip()}" if isinstance(version, str) else "TiePieLCR"
        source = replace(source, lockin=int(self.name[6:]), program=program, bandwidth_hz=bandwidth, notes=notes)
        with within(f"impedance_time of {self.name}"):
            one = Recording.rebuilt(z, self.tones_hz, time, stamps, source, clipped=self.clipping(np.asarray(time)))
        rate = one.source.rate_hz
        if at.start == 0 and bandwidth > 0 and np.isfinite(rate):  # until the demodulator's filter has settled
            one.marks["transient"][: ceil(min(_START_UP / bandwidth * rate, len(z)))] = True
        return one


def _matrix(raw: Any, name: str, tones: int) -> tuple[Vector, ...]:
    """Parts of the impedance, a row per sample and a column per frequency; one frequency or sample may be a vector."""
    wrong = BadInput(f"impedance_data.{name} is {_described(raw)}; expected a column for each of its {tones} tones")
    if not isinstance(raw, np.ndarray | Split) or raw.dtype.kind not in "iufcb" or raw.ndim > 2:
        raise wrong
    shape, is_vector = (raw.size // tones, tones), raw.size == max(raw.shape, default=1)
    if raw.shape not in (shape, (tones,)) and not (is_vector and tones == 1):
        raise wrong
    return tuple(part.reshape(shape) for part in ((raw.real, raw.imag) if raw.dtype.kind == "c" else (raw.real,)))


def _clipping(tree: Tree, k: int, count: int, settings: Tree) -> Callable[[Real], Mask]:
    """Times at which the mean of an input fills the input's range.

    The program detects clipping in its waveforms and displays it, but the file has only the means of the two inputs: a
    mean at the end of the range is clipping. Waveforms that clip symmetrically cannot be detected.
    """
    try:
        at = _vectors(tree, "offset_time", count)[k]
        means = [_vectors(tree, name, count)[k] for name in ("ref_offset", "sig_offset")]
        ranges = _few(settings["scope_range_list"], "scope_range_list")
        reference, signal = ranges[_few(settings["scope_ranges"], "scope_ranges").astype(int)]
    except (BadInput, KeyError, IndexError, ValueError, TypeError):  # the file lacks the means or the ranges
        return lambda time_s: np.zeros(len(time_s), bool)
    # the file has the reference as volts times its amplifier's amperes or coulombs per volt, and the signal as volts
    # over the gain before the input; the ranges are those of the inputs themselves
    amplifier, gain = _gain(settings, "reference_gain_list", "reference"), _gain(settings, "gain_list", "gain")
    each, limits = -(-len(at) // _MOST_MEANS) or 1, (float(reference * amplifier), float(signal / gain))
    times = np.array(at[::each], float)
    order = np.argsort(times, kind="stable")
    curves = [(_largest(mean, each)[order], limit) for mean, limit in zip(means, limits, strict=True)
              if len(mean) == len(at) > 0]  # fmt: skip

    def clipped(time_s: Real) -> Mask:
        over = [np.interp(time_s, times[order], mean) >= _MARGIN * limit for mean, limit in curves]
        return np.asarray(np.any([np.zeros(len(time_s), bool), *over], axis=0))

    return clipped


def _largest(mean: Vector, each: int) -> Real:
    """Magnitude of a mean, the largest of so many one after the other."""
    step = each * (_MOST_MEANS // 16)
    pieces = (np.abs(np.asarray(mean[k : k + step], float)) for k in range(0, len(mean), step))
    return np.concatenate([np.fmax.reduceat(piece, np.arange(0, len(piece), each)) for piece in pieces])


def _gain(settings: Tree, listed: str, chosen: str) -> float:
    """Gain by its number in the calibration's list; 1 where the file lacks it."""
    calibration = next(_structs(settings.get("calibration")), {})
    try:
        gain = abs(float(_vector(calibration[listed], listed)[int(_number(settings, chosen))]))
    except (BadInput, KeyError, IndexError, ValueError, OverflowError):
        return 1.0
    return gain if gain > 0 else 1.0
