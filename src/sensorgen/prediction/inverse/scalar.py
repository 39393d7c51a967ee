"""The forward model for one press at a time: in plain numbers it takes a tenth of what arrays of one take."""

import cmath

import numpy as np

from sensorgen.models import line
from sensorgen.prediction.inverse.forward import Forward

Section = tuple[float, list[complex], float]


class Scalar:
    """Exact ln Z of one press; as :class:`Forward`, whose numbers it takes and which its tests hold it against.

    Parameters
    ----------
    forward : Forward
        The model for many presses.

    Examples
    --------
    >>> from sensorgen.models.compression import unconfined
    >>> from sensorgen.models.sensor import Sensor
    >>> forward = Forward(Sensor(0.1, 0.01, (3e-4, 3e-4), (5.0, 5.0), 7.6e-10, unconfined(6e5)), [1e3, 1e5])
    >>> found = Scalar(forward).log_impedance(3.0, 0.05)
    >>> np.allclose(found, forward.log_impedance(np.array([3.0]), np.array([0.05])), rtol=1e-14)
    True
    """

    def __init__(self, forward: Forward) -> None:
        self._sensor = forward.sensor
        self._susceptance = forward.susceptance.tolist()
        self._loose = forward.loose.tolist()
        self._track = forward.track, forward.track_per_pascal
        far_ohm = complex(line.cascade([0.0], [0.0], [0.0], self._sensor.far_end))  # of no line: what lies behind it
        self._load = None if cmath.isinf(far_ohm) else far_ohm

    def log_impedance(self, force_n: float, position_m: float) -> list[complex]:
        """Natural logarithm of Z/ohm, tone by tone; errors as :meth:`Sensor.line_inputs`."""
        sensor, (track, per_pascal) = self._sensor, self._track
        left = max(position_m - sensor.tip_m / 2, 0.0)
        end = min(position_m + sensor.tip_m / 2, sensor.length_m)
        stress = force_n / (sensor.width_m * (end - left))
        stiffer = (sensor.tan_delta + 1j) / (1 - float(sensor.compression.capacitive_strain(np.asarray(stress))[0]))
        pressed = [sensor.leak_s_per_m + stiffer * b for b in self._susceptance]
        right = sensor.length_m - end, self._loose, track
        return self._from_far_end(right, (end - left, pressed, track + stress * per_pascal), (left, self._loose, track))

    def _from_far_end(self, *sections: Section) -> list[complex]:
        """As :meth:`Forward._from_far_end`."""
        passed = [self._load or 0j] * len(self._loose)
        for length, y, r in sections:
            if length > 0:
                step = self._open if self._load is None else self._closed
                passed = [step(q, y_k, r, length) for q, y_k in zip(passed, y, strict=True)]
        sign = -1.0 if self._load is None else 1.0
        return [sign * cmath.log(q) for q in passed]

    @staticmethod
    def _open(q: complex, y: complex, r: float, length: float) -> complex:
        along = _along(y * r, length)
        return (q + y * along) / (1.0 + q * r * along)

    @staticmethod
    def _closed(q: complex, y: complex, r: float, length: float) -> complex:
        along = _along(y * r, length)
        return (q + r * along) / (1.0 + q * y * along)


def _along(squared: complex, length: float) -> complex:
    """Length times tanh(z)/z, z the length times the root: right to rounding of its magnitude, all that counts here."""
    z = cmath.sqrt(squared) * length
    return length * cmath.tanh(z) / z if z else complex(length)
