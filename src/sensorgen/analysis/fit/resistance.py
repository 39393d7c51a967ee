"""Resistivity and leak from a multimeter's readings."""

from collections.abc import Sequence
from math import exp, isfinite

import numpy as np

from sensorgen.analysis.comparison.allowed import Allowed
from sensorgen.analysis.fit.results import LEVEL, Fitted, Untold
from sensorgen.design.materials import FILM_LEAK
from sensorgen.measure.recording.samples import Real

RESISTIVITY = "resistivity_ohm_m"
LEAST = 3  # readings that a scatter can be told from
_DRAWS = 2000
_PROPERTY = 10.0  # leaks that scatter by more than this factor about their median are no property of a material


def resistivity(readings: Sequence[Allowed], material: str, seed: int) -> Fitted | Untold:
    """One resistivity for both electrodes: the median of the middles; its interval holds the medians of both ends."""
    if len(readings) < LEAST:
        return Untold(f"{RESISTIVITY} along", f"{len(readings)} readings of sound electrodes; expected {LEAST} or more")
    ends = np.array([(r.low, r.high) for r in readings])
    draws = _medians(ends, seed)
    outer = 100 * np.array([(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    low, high = np.percentile(draws[:, 0], outer[0]), np.percentile(draws[:, 1], outer[1])
    middle = float(np.median(ends.mean(axis=1)))
    scatter = np.exp(np.percentile(_medians(ends.mean(axis=1)[:, None], seed)[:, 0], outer) - middle)
    return Fitted(
        material, RESISTIVITY, exp(middle), exp(low), exp(high),
        f"R_Y of {len(readings)} specimens, along the electrode; scatter alone x {scatter[0]:.3g} to {scatter[1]:.3g}, "
        "the rest of the interval: which electrode was measured, how it is printed, and how much of R_Y the film took",
    )  # fmt: skip


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


def leak(readings: Sequence[Allowed], material: str, seed: int) -> Fitted | Untold:
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
