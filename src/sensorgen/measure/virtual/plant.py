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


class Simulator:
    """A device on a plant at the end of a line, asked in turns.

    Parameters
    ----------
    plant : Plant
        What it moves or measures.

    Attributes
    ----------
    fault : str
        Planted fault, or "": of all devices "cut", the cable is out; "silent", no answers; "hung", no action either.
    heard : list of bytes
        Every line that has come.
    """

    END, GARBAGE = b"\n", b"\x7f?<\n"

    def __init__(self, plant: Plant) -> None:
        self.fault = ""
        self.heard: list[bytes] = []
        self._plant, self._now_s = plant, 0.0
        self._received, self._out = bytearray(), bytearray()

    def exchange(self, data: bytes, time_s: float) -> bytes:
        """Bytes sent by a time, after having received some; OSError where the cable is out."""
        if self.fault == "cut":
            raise OSError("cable out")
        self._now_s = time_s
        self._plant.advance(time_s)
        self._step()
        *lines, rest = bytes(self._received + data).split(self.END)
        self._received[:] = rest
        for line in lines:
            self.heard.append(line)
            if self.fault != "hung":
                self._take(line)
        self._step()
        sent, self._out = bytes(self._out), bytearray()
        return b"" if self.fault in ("silent", "hung") else sent

    def _spoilt(self, answer: bytes) -> bytes:
        """An answer as faults of the line have it."""
        answer = self.GARBAGE if self.fault == "garbage" else answer
        return answer[: len(answer) // 2] if self.fault == "truncated" else answer

    def _step(self) -> None:
        """Step of the device by itself, whether anything has come or not."""

    def _take(self, line: bytes) -> None:
        """One line that has come."""
        raise NotImplementedError
