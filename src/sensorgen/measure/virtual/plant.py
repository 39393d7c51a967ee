"""Plant of the simulated controllers: piston, tip, stage and specimen as one mechanism with one time."""

from typing import Protocol

from sensorgen.core.arrays import Complex, Real


class Plant(Protocol):
    """Mechanism and specimen. Lengths in mm, forces in N, downwards positive; time by the run's clock.

    A simulated device first calls :meth:`advance` with the time of the message that it was sent.

    Attributes
    ----------
    extension_mm : float
        How far the piston is out.
    motor_n : float
        Force of the motor by its current, which is all that the controller can measure: neither weight nor friction.
    """

    extension_mm: float
    motor_n: float

    def advance(self, time_s: float) -> None:
        """Let the mechanism move on to a time [s]."""

    def switch(self, *, on: bool) -> None:
        """Motor on or off; off, nothing but friction holds the piston."""

    def limit(self, motor_n: float) -> None:
        """Largest force of the motor, either way [N]."""

    def drive(self, motor_n: float) -> None:
        """Force mode: a force of the motor [N]."""

    def seek(self, extension_mm: float, speed_mm_s: float, motor_n: float) -> None:
        """Position mode: go to an extension with at most a force of the motor."""

    def travel(self, axis: str, position_mm: float, speed_mm_s: float) -> None:
        """Begin a move of the stage along "x", or "z", which raises the actuator."""

    def axis(self, axis: str) -> tuple[float, bool]:
        """Position of an axis [mm], and whether it moves."""

    def impedance(self, frequency_hz: Real) -> Complex:
        """Reading of an ideal instrument at the end of the leads now, of (m,) frequencies [ohm]."""

    def resistance(self, *, wires: int) -> float:
        """Reading of an ideal multimeter across the bottom electrode [ohm]."""


def lines(received: bytearray, data: bytes, end: bytes) -> list[bytes]:
    """Lines that are complete with some more bytes; what is left stays in ``received``."""
    received += data
    *found, rest = bytes(received).split(end)
    received[:] = rest
    return found
