"""A small plant for the tests of drivers: a piston without mass on a spring, and a stage with constant speed."""

import numpy as np


class SpringPlant:
    """A specimen of 2 N/mm below 20 mm of air; 1 kohm and 10 pF that grows with the force."""

    weight_n, stroke_mm = 0.9, 50.0

    def __init__(self, *, extension_mm=0.0, touch_mm=20.0, stiffness_n_mm=2.0, speed_mm_s=400.0):
        self.extension_mm, self.motor_n, self.time_s = extension_mm, 0.0, 0.0
        self.touch_mm, self.stiffness, self.fastest = touch_mm, stiffness_n_mm, speed_mm_s
        self.on, self.most_n, self.goal = False, 100.0, None
        self.axes = {"x": [0.0, 0.0, 1.0], "z": [0.0, 0.0, 1.0]}  # place, goal, speed

    @property
    def force_n(self):
        """Of the piston on the specimen."""
        return max(0.0, self.extension_mm - self.touch_mm - self.axes["z"][0]) * self.stiffness

    def advance(self, time_s):
        """In steps of 1 ms at most."""
        while self.time_s < time_s - 1e-12:
            step = min(1e-3, time_s - self.time_s)
            self.time_s += step
            self._step(step)

    def _step(self, step):
        for axis in self.axes.values():
            axis[0] = _towards(axis[0], axis[1], axis[2] * step)
        if not self.on:
            return
        speed, motor = self.fastest, self.motor_n
        rest = self.touch_mm + self.axes["z"][0] + max(0.0, motor + self.weight_n) / self.stiffness
        goal = rest if motor + self.weight_n > 0 else 0.0
        if self.goal is not None:
            target, speed, most = self.goal
            highest = self.touch_mm + self.axes["z"][0] + max(0.0, most + self.weight_n) / self.stiffness
            goal = min(target, highest)
            self.motor_n = self.force_n - self.weight_n
        self.extension_mm = min(max(_towards(self.extension_mm, goal, speed * step), 0.0), self.stroke_mm)

    def switch(self, *, on):
        """Motor."""
        self.on, self.goal, self.motor_n = on, None, 0.0

    def limit(self, motor_n):
        """Either way."""
        self.most_n = motor_n

    def drive(self, motor_n):
        """Force mode."""
        self.goal, self.motor_n = None, min(max(motor_n, -self.most_n), self.most_n)

    def seek(self, extension_mm, speed_mm_s, motor_n):
        """Position mode."""
        self.goal = (extension_mm, speed_mm_s, min(motor_n, self.most_n))

    def travel(self, axis, position_mm, speed_mm_s):
        """Stage."""
        self.axes[axis][1:] = [position_mm, speed_mm_s]

    def axis(self, axis):
        """Place, and whether it moves."""
        place, goal, _ = self.axes[axis]
        return float(place), place != goal

    def impedance(self, frequency_hz):
        """1 kohm in series with 10 pF that grows by a tenth per newton."""
        capacitance = 10e-12 * (1 + 0.1 * self.force_n)
        return 1000.0 + 1 / (2j * np.pi * np.asarray(frequency_hz) * capacitance)

    def resistance(self, *, wires):
        """Leads of half an ohm each."""
        return 650.0 + (1.0 if wires == 2 else 0.0)


def _towards(now, goal, most):
    return goal if abs(goal - now) <= most else now + (most if goal > now else -most)
