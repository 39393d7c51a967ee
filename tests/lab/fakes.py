"""A small rig of its own: devices without protocols on a mechanism that keeps the record of what was done to it.

Its physics is as simple as can be, and apart from the simulators that ship, so that the run's safety is judged twice.
"""

from dataclasses import dataclass, field

import numpy as np

from sensorgen.measure.lab.devices import DeviceFault, Extension, Identity, Place, Readings
from sensorgen.measure.lab.safety import RunDevices

CONTACT_MM, STIFF_N_MM, RAISED_MM, SPEED_MM_S = 20.0, 50.0, 30.0, 40.0
STEP_S, STROKE_MM = 0.002, 40.0


@dataclass
class Mechanism:
    """Piston, stage and specimen.

    ``worst_n`` is the largest force on the specimen, ``above_s`` for how long it was above ``limit_n``, ``sideways``
    how many steps the stage moved along x while the tip was lower than 1 mm above the specimen.
    """

    time_s: float = 0.0
    extension_mm: float = 0.0
    x_mm: float = 0.0
    z_mm: float = RAISED_MM
    to_x_mm: float = 0.0
    to_z_mm: float = RAISED_MM
    x_speed: float = 20.0
    on: bool = False
    mode: str = "off"  # off, seek, push
    target_mm: float = 0.0
    speed_mm_s: float = SPEED_MM_S
    force_n: float = 0.0  # what the motor is set to
    device_limit_n: float = 1e9
    limit_n: float = 7.0
    worst_n: float = 0.0
    above_s: float = 0.0
    sideways: int = 0
    sent: list[str] = field(default_factory=list)

    def surface_mm(self) -> float:
        return CONTACT_MM + self.z_mm

    def load_n(self) -> float:
        return max(0.0, (self.extension_mm - self.surface_mm()) * STIFF_N_MM)

    def advance(self, time_s: float) -> None:
        while self.time_s < time_s - 1e-12:
            dt = min(STEP_S, time_s - self.time_s)
            self._step(dt)
            self.time_s += dt

    def _step(self, dt: float) -> None:
        before_x = self.x_mm
        self.x_mm = _towards(self.x_mm, self.to_x_mm, self.x_speed * dt)
        self.z_mm = _towards(self.z_mm, self.to_z_mm, 20.0 * dt)
        if self.on and self.mode == "seek":
            wanted = _towards(self.extension_mm, self.target_mm, self.speed_mm_s * dt)
            deepest = self.surface_mm() + self.force_n / STIFF_N_MM
            self.extension_mm = min(wanted, max(deepest, 0.0)) if wanted > self.extension_mm else wanted
        elif self.on and self.mode == "push":
            motor = min(self.force_n, self.device_limit_n)
            goal = self.surface_mm() + max(motor, 0.0) / STIFF_N_MM if motor > 0 else self.extension_mm
            self.extension_mm = _towards(self.extension_mm, goal, 50.0 * dt)
        self.extension_mm = min(self.extension_mm, STROKE_MM)
        load = self.load_n()
        self.worst_n = max(self.worst_n, load)
        self.above_s += dt if load > self.limit_n * 1.001 else 0.0
        if self.x_mm != before_x and self.extension_mm > self.surface_mm() - 1.0:
            self.sideways += 1

    @property
    def tip_up(self) -> bool:
        return self.extension_mm < self.surface_mm() - 5.0


def _towards(now: float, goal: float, most: float) -> float:
    return goal if abs(goal - now) <= most else now + most * np.sign(goal - now)


class _Device:
    name = ""

    def __init__(self, plant: Mechanism, clock) -> None:
        self.plant, self.clock = plant, clock
        self.dead = False  # answers nothing and does nothing

    def _message(self, what: str) -> None:
        self.plant.advance(self.clock.now())
        if self.dead:
            self.clock.wait_until(self.clock.now() + 0.2)
            raise DeviceFault(f"{self.name}: no answer")
        self.plant.sent.append(f"{self.name} {what}")

    def identify(self) -> Identity:
        self._message("identify")
        return Identity(f"fake {self.name}", "1")

    def close(self) -> None:
        """Nothing to close."""


class FakeActuator(_Device):
    name = "actuator"
    deaf = False  # answers, but obeys nothing

    def watch(self, seconds: float) -> None:
        self._message("watch")

    def start(self, limit_n: float) -> None:
        self._message("start")
        self.plant.on, self.plant.device_limit_n = True, limit_n
        self.lift()

    def move(self, position_mm: float, speed_mm_s: float, force_n: float) -> None:
        self._message("move")
        p = self.plant
        if not self.deaf:
            p.mode, p.target_mm, p.speed_mm_s, p.force_n = "seek", position_mm, speed_mm_s, force_n

    def push(self, force_n: float) -> None:
        self._message("push")
        if not self.deaf:
            self.plant.mode, self.plant.force_n = "push", force_n

    def read(self) -> Extension:
        self._message("read")
        return Extension(self.clock.now(), self.plant.load_n(), self.plant.extension_mm)

    def lift(self) -> None:
        self._message("lift")
        p = self.plant
        if not self.deaf:
            p.mode, p.target_mm, p.speed_mm_s, p.force_n = "seek", 0.0, SPEED_MM_S, 1.0

    def off(self) -> None:
        self._message("off")
        self.plant.on, self.plant.mode = False, "off"


class FakeStage(_Device):
    name = "stage"

    def start(self) -> None:
        self._message("start")
        self.plant.to_z_mm, self.plant.to_x_mm = RAISED_MM, 0.0

    def move(self, position_mm: float, speed_mm_s: float) -> None:
        self._message("move")
        self.plant.to_x_mm, self.plant.x_speed = position_mm, speed_mm_s

    def lower(self) -> None:
        self._message("lower")
        self.plant.to_z_mm = 0.0

    def lift(self) -> None:
        self._message("lift")
        self.plant.to_z_mm = RAISED_MM

    def read(self) -> Place:
        self._message("read")
        p = self.plant
        moving = p.x_mm != p.to_x_mm or p.z_mm != p.to_z_mm
        return Place(self.clock.now(), p.x_mm, p.z_mm, moving)

    def stop(self) -> None:
        self._message("stop")
        self.plant.to_x_mm, self.plant.to_z_mm = self.plant.x_mm, self.plant.z_mm


class FakeImpedance(_Device):
    """20 readings a second of a leaky capacitor that a load makes larger."""

    name = "impedance"
    rate_hz = 20.0

    def start(self, tones_hz, voltage_v: float) -> None:
        self._message("start")
        self.tones, self.begun, self.given = np.asarray(tones_hz), self.clock.now(), 0
        self.rng = np.random.default_rng(1)

    def read(self) -> Readings:
        self._message("read")
        due = int((self.clock.now() - self.begun) * self.rate_hz)
        count, self.given = due - self.given, due
        c = 60e-12 * (1 + 0.02 * self.plant.load_n())
        z = 3000 + 1 / (2j * np.pi * self.tones * c)
        rows = np.tile(z, (count, 1)) * (1 + 1e-4 * self.rng.standard_normal((count, len(z))))
        times = self.begun + (due - count + 1 + np.arange(count)) / self.rate_hz
        return Readings(times, rows, np.zeros(count, bool))

    def stop(self) -> None:
        self._message("stop")


def fake_rig(clock, plant: Mechanism | None = None) -> tuple[RunDevices, Mechanism]:
    """Devices on one mechanism."""
    plant = plant or Mechanism()
    return RunDevices(FakeActuator(plant, clock), FakeStage(plant, clock), FakeImpedance(plant, clock)), plant
