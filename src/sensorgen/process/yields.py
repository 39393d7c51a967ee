r"""Yield per group with its interval, and whether it depends on the group, exactly.

Intervals are Clopper's and Pearson's: with few specimens and yields near 0 or 1 they are the ones that hold at least
the stated confidence whatever the true yield is. Wilson's are narrower because they hold it on average only; who is
told a yield of "0 to 6 %" should not find 8.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import comb, isnan, nan, prod
from statistics import median

from sensorgen.errors import OutOfRange
from sensorgen.process.verdicts import ORDER, Evidence, Verdict

CONFIDENCE = 0.95
_MOST_TABLES = 1_000_000
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
        The yield: those that are intact, of those that a verdict was possible on.
    shorted : Share
        Those whose R_Z is of the order of their R_Y or below, of those that have both readings.
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
    found: dict[tuple[Hashable, ...], list[Verdict]] = {}
    for of, verdict in judged:
        found.setdefault(by(of), []).append(verdict)
    return [
        _group(key, found[key], confidence, order)
        for key in sorted(found, key=lambda key: [(k is None, str(k)) for k in key])
    ]


def _group(key: tuple[Hashable, ...], verdicts: Sequence[Verdict], confidence: float, order: float) -> Group:
    known = [v for v in verdicts if v.word != "unknown"]
    both = [v for v in verdicts if not isnan(v.ratio)]
    words: dict[str, int] = {}
    for v in verdicts:
        words[v.word] = words.get(v.word, 0) + 1
    return Group(
        key, share(sum(v.word == "intact" for v in known), len(known), confidence),
        share(sum(v.ratio <= order for v in both), len(both), confidence),
        median([v.ratio for v in both]) if both else nan, words,
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

    Parameters
    ----------
    table : sequence of (int, int)
        For every group, how many did and how many did not.

    Raises
    ------
    OutOfRange
        Counts below 0, or so many groups and counts that their tables cannot all be looked at.

    Examples
    --------
    Fisher's lady, who tasted all eight cups rightly:

    >>> round(independence([(4, 0), (0, 4)]), 4)
    0.0286
    """
    if any(n < 0 for row in table for n in row) or prod(sorted(a + b + 1 for a, b in table)[:-1]) > _MOST_TABLES:
        raise OutOfRange("expected counts from 0 on, in fewer or smaller groups")
    sizes, did = [a + b for a, b in table], sum(a for a, _ in table)
    ways = _ways([a for a, _ in table], sizes)
    likely = sum(n for n in _every(sizes, did) if n <= ways * _SAME)
    return likely / comb(sum(sizes), did)


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
