"""Recordings of the log, reduced to what a prediction gives: rest, loads, differences."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from sensorgen.analysis.plots.figure import thinned_together
from sensorgen.core.errors import SensorgenError
from sensorgen.measure.log import BenchRun, Log
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.recording import Joined, Recording, RigLog, Source, joined_all
from sensorgen.measure.recording.samples import Complex, Real
from sensorgen.measure.signal import presses
from sensorgen.measure.signal.run import processed


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A recording, or a part of one, without its samples.

    Attributes
    ----------
    entry : BenchRun
        As logged.
    source : Source
        Its origin.
    tones_hz : (m,) array
        Frequencies [Hz].
    samples, valid : int
        Samples, and valid ones.
    seconds : float
        Time of the last sample [s].
    time_s, raw_ohm : (n,), (n, m) array
        Valid samples to be drawn: of many, the least and the largest of each stretch [s], [ohm].
    filtered_s, filtered_ohm : (k,), (k, m) array
        The same, low-passed forward and backward [s], [ohm].
    rest_ohm, rest_error_ohm : (m,) array
        Impedance at rest, and its standard error: of R in the real, of X in the imaginary part [ohm].
    noise_ohm : (m,) array
        Standard deviation of one sample at rest, drift included, in the same way [ohm].
    pairs : Pairs or None
        Before and under each press; None where there are none, or no force is known.
    notes : tuple of str
        What was left out, or taken with care.
    """

    entry: BenchRun
    source: Source
    tones_hz: Real
    samples: int
    valid: int
    seconds: float
    time_s: Real
    raw_ohm: Complex
    filtered_s: Real
    filtered_ohm: Complex
    rest_ohm: Complex
    rest_error_ohm: Complex
    noise_ohm: Complex
    pairs: presses.Pairs | None
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        """Specimen, the recording's number in the log, and whether it is simulated."""
        part = f", part {self.source.part}" if self.source.part else ""
        lockin = f", lock-in {self.source.lockin}" if self.source.lockin > 1 else ""
        simulated = ", simulated" if self.entry.simulated else ""
        return f"{self.entry.specimen}, recording {self.entry.number}{part}{lockin}{simulated}"


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


def _of_part(entry: BenchRun, lockins: Sequence[Recording], pressed: RigLog | None) -> Iterator[RecordedRun]:
    """All lock-ins of a part, each with the rig's log, or without if they cannot be joined."""
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
        marked = {name: count for name, count in counts.items() if count and name not in ("samples", "valid")}
        marks = (f"{count} samples marked: {name}" for name, count in marked.items())
        notes = (*filter(None, [without]), *done.notes, *marks)
        valid = one.valid()
        z = done.pairs.before_ohm if done.pairs else one.impedance_ohm[valid]
        z = z[np.isfinite(z).all(axis=1)]
        scatter = np.full(z.shape[1], complex("nan"))
        if len(z) > 1:
            scatter = z.real.std(axis=0, ddof=1) + 1j * z.imag.std(axis=0, ddof=1)
        rest, spread = z.mean(axis=0), np.asarray(scatter / np.sqrt(max(len(z), 1)))
        raw = np.flatnonzero(valid)[thinned_together(one.impedance_ohm, valid)]
        smooth = thinned_together(done.filtered_ohm)
        yield RecordedRun(
            entry, one.source, one.tones_hz, counts["samples"], counts["valid"], float(one.time_s[-1]),
            one.time_s[raw], one.impedance_ohm[raw], done.filtered_s[smooth], done.filtered_ohm[smooth], rest, spread,
            scatter, done.pairs if done.by_force else None, notes,
        )  # fmt: skip
