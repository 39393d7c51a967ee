"""What is drawn: impedance and its slopes over tone, force and position."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.models.sensor import Sensor

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LARGEST = 500_000  # points that a page in a browser still turns
MOST_TONES = 24  # panels that a picture still shows

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


class Quantity(NamedTuple):
    """A real quantity over force and position."""

    symbol: str
    title: str
    unit: str


QUANTITIES = {
    "resistance": Quantity("R", "Resistance R, real part of the impedance", "Ω"),
    "reactance": Quantity("X", "Reactance X, imaginary part of the impedance", "Ω"),
    "resistance-by-position": Quantity("dR/dx", "Change of resistance per position, dR/dx", "Ω/mm"),
    "resistance-by-force": Quantity("dR/dF", "Change of resistance per force, dR/dF", "Ω/N"),
    "reactance-by-position": Quantity("dX/dx", "Change of reactance per position, dX/dx", "Ω/mm"),
    "reactance-by-force": Quantity("dX/dF", "Change of reactance per force, dX/dF", "Ω/N"),
}


@dataclass(frozen=True)
class Field:
    """Impedance and its slopes; the axes of the arrays are tone, force and position.

    Attributes
    ----------
    frequency_hz, force_n, position_mm : (n,) array
        Tones [Hz], forces [N], centres of the tip [mm].
    impedance_ohm : complex array
        Impedance [ohm].
    by_force_ohm_per_n, by_position_ohm_per_mm : complex array
        Its exact derivatives [ohm/N], [ohm/mm].
    tip_mm, length_mm : float
        Of the tip and of the sensor [mm].
    """

    frequency_hz: Real
    force_n: Real
    position_mm: Real
    impedance_ohm: Complex
    by_force_ohm_per_n: Complex
    by_position_ohm_per_mm: Complex
    tip_mm: float
    length_mm: float

    def values(self, name: str) -> Real:
        """One of ``QUANTITIES``, over tone, force and position, in the unit named there."""
        slopes = {"position": self.by_position_ohm_per_mm, "force": self.by_force_ohm_per_n}
        part, _, by = name.partition("-by-")
        source = slopes.get(by, self.impedance_ohm)
        return np.asarray(source.real if part == "resistance" else source.imag)

    def on_sensor(self) -> NDArray[np.bool_]:
        """Positions where the whole tip rests on the sensor; all, where it does at none."""
        half = self.tip_mm / 2 * (1 + 1e-9)  # where the tip just reaches an end, the slopes jump
        inside = (self.position_mm > half) & (self.position_mm < self.length_mm - half)
        return inside if inside.any() else ~inside

    def folds(self) -> NDArray[np.bool_]:
        """Presses beyond which (F, x) -> (R, X) turns over: the sign of its determinant changes towards the next."""
        turning = (np.conj(self.by_force_ohm_per_n) * self.by_position_ohm_per_mm).imag
        turning = np.sign(np.where(np.abs(turning) > 1e-12 * np.abs(turning).max(initial=0), turning, 0))
        found = np.zeros(turning.shape, bool)
        found[:, :-1] |= turning[:, :-1] * turning[:, 1:] < 0
        found[:, :, :-1] |= turning[:, :, :-1] * turning[:, :, 1:] < 0
        return found


def field(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]
) -> Field:
    """Work out what is drawn.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz, force_n, position_mm : sequence of float
        Tones [Hz], forces [N] and centres of the tip [mm], each rising.

    Raises
    ------
    OutOfRange
        Too little or too much to draw; a position or a force that the sensor has no answer for.
    """
    f, force, at = (np.asarray(values, float) for values in (frequency_hz, force_n, position_mm))
    if min(len(force), len(at)) < 2:
        raise OutOfRange(f"{len(force)} force(s) and {len(at)} position(s) make no map; expected two or more of each")
    if len(f) > MOST_TONES or math.prod(map(len, (f, force, at))) > LARGEST:
        raise OutOfRange(
            f"{len(f)} tones, {len(force)} forces and {len(at)} positions are too much to draw; "
            f"expected up to {MOST_TONES} tones and {LARGEST} points in all: use larger steps"
        )
    found = sensor.response(f[:, None, None], force[:, None], at * M_PER_MM)
    by_mm = found.by_position_ohm_per_m * M_PER_MM
    size = (sensor.tip_m / M_PER_MM, sensor.length_m / M_PER_MM)
    return Field(f, force, at, found.impedance_ohm, found.by_force_ohm_per_n, by_mm, *size)


def scale(values: Real, unit: str) -> tuple[float, str]:
    """Divisor and unit that leave up to three digits before the point.

    Parameters
    ----------
    values : array
        In ``unit``.
    unit : str
        Without a prefix.

    Examples
    --------
    >>> scale(np.array([2300.0, -1100.0]), "Ω/mm")
    (1000.0, 'kΩ/mm')
    """
    largest = float(np.abs(values).max(initial=0.0))
    power = max((p for p in _PREFIXES if largest >= 10.0**p), default=0 if not largest else min(_PREFIXES))
    return 10.0**power, _PREFIXES[power] + unit


def tone(frequency_hz: float) -> str:
    """A frequency for a heading.

    Parameters
    ----------
    frequency_hz : float
        Frequency [Hz].

    Examples
    --------
    >>> tone(99700.0)
    '99.7 kHz'
    """
    divisor, unit = scale(np.asarray(frequency_hz), "Hz")
    return f"{frequency_hz / divisor:g} {unit}"
