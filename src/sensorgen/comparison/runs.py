"""Recordings of the log, brought to where a prediction can be held against them: rest, presses, differences."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sensorgen.errors import SensorgenError
from sensorgen.log import BenchRun, Log
from sensorgen.log.bench import reopened
from sensorgen.process import drift, lowpass, presses
from sensorgen.recording import joined
from sensorgen.recording.samples import Bools, Complex, Real, Recording

_LEAST = 16  # valid samples that a mean at rest needs
_BLOCKS = 50_000  # that a drift is fitted to


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
    force_n : (n,) array
        At the recording's samples [N]; nan everywhere without a rig's log.
    rest_ohm, rest_error_ohm : (m,) array
        Impedance at rest, and its standard error: of R in the real, of X in the imaginary part [ohm].
    pairs : Pairs or None
        Before and under each press; None where there are none.
    notes : tuple of str
        What was left out, or taken with care.
    """

    entry: BenchRun
    recording: Recording
    time_s: Real
    filtered_ohm: Complex
    force_n: Real
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
    found, pressed = reopened(log, entry)
    for one in found:
        silent = np.full(len(one.time_s), np.nan)
        if pressed is None:
            yield _processed(entry, one, silent, silent, ["no log of the rig: force and position are not known"])
            continue
        try:
            beside = joined(one, pressed)
        except SensorgenError as error:
            yield _processed(entry, one, silent, silent, [f"not joined with the rig's log: {error}"])
            continue
        notes = [beside.words(), *beside.notes]
        yield _processed(entry, beside.recording, beside.force_n, beside.set_position_mm, notes)


def _processed(entry: BenchRun, one: Recording, force: Real, position: Real, notes: list[str]) -> Run:
    valid = one.valid()
    time, filtered = lowpass.filtered(one)
    counts = {name: count for name, count in one.counts().items() if count and name not in ("samples", "valid")}
    notes = [*notes, *one.source.notes, *(f"{count} samples marked: {name}" for name, count in counts.items())]
    pairs = _pairs(one, force, position, notes)
    at_rest = valid & ~(force >= presses.THRESHOLD_N / 2) if np.isfinite(force).any() else valid
    if np.count_nonzero(at_rest) < _LEAST:
        at_rest = valid
    mean, error = _mean(one.impedance_ohm[at_rest]) if pairs is None else _mean(pairs.before_ohm)
    return Run(entry, one, time, filtered, force, mean, error, pairs, tuple(notes))


def _pairs(one: Recording, force: Real, position: Real, notes: list[str]) -> presses.Pairs | None:
    """Before and under each press, the drift of the rest taken out; nothing where the force is not known."""
    if not np.isfinite(force).any():
        return None
    try:
        spans = presses.pressed(one.time_s, force)
        fit = drift.fitted(*_in_blocks(one.time_s, one.impedance_ohm, one.valid(), force))
        clean = fit.removed(one.time_s, one.impedance_ohm)
        made = presses.pairs(one.time_s, clean, one.valid(), spans, force, position)
    except SensorgenError as error:
        notes.append(f"no presses: {error}")
        return None
    notes.extend(f"left out: {text}" for text in made.left_out)
    return made


def _in_blocks(time_s: Real, impedance_ohm: Complex, valid: Bools, force_n: Real) -> tuple[Real, Complex, Bools, Real]:
    """Means over blocks of neighbours, so that a long recording has ``_BLOCKS`` of them: drift is slower by far."""
    size = len(time_s) // _BLOCKS
    if size < 2:
        return time_s, impedance_ohm, valid, force_n
    end = len(time_s) // size * size
    blocks = [values[:end].reshape(-1, size, *values.shape[1:]) for values in (time_s, impedance_ohm, valid, force_n)]
    counts = np.asarray(blocks[2].all(axis=1), bool)
    return blocks[0].mean(axis=1), blocks[1].mean(axis=1), counts, np.abs(blocks[3]).max(axis=1)


def _mean(z: Complex) -> tuple[Complex, Complex]:
    """Mean of rows, and the standard error of its parts."""
    z = z[np.isfinite(z).all(axis=1)]
    scatter = (
        (z.real.std(axis=0, ddof=1) + 1j * z.imag.std(axis=0, ddof=1)) if len(z) > 1 else np.full(z.shape[1], np.nan)
    )
    return z.mean(axis=0), np.asarray(scatter / np.sqrt(max(len(z), 1)))
