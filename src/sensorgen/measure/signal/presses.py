"""Presses of a run: planned at random, reproducible by a seed; detected, averaged, and their differences interpolated.

Planned forces and positions are independent and uniform, so that neither drift nor creep correlates with them. Repeated
presses come at random times of the run, not one after the other, so that they show repeatability and not relaxation.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.measure.recording.rig import MAD, principal_component

MOST_PRESSES = 100_000
_STEP_N, _STEP_MM = 0.001, 0.001  # resolution: the file has all digits


@dataclass(frozen=True)
class Step:
    """One press.

    Attributes
    ----------
    press : int
        Number in the run, from 1.
    point : int
        Number of the point, from 1; the same in a repeat.
    start_s : float
        Begin of the press, since the begin of the run [s].
    force_n, position_mm : float
        Force, and position of the tip's centre along the sensor [N], [mm].
    dwell_s, rest_s : float
        Length of the press, and of the rest after it [s].
    """

    press: Annotated[int, Column("press")]
    point: Annotated[int, Column("point")]
    start_s: Annotated[float, Column("start", "s")]
    force_n: Annotated[float, Column("force", "N")]
    position_mm: Annotated[float, Column("position", "mm", digits=5)]
    dwell_s: Annotated[float, Column("dwell", "s")]
    rest_s: Annotated[float, Column("rest", "s")]


@dataclass(frozen=True)
class RunPlan:
    """Parameters of a run.

    Attributes
    ----------
    seed : int
        Seed of the random numbers.
    presses : int
        Number of points; each is pressed ``1 + repeats`` times.
    force_n, position_mm : (float, float)
        Least and largest [N], [mm].
    dwell_s, rest_s : float
        Length of each press and of each rest [s].
    repeats : int
        Number of repeats of each point.
    design : str
        Name of the design; "" if unknown.
    """

    seed: int
    presses: int
    force_n: tuple[float, float]
    position_mm: tuple[float, float]
    dwell_s: float
    rest_s: float
    repeats: int = 0
    design: str = ""

    def __post_init__(self) -> None:
        """Check the ranges."""
        total = self.presses * (1 + self.repeats)
        if self.presses < 1 or self.repeats < 0 or total > MOST_PRESSES:
            raise OutOfRange(f"{self.presses} presses, each {self.repeats} times more; expected up to {MOST_PRESSES}")
        for name, (low, high) in {"forces": self.force_n, "positions": self.position_mm}.items():
            if not 0 <= low <= high < np.inf:
                raise OutOfRange(f"{name} from {low:g} to {high:g}; expected two numbers that rise, from 0 on")
        if not (0 < self.dwell_s < np.inf and 0 <= self.rest_s < np.inf):
            raise OutOfRange(f"dwell {self.dwell_s:g} s and rest {self.rest_s:g} s; expected a dwell above 0")

    def steps(self) -> list[Step]:
        """Presses in the order of the run, after a rest."""
        rng = np.random.default_rng(self.seed)
        force = np.round(rng.uniform(*self.force_n, self.presses) / _STEP_N) * _STEP_N
        position = np.round(rng.uniform(*self.position_mm, self.presses) / _STEP_MM) * _STEP_MM
        order = list(range(self.presses))
        for _ in range(self.repeats):
            order += rng.permutation(self.presses).tolist()
        each = self.dwell_s + self.rest_s
        starts = [round(self.rest_s + k * each, 6) for k in range(len(order))]
        return [
            Step(k, p + 1, start, round(float(force[p]), 6), round(float(position[p]), 6), self.dwell_s, self.rest_s)
            for k, (p, start) in enumerate(zip(order, starts, strict=True), 1)
        ]

    def seconds(self) -> float:
        """Length of the run [s]."""
        return self.rest_s + self.presses * (1 + self.repeats) * (self.dwell_s + self.rest_s)

    def to_json(self) -> str:
        """Parameters and presses."""
        data = {**asdict(self), "seconds": self.seconds(), "steps": [asdict(step) for step in self.steps()]}
        return json.dumps(data, indent=2, ensure_ascii=False) + "\n"

    def document(self) -> Iterator[Part]:
        """The presses, then their number and the length of the run."""
        steps = self.steps()
        yield Table.of("presses", "", steps)
        minutes, rest = divmod(round(self.seconds()), 60)
        hours, minutes = divmod(minutes, 60)
        yield f"{len(steps)} presses, {f'{hours} h {minutes} min' if hours else f'{minutes} min {rest} s'}"


THRESHOLD_N = 0.2
WINDOW_S, GUARD_S = 1.0, 0.3
_SHORTEST_S = 0.2
_LEAST = 8  # samples that a mean and its error need
_HYSTERESIS = 0.5
_STEP_S, _SIGNIFICANT = 0.3, 6.0
_ROUNDING = 1e-6  # of the signal: a smaller step is none, however quiet the readings are
_SAME, _SAME_N = 0.05, 0.05  # share, and least difference, up to which two forces are one


class PressTimes(NamedTuple):
    """Begin and end of a press [s]."""

    start_s: float
    end_s: float


def by_force(time_s: Real, force_n: Real, threshold_n: float = THRESHOLD_N) -> list[PressTimes]:
    """Presses by the force: from the threshold up to the fall below half of it.

    Parameters
    ----------
    time_s, force_n : (n,) array
        Time [s] and force [N]; nan where the force is unknown, which ends a press.
    threshold_n : float
        Least force of a press [N].

    Returns
    -------
    list of Press
        Presses of at least 0.2 s; also the last one if the run ends during it.
    """
    force = np.where(np.isfinite(force_n), force_n, -np.inf)
    switch = np.where(force >= threshold_n, 1, np.where(force < _HYSTERESIS * threshold_n, -1, 0))
    last = np.maximum.accumulate(np.where(switch != 0, np.arange(len(switch)), 0))
    spans = ((float(time_s[a]), float(time_s[b - 1])) for a, b in _spans(switch[last] == 1))
    return [PressTimes(start, end) for start, end in spans if end - start >= _SHORTEST_S]


def by_readings(time_s: Real, impedance_ohm: Complex) -> list[PressTimes]:
    """Presses by the readings alone: where they leave their usual level.

    Parameters
    ----------
    time_s : (n,) array
        Time, even steps [s].
    impedance_ohm : (n, m) array
        Valid readings [ohm].

    Raises
    ------
    BadInput
        Readings without any change, or fewer than 16.

    Notes
    -----
    Steps of the principal component of ln Z: where means over 0.3 s before and after differ by more than six times
    their noise. A slower change is no step, so that creep is no press; nor is a press that takes seconds. The sign of a
    press follows from the levels: after a press the readings return to their level before it, between two presses they
    do not, unless all presses are equally strong; then the first step is a press.
    """
    if len(time_s) < 2 * _LEAST:
        raise BadInput(f"{len(time_s)} readings; expected at least {2 * _LEAST} to find presses in")
    width = min(max(1, round(_STEP_S / float(np.median(np.diff(time_s))))), len(time_s) // 2)
    signal = principal_component(impedance_ohm)
    signal -= np.arange(len(signal)) * float(np.median(signal[width:] - signal[:-width])) / width
    sums = np.concatenate([[0.0], np.cumsum(np.pad(signal, width, mode="edge"))])
    means = (sums[width:] - sums[:-width]) / width  # over so many samples before, and from, each sample
    before, after = means[: len(time_s)], means[width : width + len(time_s)]
    step = after - before
    limit = max(_SIGNIFICANT * float(np.median(np.abs(step))) / MAD, _ROUNDING * float(np.ptp(signal)))
    edges = sorted(
        (int(a + np.argmax(sign * step[a:b])), sign) for sign in (1, -1) for a, b in _spans(sign * step > limit)
    )
    spans = _returning(edges, before, after, width, limit)
    return [PressTimes(float(time_s[i]), float(time_s[j])) for i, j in spans if time_s[j] - time_s[i] >= _SHORTEST_S]


def _spans(on: Mask) -> list[tuple[int, int]]:
    """First samples, and those after the last, of every span that is on."""
    edges = np.diff(np.concatenate([[False], on, [False]]).astype(int))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def _returning(
    edges: list[tuple[int, int]], before: Real, after: Real, width: int, limit: float
) -> list[tuple[int, int]]:
    """Presses from steps: of the two ways to pair them, the one whose presses return to the level before."""
    if not edges:
        return []
    places = np.arange(len(before))
    level_before = before[np.clip(places - width // 2, 0, len(before) - 1)]
    level_after = after[np.clip(places + width // 2, 0, len(after) - 1)]

    def difference(spans: list[tuple[int, int]]) -> float:
        return float(np.median([abs(level_after[j] - level_before[i]) for i, j in spans])) if spans else np.inf

    first = edges[0][1]
    likely, other = ([(i, j) for (i, a), (j, b) in pairwise(edges) if (a, b) == (s, -s)] for s in (first, -first))
    return other if difference(likely) > max(2 * difference(other), limit) else likely


@dataclass(frozen=True, eq=False)
class Pairs:
    """Readings before and under each press, a row per press and a column per frequency.

    Attributes
    ----------
    time_s : (p,) array
        Begin of the press [s].
    force_n, position_mm : (p,) array
        Mean force and position over the window [N], [mm].
    before_ohm, pressed_ohm : (p, m) array
        Means over the windows [ohm].
    difference_ohm : (p, m) array
        Pressed less before [ohm].
    error_ohm : (p, m) array
        Standard errors of the difference: of R in the real part, of X in the imaginary part [ohm].
    samples : (p, 2) array
        Readings in the two means.
    peak_n, hold_s : (p,) array
        Largest force of the press so far [N], and the time for which the force has been what it is [s]; nan if unknown.
    left_out : tuple of str
        Presses without enough readings.
    """

    time_s: Real
    force_n: Real
    position_mm: Real
    before_ohm: Complex
    pressed_ohm: Complex
    difference_ohm: Complex
    error_ohm: Complex
    samples: NDArray[np.intp]
    peak_n: Real
    hold_s: Real
    left_out: tuple[str, ...] = ()


def pairs(
    time_s: Real, impedance_ohm: Complex, valid: Mask, presses: list[PressTimes], force_n: Real, position_mm: Real
) -> Pairs:
    """Average the readings before and under each press, over a second each, apart from the ramps.

    Parameters
    ----------
    time_s : (n,) array
        Time [s].
    impedance_ohm : (n, m) array
        Readings, not filtered: their mean is the better filter, and its error is known [ohm].
    valid : (n,) array of bool
        Valid readings.
    presses : list of PressTimes
        As :func:`by_force` or :func:`by_readings` returns them.
    force_n, position_mm : (n,) array
        Force and position; nan where unknown [N], [mm].

    Raises
    ------
    BadInput
        No press with readings before and under it.

    Notes
    -----
    The error is that of the noise: the scatter about a straight line within each window, with the number of independent
    samples. It does not include drift between the two windows; see :mod:`sensorgen.measure.signal.drift`.
    """
    rows, left_out, last_end = [], [], -np.inf
    for k, press in enumerate(presses, 1):
        until, end = press.start_s - GUARD_S, press.end_s - GUARD_S
        before = _within(time_s, valid, max(until - WINDOW_S, last_end + GUARD_S), until)
        under = _within(time_s, valid, max(end - WINDOW_S, press.start_s + GUARD_S), end)
        last_end = press.end_s
        if min(len(before), len(under)) < _LEAST:
            counts = f"{len(before)} readings before and {len(under)} under it"
            left_out.append(f"press {k} at {press.start_s:.6g} s: {counts}")
            continue
        first, second = impedance_ohm[before], impedance_ohm[under]
        re, im = (
            np.hypot(_mean_error(time_s[before], a), _mean_error(time_s[under], b))
            for a, b in ((first.real, second.real), (first.imag, second.imag))
        )
        rows.append((
            press.start_s, _known_mean(force_n[under]), _known_mean(position_mm[under]), first.mean(axis=0),
            second.mean(axis=0), re + 1j * im, (len(before), len(under)),
            *_course(time_s, force_n, press.start_s, end - WINDOW_S / 2),
        ))  # fmt: skip
    if not rows:
        raise BadInput(
            f"{len(presses)} presses, none with {_LEAST} readings in the {WINDOW_S:g} s before it and before its end; "
            f"expected some: record {_LEAST / WINDOW_S:g} readings a second or more"
        )
    start, force, position, unloaded, loaded, error, samples, peak, hold = map(np.array, zip(*rows, strict=True))
    return Pairs(
        start, force, position, unloaded, loaded, loaded - unloaded, error, samples, peak, hold, tuple(left_out)
    )  # fmt: skip


def _course(time_s: Real, force_n: Real, start_s: float, at_s: float) -> tuple[float, float]:
    """Largest force so far, and since when the force has been as at that time."""
    first, last = np.searchsorted(time_s, [start_s, at_s])
    force = force_n[first : last + 1]
    if not np.isfinite(force).any():
        return np.nan, np.nan
    now = force[np.isfinite(force)][-1]
    other = np.flatnonzero(~(np.abs(force - now) <= max(_SAME * now, _SAME_N)))
    since = time_s[first + other[-1] + 1] if other.size else start_s
    return float(np.nanmax(force)), float(at_s - since)


def _known_mean(values: Real) -> float:
    """Mean without nan; nan of nothing."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _within(time_s: Real, valid: Mask, start_s: float, end_s: float) -> NDArray[np.intp]:
    """Valid readings between two times."""
    first, after = np.searchsorted(time_s, start_s), np.searchsorted(time_s, end_s, side="right")
    return first + np.flatnonzero(valid[first:after])


def _mean_error(time_s: Real, values: Real) -> Real:
    """Standard error of the mean of readings with correlated scatter about a straight line."""
    t = time_s - time_s.mean()
    residual = values - values.mean(axis=0)
    residual = residual - t[:, None] * (t @ residual / (t @ t))
    squares, count = (residual**2).sum(axis=0), len(residual)
    correlation = (residual[1:] * residual[:-1]).sum(axis=0) / np.maximum(squares, 1e-300)
    rho = np.clip(correlation + 1 / count, 0.0, 1 - 1 / count)
    return np.asarray(np.sqrt(squares / (count - 2) / count * (1 + rho) / (1 - rho)))


POINTS = 50


@dataclass(frozen=True, eq=False)
class Surface:
    """Values on a grid, linear between the presses (Delaunay triangulation).

    Attributes
    ----------
    force_n, position_mm : (k,) array
        Axes of the grid [N], [mm].
    values : (k, k, m) array
        By force, then position; nan outside the convex hull of the presses.
    """

    force_n: Real
    position_mm: Real
    values: Real


def surface(force_n: Real, position_mm: Real, values: Real, points: int = POINTS) -> Surface:
    """Interpolate scattered presses linearly.

    Parameters
    ----------
    force_n, position_mm : (p,) array
        Force and position of the presses [N], [mm].
    values : (p, m) array
        Readings, as differences of R or X at every frequency.
    points : int
        Grid points along each axis.

    Raises
    ------
    BadInput
        Fewer than three presses, or all of them on one line.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    where = np.column_stack([force_n, position_mm])
    if len(where) < 3:
        raise BadInput(f"{len(where)} presses; expected three or more for a surface")
    forces, positions = (np.linspace(axis.min(), axis.max(), points) for axis in where.T)
    try:
        through = LinearNDInterpolator(where, values, rescale=True)
    except QhullError:
        raise BadInput("all presses lie on one line over force and position: they span no surface") from None
    return Surface(forces, positions, np.asarray(through(*np.meshgrid(forces, positions, indexing="ij"))))


def normalised(sets: Sequence[Real], *, together: bool = False) -> list[Real]:
    """Scale the differences of several sets to 0 to 1, as in figure 6.33 of the thesis.

    Parameters
    ----------
    sets : sequence of (p, m) arrays
        Differences of R, or of X, of each set; a column per frequency.
    together : bool
        One scale for all sets, to compare sizes; else one for each set, to compare shapes.

    Returns
    -------
    list of (p, m) arrays
        0 is the least and 1 the largest of each column; nan where all values of a column are equal.

    Examples
    --------
    >>> [values.ravel().tolist() for values in normalised([np.array([[1.0], [3.0]]), np.array([[2.0], [5.0]])])]
    [[0.0, 1.0], [0.0, 1.0]]
    """
    scales = [_scale(np.vstack(list(sets)))] * len(sets) if together and sets else [_scale(values) for values in sets]
    return [np.asarray((values - low) / span) for values, (low, span) in zip(sets, scales, strict=True)]


def _scale(values: Real) -> tuple[Real, Real]:
    low, span = np.nanmin(values, axis=0), np.nanmax(values, axis=0) - np.nanmin(values, axis=0)
    return low, np.where(span > 0, span, np.nan)
