"""Standard errors of force and position by one film, by two, and by their difference alone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.models.stack import Press, Stack, StackResponse, port, standard_errors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ROUNDING = 1e-12  # relative difference of two slopes below which it is rounding


@dataclass(frozen=True)
class DriftErrors:
    """Standard error with the permittivity known, and with it drifting; None where the readings have no information."""

    known: float | None
    drifting: float | None


@dataclass(frozen=True)
class ReadingErrors:
    """Standard errors of force [N] and position [m] of one way of reading."""

    reading: str
    force_n: DriftErrors
    position_m: DriftErrors


def bounds(stack: Stack, frequency_hz: Real, press: Press, noise: float, drift: float) -> tuple[ReadingErrors, ...]:
    """Cramer-Rao bounds from one film, from both readings, and from their difference alone.

    Parameters
    ----------
    stack : Stack
        With two films.
    frequency_hz : array
        Frequencies [Hz].
    press : Press
        Force and place.
    noise : float
        Standard deviation of real and imaginary part of each reading, relative to its modulus [-].
    drift : float
        Standard deviation of the drift of permittivity, the same in both films, relative [-].
    """
    found = stack.response(frequency_hz, press)
    upper, lower = port(2, 1, 2), port(1, 0, 2)
    size_upper, size_lower = (noise * np.abs(found.impedance_ohm @ p @ p) for p in (upper, lower))
    slopes = _slopes(found)
    by_upper, by_lower = slopes @ upper @ upper, slopes @ lower @ lower
    apart = by_upper - by_lower
    apart[np.abs(apart) < _ROUNDING * (np.abs(by_upper) + np.abs(by_lower))] = 0.0
    ways = {
        "lower film alone": _alone(stack, 0, frequency_hz, press, noise),
        "upper film alone": _alone(stack, 1, frequency_hz, press, noise),
        "both readings": (
            np.concatenate([by_upper, by_lower], axis=1), np.concatenate([size_upper, size_lower]),
        ),
        "difference alone": (apart, np.hypot(size_upper, size_lower)),
    }  # fmt: skip
    return tuple(ReadingErrors(name, *_errors(*way, drift)) for name, way in ways.items())


def _alone(stack: Stack, which: int, frequency_hz: Real, press: Press, noise: float) -> tuple[Complex, Real]:
    """Slopes and noise of one film between its two tracks, without the other film."""
    tracks, films = stack.tracks[which : which + 2], stack.films[which : which + 1]
    found = Stack(stack.length_m, stack.width_m, tracks, films).response(frequency_hz, press)
    return _slopes(found)[..., 0, 0], noise * np.abs(found.impedance_ohm[..., 0, 0])


def _slopes(response: StackResponse) -> Complex:
    """By force, position, and the drift that all films share, along a first axis."""
    drift = np.sum(response.by_film_ohm, axis=0)
    return np.stack([response.by_force_ohm_per_n, response.by_position_ohm_per_m, drift])


def _errors(slopes: Complex, noise: Real, drift: float) -> tuple[DriftErrors, DriftErrors]:
    """Prior knowledge of the drift is one more reading, of the drift itself."""
    known = standard_errors(slopes[:2], noise)
    aware = np.concatenate([slopes, np.array([[0.0], [0.0], [1.0]])], axis=1)
    drifting = standard_errors(aware, np.append(noise, drift))
    force, position = (
        DriftErrors(*(float(v) if np.isfinite(v) else None for v in (known[k], drifting[k]))) for k in (0, 1)
    )
    return force, position
