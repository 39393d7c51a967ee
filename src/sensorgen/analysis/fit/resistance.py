"""Resistivity and leak from a multimeter's readings."""

from collections.abc import Iterator, Mapping, Sequence
from math import exp, isfinite, log, sqrt

import numpy as np

from sensorgen.analysis.comparison.allowed import AllowedValues
from sensorgen.analysis.fit.results import LEVEL, Fitted, GroupError, Untold
from sensorgen.design.materials import FILM_LEAK
from sensorgen.measure.recording.samples import Real

RESISTIVITY = "resistivity_ohm_m"
LEAST = 3  # readings that a scatter can be told from
_DRAWS = 2000
_PROPERTY = 10.0  # leaks that scatter by more than this factor about their median are no property of a material


def resistivity(readings: Sequence[AllowedValues], material: str) -> Fitted | Untold:
    """One resistivity for both electrodes: the median of prints, and the interval that holds 95 % of other prints.

    The interval is Student's for one more print, by the scatter of ln of the resistivity; it holds at least the medians
    of what single readings leave open.
    """
    from scipy.special import stdtrit

    count = len(readings)
    if count < LEAST:
        return Untold(f"{RESISTIVITY} along", f"{count} readings of sound electrodes; expected {LEAST} or more")
    low, high = np.array([(r.low, r.high) for r in readings]).T
    at = (low + high) / 2
    middle, scatter = float(np.median(at)), float(np.std(at, ddof=1))
    reach = float(stdtrit(count - 1, (1 + LEVEL) / 2)) * scatter * sqrt(1 + 1 / count)
    return Fitted(
        material, RESISTIVITY, exp(middle), exp(min(middle - reach, np.median(low))),
        exp(max(middle + reach, np.median(high))),
        f"R_Y and R_Z of {count} specimens, along the electrode: the median; the interval holds 95 % of prints, which "
        f"scatter by a factor of {exp(scatter):.3g} (one standard deviation)",
    )  # fmt: skip


def by_group(groups: Mapping[str, Sequence[tuple[AllowedValues, bool]]], material: str) -> Iterator[GroupError]:
    """Readings of each group beside the resistivity of all other groups.

    Parameters
    ----------
    groups : mapping of str to sequence of (AllowedValues, bool)
        Readings of a group, and whether the electrode is sound: others are predicted, but not fitted to.
    material : str
        Of the electrodes.
    """
    for name, group in groups.items():
        rest = [reading for other, of in groups.items() if other != name for reading, sound in of if sound]
        if isinstance(fitted := resistivity(rest, material), Fitted):
            low, high = log(fitted.low), log(fitted.high)
            inside = sum(reading.low <= high and reading.high >= low for reading, _ in group)
            ratio = exp(float(np.median([(reading.low + reading.high) / 2 for reading, _ in group]))) / fitted.value
            yield GroupError(name, len(group), inside, ratio, fitted.value, fitted.low, fitted.high)


def _medians(values: Real, seed: int) -> Real:
    """Medians of n specimens drawn from n again and again (bootstrap), column by column.

    Which of the sorted specimens is the median of a draw is drawn itself: the k-th of n even random numbers follows
    a beta distribution, and the one after it is the least of the n - k that are larger.
    """
    count, rng = len(values), np.random.default_rng(seed)
    lower = rng.beta((count + 1) // 2, count - (count + 1) // 2 + 1, _DRAWS)
    upper = lower if count % 2 else lower + (1 - lower) * rng.beta(1, count // 2, _DRAWS)
    ranks = [np.minimum((u * count).astype(np.intp), count - 1) for u in (lower, upper)]
    ordered = np.sort(values, axis=0)
    return np.asarray((ordered[ranks[0]] + ordered[ranks[1]]) / 2)


def leak(readings: Sequence[AllowedValues], material: str, seed: int) -> Fitted | Untold:
    """Leak per area, where it scatters little enough to be anything of the material's."""
    known = np.array([r.leak for r in readings if isfinite(r.leak)])
    if len(known) < LEAST:
        return Untold("leak", f"{len(known)} readings of films that leak; expected {LEAST} or more")
    middle, spread = float(np.median(known)), float(np.exp(np.median(np.abs(known - np.median(known)))))
    if spread > _PROPERTY:
        least, most = np.exp(known.min()), np.exp(known.max())
        return Untold(
            "leak",
            f"{len(known)} specimens leak, if evenly, by {least:.2g} to {most:.2g} S/m2, median {np.exp(middle):.2g}; "
            f"half of them by more than {spread:.3g} times more or less: single bridges, and no property of {material}",
        )
    outer = np.percentile(_medians(known[:, None], seed)[:, 0], 100 * np.array([(1 - LEVEL) / 2, (1 + LEVEL) / 2]))
    return Fitted(
        material, FILM_LEAK, exp(middle), exp(outer[0]), exp(outer[1]),
        f"R_Z of {len(known)} specimens, taken to leak evenly",
    )  # fmt: skip
