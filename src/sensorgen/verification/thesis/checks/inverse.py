"""The thesis's inverse: C.1 to C.5, on presses of a line with the sizes of Table C.1."""

from functools import cache

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.models import compression
from sensorgen.models.sensor import Sensor
from sensorgen.verification.thesis.items import ItemPart, Parts, table

_LOW_HZ, _TONE_HZ = 1.1e3, 99.7e3
_MISSED_OHM = 2.0
_GIVEN = table("C.1")
_LENGTH_M, _WIDTH_M = (mm * M_PER_MM for mm in _GIVEN["size_mm"])
_FORCES_N = np.linspace(0.5, 6.0, 8)
_PLACES_M = np.linspace(0.01, 0.165, 9)
# An electrode of 0.3 mm: Table C.1 gives none.
_SENSOR = Sensor(
    _LENGTH_M, _WIDTH_M, (3e-4, 3e-4), (_GIVEN["resistivity_ohm_m"]["top"], _GIVEN["resistivity_ohm_m"]["bottom"]),
    EPS0_F_PER_M * _GIVEN["x60"]["relative_permittivity"] * _WIDTH_M / (_GIVEN["plate_mm"] * M_PER_MM),
    compression.unconfined(_GIVEN["x60"]["youngs_modulus_pa"]),
)  # fmt: skip
# A polynomial as C.2 has it, whose root on the sensor is one: R0 [ohm], A, B, D, E [per N and m].
_R0, _A, _B, _D, _E = 5000.0, 2.0, -3e4, 9e3, 15.0
_C0_F, _CF_F_PER_N = 140e-12, 0.5e-12


@cache
def _readings() -> tuple[Real, Real, Real, Real]:
    """Force, position, C and R of every press [N], [m], [F], [ohm]."""
    force, x = (a.ravel() for a in np.meshgrid(_FORCES_N, _PLACES_M))
    z = _SENSOR.impedance(_TONE_HZ, force, x)
    return force, x, _capacitance_f(_TONE_HZ, z), z.real


def _capacitance_f(tone_hz: float, z: Complex) -> Real:
    """Of a reading, taken as a resistor in series with a capacitor [F]."""
    return np.asarray(-1 / (2 * np.pi * tone_hz * z.imag))


def _least_squares(columns: list[Real], wanted: Real) -> Real:
    basis = np.stack(columns, -1)
    scale = abs(basis).max(0)
    return np.asarray(basis @ (np.linalg.lstsq(basis / scale, wanted, rcond=None)[0] / scale))


def _straight(tone_hz: float) -> tuple[Real, Real, float]:
    """Rise of C over rest of all presses, that by C.1, and the slope C_F of C.1 [F], [F], [F/N]."""
    force, x, _, _ = _readings()
    c = _capacitance_f(tone_hz, _SENSOR.impedance(tone_hz, force, x))
    rest = _capacitance_f(tone_hz, _SENSOR.impedance(tone_hz, 0.0, _LENGTH_M / 2))
    straight = _least_squares([np.ones_like(force), force], c)
    return c - rest, straight - rest, float(np.ptp(straight) / np.ptp(force))


def capacitance() -> Parts:
    """C.1: one straight line for all positions; by what a press changes, at the lowest and the highest tone."""
    for tone in (_LOW_HZ, _TONE_HZ):
        yield ItemPart(f"C - C(0) at {tone / 1e3:g} kHz", "F", *_straight(tone)[:2])


def force() -> Parts:
    """C.4: the force that C.1 reads from these capacitances."""
    pressed, _, _, _ = _readings()
    for tone in (_LOW_HZ, _TONE_HZ):
        rise, straight, slope = _straight(tone)
        yield ItemPart(f"F at {tone / 1e3:g} kHz", "N", pressed, pressed + (rise - straight) / slope)


def resistance() -> Parts:
    """C.2: what force and position change of R, by both sets of powers."""
    force, x, _, r = _readings()
    rest = float(np.real(_SENSOR.impedance(_TONE_HZ, 0.0, _LENGTH_M / 2)))
    one = np.ones_like(force)
    printed = _least_squares([one, force, x * x, x, force * x], r - rest)
    corrected = _least_squares([one, force, force * x, force * x * x], r - rest)
    yield ItemPart("R - R0", "ohm", r - rest, printed, corrected)


def cost() -> Parts:
    """C.3: readings that miss C.2 by a known amount, which bends with the force and so no fit can follow."""
    force, x, _, r = _polynomial()
    bent = 3 * (force - force.mean()) ** 2
    bent -= bent.mean()
    missed = _MISSED_OHM * bent / np.sqrt(np.mean(bent**2))
    fitted = _least_squares([np.ones_like(force), force, x * x, x, force * x], r + missed)
    left = np.sqrt(np.mean((fitted - r - missed) ** 2))
    outside = np.sqrt(np.sum(missed) ** 2 / len(missed))
    yield ItemPart("what is left of R", "ohm", float(left), float(outside), _MISSED_OHM)


def _polynomial() -> tuple[Real, Real, Real, Real]:
    """Presses that obey C.1 and C.2 exactly."""
    force, x, _, _ = _readings()
    return force, x, _C0_F + force * _CF_F_PER_N, _R0 + _A * force + _B * x * x + _D * x + _E * force * x


def position() -> Parts:
    """C.5, on presses whose resistance is that polynomial; printed without the measured one, and with -(D + EF)^2."""
    _, x, c, r = _polynomial()
    f = (c - _C0_F) / _CF_F_PER_N
    linear = _D + _E * f
    printed = (-linear - np.sqrt(-(linear**2) - 4 * _B * (_R0 + _A * f))) / (2 * _B)
    under = linear**2 - 4 * _B * (_R0 + _A * f - r)
    both = np.stack([(-linear + sign * np.sqrt(under)) / (2 * _B) for sign in (1, -1)], -1)
    corrected = np.take_along_axis(both, abs(both - x[:, None]).argmin(1)[:, None], 1)[:, 0]
    yield ItemPart("x", "m", x, printed, corrected)


def weights(w_fit: list[float]) -> Parts:
    """C.1.1: weights of R0, C0, C_F, A, B, D, E, in the order of its list: B has none, and C.5 divides by it."""
    yield ItemPart("B of C.5 over its first estimate", "", w_fit[4])
