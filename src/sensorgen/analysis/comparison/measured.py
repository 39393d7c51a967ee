"""Measurements of an iteration: readings in little memory, and recordings reduced to what a prediction gives."""

from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sensorgen.analysis.plots.figure import thinned_together
from sensorgen.analysis.plots.recordings import DrawnRecording
from sensorgen.core.arrays import Complex
from sensorgen.core.errors import SensorgenError
from sensorgen.core.lazy import Lazy
from sensorgen.measure.log import BenchRun, Log, Reading

if TYPE_CHECKING:
    from sensorgen.measure.recording import Joined, Recording, RigLog, Source


class Words(NamedTuple):
    """Texts that many readings share; attributes as of :class:`sensorgen.measure.log.Reading`."""

    specimen: str
    shape: str
    film_mm: float | None
    axes: str
    baked: bool | None
    batch: str
    defects: str
    instrument: str
    wires: int | None
    remark: str
    doubts: tuple[str, ...]
    source: str


class Measured(NamedTuple):
    """A reading.

    Attributes
    ----------
    number : int
        In the log.
    y_ohm, z_ohm : tuple of float
        Along an electrode and between the electrodes, as logged [ohm].
    words : Words
        Specimen, remark and the like.
    """

    number: int
    y_ohm: tuple[float, ...]
    z_ohm: tuple[float, ...]
    words: Words

    @property
    def specimen(self) -> str:
        """Name of the specimen."""
        return self.words.specimen

    @property
    def shape(self) -> str:
        """Name of the shape."""
        return self.words.shape


@dataclass(frozen=True, eq=False)
class IterationReadings:
    """All readings of an iteration.

    Attributes
    ----------
    rows : Lazy of Measured
        In the order of the log.
    alternating : tuple of Reading
        Those with AC quantities.
    designs : frozenset of (str, str)
        Names and identities of designs that the log has for them.
    """

    rows: Lazy[Measured]
    alternating: tuple[Reading, ...]
    designs: frozenset[tuple[str, str]]


def readings(logged: Iterable[Reading]) -> IterationReadings:
    """Readings one after the other, of which none is kept as it comes."""
    numbers, ends = array("q"), array("q", [0])
    ohms, along, kinds = array("d"), array("q"), array("q")
    known: dict[Words, int] = {}
    designs, alternating = set(), []
    for one in logged:
        words = Words(
            one.specimen, one.shape, one.film_mm, one.axes, one.baked, one.batch, ", ".join(one.defects),
            one.instrument, one.wires, one.remark, one.doubts, one.source,
        )  # fmt: skip
        if one.quantity:
            alternating.append(one)
        kinds.append(known.setdefault(words, len(known)))
        numbers.append(one.number)
        ohms.extend((*one.y_ohm, *one.z_ohm))
        along.append(len(one.y_ohm))
        ends.append(len(ohms))
        designs.add((one.design, one.design_id))
    listed = list(known)

    def made(k: int) -> Measured:
        begin, end = ends[k], ends[k + 1]
        split = begin + along[k]
        return Measured(numbers[k], tuple(ohms[begin:split]), tuple(ohms[split:end]), listed[kinds[k]])

    return IterationReadings(Lazy(made, range(len(numbers))), tuple(alternating), frozenset(designs))


@dataclass(frozen=True, eq=False)
class RecordedRun(DrawnRecording):
    """A recording, or a part of one; of its samples, those that are drawn: of many, the least and largest of stretches.

    Attributes
    ----------
    entry : BenchRun
        As logged.
    source : Source
        Its origin.
    samples, valid : int
        Samples, and valid ones.
    seconds : float
        From the first sample to the last [s].
    rest_ohm, rest_error_ohm : (m,) array
        Impedance at rest, and its standard error: of R in the real, of X in the imaginary part [ohm].
    noise_ohm : (m,) array
        Standard deviation of one sample at rest, drift included, in the same way [ohm].
    notes : tuple of str
        What was left out, or taken with care.
    """

    entry: BenchRun
    source: "Source"
    samples: int
    valid: int
    seconds: float
    rest_ohm: Complex
    rest_error_ohm: Complex
    noise_ohm: Complex
    notes: tuple[str, ...]


def _name(entry: BenchRun, source: "Source") -> str:
    """Specimen, the recording's number in the log, and whether it is simulated."""
    part = f", part {source.part}" if source.part else ""
    lockin = f", lock-in {source.lockin}" if source.lockin > 1 else ""
    return f"{entry.specimen}, recording {entry.number}{part}{lockin}{', simulated' * entry.simulated}"


def runs(
    log: Log, iteration: int | None, left_out: list[tuple[str, str]], *, specimens: Sequence[str] = ()
) -> Iterator[RecordedRun]:
    """Recordings of an iteration, part after part; what cannot be read or used goes to ``left_out`` with its reason.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int or None
        Of the design; of all if None, and no specimens are given.
    left_out : list of (str, str)
        Grows.
    specimens : sequence of str
        Names of specimens, in place of an iteration.
    """
    for entry in log.about(BenchRun, iteration, specimens):
        from sensorgen.measure.log.bench import read_again  # and all that reads recordings, where the log has one

        name = f"recording {entry.number}, {entry.specimen}"
        with _noted(left_out, name):
            parts, pressed = read_again(log, entry)
            for lockins in parts:
                with _noted(left_out, name + (f", part {lockins[0].source.part}" if lockins[0].source.part else "")):
                    yield from _of_part(entry, lockins, pressed)


@contextmanager
def _noted(left_out: list[tuple[str, str]], name: str) -> Iterator[None]:
    """List an error with its reason: one bad recording does not stop the others."""
    try:
        yield
    except SensorgenError as error:
        left_out.append((name, str(error)))
    except MemoryError:
        left_out.append((name, "not enough memory"))
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        left_out.append((name, f"{type(error).__name__}: {error}; a fault of sensorgen, please report it"))


def _at_rest(impedance_ohm: Complex) -> tuple[Complex, Complex, Complex]:
    """Mean of rows of impedances, its standard error, and the scatter of one row [ohm]; nan of one row alone."""
    z = impedance_ohm[np.isfinite(impedance_ohm).all(axis=1)]
    scatter = np.full(z.shape[1], complex("nan"))
    if len(z) > 1:
        scatter = z.real.std(axis=0, ddof=1) + 1j * z.imag.std(axis=0, ddof=1)
    return z.mean(axis=0), np.asarray(scatter / np.sqrt(max(len(z), 1))), scatter


def _of_part(entry: BenchRun, lockins: "Sequence[Recording]", pressed: "RigLog | None") -> Iterator[RecordedRun]:
    """All lock-ins of a part, each with the rig's log, or without if they cannot be joined."""
    from sensorgen.measure.recording import joined_all
    from sensorgen.measure.signal.run import processed

    beside: Sequence[Joined | None] = [None] * len(lockins)
    without = "no log of the rig: force and position are not known"
    if pressed is not None:
        try:
            beside, without = joined_all(lockins, pressed), ""
        except SensorgenError as error:
            without = f"not joined with the rig's log: {error}"
    for recording, with_rig in zip(lockins, beside, strict=True):
        done = processed(recording, with_rig)
        one, counts = done.recording, done.recording.counts()
        marked = (name for name, count in counts.items() if count and name not in ("samples", "valid"))
        marks = (f"{counts[name]} samples marked: {name}" for name in marked)
        notes = (*filter(None, [without]), *done.notes, *marks)
        valid = one.valid()
        rest, spread, scatter = _at_rest(done.pairs.before_ohm if done.pairs else one.impedance_ohm[valid])
        raw = np.flatnonzero(valid)[thinned_together(one.impedance_ohm, valid)]
        smooth = thinned_together(done.filtered_ohm)
        yield RecordedRun(
            _name(entry, one.source), one.tones_hz, one.time_s[raw], one.impedance_ohm[raw], done.filtered_s[smooth],
            done.filtered_ohm[smooth], done.pairs if done.by_force else None, entry, one.source, counts["samples"],
            counts["valid"], float(np.ptp(one.time_s)), rest, spread, scatter, notes,
        )  # fmt: skip
