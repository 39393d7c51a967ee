"""Which of the given tones tell most, and where tones should lie."""

from itertools import combinations
from typing import Any

import numpy as np

from sensorgen.prediction.identifiability.fisher import Real, Setup, Slopes, bounds, slopes
from sensorgen.prediction.identifiability.verdict import Required

SEARCHED = 40  # tones among which the best are sought, all combinations tried
PER_DECADE = 20  # of the grid for better tones
BELOW, ABOVE = 100.0, 10.0  # how far the grid reaches from the corner, as factors


def best(setup: Setup, found: Slopes, required: Required) -> list[dict[str, Any]]:
    """The best one, two and three of the given tones, all combinations tried.

    Parameters
    ----------
    setup : Setup
        The press and the tones. Of more than ``SEARCHED`` tones, as many are taken evenly from the list.
    found : Slopes
        At the tones, and the press.
    required : Required
        What has to be known how well; the best has the smallest shortfall.
    """
    count = len(setup.frequency_hz)
    taken = np.unique(np.linspace(0, count - 1, min(count, SEARCHED)).astype(int))
    tones = np.asarray(setup.frequency_hz)[taken]
    among = Slopes(*(slope[taken] for slope in found))
    return [_best(tones, among, size, setup.noise, required) for size in range(1, min(3, len(taken)) + 1)]


def advised(setup: Setup, required: Required) -> dict[str, Any]:
    """The best single tone and the best pair on a grid about the corner, up to the instrument's limit."""
    grid = _grid(setup)
    found = slopes(setup.sensor, grid, setup.force_n, setup.position_m)
    single, pair = (_best(grid, found, size, setup.noise, required) for size in (1, 2))
    return {"lowest_hz": float(grid[0]), "highest_hz": float(grid[-1]), "single": single, "pair": pair}


def spread(setup: Setup) -> tuple[float, ...]:
    """As many tones as there are, evenly on a logarithmic scale from a tenth of the corner to ten times it [Hz]."""
    corner = min(setup.sensor.corner_frequency_hz(), setup.highest_hz)
    if len(setup.frequency_hz) == 1:
        return (corner,)
    return tuple(np.geomspace(corner / 10, min(10 * corner, setup.highest_hz), len(setup.frequency_hz)).tolist())


def _grid(setup: Setup) -> Real:
    """Frequencies around the corner [Hz]."""
    resistive = setup.sensor.resistance_ohm() > 0
    corner = min(setup.sensor.corner_frequency_hz(), setup.highest_hz) if resistive else setup.highest_hz
    low, high = corner / BELOW, min(corner * ABOVE, setup.highest_hz)
    return np.geomspace(low, high, round(PER_DECADE * float(np.log10(high / low))) + 1)


def _best(tones: Real, found: Slopes, size: int, noise: float, required: Required) -> dict[str, Any]:
    """The combination of ``size`` tones with the smallest shortfall; none where all are undefined."""
    chosen = np.array(list(combinations(range(len(tones)), size)))
    limits = bounds(Slopes(*(slope[chosen] for slope in found)), noise)
    short = required.shortfall(limits)
    k = int(np.argmin(short))
    if np.isinf(short[k]):
        return {"frequency_hz": None, "sigma_force_n": None, "sigma_position_m": None}
    return {
        "frequency_hz": tones[chosen[k]].tolist(),
        "sigma_force_n": float(limits.force_n[k]),
        "sigma_position_m": float(limits.position_m[k]),
    }
