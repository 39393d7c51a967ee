"""Recordings of the log, reduced to what a prediction gives: rest, loads, differences."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.errors import SensorgenError
from sensorgen.measure.log import BenchRun, Log
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.recording import Joined, joined_all
from sensorgen.measure.recording.samples import Complex, Real, Recording
from sensorgen.measure.signal import presses
from sensorgen.measure.signal.run import processed


@dataclass(frozen=True, eq=False)
class Run:
    """A recording.

    Attributes
    ----------
    entry : BenchRun
        As logged.
    recording : Recording
        What the instrument measured, with its marks.
    time_s, filtered_ohm : (k,), (k, m) array
        Low-passed forward and backward on even steps [s], [ohm].
    rest_ohm, rest_error_ohm : (m,) array
        Impedance at rest, and its standard error: of R in the real, of X in the imaginary part [ohm].
    pairs : Pairs or None
        Before and under each press; None where there are none, or no force is known.
    notes : tuple of str
        What was left out, or taken with care.
    """

    entry: BenchRun
    recording: Recording
    time_s: Real
    filtered_ohm: Complex
    rest_ohm: Complex
    rest_error_ohm: Complex
    pairs: presses.Pairs | None
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        """Specimen, and the recording's number in the log."""
        lockin = f", lock-in {self.recording.source.lockin}" if self.recording.source.lockin > 1 else ""
        return f"{self.entry.specimen}, recording {self.entry.number}{lockin}"


def runs(log: Log, iteration: int, left_out: list[tuple[str, str]]) -> Iterator[Run]:
    """Recordings of an iteration; what cannot be read or used goes to ``left_out`` with its reason.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int
        Of the design.
    left_out : list of (str, str)
        Grows.
    """
    for entry in log.recordings(iteration=iteration):
        try:
            yield from _of_entry(log, entry)
        except (SensorgenError, KeyError) as error:
            left_out.append((f"recording {entry.number}, {entry.specimen}", str(error)))


def _of_entry(log: Log, entry: BenchRun) -> Iterator[Run]:
    """All lock-ins of a recording, each with the rig's log, or without if they cannot be joined."""
    found, pressed = read_again(log, entry)
    beside: Sequence[Joined | None] = [None] * len(found)
    without = "no log of the rig: force and position are not known"
    if pressed is not None:
        try:
            beside, without = joined_all(found, pressed), ""
        except SensorgenError as error:
            without = f"not joined with the rig's log: {error}"
    for recording, with_rig in zip(found, beside, strict=True):
        done = processed(recording, with_rig)
        one = done.recording
        marked = {name: count for name, count in one.counts().items() if count and name not in ("samples", "valid")}
        marks = (f"{count} samples marked: {name}" for name, count in marked.items())
        notes = (*filter(None, [without]), *done.notes, *marks)
        z = done.pairs.before_ohm if done.pairs else one.impedance_ohm[one.valid()]
        z = z[np.isfinite(z).all(axis=1)]
        scatter = np.full(z.shape[1], complex("nan"))
        if len(z) > 1:
            scatter = z.real.std(axis=0, ddof=1) + 1j * z.imag.std(axis=0, ddof=1)
        spread = np.asarray(scatter / np.sqrt(max(len(z), 1)))
        pairs = done.pairs if done.by_force else None
        yield Run(entry, one, done.filtered_s, done.filtered_ohm, z.mean(axis=0), spread, pairs, notes)
