"""An experiment as it is written, in a YAML file, with limits and rules that end it early; and its plan as presses."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, nan, pi, sin
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationError, model_validator

from sensorgen.core import yamlfile
from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, OutOfRange, within
from sensorgen.core.records import Finite, Line, NotNegative, Positive, Strict, checked, problem
from sensorgen.measure.signal.presses import GUARD_S, WINDOW_S, RunPlan
from sensorgen.measure.virtual.mechanics import VirtualSpecimen
from sensorgen.prediction.query import TONES_HZ

Count = Annotated[int, Field(ge=1, le=100_000)]
Span = Annotated[tuple[Finite, Finite], Field(strict=False)]


def _rising(span: tuple[float, float]) -> tuple[float, float]:
    if not 0 < span[0] <= span[1]:
        raise ValueError(f"{span[0]:g}, {span[1]:g}; expected numbers above 0 that rise")
    return span


Rising = Annotated[Span, AfterValidator(_rising)]
Frequencies = Annotated[tuple[Positive, ...], Field(strict=False, min_length=1, max_length=100)]
Name = Annotated[Line, Field(min_length=1, max_length=100)]


class Device(Strict):
    """A device and where it is.

    Attributes
    ----------
    kind : str
        Of the catalogue of devices, as smac-lcc10.
    address : str
        Serial port, URL, VISA resource or serial number.
    settings : mapping of str to number or text
        What its kind knows beside, as ``newton_per_unit``.
    """

    kind: Name
    address: Line = ""
    settings: dict[str, bool | float | Line | tuple[float, ...]] = Field(default_factory=dict)


class Devices(Strict):
    """Devices by their roles."""

    actuator: Device
    stage: Device
    impedance: Device


class ExperimentTip(Strict):
    """Tip that presses.

    Attributes
    ----------
    length_mm : float
        Along the specimen [mm].
    stiffness_n_mm : float or None
        Of the tip itself; None where it is much stiffer than the specimen [N/mm].
    """

    length_mm: Positive
    stiffness_n_mm: Positive | None = None


_ROOM = 0.95  # of the limit, so that the noise of a reading does not reach it
TIPS = {"flat": ExperimentTip(length_mm=5.0), "soft": ExperimentTip(length_mm=10.0)}
"""Thesis 5.1: of PLA, flat, 5 mm; of Ninjaflex, 10 mm, whose stiffness was not measured."""


class Readout(Strict):
    """Settings of the impedance meter: frequencies [Hz] and amplitude [V]."""

    tones_hz: Frequencies = TONES_HZ
    voltage_v: Positive = 1.0


class Limits(Strict):
    """Limits that no device may leave.

    Attributes
    ----------
    force_n : float
        Above it the tip is lifted in the same period [N].
    deepest_mm : float
        Of the piston, from its upper end [mm].
    travel_mm : (float, float)
        Of the stage along the specimen [mm].
    places_mm : (float, float) or None
        Where the tip's centre may press; the whole tip on the specimen if None [mm].
    hours : float
        A longer plan is refused [h].
    dead_man_s : float
        Without a sign of life of the run for this long the guardian lifts the tip [s].
    operator_min : float or None
        Without a key or a command of the page for this long the run ends; None to leave the run alone [min].
    """

    force_n: Positive = 7.0
    deepest_mm: Positive = 45.0
    travel_mm: Span = (0.0, 300.0)
    places_mm: Span | None = None
    hours: Annotated[float, Field(gt=0, le=20)] = 12.0
    dead_man_s: Annotated[float, Field(ge=0.3, le=60)] = 2.0
    operator_min: Positive | None = None


class Approach(Strict):
    """Approach of the tip, and rate of the force.

    Attributes
    ----------
    contact_n : float
        Largest force of the soft landing [N].
    speed_mm_s, landing_mm_s : float
        Of the piston in free air, and of the soft landing [mm/s].
    travel_mm_s : float
        Of the stage [mm/s].
    rate_n_s : float
        Rate of the force from one set force to the next [N/s].
    place_mm : float or None
        Where contact is looked for first; the middle of the allowed places if None [mm].
    """

    contact_n: Positive = 0.3
    speed_mm_s: Positive = 20.0
    landing_mm_s: Positive = 4.0
    travel_mm_s: Positive = 20.0
    rate_n_s: Positive = 20.0
    place_mm: Finite | None = None

    def course(self, *stops: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        """Course of the force from the contact on: to each force, where it stays for a time [N], [s]."""
        course = [(0.0, self.contact_n)]
        for force_n, stay_s in stops:
            time_s, at_n = course[-1]
            there_s = time_s + abs(force_n - at_n) / self.rate_n_s
            course += [(there_s, force_n), (there_s + stay_s, force_n)]
        return tuple(course)


class Free(Strict):
    """Presses whose force, place and hold are not given."""

    presses: Count
    force_n: Rising = (0.4, 6.0)
    position_mm: Rising | None = None
    hold_s: Rising = (0.3, 30.0)
    rest_s: Positive = 4.0


class Random(Free):
    """Presses of random force, place and hold, half of them after a higher force."""

    seed: Annotated[int, Field(ge=0)]
    repeats: Annotated[int, Field(ge=0, le=1000)] = 0
    from_above: Annotated[float, Field(ge=0, le=1)] = 0.5


class Ramp(Strict):
    """Force up and down at a steady rate, at one place."""

    position_mm: Finite
    force_n: Positive
    rate_n_s: Positive = 1.0
    repeats: Count = 1
    rest_s: Positive = 4.0


class Hold(Strict):
    """A constant force for long, for creep."""

    position_mm: Finite
    force_n: Positive
    hold_s: Positive
    rest_s: Positive = 4.0


class Sine(Strict):
    """A force that swings about its mean, for hysteresis."""

    position_mm: Finite
    mean_n: Positive
    amplitude_n: Positive
    frequency_hz: Annotated[float, Field(gt=0, le=10)]
    cycles: Count = 10
    rest_s: Positive = 4.0


class ForceSweep(Strict):
    """One force at places side by side."""

    force_n: Positive
    position_mm: Span
    places: Annotated[int, Field(ge=2, le=10_000)]
    hold_s: NotNegative = 1.0
    rest_s: Positive = 4.0


class Next(Free):
    """Presses that are chosen during the run, each by what it is expected to tell."""

    aim: Literal["values", "presses"] = "values"


Kind = Random | Ramp | Hold | Sine | ForceSweep | Next


class ExperimentPart(Strict):
    """A part of the plan: one of its keys."""

    random: Random | None = None
    ramp: Ramp | None = None
    hold: Hold | None = None
    sine: Sine | None = None
    sweep: ForceSweep | None = None
    next: Next | None = None

    @model_validator(mode="after")
    def _one(self) -> "ExperimentPart":
        if len(self.model_fields_set) != 1 or None in (getattr(self, name) for name in self.model_fields_set):
            given = ", ".join(sorted(self.model_fields_set)) or "nothing"
            raise ValueError(f"a part of {given}; expected one of {', '.join(type(self).model_fields)}")
        return self

    @property
    def kind(self) -> str:
        """Key of the step."""
        return next(iter(self.model_fields_set))

    @property
    def content(self) -> Kind:
        """Value of that key."""
        value: Kind = getattr(self, self.kind)
        return value


class Stop(Strict):
    """Rules that end a run early, tip up and log closed.

    Attributes
    ----------
    presses : int or None
        After so many.
    minutes : float or None
        After so long [min].
    drift : float or None
        Change of abs(Z) at rest since the first press, at any frequency [-].
    short : bool
        The specimen conducts: at the lowest frequency Re Z exceeds -Im Z.
    interval : float or None
        Of presses chosen during the run: no further one where the widest interval is below this, relative [-].
    """

    presses: Count | None = None
    minutes: Positive | None = None
    drift: Positive | None = None
    short: bool = True
    interval: Positive | None = None


class Experiment(Strict):
    """One experiment.

    Attributes
    ----------
    specimen : str
        Its name in the log.
    length_mm : float or None
        Of the specimen; of its design if None [mm].
    virtual : VirtualSpecimen or None
        The virtual specimen and rig of ``--simulate``.
    devices : Devices or None
        None for a simulated run alone.
    tip, readout, approach, limits, plan, stop
        See there.
    remark : str
        Goes into the log.
    """

    specimen: Name
    length_mm: Positive | None = None
    virtual: VirtualSpecimen | None = None
    devices: Devices | None = None
    tip: Literal["flat", "soft"] | ExperimentTip = "flat"
    readout: Readout = Readout()
    approach: Approach = Approach()
    limits: Limits = Limits()
    plan: Annotated[tuple[ExperimentPart, ...], Field(strict=False, min_length=1, max_length=1000)]
    stop: Stop = Stop()
    remark: Annotated[Line, Field(max_length=1000)] = ""

    @property
    def pressing(self) -> ExperimentTip:
        """The tip with its size."""
        return TIPS[self.tip] if isinstance(self.tip, str) else self.tip

    def places_mm(self, length_mm: float) -> tuple[float, float]:
        """Where the tip's centre may press on a specimen of that length [mm]."""
        half = self.pressing.length_mm / 2
        return self.limits.places_mm or (half, length_mm - half)


def read(path: Path) -> Experiment:
    """An experiment from a file.

    Raises
    ------
    BadInput
        A file that cannot be read, or a key that is unknown, missing or of another kind, with file and key.
    """
    with within(str(path)):
        return checked(Experiment, yamlfile.read(path))


def from_json(data: Any) -> Experiment:
    """An experiment out of a journal.

    Raises
    ------
    BadInput
        Not what a journal has.
    """
    try:
        return Experiment.model_validate_json(json.dumps(data))
    except ValidationError as error:
        raise BadInput(f"the journal's experiment is damaged: {problem(error, data)}") from None


def check(experiment: Experiment, length_mm: float) -> None:
    """Cross checks that need the specimen's length, before anything moves.

    Parameters
    ----------
    experiment : Experiment
        What was read.
    length_mm : float
        Of the specimen [mm].

    Raises
    ------
    OutOfRange
        A tip longer than the specimen, a force above the limit, a place beyond the specimen or the stage's travel, or a
        span that falls; the message names the key.
    """
    tip, limits, approach = experiment.pressing, experiment.limits, experiment.approach
    if tip.length_mm > length_mm:
        raise OutOfRange(f"tip: {tip.length_mm:g} mm is longer than the specimen, {length_mm:g} mm; expected a shorter")
    low, high = experiment.places_mm(length_mm)
    whole = (tip.length_mm / 2, length_mm - tip.length_mm / 2)
    if not whole[0] <= low <= high <= whole[1]:
        raise OutOfRange(
            f"limits.places_mm: {low:g} to {high:g} mm; expected from {whole[0]:g} to {whole[1]:g} mm, where the whole "
            f"tip of {tip.length_mm:g} mm is on the specimen of {length_mm:g} mm"
        )
    if not limits.travel_mm[0] <= low <= high <= limits.travel_mm[1]:
        raise OutOfRange(f"limits.travel_mm: {limits.travel_mm[0]:g} to {limits.travel_mm[1]:g} mm does not contain "
                         f"the places {low:g} to {high:g} mm")  # fmt: skip
    if approach.contact_n > limits.force_n / 2:
        raise OutOfRange(f"approach.contact_n: {approach.contact_n:g} N is more than half of limits.force_n")
    if approach.place_mm is not None:
        _inside("approach.place_mm", approach.place_mm, (low, high))
    for k, part in enumerate(experiment.plan):
        _check_part(f"plan.{k}.{part.kind}", part.content, limits.force_n, (low, high))


def _check_part(key: str, part: Kind, limit_n: float, places_mm: tuple[float, float]) -> None:
    if isinstance(part, Sine):
        if part.amplitude_n >= part.mean_n:
            raise OutOfRange(f"{key}.amplitude_n: {part.amplitude_n:g} N lifts the tip; expected less than mean_n")
        largest, name = part.mean_n + part.amplitude_n, "mean_n + amplitude_n"
    else:
        largest, name = float(np.max(part.force_n)), "force_n"
    if largest > _ROOM * limit_n:
        raise OutOfRange(
            f"{key}.{name}: {largest:g} N; expected up to {_ROOM * limit_n:.4g} N, {_ROOM:.0%} of limits.force_n, "
            "above which the tip is lifted"
        )
    for place in () if part.position_mm is None else np.ravel(part.position_mm).tolist():
        _inside(f"{key}.position_mm", place, places_mm)


def check_press(experiment: Experiment, force_n: float, place_mm: float, length_mm: float) -> None:
    """Refuse a press that was chosen during the run and leaves the limits; errors as :func:`check`."""
    if not 0 < force_n <= _ROOM * experiment.limits.force_n:
        raise OutOfRange(f"next press: {force_n:g} N; expected up to {_ROOM * experiment.limits.force_n:.4g} N")
    _inside("next press", place_mm, experiment.places_mm(length_mm))


def _inside(key: str, place_mm: float, allowed_mm: tuple[float, float]) -> None:
    if not allowed_mm[0] <= place_mm <= allowed_mm[1]:
        raise OutOfRange(f"{key}: {place_mm:g} mm; expected {allowed_mm[0]:g} to {allowed_mm[1]:g} mm, where the whole "
                         "tip is on the specimen and limits.places_mm allows it")  # fmt: skip


AVERAGED_S = WINDOW_S + GUARD_S  # end of every hold, over which the evaluation averages [s]
_AT_PEAK_S = 0.5  # how long a higher force is held before the force of the press
_LANDING_S = 2.0  # lift, approach and landing of one press, about
_TRAVEL_S = 8.0  # to another place, about: a part of the rest


@dataclass(frozen=True)
class PlannedPress:
    """One press.

    Attributes
    ----------
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
    number : int
        In the plan, from 1.
    part : int
        Part of the plan, from 0.
    kind : str
        Of the part.
    """

    place_mm: float
    course: tuple[tuple[float, float], ...]
    rest_s: float
    force_n: float
    peak_n: float
    hold_s: float = 0.0
    wave: tuple[float, float] = (0.0, 0.0)
    number: int = 0
    part: int = 0
    kind: str = ""

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

    def press(self, approach: Approach, rest_s: float) -> PlannedPress:
        """Up to the force, over a higher one if there is one, hold, and average."""
        peak = ((self.peak_n, _AT_PEAK_S),) if self.peak_n > self.force_n else ()
        course = approach.course(*peak, (self.force_n, self.hold_s + AVERAGED_S))
        most = max(self.peak_n, self.force_n)
        return PlannedPress(self.position_mm, course, rest_s, self.force_n, most, self.hold_s)


NextPress = Callable[[Next, Sequence[DonePress], Complex], Choice]
"""The best next press, by the part of the plan that asks, all presses so far, and the mean at rest (m,) [ohm]."""


def steps(experiment: Experiment, length_mm: float) -> list[PlannedPress]:
    """All presses of an experiment on a specimen of a length [mm]."""
    places = experiment.places_mm(length_mm)
    presses: list[PlannedPress] = []
    for k, part in enumerate(experiment.plan):
        for step in _presses(part.content, experiment, places):
            presses.append(replace(step, number=len(presses) + 1, part=k, kind=part.kind))
    return presses


def seconds(planned: Sequence[PlannedPress], longest_hold_s: float = 30.0) -> float:
    """About how long a plan takes; one chosen during the run is taken as held for a third of the longest [s]."""
    chosen = longest_hold_s / 3 + AVERAGED_S
    return sum(max(step.rest_s, _TRAVEL_S) + _LANDING_S + (step.seconds if step.course else chosen) for step in planned)


def _presses(part: Kind, experiment: Experiment, places: tuple[float, float]) -> Iterator[PlannedPress]:
    approach = experiment.approach
    match part:
        case Random():
            for choice in _random(part, part.position_mm or places):
                yield choice.press(approach, part.rest_s)
        case Ramp():
            low = min(approach.contact_n, part.force_n)
            took = (part.force_n - low) / part.rate_n_s
            ramp = ((0.0, low), (took, part.force_n), (2 * took, low))
            yield from [PlannedPress(part.position_mm, ramp, part.rest_s, part.force_n, part.force_n)] * part.repeats
        case Hold():
            yield Choice(part.force_n, part.position_mm, hold_s=part.hold_s).press(approach, part.rest_s)
        case Sine():
            course, most = (
                approach.course((part.mean_n, part.cycles / part.frequency_hz)),
                part.mean_n + part.amplitude_n,
            )
            wave = part.amplitude_n, part.frequency_hz
            yield PlannedPress(part.position_mm, course, part.rest_s, most, most, wave=wave)
        case ForceSweep():
            for place in np.linspace(*part.position_mm, part.places).round(3).tolist():
                yield Choice(part.force_n, place, hold_s=part.hold_s).press(approach, part.rest_s)
        case Next():
            yield from [PlannedPress(nan, (), part.rest_s, nan, nan)] * part.presses


def _random(part: Random, places: tuple[float, float]) -> Iterator[Choice]:
    """Forces and places of a seeded plan; holds even in their logarithm, and a share reached from a higher force."""
    plan = RunPlan(part.seed, part.presses, part.force_n, places, 1.0, 0.0, part.repeats).steps()
    rng = np.random.default_rng([part.seed, 1])
    short, long = np.log(part.hold_s).tolist()
    holds = np.exp(rng.uniform(short, long, len(plan))).round(2).tolist()
    above = rng.permutation(len(plan)) < round(part.from_above * len(plan))
    shares = rng.uniform(0.2, 1.0, len(plan)).tolist()
    for press, hold, higher, share in zip(plan, holds, above.tolist(), shares, strict=True):
        peak = press.force_n + share * (part.force_n[1] - press.force_n) if higher else 0.0
        yield Choice(press.force_n, press.position_mm, round(peak, 3), hold)
