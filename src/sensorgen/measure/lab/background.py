"""Read an impedance meter beside the control loop, which then never waits for it."""

import queue
import threading

from sensorgen.core.arrays import Real
from sensorgen.measure.lab.devices import DeviceFault, Identity, ImpedanceMeter, Readings

_POLL_S, _LONGEST_S = 0.005, 5.0  # between two questions; longer than any answer takes


class Background:
    """An :class:`ImpedanceMeter` that another one is read through, in a thread.

    Parameters
    ----------
    meter : ImpedanceMeter
        Whose ``read`` may wait, as for an answer by VISA.
    """

    def __init__(self, meter: ImpedanceMeter) -> None:
        self._meter, self._tones = meter, 0
        self._found: queue.SimpleQueue[Readings] = queue.SimpleQueue()
        self._fault: BaseException | None = None
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def identify(self) -> Identity:
        """Ask what it is."""
        return self._meter.identify()

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to measure, and to read [Hz], [V]."""
        self._meter.start(tones_hz, voltage_v)
        self._tones = len(tones_hz)
        self._thread = threading.Thread(target=self._work, name="impedance", daemon=True)
        self._thread.start()

    def read(self) -> Readings:
        """Readings since the last call; a failure of the meter is raised here."""
        if self._fault:
            raise self._fault
        parts = []
        while not self._found.empty():
            parts.append(self._found.get())
        return Readings.joined(parts, self._tones)

    def stop(self) -> None:
        """End the reading, then the measurement.

        Raises
        ------
        DeviceFault
            The meter still waits for an answer.
        """
        self._end.set()
        if self._thread:
            self._thread.join(_LONGEST_S)
            if self._thread.is_alive():
                raise DeviceFault(f"impedance meter: no answer for {_LONGEST_S:g} s; switch its output off by hand")
        self._meter.stop()

    def close(self) -> None:
        """Give the connection back."""
        self._meter.close()

    def _work(self) -> None:
        try:
            while not self._end.wait(_POLL_S):
                found = self._meter.read()
                if len(found.time_s) or found.lost:
                    self._found.put(found)
        except BaseException as error:  # for the run, which lifts the tip
            self._fault = error
