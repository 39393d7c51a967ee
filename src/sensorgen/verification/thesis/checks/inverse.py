"""The thesis's inverse: C.1 to C.5, on presses of a line with the sizes of Table C.1."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression, line_fit
from sensorgen.models.sensor import Sensor
from sensorgen.verification.thesis.verdicts import Part

Real = NDArray[np.float64]

_TONE_HZ = 99.7e3
_LENGTH_M = 0.178
_FORCES_N = np.linspace(0.5, 6.0, 8)
_PLACES_M = np.linspace(0.01, 0.165, 9)
# An electrode of 0.3 mm: Table C.1 gives none.
_SENSOR = Sensor(
    _LENGTH_M, 8.4e-3, (3e-4, 3e-4), (0.07, 0.2), EPS0_F_PER_M * 6.33 * 8.4e-3 / 6e-4, compression.unconfined(1e6)
)
# A polynomial as C.2 has it, whose root on the sensor is one: R0 [ohm], A, B, D, E [per N and m].
_R0, _A, _B, _D, _E = 5000.0, 2.0, -3e4, 9e3, 15.0
_C0_F, _CF_F_PER_N = 140e-12, 0.5e-12


@cache
def _readings() -> tuple[Real, Real, Real, Real]:
    """Force, position, C and R of every press [N], [m], [F], [ohm]."""
    force, x = (a.ravel() for a in np.meshgrid(_FORCES_N, _PLACES_M))
    return force, x, *line_fit.series(_TONE_HZ, _SENSOR.impedance(_TONE_HZ, force, x))


def _least_squares(columns: list[Real], wanted: Real) -> Real:
    basis = np.stack(columns, -1)
    scale = abs(basis).max(0)
    return np.asarray(basis @ (np.linalg.lstsq(basis / scale, wanted, rcond=None)[0] / scale))


def capacitance() -> list[Part]:
    """C.1: a straight line for what is a hyperbola."""
    force, _, c, _ = _readings()
    return [Part("C", "F", c, _least_squares([np.ones_like(force), force], c))]


def resistance() -> list[Part]:
    """C.2: what force and position change of R, by both sets of powers."""
    force, x, _, r = _readings()
    rest = float(np.real(_SENSOR.impedance(_TONE_HZ, 0.0, _LENGTH_M / 2)))
    one = np.ones_like(force)
    printed = _least_squares([one, force, x * x, x, force * x], r - rest)
    corrected = _least_squares([one, force, force * x, force * x * x], r - rest)
    return [Part("R - R0", "ohm", r - rest, printed, corrected)]


def cost() -> list[Part]:
    """C.3: what a fit leaves, with the square around the sum and inside it."""
    force, x, c, r = _readings()
    fit = line_fit.fit(force, x, c, r, form="printed")
    left = r - _least_squares([np.ones_like(force), force, x * x, x, force * x], r)
    outside, inside = np.sqrt(np.sum(left) ** 2 / len(left)), np.sqrt(np.mean(left**2))
    return [Part("what is left of R", "ohm", fit.residual_ohm, float(outside), float(inside))]


def _polynomial() -> tuple[line_fit.LineFit, Real, Real, Real, Real]:
    """A fit of presses that obey C.1 and C.2 exactly, and these presses."""
    force, x, _, _ = _readings()
    c = _C0_F + force * _CF_F_PER_N
    r = _R0 + _A * force + _B * x * x + _D * x + _E * force * x
    return line_fit.fit(force, x, c, r, form="printed"), force, x, c, r


def force() -> list[Part]:
    """C.4."""
    fit, _, _, c, _ = _polynomial()
    return [Part("F", "N", fit.force_n(c), (c - _C0_F) / _CF_F_PER_N)]


def position() -> list[Part]:
    """C.5, on presses whose resistance is that polynomial."""
    fit, f, x, c, r = _polynomial()
    roots = fit.presses(c, r).position_m
    ours = np.take_along_axis(roots, abs(roots - x[:, None]).argmin(1)[:, None], 1)[:, 0]
    linear = _D + _E * f
    under = linear**2 - 4 * _B * (_R0 + _A * f - r)
    both = np.stack([(-linear + sign * np.sqrt(under)) / (2 * _B) for sign in (1, -1)], -1)
    corrected = np.take_along_axis(both, abs(both - x[:, None]).argmin(1)[:, None], 1)[:, 0]
    return [Part("x", "m", ours, fit.printed_position_m(c), corrected)]
