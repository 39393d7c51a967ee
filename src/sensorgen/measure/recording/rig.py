r"""Log of the rig: forces, positions and errors in its own time, and the offset of that clock from a recording's.

The sensor responds to the force, so that the recording is fitted by

.. math::
   y(t) = \sum_{i=0}^{3} c_i t^i + \sum_{i=1}^{2} b_i \ln(1 + t / \tau_i) + \sum_{i=1}^{3} \sum_{j=0}^{2} c_{ij} F^i x^j
          + \sum_{i=1}^{3} e_i (F - F_i)_+ + (\hat F - F) \sum_{i=0}^{2} h_i F^i
          + \sum_{i=1}^{5} d_i \int_0^t F(s)\, e^{-(t - s)/T_i} \frac{ds}{T_i}

with F and x shifted by the offset, y the principal component of ln Z, creep with time constants of a tenth and a
hundredth of the run, and relaxation times T from one second to half a minute: without them a slow film would count as
a late clock, as hysteresis without the terms of the largest force of the press so far, :math:`\hat F`, and a law that
is steep at small forces without the bends at :math:`F_i`. A cross-correlation over all offsets gives the starts, its
highest peaks, those where a press lowers abs(Z) if there are any: equal presses resemble themselves half a period late,
too. From each follow a search and Gauss-Newton; the best fit counts. The standard error is that of the fit, with the
number of independent samples.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading
from sensorgen.measure import csv_table
from sensorgen.measure.csv_table import SAME_NAMES, CsvTable, listed
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.recording.samples import MAX_SKEW, Recording
from sensorgen.measure.recording.spool import MOST_BYTES

_TIME, _STAMP = "time_s", "stamp_s"
_NEEDED = ("set_force_n", "set_position_mm")
_MOST_ROWS = 1 << 21  # 29 h at 20 rows/s
_FORCE, _ERROR = "force_n", "error"
_NO_ERROR = frozenset({"", "0", "0.0", "false", "no", "none", "ok"})


@dataclass(frozen=True, eq=False)
class RigLog:
    """Rows of the rig's log.

    Attributes
    ----------
    time_s : (n,) array
        Time by the rig's clock, since 1970 or since any other moment [s].
    set_force_n, set_position_mm : (n,) array
        Set force [N]; set position of the tip's centre along the sensor [mm].
    force_n : (n,) array
        Measured force [N]; nan where none was measured.
    error : (n,) array
        Rows that report an error, are not later than all rows before, or are incomplete.
    notes : tuple of str
        Remarks on the whole log.
    stamped : bool
        Whether the time is by the computer that stamped the recording, too.
    """

    time_s: Real
    set_force_n: Real
    set_position_mm: Real
    force_n: Real
    error: Mask
    notes: tuple[str, ...] = ()
    stamped: bool = False

    def sound(self) -> tuple[Real, Real, Real, Real]:
        """Time [s], force (the set one if none was measured), set force [N] and position [mm] of sound rows."""
        good = ~self.error
        force = np.where(np.isfinite(self.force_n), self.force_n, self.set_force_n)
        return self.time_s[good], force[good], self.set_force_n[good], self.set_position_mm[good]

    def counts(self) -> dict[str, int]:
        """Number of rows, and of those with an error."""
        return {"rows": len(self.time_s), "errors": int(np.count_nonzero(self.error))}


def rig(path: Path | str, columns: Mapping[str, str] | None = None) -> RigLog:
    """Read the rig's log.

    Parameters
    ----------
    path : Path or str
        CSV file with the columns ``time_s``, ``set_force_n`` and ``set_position_mm``; ``force_n`` and ``error`` are
        optional. Times are seconds, or dates as 2023-05-04T12:00:01.25+02:00. ``stamp_s`` in place of ``time_s``:
        seconds since 1970 by the computer that stamped the recording, too.
    columns : mapping of str to str, optional
        From the file's column names to sensorgen's.

    Raises
    ------
    BadInput
        A file that cannot be read, lacks a column or has a cell that is no number, with file, row and column.
    """
    path = Path(path)
    checked_head(path, MOST_BYTES, "a rig's log as CSV")
    with reading(path), csv_table.opened(path, columns or SAME_NAMES) as table:
        return _read(table)


def _check_names(table: CsvTable, time_name: str) -> None:
    for needed in (time_name, *_NEEDED):
        if table.names.count(needed) != 1:
            expected = ", ".join((_TIME, *_NEEDED))
            message = f"columns {listed(table.names)}; expected {expected} once each, and {_FORCE} and {_ERROR} if "
            raise table.error(1, f"{message}available: {needed} is not there once")


def _read(table: CsvTable) -> RigLog:
    names = table.names
    time_name = _STAMP if _STAMP in names else _TIME
    _check_names(table, time_name)
    force, error = ([names.index(name)] if name in names else [] for name in (_FORCE, _ERROR))
    needed_columns = list(map(names.index, (time_name, *_NEEDED)))
    numbers, reported = [], []
    for block in table.blocks([*needed_columns, *force], error, dates=needed_columns[:1], truncated=True):
        numbers.append(block.numbers)
        reported.append(np.array(["".join(c).strip().lower() not in _NO_ERROR for c in block.text]))
        if block.rows[-1] > _MOST_ROWS:
            raise table.error(block.rows[-1], f"more rows than expected, {_MOST_ROWS}; split the log of the rig")
    values = np.concatenate(numbers)
    incomplete = ~np.isfinite(values[:, :3]).all(axis=1)
    late = ~(values[:, 0] > np.fmax.accumulate(np.concatenate([[-np.inf], values[:-1, 0]])))
    notes = ["the last row is incomplete: dropped"] if table.truncated else []
    if late.any():
        notes.append(f"{np.count_nonzero(late)} rows are not later than the rows before: taken as errors")
    time, set_force, position = values[:, :3].T
    measured = values[:, 3] if force else np.full(len(values), np.nan)
    error_rows = np.concatenate(reported) | late | incomplete
    return RigLog(time, set_force, position, measured, error_rows, tuple(notes), time_name == _STAMP)


_FINE_S = 0.02  # grid of a relaxation
_MOST_GRID = 1 << 21  # 11.6 h of the fine one
_NOISELESS = 1e-9  # of the spread: noise below it counts as none
_ROUNDING = 1e-12  # of ln Z: a smaller spread is no signal


def principal_component(impedance_ohm: Complex) -> Real:
    """First principal component of ln Z in units of its noise, without linear trend; it rises as abs(Z) falls.

    Parameters
    ----------
    impedance_ohm : (n, m) array
        Valid readings [ohm].

    Returns
    -------
    (n,) array
        Component over time [-].

    Raises
    ------
    BadInput
        Readings without any change.
    """
    t = np.linspace(-1, 1, len(impedance_ohm))
    basis = np.column_stack([np.ones_like(t), t])
    channels: list[Real] = []
    for parts in ((np.log(np.abs(z)), np.unwrap(np.angle(z))) for z in impedance_ohm.T):  # one by one, to save memory
        for channel in parts:
            noise, spread = float(np.median(np.abs(np.diff(channel)))), float(np.ptp(channel))
            if spread > _ROUNDING:
                channel = channel / (noise if noise > _NOISELESS * spread else spread)
                channels.append(channel - basis @ np.linalg.lstsq(basis, channel, rcond=None)[0])
    if not channels:
        raise BadInput("the readings do not change: they show no presses")
    directions = np.linalg.svd([[a @ b for b in channels] for a in channels])[2]
    component = np.zeros_like(t)
    for weight, channel in zip(directions[0], channels, strict=True):
        component += weight * channel
    rise = float(component @ np.log(np.abs(impedance_ohm)).sum(axis=1))
    return np.asarray(component * np.copysign(1.0, -rise))


def relaxation(time_s: Real, force_n: Real, tau_s: float) -> Callable[[Real], Real]:
    r"""Response of one relaxation time to a force, :math:`\int F(s) e^{-(t - s)/\tau} ds / \tau`.

    Parameters
    ----------
    time_s, force_n : (n,) array
        Time, rising [s], and force [N]; linear in between, and where the force is nan.
    tau_s : float
        Time constant [s].

    Returns
    -------
    callable
        From times [s] to the response [N].
    """
    from scipy.signal import lfilter

    known = np.isfinite(force_n)
    if not known.any():
        return np.zeros_like
    step = max(_FINE_S, float(time_s[-1] - time_s[0]) / _MOST_GRID)
    grid = np.arange(time_s[0], time_s[-1] + step, step)
    decay = np.exp(-step / tau_s)
    response = lfilter([(1 - decay) / 2] * 2, [1, -decay], np.interp(grid, time_s[known], force_n[known]))
    return lambda at_s: np.interp(at_s, grid, response)


_GRID_S = 0.05  # of the correlation
_MOST_FITTED = 40_000
_LEAST_SHARE = 0.05  # of the recording's variance that the force must explain
_LEAST_F = 8.0  # Fisher's F: the best of thousands of offsets reaches this by chance, with correlated noise
_SIGNIFICANT = 3.0  # standard errors from which on a skew is one
_STEPS = 20
_CREEP = (10.0, 100.0)  # length of the run over time constants of creep
MAD = 0.6745  # median absolute deviation of noise over its standard deviation
_CLEAR = 4.0  # least unloading that is told from noise, over its standard deviation [-]
_LIFTED = 0.005  # of the largest force: below it the tip does not press
_RELAXATION_S = (1.0, 2.0, 4.0, 8.0, 32.0)
_PEAK, _PEAKS, _APART_S = 0.8, 6, 1.0  # of the correlation: share of the highest, number, and distance of those tried
_AROUND_S, _FEW = np.linspace(-2.0, 2.0, 41), 4000  # of the search around each of them; samples for it
_BENDS = (1 / 64, 1 / 16, 1 / 4)  # of the law, over the largest force
_MEAN_S = (1e-3, 1.0)  # least and most over which signal and responses are averaged before they are compared
_QUIET = 20.0  # times in which the force rises by its noise, that such a mean spans


@dataclass(frozen=True)
class Offset:
    """Relation of two clocks.

    Attributes
    ----------
    offset_s, offset_error_s : float
        To be added to the rig's time to get the recording's, and its standard error [s].
    skew, skew_error : float
        Rate of the recording's clock over the rig's, less 1, and its standard error; 0 unless significant [-].
    middle_s : float
        The recording's time at which the offset holds [s].
    explained : float
        Share of the signal's variance that the force explains [-].
    by_chance : bool
        Whether chance explains as much.
    """

    offset_s: float
    offset_error_s: float
    skew: float
    skew_error: float
    middle_s: float
    explained: float
    by_chance: bool

    def words(self) -> str:
        """The offset, for people."""
        if np.isnan(self.offset_error_s):
            why = f"no significant response to the force (it explains {self.explained:.1%} of the signal)"
            if not self.by_chance:
                why = f"one computer stamped both, but the force fits best more than {_STAMPED_S:g} s away"
            return f"clocks assumed to agree: {why}"
        skew = f", skew {self.skew * 1e6:.3g} +- {self.skew_error * 1e6:.2g} ppm" if self.skew else ""
        sign = "-" if self.offset_s < 0 else "+"
        return f"rig's clock {sign} {abs(self.offset_s):.4f} +- {self.offset_error_s:.2g} s{skew}"


NO_CLOCKS = Offset(np.nan, np.nan, 0.0, np.nan, np.nan, 0.0, by_chance=True)


def estimated(recording: Recording, time: Real, rig: RigLog, within_s: float) -> Offset:
    """Offset of the clocks by one lock-in's readings.

    Parameters
    ----------
    recording : Recording
        Recording of the lock-in.
    time : (n,) array
        Its time by the clock to compare with the rig's [s].
    rig : RigLog
        Log of the rig.
    within_s : float
        Largest offset [s].

    Raises
    ------
    BadInput
        Too few samples or rows.
    """
    valid, rows = np.flatnonzero(recording.valid()), int(np.count_nonzero(~rig.error))
    if rows < 2 or len(valid) < 16:
        raise BadInput(f"{rows} rows of the rig and {len(valid)} samples without errors; expected at least 2 and 16")
    used = valid[:: max(1, len(valid) // _MOST_FITTED)]
    signal = principal_component(recording.impedance_ohm[used])
    starts = _correlated(time[used], signal, rig, within_s)
    refined = (_refined(time[used], signal, rig, start) for start in starts)
    return min(refined, key=lambda offset: (offset.by_chance, -offset.explained))


def _correlated(time: Real, signal: Real, rig: RigLog, within_s: float) -> list[float]:
    """Offsets at the highest peaks of the cross-correlation of signal and force, where abs(Z) falls if any [s]."""
    from scipy.signal import correlate, find_peaks

    rows, force, _, _ = rig.sound()
    step = max(_GRID_S, (np.ptp(time) + np.ptp(rows)) / _MOST_GRID)
    ours = _high_pass(np.interp(np.arange(time[0], time[-1], step), time, signal))
    theirs = _high_pass(np.interp(np.arange(rows[0], rows[-1], step), rows, force))
    if len(ours) < 4 or len(theirs) < 4:
        raise BadInput(f"{min(np.ptp(time), np.ptp(rows)):.3g} s to compare; expected at least {4 * step:g} s")
    correlation = correlate(ours, theirs, method="fft")
    lags = np.arange(-(len(theirs) - 1), len(ours))
    shared = np.minimum(np.minimum(len(ours), len(theirs)), np.minimum(lags + len(theirs), len(ours) - lags))
    offsets = time[0] - rows[0] + lags * step
    allowed = (shared * 2 >= min(len(ours), len(theirs))) & (np.abs(offsets) <= within_s)
    if not allowed.any():
        raise BadInput(
            f"recording and rig's log do not overlap within {within_s:g} s: their clocks are "
            f"{time[0] - rows[0]:.6g} s apart"
        )
    score = np.where(allowed, np.abs(correlation) / np.sqrt(np.maximum(shared, 1)), -1.0)
    edged = np.pad(score, 1, constant_values=-1.0)
    peaks = find_peaks(edged, height=_PEAK * score.max(), distance=max(round(_APART_S / step), 1))[0] - 1
    falling = peaks[correlation[peaks] > 0]
    peaks = falling if len(falling) else peaks
    return [float(offsets[k]) for k in peaks[np.argsort(-score[peaks])][:_PEAKS]]


def _high_pass(values: Real) -> Real:
    """Values less their moving average over 20 s."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(values - uniform_filter1d(values, min(len(values), round(20 / _GRID_S)), mode="nearest"))


def _responses(rig: RigLog) -> tuple[Real, Real, float]:
    """Rows of the rig's log [s], terms of the fit at each of them (n, k), and the time to average over [s]."""
    rows, force, _, position = rig.sound()
    where = (position - position.mean()) / max(float(np.ptp(position)), 1e-9)
    least = 2 * float(np.median(np.diff(rows)))  # a faster relaxation and a late clock look alike in so few rows
    slow = [relaxation(rows, force, max(tau, least)) for tau in _RELAXATION_S]
    noise = float(np.median(np.abs(np.diff(force, 2)))) / (MAD * 6**0.5) if len(force) > 2 else 0.0
    pressed = force > max(_LIFTED * force.max(), _CLEAR * noise)
    apart = np.cumsum(np.diff(pressed, prepend=False)) * 2 * np.ptp(force)  # raises each press above those before
    peak = np.maximum.accumulate(force + apart) - apart
    back = np.where(pressed, np.maximum(peak - force - _CLEAR * noise, 0), 0)
    powers = ((force, force**2, force**3), (1.0, where, where**2))
    bent = (np.maximum(force - share * force.max(), 0.0) for share in _BENDS)
    immediate = (*(a * b for a, b in product(*powers)), *bent, back, back * force, back * force**2)
    fastest = np.abs(np.interp(rows + 1.0, rows, force) - force).max()  # in a second
    mean_s = float(np.clip(_QUIET * noise / max(fastest, 1e-9), *_MEAN_S))
    return rows, np.column_stack([*immediate, *(term(rows) for term in slow)]), mean_s


def _averaged(time_s: Real, columns: Real, mean_s: float) -> Callable[[Real], Real]:
    """Means of columns (n, k) over a span around any times, which have as little noise as a slow response."""
    ends = np.concatenate([[time_s[0] - mean_s], time_s, [time_s[-1] + mean_s]])
    level = np.vstack([columns[:1], columns, columns[-1:]])
    area = np.vstack([0 * level[:1], np.cumsum((level[1:] + level[:-1]) / 2 * np.diff(ends)[:, None], axis=0)])

    def means(at_s: Real) -> Real:
        later, earlier = at_s + mean_s / 2, at_s - mean_s / 2
        return np.column_stack([np.interp(later, ends, of) - np.interp(earlier, ends, of) for of in area.T]) / mean_s

    return means


def _refined(time: Real, signal: Real, rig: RigLog, offset: float) -> Offset:
    """Gauss-Newton for offset and skew, from a search around a first offset."""
    middle = float((time[0] + time[-1]) / 2)
    half = max(float(np.ptp(time)) / 2, 1e-9)
    u = (time - middle) / half
    h = float(np.median(np.diff(rig.time_s[~rig.error]))) / 2
    rows, columns, mean_s = _responses(rig)
    responses, unaveraged = _averaged(rows, columns, mean_s), signal
    signal = _averaged(time, signal[:, None], mean_s)(time)[:, 0]
    creep = [np.log1p((1 + u) * ratio / 2) for ratio in _CREEP]
    drift, skew = np.column_stack([np.ones_like(u), u, u**2, u**3, *creep]), 0.0
    few, lag = slice(None, None, max(1, len(time) // _FEW)), max(1, round(mean_s / float(np.median(np.diff(time)))))

    def misfit(by: float) -> float:
        model = np.hstack([drift[few], responses(time[few] - offset - by)])
        residual = signal[few] - model @ _least_squares(model, signal[few])
        return float(residual @ residual)

    offset += float(min(_AROUND_S, key=misfit))
    covariance, fitted, residual = np.full((2, 2), np.nan), signal * 0, signal
    for _ in range(_STEPS):
        at = time - offset - skew * (time - middle)
        terms = responses(at)
        model = np.hstack([drift, terms])
        weights = _least_squares(model, signal)
        of_force = weights[drift.shape[1] :]
        fitted, residual = terms @ of_force, signal - model @ weights
        slope = -((responses(at + h) - responses(at - h)) / (2 * h)) @ of_force
        extended = np.hstack([model, slope[:, None], (slope * u * half)[:, None]])
        step = _least_squares(extended, residual)[-2:]
        covariance = _covariance(extended, residual, lag)
        offset, skew = offset + float(np.clip(step[0], -h, h)), float(np.clip(skew + step[1], -MAX_SKEW, MAX_SKEW))
        if abs(step[0]) < 1e-3 * covariance[0, 0] ** 0.5 or abs(step[0]) < 1e-9:
            break
    error, skew_error = np.sqrt(np.diag(covariance))
    explained = float(np.var(fitted) / (np.var(fitted) + np.var(residual))) if np.var(signal) > 0 else 0.0
    significant = bool(abs(skew) > _SIGNIFICANT * skew_error)
    terms = np.column_stack([np.interp(at, rows, column) for column in columns.T])
    by_chance = explained < _LEAST_SHARE or _fisher_f(unaveraged, drift, terms) < _LEAST_F
    return Offset(offset, float(error), skew if significant else 0.0, float(skew_error), middle, explained, by_chance)


def _fisher_f(signal: Real, drift: Real, terms: Real) -> float:
    """Fisher's F of the immediate response to the force, beside drift and relaxation, which follow correlated noise."""
    slow = np.hstack([drift, terms[:, -len(_RELAXATION_S) :]])
    without, residual = (signal - of @ _least_squares(of, signal) for of in (slow, np.hstack([drift, terms])))
    immediate = terms.shape[1] - len(_RELAXATION_S)
    free = _independent(residual) - slow.shape[1] - immediate
    more = float(without @ without) / max(float(residual @ residual), 1e-300) - 1
    return float(more * free / immediate)


def _least_squares(model: Real, signal: Real) -> Real:
    """Weights by the normal equations: ten times as fast as by QR, and accurate enough for a step."""
    size = np.sqrt((model**2).sum(axis=0))
    size = np.where(size > 0, size, 1.0)
    scaled = model / size
    return np.asarray(np.linalg.lstsq(scaled.T @ scaled, scaled.T @ signal, rcond=1e-13)[0] / size)


def _covariance(model: Real, residual: Real, lag: int = 1) -> Real:
    """Covariance of the last two weights for correlated residuals."""
    variance = float((residual**2).sum()) / max(len(residual) - model.shape[1], 1)
    variance *= len(residual) / _independent(residual, lag)
    return np.asarray(np.linalg.pinv(model.T @ model)[-2:, -2:] * variance)


def _independent(residual: Real, lag: int = 1) -> float:
    """Number of independent residuals of a first-order autoregressive process, by those a lag apart."""
    count = len(residual) / lag
    rho = float((residual[lag:] * residual[:-lag]).sum() / max(float((residual**2).sum()), 1e-300))
    rho = min(max(rho, 0.0), 1 - 1 / count)
    return count * (1 - rho) / (1 + rho)


_SILENT = 5.0  # median row distances beyond which the rig's log has a gap
_STAMPED_S = 1.0  # by which stamps of one computer differ at most: blocks that wait, instruments that take their time


@dataclass(frozen=True, eq=False)
class Joined:
    """A recording with force and position.

    Attributes
    ----------
    recording : Recording
        With the mark "rig error" where the rig's log has a gap or an error.
    force_n : (n,) array
        Measured force, or the set force where none was measured [N]; nan in gaps of the rig's log.
    set_force_n, set_position_mm : (n,) array
        Set force [N] and position [mm]; nan in gaps of the rig's log.
    clocks : Offset
        Of the recording's real time from the rig's.
    notes : tuple of str
        Remarks.
    """

    recording: Recording
    force_n: Real
    set_force_n: Real
    set_position_mm: Real
    clocks: Offset
    notes: tuple[str, ...] = ()


def joined_all(recordings: Sequence[Recording], rig: RigLog) -> tuple[Joined, ...]:
    """All lock-ins of a file, each joined with the rig's log.

    They share one clock: the offset with the least standard error is used for all of them, also for a lock-in that
    does not respond to the force.

    Parameters
    ----------
    recordings : sequence of Recording
        Recordings of the lock-ins.
    rig : RigLog
        Log of the rig; rows with errors are ignored. Its clock has any offset with half of the shorter record in
        common, or up to a second where one computer stamped both.

    Raises
    ------
    BadInput
        Too few samples or rows; no response to the force, and no common clock to assume instead.
    """
    common_clock = all(np.isfinite(one.clock.epoch_s) for one in recordings)
    times = [one.clock.real_s(one.time_s) if common_clock else one.time_s for one in recordings]
    limit_s = _STAMPED_S if common_clock and rig.stamped else np.inf
    offset = _best(recordings, times, rig, limit_s)
    if offset.by_chance or abs(offset.offset_s) > limit_s:  # its refinement looks beyond
        _refuse_apart(times[0], rig, offset, 0.0 if common_clock else 0.5)
        offset = replace(offset, offset_s=0.0, offset_error_s=np.nan, skew=0.0, skew_error=np.nan)
    return tuple(_joined(one, rig, time, offset) for one, time in zip(recordings, times, strict=True))


def _refuse_apart(time: Real, rig: RigLog, offset: Offset, share: float) -> None:
    """Refuse clocks whose offset is unknown, unless that share of the shorter record lies in the other."""
    rows = rig.sound()[0]
    common = min(time[-1], rows[-1]) - max(time[0], rows[0])
    if not common > share * min(np.ptp(time), np.ptp(rows)):
        raise BadInput(
            f"the force explains {offset.explained:.1%} of the readings: too little to find the offset of the clocks, "
            f"which have {max(common, 0):.4g} s in common (recording from {time[0]:.6g} s, rig's log from "
            f"{rows[0]:.6g} s); expected time stamps of both, or times that count from the same moment"
        )


def _best(recordings: Sequence[Recording], times: Sequence[Real], rig: RigLog, within_s: float) -> Offset:
    """Offset with the least standard error; one of a lock-in that responds goes before."""
    offsets: list[Offset] = []
    faults: list[BadInput] = []
    for one, time in zip(recordings, times, strict=True):
        try:
            offsets.append(estimated(one, time, rig, within_s))
        except BadInput as error:  # no fault where another lock-in responds
            faults.append(error)
    if not offsets:
        raise faults[0]
    return min(offsets, key=lambda offset: (offset.by_chance, offset.offset_error_s))


def _joined(recording: Recording, rig: RigLog, time: Real, offset: Offset) -> Joined:
    """Columns of the rig at the samples' times."""
    at = time - offset.offset_s - offset.skew * (time - offset.middle_s)
    rows, force, set_force, position = rig.sound()
    before = np.searchsorted(rows, at, side="right") - 1
    inside = (before >= 0) & (at <= rows[-1])
    last = np.clip(before, 0, len(rows) - 1)
    step = float(np.median(np.diff(rows)))
    after = np.minimum(last + 1, len(rows) - 1)
    silent = ~inside | ((rows[after] - rows[last] > _SILENT * step) & (at - rows[last] > step))
    mask = np.where(silent, np.nan, 1.0)
    finite = np.isfinite(rig.time_s)
    order = np.argsort(rig.time_s[finite], kind="stable")
    every, error = rig.time_s[finite][order], rig.error[finite][order]
    later = np.clip(np.searchsorted(every, at), 1, len(every) - 1)
    nearest = np.where(at - every[later - 1] <= every[later] - at, later - 1, later)
    marks = dict(recording.marks)
    marks["rig error"] = marks["rig error"] | silent | error[nearest]  # of the nearest row
    notes = list(rig.notes)
    if silent.any():
        notes.append(f"{np.count_nonzero(silent)} samples while the rig was silent")
    return Joined(
        replace(recording, marks=marks), np.interp(at, rows, force) * mask, set_force[last] * mask,
        position[last] * mask, offset, tuple(notes),
    )  # fmt: skip
