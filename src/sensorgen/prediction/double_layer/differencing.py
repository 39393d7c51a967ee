"""What a second film tells that one does not."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.models.stack import Press, Response, Stack, port, standard_errors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ROUNDING = 1e-12  # of two slopes, below which their difference says nothing


def bounds(stack: Stack, frequency_hz: Real, press: Press, noise: float, drift: float) -> list[dict[str, Any]]:
    """Standard errors of force and position from one film, from both readings, and from their difference alone.

    Parameters
    ----------
    stack : Stack
        With two films.
    frequency_hz : array
        Tones [Hz].
    press : Press
        What presses.
    noise : float
        Standard deviation of real and imaginary part of each reading, relative to its modulus [-].
    drift : float
        Standard deviation of what permittivity may have drifted by, the same in both films, relative [-].

    Returns
    -------
    list of dict
        Per way of reading: ``reading``, and ``force_n`` and ``position_m`` each with the permittivity ``known`` or
        ``drifting``; None where nothing can be told.
    """
    found = stack.response(frequency_hz, press)
    upper, lower = port(2, 1, 2), port(1, 0, 2)
    size_upper, size_lower = (noise * np.abs(found.impedance_ohm @ p @ p) for p in (upper, lower))
    slopes = _slopes(found)
    both = np.concatenate([slopes @ upper @ upper, slopes @ lower @ lower], axis=1)
    ways = {
        "lower film alone": _alone(stack, 0, frequency_hz, press, noise),
        "upper film alone": _alone(stack, 1, frequency_hz, press, noise),
        "both readings": (both, np.concatenate([size_upper, size_lower])),
        "difference alone": (_apart(slopes @ upper @ upper, slopes @ lower @ lower), np.hypot(size_upper, size_lower)),
    }
    return [{"reading": name, **_errors(*way, drift)} for name, way in ways.items()]


def _alone(stack: Stack, which: int, frequency_hz: Real, press: Press, noise: float) -> tuple[Complex, Real]:
    """Slopes and noise of one film between its two tracks, the other film not being there."""
    tracks, films = stack.tracks[which : which + 2], stack.films[which : which + 1]
    found = Stack(stack.length_m, stack.width_m, tracks, films).response(frequency_hz, press)
    return _slopes(found)[..., 0, 0], noise * np.abs(found.impedance_ohm[..., 0, 0])


def _slopes(response: Response) -> Complex:
    """By force, position, and the drift that all films share, along a first axis."""
    drift = np.sum(response.by_film_ohm, axis=0)
    return np.stack([response.by_force_ohm_per_n, response.by_position_ohm_per_m, drift])


def _apart(one: Complex, other: Complex) -> Complex:
    """The difference, 0 where it is rounding."""
    found = one - other
    return np.where(np.abs(found) < _ROUNDING * (np.abs(one) + np.abs(other)), 0.0, found)


def _errors(slopes: Complex, noise: Real, drift: float) -> dict[str, dict[str, float | None]]:
    """What is known of the drift beforehand is one more reading, of the drift itself."""
    known = standard_errors(slopes[:2], noise)
    aware = np.concatenate([slopes, np.array([[0.0], [0.0], [1.0]])], axis=1)
    drifting = standard_errors(aware, np.append(noise, drift))
    return {
        name: {"known": _or_none(known[k]), "drifting": _or_none(drifting[k])}
        for k, name in enumerate(("force_n", "position_m"))
    }


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
