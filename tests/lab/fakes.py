"""Devices without protocols on the mechanism of the drivers' tests, which keeps the record of what was done to it.

They share no code with the simulators that ship, so that the run's safety is judged twice.
"""

from dataclasses import dataclass

import numpy as np

from lab.spring_plant import SpringPlant
from sensorgen.measure.lab.devices import DeviceFault, Extension, Identity, Place, Readings, SimulatedClock
from sensorgen.measure.lab.safety import RunDevices

RAISED_MM, SPEED_MM_S, LIMIT_N = 30.0, 40.0, 7.0


class Mechanism(SpringPlant):
    """Piston, stage and a stiff specimen.

    ``worst_n`` is the largest force on the specimen, ``above_s`` for how long it was above the limit, ``sideways``
    how many steps the stage moved along x while the tip was lower than 1 mm above the specimen, ``sent`` all messages.
    """

    stroke_mm = 40.0

    def __init__(self):
        super().__init__(stiffness_n_mm=50.0, speed_mm_s=50.0)
        self.axes["z"][:] = [RAISED_MM, RAISED_MM, 20.0]
        self.worst_n = self.above_s = self.sideways = 0
        self.sent = []

    @property
    def above_mm(self):
        """Of the tip, above the specimen."""
        return self.touch_mm + self.axes["z"][0] - self.extension_mm

    def _step(self, step):
        before = self.axes["x"][0]
        super()._step(step)
        self.worst_n = max(self.worst_n, self.force_n)
        self.above_s += step if self.force_n > LIMIT_N * 1.001 else 0.0
        self.sideways += self.axes["x"][0] != before and self.above_mm < 1.0


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
        self.plant.switch(on=True)
        self.plant.limit(limit_n)
        self.lift()

    def move(self, position_mm: float, speed_mm_s: float, force_n: float) -> None:
        self._message("move")
        if not self.deaf:
            self.plant.seek(position_mm, speed_mm_s, force_n - self.plant.weight_n)

    def push(self, force_n: float) -> None:
        self._message("push")
        if not self.deaf:
            self.plant.drive(force_n - self.plant.weight_n)

    def read(self) -> Extension:
        self._message("read")
        return Extension(self.clock.now(), self.plant.force_n, self.plant.extension_mm)

    def lift(self) -> None:
        self._message("lift")
        if not self.deaf:
            self.plant.seek(0.0, SPEED_MM_S, 1.0)

    def off(self) -> None:
        self._message("off")
        self.plant.switch(on=False)


class FakeStage(_Device):
    name = "stage"

    def start(self) -> None:
        self._message("start")
        self.plant.travel("z", RAISED_MM, 20.0)
        self.plant.travel("x", 0.0, 20.0)

    def move(self, position_mm: float, speed_mm_s: float) -> None:
        self._message("move")
        self.plant.travel("x", position_mm, speed_mm_s)

    def lower(self) -> None:
        self._message("lower")
        self.plant.travel("z", 0.0, 20.0)

    def lift(self) -> None:
        self._message("lift")
        self.plant.travel("z", RAISED_MM, 20.0)

    def read(self) -> Place:
        self._message("read")
        (x_mm, x_moves), (z_mm, z_moves) = (self.plant.axis(axis) for axis in "xz")
        return Place(self.clock.now(), x_mm, z_mm, x_moves or z_moves)


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
        c = 60e-12 * (1 + 0.02 * self.plant.force_n)
        z = 3000 + 1 / (2j * np.pi * self.tones * c)
        rows = np.tile(z, (count, 1)) * (1 + 1e-4 * self.rng.standard_normal((count, len(z))))
        times = self.begun + (due - count + 1 + np.arange(count)) / self.rate_hz
        return Readings(times, rows, np.zeros(count, bool))

    def stop(self) -> None:
        self._message("stop")


@dataclass
class FakeLab:
    """Devices on one mechanism."""

    clock: SimulatedClock
    mechanism: Mechanism
    rig: RunDevices


def fake_lab() -> FakeLab:
    """A new one."""
    clock, plant = SimulatedClock(), Mechanism()
    rig = RunDevices(FakeActuator(plant, clock), FakeStage(plant, clock), FakeImpedance(plant, clock))
    return FakeLab(clock, plant, rig)
