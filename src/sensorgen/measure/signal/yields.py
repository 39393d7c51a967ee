r"""Yield of groups of specimens with confidence intervals, and exact tests of independence.

Intervals are those of Clopper and Pearson: they hold at least the stated confidence for every true yield, also with few
specimens and yields near 0 or 1. Wilson's are narrower because they hold it only on average. Specimens of one plate
have its faults in common: with plates known, the interval is that of as many independent specimens as have the same
standard error (Korn and Graubard 1998).
"""

from array import array
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, product
from math import comb, isnan, nan, prod
from statistics import median
from typing import Any

from sensorgen.core.errors import OutOfRange
from sensorgen.measure.signal.verdicts import ORDER, Evidence, SignalVerdict

CONFIDENCE = 0.95
_MOST_TABLES, _MOST = 20_000, 1000  # tables, and specimens in them, that are enumerated
_DRAWS, _SEED, _ALIKE = 100_000, 23, 1e-6  # random tables beyond that; difference in ln of equal probabilities
_SAME = 1 + 1e-9  # ratio of equal probabilities after rounding


@dataclass(frozen=True)
class CountShare:
    """Share of a count in a total, with its confidence interval."""

    count: int
    total: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """Count over total [-]; nan of nothing."""
        return self.count / self.total if self.total else nan


@dataclass(frozen=True)
class Group:
    """A group of specimens.

    Attributes
    ----------
    key : tuple
        Common property.
    intact : CountShare
        The yield: intact specimens among those with a verdict, without shorts by design.
    shorted : CountShare
        Specimens whose R_Z is below ten times R_Y among those with both readings, without shorts by design.
    median_ratio : float
        Median of R_Z over R_Y [-]; nan without any.
    words : mapping of str to int
        Number of specimens by verdict.
    """

    key: tuple[Hashable, ...]
    intact: CountShare
    shorted: CountShare
    median_ratio: float
    words: Mapping[str, int]


Judged = tuple[Evidence, SignalVerdict]


def share(count: int, total: int, confidence: float = CONFIDENCE, plates: Sequence[tuple[int, int]] = ()) -> CountShare:
    """Share with its exact confidence interval (Clopper and Pearson 1934).

    Parameters
    ----------
    count, total : int
        Count and total.
    confidence : float
        Least coverage of the interval [-].
    plates : sequence of (int, int)
        Count and total of each plate; all specimens are independent if not given.

    Raises
    ------
    OutOfRange
        A count that is not between 0 and the total, a confidence that is not between 0 and 1.

    Examples
    --------
    >>> none = share(0, 10)
    >>> round(none.low, 4), round(none.high, 4)
    (0.0, 0.3085)
    """
    from scipy.special import betaincinv

    if not 0 <= count <= total or not 0 < confidence < 1:
        raise OutOfRange(f"{count} of {total} at a confidence of {confidence:g}; expected a count up to the total")
    tail = (1 - confidence) / 2
    part = _independent(count, total, confidence, plates) / total if total else 1.0
    yes, no = count * part, (total - count) * part
    low = float(betaincinv(yes, no + 1, tail)) if count else 0.0
    high = float(betaincinv(yes + 1, no, 1 - tail)) if count < total else 1.0
    return CountShare(count, total, low, high)


def _independent(count: int, total: int, confidence: float, plates: Sequence[tuple[int, int]]) -> float:
    """Number of independent specimens of the same standard error; all of them where no plate can tell."""
    from scipy.special import stdtrit

    m = len(plates)
    if m < 2 or m == total or count in (0, total):
        return float(total)
    share_ = count / total
    variance = m / (m - 1) * sum((k - share_ * n) ** 2 for k, n in plates) / total**2
    tail = (1 + confidence) / 2
    wider = float(stdtrit(m - 1, tail) / stdtrit(total - 1, tail)) ** 2
    return min(float(total), share_ * (1 - share_) / variance / wider) if variance else float(total)


def groups(
    judged: Iterable[Judged],
    by: Callable[[Evidence], tuple[Hashable, ...]],
    confidence: float = CONFIDENCE,
    order: float = ORDER,
) -> list[Group]:
    """Yield of every group, by key.

    Parameters
    ----------
    judged : iterable of (Evidence, SignalVerdict)
        Specimens.
    by : function
        Key of a specimen, as ``lambda of: (of.shape, of.film_mm)``.
    confidence : float
        Confidence of the intervals [-].
    order : float
        R_Z over R_Y up to which a specimen counts as shorted [-].
    """
    members: dict[tuple[Hashable, ...], tuple[_Counts, array[float]]] = {}
    for of, v in judged:
        counts, ratios = members.setdefault(by(of), (Counter(), array("d")))
        counts[of.plate, v.word, of.touching, None if isnan(v.ratio) else v.ratio <= order] += 1
        if not isnan(v.ratio):
            ratios.append(v.ratio)
    keys = sorted(members, key=lambda key: [(k is None, str(k)) for k in key])
    return [_group(key, *members[key], confidence) for key in keys]


_Plates = Counter[tuple[str, bool]]
_Counts = Counter[tuple[str, str, bool, bool | None]]  # specimens by plate, verdict, touching, and a ratio of one order


def _group(key: tuple[Hashable, ...], counts: _Counts, ratios: "array[float]", confidence: float) -> Group:
    words, known, both = Counter[str](), _Plates(), _Plates()
    for (plate, word, touching, low), count in counts.items():
        words[word] += count
        if not touching and word != "unknown":
            known[plate, word == "intact"] += count
        if not touching and low is not None:
            both[plate, low] += count
    intact, shorted = (_shared(such, confidence) for such in (known, both))
    return Group(key, intact, shorted, median(ratios) if ratios else nan, words)


def _shared(such: _Plates, confidence: float) -> CountShare:
    """A share by plates; a specimen whose plate is not known is a plate of its own."""
    count = sum(n for (_, yes), n in such.items() if yes)
    named = {plate for plate, _ in such if plate}
    plates = [(such[plate, True], such[plate, True] + such[plate, False]) for plate in sorted(named)]
    plates += [(1, 1)] * such["", True] + [(0, 1)] * such["", False]
    return share(count, such.total(), confidence, plates)


def dependence(of: Sequence[Group]) -> float:
    """p-value of the differences in shorted specimens between groups, by :func:`independence`.

    Parameters
    ----------
    of : sequence of Group
        As :func:`groups` returns them; groups without both readings are ignored.
    """
    shorted = [group.shorted for group in of if group.shorted.total]
    return independence([(s.count, s.total - s.count) for s in shorted])


def independence(table: Sequence[tuple[int, int]]) -> float:
    """p-value of independence of a 2 x n table (Fisher, Freeman, Halton).

    Exact by enumeration of all tables with the same sums, up to a limit; beyond it from 100 000 random tables with a
    fixed seed.

    Parameters
    ----------
    table : sequence of (int, int)
        Both counts of every group.

    Raises
    ------
    OutOfRange
        Counts below 0.

    Examples
    --------
    Fisher's tea tasting, all eight cups right:

    >>> round(independence([(4, 0), (0, 4)]), 4)
    0.0286
    """
    if min(chain([0], *table)) < 0:
        raise OutOfRange("expected counts from 0 on")
    sizes, seen = list(map(sum, table)), [a for a, _ in table]
    if sum(sizes) > _MOST or prod(sorted(n + 1 for n in sizes)[:-1]) > _MOST_TABLES:
        return _drawn(sizes, seen)
    ways = prod(comb(n, k) for k, n in zip(seen, sizes, strict=True))
    likely = sum(n for n in _every(sizes, sum(seen)) if n <= ways * _SAME)
    return likely / comb(sum(sizes), sum(seen))


def _drawn(sizes: Sequence[int], seen: Sequence[int]) -> float:
    """p-value from random tables; the observed table is one of them, so that it is never 0."""
    import numpy as np
    from scipy.special import gammaln

    size = np.array(sizes)

    def ln_ways(did: Any) -> Any:
        return (gammaln(size + 1) - gammaln(did + 1) - gammaln(size - did + 1)).sum(axis=-1)

    tables = np.random.default_rng(_SEED).multivariate_hypergeometric(size, sum(seen), _DRAWS)
    unlikely = int((ln_ways(tables) <= ln_ways(np.array(seen)) + _ALIKE).sum())
    return (1 + unlikely) / (1 + _DRAWS)


def _every(sizes: Sequence[int], did: int) -> Iterator[int]:
    """Number of arrangements of each table with the same sums."""
    *others, largest = sorted(sizes) or [0]
    for counts in product(*(range(n + 1) for n in others)):
        if 0 <= (left := did - sum(counts)) <= largest:
            yield prod(map(comb, others, counts)) * comb(largest, left)
