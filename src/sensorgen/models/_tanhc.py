"""tanh(z)/z of z squared, and its derivative: smooth through 0, right to rounding in both parts."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Taylor coefficients of tanh(z)/z in z^2: 2^2n (2^2n - 1) B_2n / (2n)!
_TERMS = (
    1.0, -1 / 3, 2 / 15, -17 / 315, 62 / 2835, -1382 / 155925, 21844 / 6081075, -929569 / 638512875,
    6404582 / 10854718875, -443861162 / 1856156927625, 18888466084 / 194896477400625,
    -113927491862 / 2900518163668125, 58870668456604 / 3698160658676859375,
)  # fmt: skip
_SLOPES = tuple(k * term for k, term in enumerate(_TERMS))[1:]
_SMALL = 1e-2  # |z^2| below which eight terms serve: the ninth is under 1e-19 of the first
_SMALL_SLOPE = 0.05  # the quotient of the derivative cancels twice, so its series reaches further: twelve terms, 1e-17


def tanhc(squared: NDArray[Any]) -> NDArray[Any]:
    """tanh(z)/z [-], given z^2 with a real part of 0 or more.

    >>> complex(tanhc(np.asarray(0j))), round(float(tanhc(np.asarray(1.0 + 0j)).real), 6)
    ((1+0j), 0.761594)
    """
    small = np.abs(squared.imag) + np.abs(squared.real) < _SMALL
    if small.all():
        return _horner(_TERMS[:8], squared)
    z = np.sqrt(squared)
    if not small.any():
        return np.asarray(np.tanh(z) / z)
    found = np.empty_like(squared)
    found[small] = _horner(_TERMS[:8], squared[small])
    found[~small] = np.tanh(z[~small]) / z[~small]
    return found


def tanhc_slope(squared: NDArray[Any], value: NDArray[Any]) -> NDArray[Any]:
    """Derivative of tanh(z)/z by z^2 [-], given its value T: (1 - z^2 T^2 - T) / (2 z^2).

    >>> round(float(tanhc_slope(np.asarray(0j), np.asarray(1 + 0j)).real), 6)
    -0.333333
    """
    small = np.abs(squared) < _SMALL_SLOPE
    safe = np.where(small, 1.0, squared)
    return np.where(small, _horner(_SLOPES, squared), (1 - squared * value**2 - value) / (2 * safe))


def _horner(terms: Sequence[float], at: NDArray[Any]) -> NDArray[Any]:
    total = at * terms[-1]
    for term in terms[-2:0:-1]:
        total += term
        total *= at
    total += terms[0]
    return np.asarray(total)
