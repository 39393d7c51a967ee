r"""Yield per group with its interval, and whether it depends on the group, exactly.

Intervals are Clopper's and Pearson's: with few specimens and yields near 0 or 1 they are the ones that hold at least
the stated confidence whatever the true yield is. Wilson's are narrower because they hold it on average only; who is
told a yield of "0 to 6 %" should not find 8.
"""

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import comb, isnan, nan, prod
from statistics import median
from typing import Any

from sensorgen.core.errors import OutOfRange
from sensorgen.measure.signal.verdicts import ORDER, Evidence, Verdict

CONFIDENCE = 0.95
_MOST_TABLES, _MOST = 20_000, 1000  # tables, and readings in them, that are all looked at
_DRAWS, _SEED, _ALIKE = 100_000, 23, 1e-6  # of tables, where there are more; ln of chances that are the same
_SAME = 1 + 1e-9  # tables as likely as the one seen count as such in spite of rounding


@dataclass(frozen=True)
class Share:
    """A count out of another, with the interval of the share behind it."""

    count: int
    total: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """The one over the other [-]; nan of nothing."""
        return self.count / self.total if self.total else nan


@dataclass(frozen=True)
class Group:
    """Specimens that have something in common.

    Attributes
    ----------
    key : tuple
        What they have in common.
    intact : Share
        The yield: those that are intact, of those that a verdict was possible on; shorts by design are none of either.
    shorted : Share
        Those whose R_Z is of the order of their R_Y or below, of those that have both readings; again without shorts by
        design.
    median_ratio : float
        Median of R_Z over R_Y [-]; nan where none has both.
    words : mapping of str to int
        How many have each verdict.
    """

    key: tuple[Hashable, ...]
    intact: Share
    shorted: Share
    median_ratio: float
    words: Mapping[str, int]


Judged = tuple[Evidence, Verdict]


def share(count: int, total: int, confidence: float = CONFIDENCE) -> Share:
    """A share with its exact interval (Clopper and Pearson 1934).

    Parameters
    ----------
    count, total : int
        How many, of how many.
    confidence : float
        Held at least [-].

    Raises
    ------
    OutOfRange
        A count that is not between 0 and the total, a confidence that is not between 0 and 1.

    Examples
    --------
    >>> found = share(0, 10)
    >>> round(found.low, 4), round(found.high, 4)
    (0.0, 0.3085)
    """
    from scipy.special import betaincinv

    if not 0 <= count <= total or not 0 < confidence < 1:
        raise OutOfRange(f"{count} of {total} at a confidence of {confidence:g}; expected a count up to the total")
    tail = (1 - confidence) / 2
    low = float(betaincinv(count, total - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, total - count, 1 - tail)) if count < total else 1.0
    return Share(count, total, low, high)


def groups(
    judged: Iterable[Judged],
    by: Callable[[Evidence], tuple[Hashable, ...]],
    confidence: float = CONFIDENCE,
    order: float = ORDER,
) -> list[Group]:
    """Yield of every group, in the order of their keys.

    Parameters
    ----------
    judged : iterable of (Evidence, Verdict)
        Specimens.
    by : function
        What they are grouped by, as ``lambda of: (of.shape, of.film_mm)``.
    confidence : float
        Of the intervals [-].
    order : float
        R_Z over R_Y up to which a specimen counts as shorted [-].
    """
    found: dict[tuple[Hashable, ...], list[Judged]] = {}
    for of, verdict in judged:
        found.setdefault(by(of), []).append((of, verdict))
    return [
        _group(key, found[key], confidence, order)
        for key in sorted(found, key=lambda key: [(k is None, str(k)) for k in key])
    ]


def _group(key: tuple[Hashable, ...], judged: Sequence[Judged], confidence: float, order: float) -> Group:
    open_ = [v for of, v in judged if not of.touching]
    known = [v for v in open_ if v.word != "unknown"]
    both = [v for v in open_ if not isnan(v.ratio)]
    ratios = [v.ratio for _, v in judged if not isnan(v.ratio)]
    return Group(
        key, share(sum(v.word == "intact" for v in known), len(known), confidence),
        share(sum(v.ratio <= order for v in both), len(both), confidence),
        median(ratios) if ratios else nan, Counter(v.word for _, v in judged),
    )  # fmt: skip


def dependence(found: Sequence[Group]) -> float:
    """How probable it is by chance alone that groups differ so much in how many are shorted, as :func:`independence`.

    Parameters
    ----------
    found : sequence of Group
        As :func:`groups` gives them; groups without both readings count for nothing.
    """
    shorted = [group.shorted for group in found if group.shorted.total]
    return independence([(s.count, s.total - s.count) for s in shorted])


def independence(table: Sequence[tuple[int, int]]) -> float:
    """Probability of a table at least as unlikely as this one, if the group does not matter (Fisher, Freeman, Halton).

    Exact where all tables with the same sums can be looked at; of more, 100 000 are drawn at random, always the same.

    Parameters
    ----------
    table : sequence of (int, int)
        For every group, how many did and how many did not.

    Raises
    ------
    OutOfRange
        Counts below 0.

    Examples
    --------
    Fisher's lady, who tasted all eight cups rightly:

    >>> round(independence([(4, 0), (0, 4)]), 4)
    0.0286
    """
    if any(n < 0 for row in table for n in row):
        raise OutOfRange("expected counts from 0 on")
    sizes, seen = [a + b for a, b in table], [a for a, _ in table]
    if sum(sizes) > _MOST or prod(sorted(n + 1 for n in sizes)[:-1]) > _MOST_TABLES:
        return _drawn(sizes, seen)
    ways = _ways(seen, sizes)
    likely = sum(n for n in _every(sizes, sum(seen)) if n <= ways * _SAME)
    return likely / comb(sum(sizes), sum(seen))


def _drawn(sizes: Sequence[int], seen: Sequence[int]) -> float:
    """The same from tables that are drawn; the one seen counts as one of them, so that it is never 0."""
    import numpy as np
    from scipy.special import gammaln

    size = np.array(sizes)

    def ln_ways(did: Any) -> Any:
        return (gammaln(size + 1) - gammaln(did + 1) - gammaln(size - did + 1)).sum(axis=-1)

    tables = np.random.default_rng(_SEED).multivariate_hypergeometric(size, sum(seen), _DRAWS)
    unlikely = int((ln_ways(tables) <= ln_ways(np.array(seen)) + _ALIKE).sum())
    return (1 + unlikely) / (1 + _DRAWS)


def _ways(did: Sequence[int], sizes: Sequence[int]) -> int:
    found = 1
    for k, n in zip(did, sizes, strict=True):
        found *= comb(n, k)
    return found


def _every(sizes: Sequence[int], did: int) -> Iterable[int]:
    """Ways in which each table with the same sums can come about."""
    if not sizes:
        return [1] if did == 0 else []
    rest = sizes[1:]
    room = sum(rest)
    return [
        comb(sizes[0], k) * ways
        for k in range(max(0, did - room), min(sizes[0], did) + 1)
        for ways in _every(rest, did - k)
    ]
