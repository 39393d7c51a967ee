"""An experiment as it is written, in a YAML file: specimen, devices, plan, tip, limits and rules that end it early."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, OutOfRange, within
from sensorgen.core.records import Line, Strict, checked, problem
from sensorgen.measure.virtual.rig import VirtualSpecimen
from sensorgen.prediction.query import TONES_HZ

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=100_000)]
Span = Annotated[tuple[Number, Number], Field(strict=False)]
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
    place_mm: Number | None = None


class Free(Strict):
    """Presses whose force, place and hold are not given."""

    presses: Count
    force_n: Span = (0.4, 6.0)
    position_mm: Span | None = None
    hold_s: Span = (0.3, 30.0)
    rest_s: Positive = 4.0


class Random(Free):
    """Presses of random force, place and hold, half of them after a higher force."""

    seed: Annotated[int, Field(ge=0)]
    repeats: Annotated[int, Field(ge=0, le=1000)] = 0
    from_above: Annotated[float, Field(ge=0, le=1)] = 0.5


class Ramp(Strict):
    """Force up and down at a steady rate, at one place."""

    position_mm: Number
    force_n: Positive
    rate_n_s: Positive = 1.0
    repeats: Count = 1
    rest_s: Positive = 4.0


class Hold(Strict):
    """A constant force for long, for creep."""

    position_mm: Number
    force_n: Positive
    hold_s: Positive
    rest_s: Positive = 4.0


class Sine(Strict):
    """A force that swings about its mean, for hysteresis."""

    position_mm: Number
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
        found: Kind = getattr(self, self.kind)
        return found


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
        return parse(yamlfile.read(path))


def parse(data: Any) -> Experiment:
    """An experiment from plain data; errors as :func:`read`."""
    return checked(Experiment, data)


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


def check(experiment: Experiment, length_mm: float, seconds: float) -> None:
    """Cross checks that need the specimen's length and the plan's, before anything moves.

    Parameters
    ----------
    experiment : Experiment
        What was read.
    length_mm : float
        Of the specimen [mm].
    seconds : float
        How long the plan is expected to take [s].

    Raises
    ------
    OutOfRange
        A tip longer than the specimen, a force above the limit, a place beyond the specimen or the stage's travel, a
        span that falls, or a plan that takes too long; the message names the key.
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
    if seconds > limits.hours * 3600:
        raise OutOfRange(
            f"plan: takes about {seconds / 3600:.3g} h, limits.hours is {limits.hours:g}; expected fewer presses, "
            "shorter holds, or a larger limit"
        )


def _check_part(key: str, part: Kind, limit_n: float, places_mm: tuple[float, float]) -> None:
    if isinstance(part, Sine):
        largest, name = part.mean_n + part.amplitude_n, "mean_n + amplitude_n"
        if part.amplitude_n >= part.mean_n:
            raise OutOfRange(f"{key}.amplitude_n: {part.amplitude_n:g} N lifts the tip; expected less than mean_n")
    else:
        forces = part.force_n if isinstance(part.force_n, tuple) else (part.force_n,)
        _rising(f"{key}.force_n", forces)
        largest, name = max(forces), "force_n"
    if largest > _ROOM * limit_n:
        raise OutOfRange(
            f"{key}.{name}: {largest:g} N; expected up to {_ROOM * limit_n:.4g} N, {_ROOM:.0%} of limits.force_n, "
            "above which the tip is lifted"
        )
    if isinstance(part, Free):
        _rising(f"{key}.hold_s", part.hold_s)
    where = part.position_mm
    for place in () if where is None else where if isinstance(where, tuple) else (where,):
        _inside(f"{key}.position_mm", place, places_mm)
    if isinstance(where, tuple) and not isinstance(part, ForceSweep):
        _rising(f"{key}.position_mm", where)


def check_press(experiment: Experiment, force_n: float, place_mm: float, length_mm: float) -> None:
    """Refuse a press that was chosen during the run and leaves the limits; errors as :func:`check`."""
    if not 0 < force_n <= _ROOM * experiment.limits.force_n:
        raise OutOfRange(f"next press: {force_n:g} N; expected up to {_ROOM * experiment.limits.force_n:.4g} N")
    _inside("next press", place_mm, experiment.places_mm(length_mm))


def _rising(key: str, span: tuple[float, ...]) -> None:
    if span[0] <= 0 or span[0] > span[-1]:
        raise OutOfRange(f"{key}: {', '.join(f'{value:g}' for value in span)}; expected numbers above 0 that rise")


def _inside(key: str, place_mm: float, allowed_mm: tuple[float, float]) -> None:
    if not allowed_mm[0] <= place_mm <= allowed_mm[1]:
        raise OutOfRange(f"{key}: {place_mm:g} mm; expected {allowed_mm[0]:g} to {allowed_mm[1]:g} mm, where the whole "
                         "tip is on the specimen and limits.places_mm allows it")  # fmt: skip
