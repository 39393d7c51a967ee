"""Choice of frequencies: the best of the given ones, and the best of all that an instrument can give."""

from itertools import combinations

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.prediction.identifiability.fisher import Setup, Slopes, bounds, slopes
from sensorgen.prediction.identifiability.results import AdvisedFrequencies, FrequencyChoice
from sensorgen.prediction.identifiability.verdict import Required

SEARCHED = 40  # frequencies whose combinations are all tried
PER_DECADE = 20  # of the grid of advised frequencies
BELOW, ABOVE = 100.0, 10.0  # how far the grid reaches from the corner, as factors


def best(setup: Setup, found: Slopes, required: Required) -> tuple[FrequencyChoice, ...]:
    """The best one, two and three of the given frequencies, all combinations tried.

    Parameters
    ----------
    setup : Setup
        The press and the frequencies. Of more than ``SEARCHED``, as many are taken evenly from the list.
    found : Slopes
        At the frequencies, and the press.
    required : Required
        Errors that serve; the best choice has the smallest shortfall.
    """
    count = len(setup.frequency_hz)
    taken = np.unique(np.linspace(0, count - 1, min(count, SEARCHED)).astype(int))
    frequency, among = np.asarray(setup.frequency_hz)[taken], Slopes(*(slope[taken] for slope in found))
    sizes = range(1, min(3, len(taken)) + 1)
    return tuple(_best(frequency, among, size, setup.noise, required) for size in sizes)


def advised(setup: Setup, required: Required) -> AdvisedFrequencies:
    """The best single frequency and the best pair on a grid about the corner, up to the instrument's limit."""
    corner = _corner_hz(setup)
    low, high = corner / BELOW, min(corner * ABOVE, setup.highest_hz)
    grid = np.geomspace(low, high, round(PER_DECADE * float(np.log10(high / low))) + 1)
    found = slopes(setup.sensor, grid, setup.force_n, setup.position_m)
    single, pair = (_best(grid, found, size, setup.noise, required) for size in (1, 2))
    return AdvisedFrequencies(float(grid[0]), float(grid[-1]), single, pair)


def spread(setup: Setup) -> tuple[float, ...]:
    """As many frequencies as there are, logarithmically spaced from a tenth of the corner to ten times it [Hz]."""
    corner, count = _corner_hz(setup), len(setup.frequency_hz)
    if count == 1:
        return (corner,)
    return tuple(np.geomspace(corner / 10, min(10 * corner, setup.highest_hz), count).tolist())


def _corner_hz(setup: Setup) -> float:
    return min(setup.sensor.corner_frequency_hz(), setup.highest_hz)


def _best(frequency: Real, found: Slopes, size: int, noise: float, required: Required) -> FrequencyChoice:
    """The combination of ``size`` frequencies with the smallest shortfall."""
    chosen = np.array(list(combinations(range(len(frequency)), size)))
    limits = bounds(Slopes(*(slope[chosen] for slope in found)), noise)
    short = required.shortfall(limits)
    k = int(np.argmin(short))
    if np.isinf(short[k]):
        return FrequencyChoice(sigma_force_n=None, sigma_position_m=None)
    return FrequencyChoice(
        frequency_hz=tuple(frequency[chosen[k]].tolist()),
        sigma_force_n=float(limits.force_n[k]),
        sigma_position_m=float(limits.position_m[k]),
    )
