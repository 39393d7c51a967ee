r"""tanh(z)/z of z squared, and its slopes: right to rounding in both parts, from 0 to infinity.

Near 0 it is Lambert's continued fraction, a quotient of two polynomials of z^2 that needs neither root nor exponential
and loses nothing of a tiny imaginary part; far from 0 exp(-2z) is kept apart as a length and the tangent of an angle.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class _Fraction(NamedTuple):
    """Numerator and denominator by rising powers of z^2."""

    reach: float  # largest |Re z^2| + |Im z^2| at which either part is right to 2e-15
    over: tuple[float, ...]
    under: tuple[float, ...]


def _lambert(degree: int, reach: float) -> _Fraction:
    """1 / (1 + w / (3 + w / (5 + ...))), cut off where both polynomials of w have this degree."""
    before: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,), (1.0,))
    now: tuple[tuple[float, ...], tuple[float, ...]] = ((1.0,), (1.0,))
    for odd in range(3, 4 * degree + 2, 2):
        before, now = now, (_next(odd, now[0], before[0]), _next(odd, now[1], before[1]))
    return _Fraction(reach, *(terms[: degree + 1] for terms in now))


def _next(odd: int, now: tuple[float, ...], before: tuple[float, ...]) -> tuple[float, ...]:
    """Odd times one polynomial, and w times the one before it."""
    return tuple(odd * a + b for a, b in zip((*now, 0.0), (0.0, *before, 0.0), strict=False))


_FRACTIONS = tuple(map(_lambert, range(2, 9), (6e-3, 0.18, 1.1, 4.0, 10.0, 20.0, 35.0)))
_REACH = 35.0
_REACH_OF_SLOPES = 4.0  # 1 - tanh^2 is a difference: farther on, more than one digit of it would go


def tanhc(squared: Array) -> Array:
    """T = tanh(z)/z [-], given z^2 with neither part below 0.

    >>> complex(tanhc(np.asarray(0j))), round(float(tanhc(np.asarray(1.0 + 0j)).real), 6)
    ((1+0j), 0.761594)
    """
    return _split(_near, _far, _REACH, squared)


def tanhc_slope(squared: Array, ratio: Array) -> Array:
    """Derivative of T by z^2 [-], given T.

    >>> round(float(tanhc_slope(np.asarray(0j), np.asarray(1 + 0j)).real), 6)
    -0.333333
    """
    return _split(_near_slope, lambda w, t: (_far_sech_squared(w, t) - t) / (2 * w), _REACH_OF_SLOPES, squared, ratio)


def sech_squared(squared: Array, ratio: Array) -> Array:
    """1 - tanh(z)^2 [-], given T.

    >>> complex(sech_squared(np.asarray(0j), np.asarray(1 + 0j)))
    (1+0j)
    """
    return _split(lambda _, w, t: 1 - w * t * t, _far_sech_squared, _REACH_OF_SLOPES, squared, ratio)


def _split(near: Callable[..., Array], far: Callable[..., Array], reach: float, w: Array, *more: Array) -> Array:
    """Near and far values, each by its own way."""
    size = w.real + w.imag
    largest = float(size.max(initial=0.0))
    if largest <= reach:
        return near(largest, w, *more)
    is_far = size > reach
    if is_far.all():
        return far(w, *more)
    found = np.empty_like(w)
    found[~is_far] = near(reach, *(v[~is_far] for v in (w, *more)))
    found[is_far] = far(*(v[is_far] for v in (w, *more)))
    return found


def _near(largest: float, w: Array) -> Array:
    _, over, under = _shortest(largest)
    return np.asarray(_horner(over, w) / _horner(under, w))


def _near_slope(largest: float, w: Array, ratio: Array) -> Array:
    _, over, under = _shortest(largest)
    above = _horner(_derived(over), w) - ratio * _horner(_derived(under), w)
    return np.asarray(above / _horner(under, w))


def _shortest(largest: float) -> _Fraction:
    return next(fraction for fraction in _FRACTIONS if largest <= fraction.reach)


def _horner(terms: Sequence[float], at: Array) -> Array:
    total = at * terms[-1]
    for term in terms[-2:0:-1]:
        total += term
        total *= at
    total += terms[0]
    return total


def _derived(terms: Sequence[float]) -> tuple[float, ...]:
    return tuple(k * term for k, term in enumerate(terms))[1:]


def _far(w: Array) -> Array:
    z, decay, tangent = _far_parts(w)
    square = tangent * tangent
    below = (1 + decay) ** 2 + (1 - decay) ** 2 * square
    tanh = np.empty_like(w)
    tanh.real = (1 - decay * decay) * (1 + square) / below
    tanh.imag = 4 * decay * tangent / below
    return np.asarray(tanh / z)


def _far_sech_squared(w: Array, _: Array) -> Array:
    _, decay, tangent = _far_parts(w)
    turned = (1 + decay) + 1j * ((1 - decay) * tangent)
    return np.asarray(4 * decay * (1 + tangent * tangent) / (turned * turned))


def _far_parts(w: Array) -> tuple[Array, Array, Array]:
    """The root z, exp(-2 Re z) and tan(Im z): real functions are several times as fast as complex ones."""
    z = np.empty_like(w)
    z.real = np.sqrt(0.5 * (np.abs(w) + w.real))
    z.imag = 0.5 * w.imag / z.real
    return z, np.exp(-2 * z.real), np.tan(z.imag)
