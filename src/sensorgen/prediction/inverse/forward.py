"""Forward model of one sensor at fixed frequencies, for arrays of presses and for one press in plain numbers."""

import cmath

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.models import line
from sensorgen.models.sensor import UNIFORM, Sensor

FORCE_LIMIT_N = 13.0  # the rig's largest force, thesis chapter 6
_HALVINGS = 40


class Forward:
    """Exact ln Z of a sensor at its frequencies, for one press per row.

    Attributes
    ----------
    sensor : Sensor
        The sensor.
    frequency_hz : (n_tones,) array
        Frequencies [Hz].
    susceptance, loose : (n_tones,) array
        Per length, unpressed: omega C', and the whole admittance of the film [S/m].
    track, track_per_pascal : float
        Resistance of both electrodes per length, and how it rises under the tip [ohm/m], [ohm/m/Pa].

    Examples
    --------
    >>> from sensorgen.models.compression import unconfined
    >>> sensor = Sensor(0.1, 0.01, (3e-4, 3e-4), (5.0, 5.0), 7.6e-10, unconfined(6e5))
    >>> Forward(sensor, [1e3, 1e5]).log_impedance(np.array([3.0]), np.array([0.05])).shape
    (1, 2)
    """

    def __init__(self, sensor: Sensor, frequency_hz: ArrayLike) -> None:
        if sensor.profile != UNIFORM:
            raise OutOfRange(f"a tip of profile {sensor.profile!r}: only uniform pressure can be inverted")
        self.sensor, self.frequency_hz = sensor, tones(frequency_hz)
        self.susceptance: Real = 2 * np.pi * self.frequency_hz * sensor.capacitance_f_per_m
        self.loose = sensor.leak_s_per_m + (sensor.tan_delta + 1j) * self.susceptance
        self.track, self.track_per_pascal = sensor.track_ohm_per_m()

    def log_impedance(self, force_n: Real, position_m: Real) -> Complex:
        """Natural logarithm of Z/ohm, (n, n_tones); parameters and errors as :meth:`Sensor.impedance`.

        As :meth:`Sensor.impedance`, with everything that does not depend on the press computed once.
        """
        sensor, force = self.sensor, force_n[:, None]
        patch = sensor.patch(position_m[:, None])
        stress = force / (sensor.width_m * patch.length_m)
        thinning, _ = sensor.compression.capacitive_strain(stress)
        pressed = sensor.leak_s_per_m + (sensor.tan_delta + 1j) * (self.susceptance / (1 - thinning))
        under = self.track + stress * self.track_per_pascal
        right = np.maximum(sensor.length_m - patch.left_m - patch.length_m, 0.0)
        z = line.cascade(
            [self.track, under, self.track], [self.loose, pressed, self.loose],
            [patch.left_m, patch.length_m, right], sensor.far_end,
        )  # fmt: skip
        return np.log(sensor.at_leads(z, self.frequency_hz))

    def force_limit_n(self, most_n: float = FORCE_LIMIT_N) -> float:
        """The largest force up to ``most_n`` that the sensor bears anywhere, the tip half over its end [N]."""
        if not 0 < most_n < np.inf:
            raise OutOfRange(f"a force limit of {most_n:g} N; expected a number above 0")
        low, high = 0.0, most_n
        if self._bears(high):
            return high
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if self._bears(middle) else (low, middle)
        return low * (1 - 1e-6)

    def _bears(self, force_n: float) -> bool:
        try:
            self.log_impedance(np.full(2, force_n), np.array([0.0, self.sensor.length_m]))
        except OutOfRange:
            return False
        return True


def tones(frequency_hz: ArrayLike) -> Real:
    """Frequencies as an array, checked.

    Raises
    ------
    BadInput, OutOfRange
        No list of numbers; none at all, one that is not above 0 and finite, or two that are equal.
    """
    try:
        found = np.atleast_1d(np.asarray(frequency_hz, np.float64))
    except (TypeError, ValueError):
        raise BadInput(f"frequencies are numbers in Hz, not {str(frequency_hz)[:60]!r}") from None
    if found.ndim != 1 or not found.size:
        raise BadInput(f"expected a list of frequencies in Hz, not an array of shape {found.shape}")
    bad = ~((found > 0) & (found < np.inf))
    if bad.any():
        raise OutOfRange(f"a frequency of {found[bad][0]:g} Hz; expected a number above 0")
    if len(np.unique(found)) < len(found):
        raise OutOfRange("the same frequency twice: give each once")
    return found


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
        self._track, self._frequency_hz = (forward.track, forward.track_per_pascal), forward.frequency_hz
        far_ohm = complex(line.cascade([0.0], [0.0], [0.0], self._sensor.far_end))  # of no line: what lies behind it
        self._load = None if cmath.isinf(far_ohm) else far_ohm

    def log_impedance(self, force_n: float, position_m: float) -> list[complex]:
        """Natural logarithm of Z/ohm, per frequency; errors as :meth:`Sensor.impedance`."""
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
        return self._at_leads([sign * cmath.log(q) for q in passed])

    def _at_leads(self, ln_z: list[complex]) -> list[complex]:
        """Natural logarithm of Z/ohm at the meter, of that of the sensor."""
        if not self._sensor.lead_f and not self._sensor.lead_ohm:
            return ln_z
        at_meter = self._sensor.at_leads(np.exp(ln_z), self._frequency_hz)
        return [cmath.log(z) for z in at_meter.tolist()]

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
