"""Parts of a plan as presses: where each is, and its force over time."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, nan, pi, sin

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.measure.lab.experiment import Approach, Experiment, ForceSweep, Hold, Next, Ramp, Random, Sine
from sensorgen.measure.signal.presses import GUARD_S, WINDOW_S
from sensorgen.measure.signal.schedule import RunPlan

AVERAGED_S = WINDOW_S + GUARD_S  # end of every hold, over which the evaluation averages [s]
_AT_PEAK_S = 0.5  # how long a higher force is held before the force of the press
_LANDING_S = 2.0  # lift, approach and landing of one press, about
_TRAVEL_S = 8.0  # to another place, about: a part of the rest


@dataclass(frozen=True)
class PlannedPress:
    """One press.

    Attributes
    ----------
    number : int
        In the plan, from 1.
    part : int
        Part of the plan, from 0.
    kind : str
        Of the part.
    place_mm : float
        Of the tip's centre [mm]; nan where it is chosen during the run.
    course : tuple of (float, float)
        Time since the landing and force, linear in between; empty where it is chosen during the run [s], [N].
    rest_s : float
        Rest before it, tip up [s].
    force_n, peak_n, hold_s : float
        Force at which it is read, largest force before, and time at the force before the average [N], [s].
    wave : (float, float)
        Amplitude and frequency of what is added to the last piece of the course [N], [Hz].
    """

    number: int
    part: int
    kind: str
    place_mm: float
    course: tuple[tuple[float, float], ...]
    rest_s: float
    force_n: float
    peak_n: float
    hold_s: float
    wave: tuple[float, float] = (0.0, 0.0)

    @property
    def seconds(self) -> float:
        """From the landing to the lift [s]."""
        return self.course[-1][0] if self.course else 0.0

    def force_at(self, time_s: float) -> float:
        """Set force at a time since the landing [N]."""
        time_s = min(time_s, self.seconds)
        (times_s, forces_n), (amplitude_n, frequency_hz) = np.array(self.course).T, self.wave
        swing_n = amplitude_n * sin(2 * pi * frequency_hz * max(time_s - self.course[-2][0], 0.0))
        return float(np.interp(time_s, times_s, forces_n)) + swing_n


@dataclass(frozen=True, eq=False)
class DonePress:
    """A press that was done.

    Attributes
    ----------
    step : PlannedPress
        What it was to be.
    before_ohm, pressed_ohm : (m,) array
        Mean at rest before it, and over the last second of its hold [ohm].
    noise : (m,) array
        Standard error of their ratio, of its real and imaginary part [-].
    """

    step: PlannedPress
    before_ohm: Complex
    pressed_ohm: Complex
    noise: Real


@dataclass(frozen=True)
class Choice:
    """A press that was chosen during the run.

    Attributes
    ----------
    force_n, position_mm : float
        Force and place [N], [mm].
    peak_n, hold_s : float
        Higher force before, none if below ``force_n`` [N]; time at the force before the average [s].
    interval : float
        Widest interval of what is sought, relative, by the presses so far; infinite if unknown [-].
    """

    force_n: float
    position_mm: float
    peak_n: float = 0.0
    hold_s: float = 1.0
    interval: float = inf


NextPress = Callable[[Next, Sequence[DonePress], Complex], Choice]
"""The best next press, by the part of the plan that asks, all presses so far, and the mean at rest (m,) [ohm]."""


def steps(experiment: Experiment, length_mm: float) -> list[PlannedPress]:
    """All presses of an experiment on a specimen of a length [mm]."""
    places = experiment.places_mm(length_mm)
    found: list[PlannedPress] = []
    for k, part in enumerate(experiment.plan):
        for step in _presses(part.content, experiment, places):
            found.append(replace(step, number=len(found) + 1, part=k, kind=part.kind))
    return found


def seconds(planned: Sequence[PlannedPress], longest_hold_s: float = 30.0) -> float:
    """About how long a plan takes; one chosen during the run is taken as held for a third of the longest [s]."""
    chosen = longest_hold_s / 3 + AVERAGED_S
    return sum(max(step.rest_s, _TRAVEL_S) + _LANDING_S + (step.seconds if step.course else chosen) for step in planned)


def chosen(step: PlannedPress, choice: Choice, approach: Approach) -> PlannedPress:
    """A step with what was chosen for it."""
    made = _press(approach, choice.position_mm, choice.force_n, choice.peak_n, choice.hold_s, step.rest_s)
    return replace(made, number=step.number, part=step.part, kind=step.kind)


def _presses(
    part: Random | Ramp | Hold | Sine | ForceSweep | Next, experiment: Experiment, places: tuple[float, float]
) -> Iterator[PlannedPress]:
    approach = experiment.approach
    match part:
        case Random():
            yield from _random(part, approach, part.position_mm or places)
        case Ramp():
            low = min(approach.contact_n, part.force_n)
            took = (part.force_n - low) / part.rate_n_s
            course = ((0.0, low), (took, part.force_n), (2 * took, low))
            for _ in range(part.repeats):
                yield _step(part.position_mm, course, part.rest_s, part.force_n)
        case Hold():
            yield _press(approach, part.position_mm, part.force_n, 0.0, part.hold_s, part.rest_s)
        case Sine():
            yield _swing(part, approach)
        case ForceSweep():
            for place in np.linspace(*part.position_mm, part.places).round(3).tolist():
                yield _press(approach, place, part.force_n, 0.0, part.hold_s, part.rest_s)
        case Next():
            for _ in range(part.presses):
                yield _step(nan, (), part.rest_s, nan)


def _random(part: Random, approach: Approach, places: tuple[float, float]) -> Iterator[PlannedPress]:
    """Forces and places of a seeded plan; holds even in their logarithm, and a share reached from a higher force."""
    plan = RunPlan(part.seed, part.presses, part.force_n, places, 1.0, 0.0, part.repeats).steps()
    rng = np.random.default_rng([part.seed, 1])
    short, long = np.log(part.hold_s).tolist()
    holds = np.exp(rng.uniform(short, long, len(plan))).round(2).tolist()
    above = rng.permutation(len(plan)) < round(part.from_above * len(plan))
    shares = rng.uniform(0.2, 1.0, len(plan)).tolist()
    for press, hold, higher, share in zip(plan, holds, above.tolist(), shares, strict=True):
        peak = press.force_n + share * (part.force_n[1] - press.force_n) if higher else 0.0
        yield _press(approach, press.position_mm, press.force_n, round(peak, 3), hold, part.rest_s)


def _press(
    approach: Approach, place_mm: float, force_n: float, peak_n: float, hold_s: float, rest_s: float
) -> PlannedPress:
    """Up to a force, over a higher one if there is one, hold, average, and down."""
    course = [(0.0, approach.contact_n)]
    if peak_n > force_n:
        _extend(course, approach, peak_n, _AT_PEAK_S)
    _extend(course, approach, force_n, hold_s + AVERAGED_S)
    return replace(_step(place_mm, tuple(course), rest_s, force_n), peak_n=max(peak_n, force_n), hold_s=hold_s)


def _extend(course: list[tuple[float, float]], approach: Approach, force_n: float, stay_s: float) -> None:
    """Go to a force, and stay there."""
    time_s, at_n = course[-1]
    there_s = time_s + abs(force_n - at_n) / approach.rate_n_s
    course += [(there_s, force_n), (there_s + stay_s, force_n)]


def _swing(part: Sine, approach: Approach) -> PlannedPress:
    course = [(0.0, approach.contact_n)]
    _extend(course, approach, part.mean_n, part.cycles / part.frequency_hz)
    step = _step(part.position_mm, tuple(course), part.rest_s, part.mean_n + part.amplitude_n)
    return replace(step, wave=(part.amplitude_n, part.frequency_hz))


def _step(place_mm: float, course: tuple[tuple[float, float], ...], rest_s: float, force_n: float) -> PlannedPress:
    return PlannedPress(0, 0, "", place_mm, course, rest_s, force_n, force_n, 0.0)
