"""Simulated rig: piston with weight and friction, tip, stage, specimen as an experiment describes it, and faults."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from math import copysign, exp, inf, sqrt
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from sensorgen.core import yamlfile
from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import UnknownName
from sensorgen.core.records import Finite, NotNegative, Positive, Strict
from sensorgen.design.design import Design
from sensorgen.measure.virtual.specimen import PressedSpecimen, Truth, VirtualLine, drawn

Strikes = Literal["actuator", "stage", "analyser", "lcr-meter", "multimeter", "rig"]


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong.

    Attributes
    ----------
    strikes : str
        Which simulator.
    sets : str
        Value of its attribute ``fault``.
    """

    strikes: Strikes
    sets: str


BY_DEVICE: dict[Strikes, dict[str, str]] = yamlfile.read(Path(__file__).with_name("faults.yaml"))  # type: ignore[assignment]
FAULTS: Mapping[str, Fault] = {f"{of} {name}": Fault(of, name) for of, own in BY_DEVICE.items() for name in own}
"""All of them, by name."""


class Planted(Strict):
    """A fault of an experiment.

    Attributes
    ----------
    what : str
        One of ``FAULTS``, as "actuator hung".
    at_s : float or None
        When it strikes, by the rig's clock [s].
    at_force_n : float or None
        Or as soon as the force on the specimen is so high [N].
    for_s : float or None
        How long it lasts; for good if None [s].
    """

    what: str
    at_s: Annotated[float, Field(ge=0)] | None = None
    at_force_n: Annotated[float, Field(gt=0)] | None = None
    for_s: Annotated[float, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one(self) -> "Planted":
        if self.what not in FAULTS:
            raise ValueError(str(UnknownName("fault", self.what, list(FAULTS))))
        if (self.at_s is None) == (self.at_force_n is None):
            raise ValueError("a fault needs one of at_s and at_force_n")
        return self


class FaultSchedule:
    """Faults that wait for their time, and those that last.

    Parameters
    ----------
    planted : iterable of Planted
        What goes wrong.
    """

    def __init__(self, planted: Iterable[Planted]) -> None:
        self._waiting = list(planted)
        self._lasting: list[tuple[float, Fault]] = []
        self._targets: dict[str, Any] = {}

    def attach(self, strikes: Strikes, simulator: Any) -> None:
        """Name the simulator that faults of a kind of device strike: they set its attribute ``fault``."""
        self._targets[strikes] = simulator

    def update(self, time_s: float, force_n: float) -> None:
        """Let faults begin and end that are due [s], [N]."""
        self._begin(time_s, force_n)
        for end_s, fault in [(t, f) for t, f in self._lasting if time_s >= t]:
            self._lasting.remove((end_s, fault))
            target = self._targets.get(fault.strikes)
            if target and target.fault == fault.sets:
                target.fault = ""

    def _begin(self, time_s: float, force_n: float) -> None:
        for one in tuple(self._waiting):
            if not (time_s >= one.at_s if one.at_s is not None else force_n >= (one.at_force_n or 0.0)):
                continue
            self._waiting.remove(one)
            fault = FAULTS[one.what]
            if fault.strikes in self._targets:
                self._targets[fault.strikes].fault = fault.sets
            if one.for_s is not None:
                self._lasting.append((time_s + one.for_s, fault))

    def __bool__(self) -> bool:
        """Test whether anything is to come."""
        return bool(self._waiting or self._lasting)


STEP_S = 2e-3  # of the mechanism
_OWN_MM_S = 2.0  # of a stage that moves by itself
_SHORT_OHM, _OPENS_N = 1e3, 2.0  # of a planted short
OPEN_OHM = 1e12  # what is read with the cable out
_CREEP_S = tuple(0.1 * 10 ** (k / 2) for k in range(9))  # relaxation times, half a decade apart
_PER_TIME = 0.5  # decades that each of them stands for
_RESTING_N = 1e-3  # a force below which the specimen has forgotten its peak
_PRESLIDE_MM = 0.02  # in which friction turns round (Dahl, 1968)
_NEAR_MM = 0.2  # of the set position, where the position loop integrates its error
_INTEGRAL_PER_S = 10.0
_SECONDS_OF_DRIFT = 1.0  # between steps of the drift


class Mechanics(Strict):
    """Parts of the rig.

    Attributes
    ----------
    weight_n : float
        Of the moving part [N]; 0.9 N in the thesis (5.1.2).
    friction_n : float
        Of its guide, either way [N]; up to 1 N.
    lag_s : float
        Of the motor's current behind its set value [s].
    damping_n_s_mm : float
        Of the guide [N s/mm].
    servo_n_mm : float
        Force of the position loop per error [N/mm].
    stiffness_n_mm : float
        Of tip, frame and specimen in series [N/mm]: some 40 with a tip of PLA, 3 with one of soft TPU 10 mm thick.
    clearance_mm : float
        Extension at which the tip touches, at the stage's working height [mm].
    stroke_mm : float
        Of the piston [mm].
    force_limit_n : float
        Force on the specimen above which a violation is noted [N].
    """

    weight_n: NotNegative = 0.9
    friction_n: NotNegative = 0.2
    lag_s: Positive = 2e-3
    damping_n_s_mm: Positive = 0.02
    servo_n_mm: Positive = 4.0
    stiffness_n_mm: Positive = 40.0
    clearance_mm: Finite = 30.0
    stroke_mm: Positive = 50.0
    force_limit_n: Positive = 8.0


@dataclass
class Violation:
    """Something that must not happen on a rig.

    Attributes
    ----------
    time_s : float
        Its begin [s].
    what : str
        "sideways", a move of the stage with the tip down, or "force", above the limit.
    value : float
        The largest force meanwhile [N].
    duration_s : float
        How long it lasted [s].
    """

    time_s: float
    what: str
    value: float
    duration_s: float = 0.0


@dataclass
class _Axis:
    """Way to a target at a speed, as of one axis of the stage."""

    at_mm: float
    target_mm: float
    speed_mm_s: float = 0.0

    @property
    def moves(self) -> bool:
        return self.at_mm != self.target_mm

    def step(self, dt: float) -> None:
        left = self.target_mm - self.at_mm
        most = self.speed_mm_s * dt
        self.at_mm = self.target_mm if abs(left) <= most else self.at_mm + copysign(most, left)


@dataclass
class VirtualRig:
    """A :class:`sensorgen.measure.virtual.plant.Plant`.

    Attributes
    ----------
    specimen : PressedSpecimen
        Below the tip.
    mechanics : Mechanics
        Of piston, tip and stage.
    seed : int
        Of drift and noise.
    noise : float
        Relative standard deviation of both parts of an impedance, as of interference [-].
    force_n : float
        On the specimen now [N].
    peak_n : float
        Largest force so far [N].
    violations : list of Violation
        So far, in the order of their begin.
    fault : str
        Name of a fault of the mechanism or of the cables, see :data:`FAULTS`; "" for none.
    planted : FaultSchedule or None
        Faults to come; those that strike the rig set ``fault``, others that of the simulators attached to it.
    """

    specimen: PressedSpecimen
    mechanics: Mechanics = field(default_factory=Mechanics)
    seed: int = 0
    noise: float = 0.0
    time_s: float = 0.0
    extension_mm: float = 0.0
    motor_n: float = 0.0
    force_n: float = 0.0
    peak_n: float = 0.0
    fault: str = ""
    violations: list[Violation] = field(default_factory=list)
    planted: FaultSchedule | None = None

    def __post_init__(self) -> None:
        """At rest, raised."""
        self._axes: Mapping[str, _Axis] = {"x": _Axis(0.0, 0.0), "z": _Axis(20.0, 20.0)}
        self._on, self._limit_n = False, inf
        self._sought: _Axis | None = None  # where the position loop wants the piston
        self._wanted_n = self._friction_n = self._most_n = self._against_n = 0.0
        self._press_peak_n = 0.0
        self._crept = np.zeros(len(_CREEP_S))
        self._open: dict[str, Violation] = {}
        self._rng, self._interference = (np.random.default_rng([self.seed, k]) for k in (1, 2))
        self._drift, self._drifted_s = self._rng.standard_normal(2), self.time_s
        self._lines: dict[bytes, VirtualLine] = {}

    def advance(self, time_s: float) -> None:
        """Let the mechanism move on to a time [s]; one that is past changes nothing."""
        while time_s - self.time_s > 1e-12:
            dt = min(STEP_S, time_s - self.time_s)
            if self.planted:
                self.planted.attach("rig", self)
                self.planted.update(self.time_s, self.force_n)
            moved = self._axes["x"].moves or self.fault == "stage moves"
            if self.fault == "stage moves":
                self._axes["x"].at_mm += _OWN_MM_S * dt
                self._axes["x"].target_mm += _OWN_MM_S * dt
            for axis in self._axes.values():
                if axis.moves:
                    axis.step(dt)
            self._motor(dt)
            self._piston(dt)
            self._memory(dt)
            self.time_s += dt
            self._watch("sideways", moved and self.force_n > 0, dt)
            self._watch("force", self.force_n > self.mechanics.force_limit_n, dt)

    def switch(self, *, on: bool) -> None:
        """Motor on or off; off, nothing but friction holds the piston. It goes on with no force."""
        self._on, self._sought, self._wanted_n = on, None, 0.0

    def limit(self, motor_n: float) -> None:
        """Largest force of the motor, either way [N]."""
        self._limit_n = abs(motor_n)

    def drive(self, motor_n: float) -> None:
        """Force mode: a force of the motor, downwards positive [N]."""
        self._sought, self._wanted_n = None, motor_n

    def seek(self, extension_mm: float, speed_mm_s: float, motor_n: float) -> None:
        """Position mode: go to an extension with at most a force of the motor downwards, which may be negative.

        Upwards it may use all that :meth:`limit` allows.
        """
        self._sought = _Axis(self.extension_mm, extension_mm, abs(speed_mm_s))
        self._most_n, self._against_n = motor_n, 0.0

    def travel(self, axis: str, position_mm: float, speed_mm_s: float) -> None:
        """Begin a move of the stage along "x", or "z", which raises the actuator."""
        self._axes[axis].target_mm, self._axes[axis].speed_mm_s = position_mm, abs(speed_mm_s)

    def axis(self, axis: str) -> tuple[float, bool]:
        """Position of an axis [mm], and whether it moves."""
        return self._axes[axis].at_mm, self._axes[axis].moves

    @property
    def tip_mm(self) -> float:
        """Height of the tip above the specimen; negative where it presses [mm]."""
        return self.mechanics.clearance_mm + self._axes["z"].at_mm - self.extension_mm

    def impedance(self, frequency_hz: Real) -> Complex:
        """Reading of an ideal instrument at the end of the leads now, of (m,) frequencies [ohm]."""
        frequency = np.atleast_1d(np.asarray(frequency_hz, float))
        if self.fault == "cable out":
            return np.full(len(frequency), OPEN_OHM, complex)
        key = frequency.tobytes()
        if key not in self._lines:
            self._lines[key] = VirtualLine(self.specimen, frequency)
        truth, ends = self.specimen.truth, (0.0, 0.0)
        lift = 0.0
        if self.force_n > 0:
            ends = self.specimen.patch(self._axes["x"].at_mm * 1e-3)
            lift = self._lift(ends[1] - ends[0])
        shorted = self.force_n <= truth.short_opens_n
        c, r = self._drift * (truth.drift_c, truth.drift_r)
        impedance = self._lines[key].impedance(lift, ends if lift else (0.0, 0.0), c, r, shorted=shorted)
        if self.fault == "short" and self.force_n < _OPENS_N:
            impedance = np.asarray(impedance * _SHORT_OHM / (impedance + _SHORT_OHM))
        if self.noise:
            real, imaginary = self.noise * self._interference.standard_normal((2, len(frequency)))
            impedance = impedance * (1 + real + 1j * imaginary)
        return impedance

    def resistance(self, *, wires: int) -> float:
        """Reading of an ideal multimeter across the bottom electrode [ohm]."""
        truth = self.specimen.truth
        if self.fault == "cable out":
            return OPEN_OHM
        strip = self.specimen.track_ohm_per_m[1] * self.specimen.length_m * exp(truth.drift_r * self._drift[1])
        return float(strip + (truth.lead_ohm if wires == 2 else 0.0))

    def _lift(self, covered_m: float) -> float:
        """Rise of C under the tip, with what the specimen remembers."""
        unloading = 1 - self.force_n / max(self._press_peak_n, self.force_n)
        crept = float(self._crept.sum()) * _PER_TIME / self.force_n - _CREPT_AT_1_S
        return self.specimen.rise(self.force_n, covered_m, unloading, crept)

    def _motor(self, dt: float) -> None:
        wanted = self._wanted_n
        if self._sought is not None:
            if abs(self._sought.at_mm - self.extension_mm) < 1.0:
                self._sought.step(dt)
            off = self._sought.at_mm - self.extension_mm
            if abs(off) < _NEAR_MM:
                most = self.mechanics.friction_n + _NEAR_MM * self.mechanics.servo_n_mm
                self._against_n = min(
                    max(self._against_n + _INTEGRAL_PER_S * self.mechanics.servo_n_mm * off * dt, -most), most
                )
            wanted = min(self.mechanics.servo_n_mm * off + self._against_n - self.mechanics.weight_n, self._most_n)
        wanted = min(max(wanted, -self._limit_n), self._limit_n) if self._on and self.fault != "power loss" else 0.0
        self.motor_n += (wanted - self.motor_n) * (1 - exp(-dt / self.mechanics.lag_s))

    def _piston(self, dt: float) -> None:
        """Damped motion with friction of Dahl's kind, both implicit, so that a stiff contact stays stable."""
        m = self.mechanics
        depth = -self.tip_mm
        k = m.stiffness_n_mm
        contact = k * depth if depth > 0 else 0.0
        net = self.motor_n + m.weight_n - contact - self._friction_n
        slide = 0.0
        if m.friction_n:
            against = 1 - self._friction_n / m.friction_n * (1.0 if net > 0 else -1.0)
            slide = m.friction_n / _PRESLIDE_MM * max(against, 0.0)
        speed = net / (m.damping_n_s_mm + (slide + (k if depth > 0 else 0.0)) * dt)
        if depth <= 0 < depth + speed * dt:  # touches within this step
            speed = (net - k * depth) / (m.damping_n_s_mm + (slide + k) * dt)
        speed = 0.0 if self.fault == "jammed" else speed
        before = self.extension_mm
        self.extension_mm = min(max(before + speed * dt, 0.0), m.stroke_mm)
        moved = self.extension_mm - before
        self._friction_n = min(max(self._friction_n + slide * moved, -m.friction_n), m.friction_n)
        self.force_n = max(-self.tip_mm, 0.0) * k
        self.peak_n = max(self.peak_n, self.force_n)

    def _memory(self, dt: float) -> None:
        """Peak of this press, what creeps, and the drift."""
        if self.force_n < _RESTING_N:
            self._press_peak_n = 0.0
        elif self.force_n > self._press_peak_n:
            self._press_peak_n = self.force_n
        if self.force_n > 0 or self._crept[0] > 0:
            self._crept += (self.force_n - self._crept) * _relaxed(dt)
        if self.time_s - self._drifted_s >= _SECONDS_OF_DRIFT:
            keep = exp(-(self.time_s - self._drifted_s) / self.specimen.truth.drift_s)
            self._drift = keep * self._drift + sqrt(1 - keep**2) * self._rng.standard_normal(2)
            self._drifted_s = self.time_s

    def _watch(self, what: str, wrong: bool, dt: float) -> None:
        if not wrong:
            self._open.pop(what, None)
            return
        if what not in self._open:
            self._open[what] = Violation(self.time_s, what, self.force_n)
            self.violations.append(self._open[what])
        state = self._open[what]
        state.value, state.duration_s = max(state.value, self.force_n), state.duration_s + dt


@lru_cache(maxsize=256)
def _relaxed(dt: float) -> Real:
    """Share of a change of the force that each creeping part has followed after a time [s]."""
    return np.asarray(1 - np.exp(-dt / np.array(_CREEP_S)))


_CREPT_AT_1_S = _PER_TIME * float(np.sum(_relaxed(1.0)))


class VirtualSpecimen(Strict):
    """The section ``virtual`` of an experiment: what a simulated run presses, and what goes wrong.

    Attributes
    ----------
    design : str or None
        File or shape; the design of the specimen in the log if None.
    seed : int
        Of materials, errors and drift.
    truth : Truth
        Values that are given in place of drawn ones.
    rig : Mechanics
        Piston, tip and stage.
    noise : float
        Relative standard deviation of both parts of a reading, beside the instrument's own noise [-].
    faults : sequence of Planted
        What goes wrong, and when.
    """

    design: str | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    truth: Truth = Field(default_factory=Truth)
    rig: Mechanics = Mechanics()
    noise: Annotated[float, Field(ge=0, le=1)] = 0.0
    faults: tuple[Planted, ...] = Field(default=(), strict=False)


def rig_of(settings: VirtualSpecimen, design: Design, tip_m: float) -> VirtualRig:
    """The simulated rig of an experiment, with its faults planted.

    Parameters
    ----------
    settings : VirtualSpecimen
        Of the experiment's file.
    design : Design
        What the specimen was printed of.
    tip_m : float
        Length of the tip along the strip [m].

    Raises
    ------
    BadInput, OutOfRange, MissingValue
        A truth, rig or body that cannot be.
    """
    given = {name: getattr(settings.truth, name) for name in settings.truth.model_fields_set}
    specimen = PressedSpecimen(design, drawn(design, settings.seed).model_copy(update=given), tip_m)
    return VirtualRig(
        specimen, settings.rig, settings.seed, settings.noise, planted=FaultSchedule(settings.faults)
    )  # fmt: skip
