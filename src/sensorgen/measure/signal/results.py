"""A processed recording, its hysteresis, and several recordings side by side: for people and for JSON."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import floor, hypot, isnan, log10, pi, sqrt

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.document import Cell, Column, Facts, Part, Table
from sensorgen.core.units import frequency_text
from sensorgen.measure.log import bench
from sensorgen.measure.recording import RigLog
from sensorgen.measure.signal.presses import Pairs
from sensorgen.measure.signal.run import Hysteresis, Processed, Ways

Values = tuple[float, ...]
_BY_NOISE = 3.2  # standard errors that the largest of the differences at 33 forces exceeds in 5 of 100 cases
_AT_REST = (
    Column("at rest", "Hz", si=True), Column("R", "ohm", right=True), Column("X", "ohm", right=True),
    Column("noise", "%", digits=2), Column("Cs", "F", si=True),
)  # fmt: skip


def _ends(tones_hz: Sequence[float]) -> list[int]:
    """The first and the last frequency, which people see; JSON has all."""
    return sorted({0, len(tones_hz) - 1})


def _values(array: Real) -> Values:
    return tuple(array.tolist())


@dataclass(frozen=True)
class PressResult:
    """A press; R and X before it and under it, their differences and standard errors, at each frequency [ohm].

    Force and position are None where they are not known.
    """

    time_s: float
    force_n: float | None
    position_mm: float | None
    before_re_ohm: Values
    before_im_ohm: Values
    pressed_re_ohm: Values
    pressed_im_ohm: Values
    difference_re_ohm: Values
    difference_im_ohm: Values
    error_re_ohm: Values
    error_im_ohm: Values


@dataclass(frozen=True)
class RestResult:
    """Impedance with nothing pressed, at one frequency.

    Attributes
    ----------
    frequency_hz : float
        Frequency [Hz].
    re_ohm, im_ohm : float
        Mean of the valid samples [ohm].
    noise_re_ohm, noise_im_ohm : float
        Standard deviation of one sample, drift included [ohm].
    capacitance_f : float or None
        In series, -1 / (omega X) [F]; None where X is not negative.
    """

    frequency_hz: float
    re_ohm: float
    im_ohm: float
    noise_re_ohm: float
    noise_im_ohm: float
    capacitance_f: float | None

    def row(self) -> tuple[Cell, ...]:
        """Frequency, R and X, their noise over abs(Z) [%], and series capacitance."""
        noise = hypot(self.noise_re_ohm, self.noise_im_ohm) / sqrt(2) / hypot(self.re_ohm, self.im_ohm)
        return self.frequency_hz, f"{self.re_ohm:.6g}", f"{self.im_ohm:.6g}", 100 * noise, self.capacitance_f


@dataclass(frozen=True)
class RecordingResult:
    """A processed recording.

    Attributes
    ----------
    file, lockin, program, rate_hz
        As in :class:`sensorgen.measure.recording.Source`.
    tones_hz : tuple of float
        Frequencies [Hz].
    counts, rig : dict of str to int
        Samples by mark; rows of the rig's log and those with errors, None without one.
    seconds : float
        Time of the last sample [s].
    notes : tuple of str
        Remarks.
    by_force : bool
        Whether the rig's log says where presses are; else the readings do.
    drift : float or None
        By how much Z drifted at the frequency where it drifted most [-]; None if no drift was removed.
    drift_law, drift_reason : str or None
        Its law, and why this one.
    presses : tuple of PressResult
        What each press changes.
    rest : tuple of RestResult
        Of a recording in which nothing is pressed.
    files : tuple of str
        That were written.
    """

    file: str
    lockin: int
    program: str
    rate_hz: float
    tones_hz: Values
    counts: dict[str, int]
    rig: dict[str, int] | None
    seconds: float
    notes: tuple[str, ...]
    by_force: bool
    drift: float | None
    drift_law: str | None
    drift_reason: str | None
    presses: tuple[PressResult, ...]
    rest: tuple[RestResult, ...]
    files: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """Samples, rig, drift, and a line for each press, or for each frequency at rest."""
        yield Facts(tuple(self._facts()))
        if self.presses:
            heads = (f"Δ{part} {frequency_text(self.tones_hz[k])}" for k in _ends(self.tones_hz) for part in "RX")
            columns = (Column("start", "s"), Column("force", "N", digits=3), Column("at", "mm", digits=3))
            changes = (Column(head, right=True) for head in heads)
            yield Table("presses", "", (*columns, *changes), tuple(map(self._row, self.presses)))
        if self.rest:
            yield Table("rest", "", _AT_REST, tuple(map(RestResult.row, self.rest)))
            negative = [frequency_text(one.frequency_hz) for one in self.rest if one.re_ohm < 0]
            if negative:
                yield f"negative resistance at {', '.join(negative)}: check the bridge's calibration"
        yield from self.files

    def _facts(self) -> Iterator[tuple[str, str]]:
        """Samples, rig, drift and presses."""
        yield from bench.LockIn(self.tones_hz, self.counts, self.seconds, self.program, lockin=self.lockin).words()
        if self.rig:
            yield from bench.RigDay(self.rig["rows"], self.rig["errors"]).words()
        else:
            yield "rig", "no log: forces and positions are not known"
        yield from (("", note) for note in self.notes)
        if self.drift is not None:
            yield "drift", f"{self.drift:.2%} of Z over the run, fitted to the rest, taken out of the presses"
            yield "", f"{self.drift_law}: {self.drift_reason}"
        if self.presses:
            how = "" if self.by_force else ", found by the readings alone"
            yield "presses", f"{len(self.presses)}{how}; ΔR and ΔX [ohm], standard errors in brackets"

    def _row(self, press: PressResult) -> tuple[float | str | None, ...]:
        changes = (
            in_brackets(value[k], error[k])
            for k in _ends(self.tones_hz)
            for value, error in (
                (press.difference_re_ohm, press.error_re_ohm), (press.difference_im_ohm, press.error_im_ohm)
            )
        )  # fmt: skip
        return press.time_s, press.force_n, press.position_mm, *changes


def in_brackets(value: float, error: float) -> str:
    """A value, with its standard error in units of its last digit: one digit of it, two where it begins with 1.

    >>> in_brackets(-12.3456, 0.0312), in_brackets(12345.6, 41.0), in_brackets(1.0, 0.0), in_brackets(-2.0, 0.0996)
    ('-12.35(3)', '12350(40)', '1', '-2.00(10)')
    """
    if not error > 0:
        return f"{value:.6g}"
    power = floor(log10(float(f"{error:.1e}")))
    power -= error < 1.95 * 10.0**power
    last = round(error / 10.0**power)
    shown = round(value, -power) + 0.0  # never -0
    return f"{shown:.{-power}f}({last})" if power < 0 else f"{shown:.0f}({last * 10**power})"


def of_recording(worked: Processed, rig: RigLog | None, files: Iterable[str] = ()) -> RecordingResult:
    """The result for a processed recording, the rig's log beside it, and files that were written of it."""
    one, drift, pairs = worked.recording, worked.drift, worked.pairs
    return RecordingResult(
        file=one.source.file, lockin=one.source.lockin, program=one.source.program or one.source.format,
        rate_hz=one.source.rate_hz, tones_hz=_values(one.tones_hz), counts=one.counts(),
        rig=rig.counts() if rig else None, seconds=float(np.ptp(one.time_s)), notes=worked.notes,
        by_force=worked.by_force,
        drift=float(abs(drift.at(one.time_s[-1:])).max()) if drift else None, drift_law=drift.law if drift else None,
        drift_reason=drift.reason if drift else None,
        presses=tuple(_press(pairs, i) for i in range(len(pairs.time_s))) if pairs else (),
        rest=() if pairs else tuple(_at_rest(worked)), files=tuple(files),
    )  # fmt: skip


def _at_rest(worked: Processed) -> Iterator[RestResult]:
    """Mean and scatter of the valid samples with no force at each frequency; nothing of fewer than two."""
    one = worked.recording
    z = worked.rest_ohm()
    z = z[np.isfinite(z).all(axis=1)]
    if len(z) < 2:
        return
    for frequency_hz, samples in zip(one.tones_hz.tolist(), z.T, strict=True):
        mean = complex(samples.mean())
        c = -1 / (2 * pi * frequency_hz * mean.imag) if mean.imag < 0 else None
        noise_re, noise_im = (float(part.std(ddof=1)) for part in (samples.real, samples.imag))
        yield RestResult(frequency_hz, mean.real, mean.imag, noise_re, noise_im, c)


def _press(pairs: Pairs, i: int) -> PressResult:
    force_n, position_mm = (None if isnan(v) else float(v) for v in (pairs.force_n[i], pairs.position_mm[i]))
    impedances: list[Complex] = [pairs.before_ohm[i], pairs.pressed_ohm[i], pairs.difference_ohm[i], pairs.error_ohm[i]]
    parts = (_values(part) for z in impedances for part in (z.real, z.imag))
    return PressResult(float(pairs.time_s[i]), force_n, position_mm, *parts)


@dataclass(frozen=True)
class PressHysteresis:
    """Hysteresis of R and X during one press, at each frequency; as in :class:`.hysteresis.Hysteresis`."""

    time_s: float
    force_n: tuple[float, float]
    share_re: Values
    share_im: Values
    error_re: Values
    error_im: Values
    at_n_re: Values
    at_n_im: Values
    lost_re: Values
    lost_im: Values


@dataclass(frozen=True)
class HysteresisResult:
    """Hysteresis of a run: its frequencies [Hz], its presses, those left out and why, and files that were written."""

    tones_hz: Values
    presses: tuple[PressHysteresis, ...]
    left_out: tuple[str, ...]
    files: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """A line for each press and frequency, the first and the last one."""
        share, error, at = Column("of R", "%", digits=3), Column("±", "%", digits=2), Column("at", "N", digits=3)
        columns = (
            Column("start", "s"), Column("to", "N", digits=3), Column("frequency"),
            share, error, at, Column("of X", "%", digits=3), error, at,
        )  # fmt: skip
        rows = (
            (
                p.time_s, p.force_n[1], frequency_text(self.tones_hz[k]),
                100 * p.share_re[k], 100 * p.error_re[k], p.at_n_re[k],
                100 * p.share_im[k], 100 * p.error_im[k], p.at_n_im[k],
            )
            for p in self.presses for k in _ends(self.tones_hz)
        )  # fmt: skip
        yield Table("presses", "", columns, tuple(rows))
        noisy = [
            share[k] < _BY_NOISE * error[k] for p in self.presses for k in _ends(self.tones_hz)
            for share, error in ((p.share_re, p.error_re), (p.share_im, p.error_im))
        ]  # fmt: skip
        if any(noisy):
            yield f"{sum(noisy)} of {len(noisy)} distances are below {_BY_NOISE} of their ±, as noise alone makes them"
        yield from (*self.left_out, *self.files)


def of_ways(tones_hz: Real, hysteresis: Ways, files: Iterable[str] = ()) -> HysteresisResult:
    """The result for the hysteresis of a run, and files that were written of it."""
    presses = tuple(_of_way(start, way) for start, way in hysteresis.ways.items())
    return HysteresisResult(_values(tones_hz), presses, hysteresis.left_out, tuple(files))


def _of_way(start_s: float, way: Hysteresis) -> PressHysteresis:
    half = len(way.share) // 2
    parts = (_values(p) for v in (way.share, way.error, way.at_n, way.lost) for p in (v[:half], v[half:]))
    return PressHysteresis(start_s, (float(way.force_n[0]), float(way.force_n[-1])), *parts)


@dataclass(frozen=True)
class SetResult:
    """Changes by the presses of a recording: a row for each press, a column for each frequency."""

    force_n: Values
    position_mm: Values
    difference_re_ohm: tuple[Values, ...]
    difference_im_ohm: tuple[Values, ...]


@dataclass(frozen=True)
class SetsResult:
    """Recordings side by side: frequencies [Hz], sets by name, and files that were written."""

    tones_hz: Values
    sets: dict[str, SetResult]
    files: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """Least and largest difference of each set, at the first and the last frequency."""
        least = (Column(f"{end} Δ{part}", "ohm") for part in "RX" for end in ("least", "most"))
        rows = (
            (name, len(one.force_n), frequency_text(self.tones_hz[k]), *_range(one.difference_re_ohm, k),
             *_range(one.difference_im_ohm, k))
            for name, one in self.sets.items() for k in _ends(self.tones_hz)
        )  # fmt: skip
        yield Table("sets", "", (Column("set"), Column("presses"), Column("frequency"), *least), tuple(rows))
        yield from self.files


def _range(values: tuple[Values, ...], k: int) -> tuple[float, float]:
    column = [row[k] for row in values]
    return min(column), max(column)


def of_sets(tones_hz: Real, sets: Mapping[str, Pairs], files: Iterable[str] = ()) -> SetsResult:
    """The result for recordings by name, and files that were written of them."""
    results = {
        name: SetResult(
            _values(pairs.force_n), _values(pairs.position_mm), tuple(map(_values, pairs.difference_ohm.real)),
            tuple(map(_values, pairs.difference_ohm.imag)),
        )
        for name, pairs in sets.items()
    }  # fmt: skip
    return SetsResult(_values(tones_hz), results, tuple(files))
