r"""Diagnosis of a specimen by its resistances: open electrode, short, leak, dry joint or intact; yield of groups.

Two electrodes, R and R', with a film that leaks evenly, G in all, are a ladder of resistors. Along the electrode R,
the other one floating, and between both at their contacts, with :math:`q = \sqrt{(R + R') G}`:

.. math:: R_Y = \frac{R}{R + R'} \left(R' + R\,\frac{\tanh(q/2)}{q/2}\right), \qquad
          R_Z = \frac{R + R'}{q \tanh q}

They follow from :math:`u'' = (R + R') G\,u / L^2` for the voltage u across the film, and from the current of R' being
0 at both ends. A film that leaks carries a part of the current over to the other electrode and back: R_Y falls from R
to both in parallel. A small leak reads :math:`1/G`.

Between the electrodes an intact film insulates. A short without resistance of its own, at a distance x from the
contacts, reads :math:`2 R_Y x / L`: a reading below :math:`2 R_Y` may be a short, a reading above it is none.

Intervals of a yield are those of Clopper and Pearson: they hold at least the stated confidence for every true yield,
also with few specimens and yields near 0 or 1. Wilson's are narrower because they hold it only on average. Specimens of
one plate have its faults in common: with plates known, the interval is that of as many independent specimens as have
the same standard error (Korn and Graubard 1998).
"""

from array import array
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, product
from math import comb, inf, isnan, nan, pi, prod, sqrt, tanh
from statistics import median
from typing import Any, NamedTuple

from sensorgen.core.errors import OutOfRange

_SMALL, _LARGE = 1e-12, 1e12  # of q: below, the film is tight; above, it is a short all along
_STEPS, _ROUNDING = 50, 1e-15


def along_ohm(electrode_ohm: float, leak_s: float, other: float = 1.0) -> float:
    """R_Y [ohm].

    Parameters
    ----------
    electrode_ohm : float
        R of one electrode, end to end [ohm].
    leak_s : float
        G of the whole film, infinite for a short all along [S].
    other : float
        Resistance of the other electrode over this one's [-].

    Examples
    --------
    >>> along_ohm(600.0, 0.0), along_ohm(600.0, inf), along_ohm(600.0, inf, other=2.0)
    (600.0, 300.0, 400.0)
    """
    return electrode_ohm * _along(sqrt((1 + other) * electrode_ohm * leak_s), other)


def _along(q: float, other: float) -> float:
    return 1.0 if q < _SMALL else (other + tanh(q / 2) / (q / 2)) / (1 + other)


def across_ohm(electrode_ohm: float, leak_s: float) -> float:
    """R_Z, infinite for a tight film [ohm]; parameters as of :func:`along_ohm`.

    Examples
    --------
    >>> round(across_ohm(600.0, 1e-6))  # the leak, and two thirds of an electrode
    1000400
    """
    if leak_s == 0:
        return inf
    q = sqrt(2 * electrode_ohm * leak_s)
    return 1 / leak_s if q < _SMALL else 2 * electrode_ohm / (q * tanh(q))


def leak_s(rz_ohm: float, electrode_ohm: float) -> float:
    """Leakage of the whole film by a reading between electrodes of known resistance [S].

    Parameters
    ----------
    rz_ohm : float
        Resistance between the electrodes, inf for an overload [ohm].
    electrode_ohm : float
        R of one electrode, end to end [ohm].

    Raises
    ------
    OutOfRange
        Readings below 0.

    Examples
    --------
    >>> round(1 / leak_s(1e6, 600.0))  # far above the electrodes: the leakage alone, less two thirds of one
    999600
    """
    if rz_ohm < 0 or electrode_ohm < 0:
        raise OutOfRange(f"readings of {electrode_ohm:g} and {rz_ohm:g} ohm; expected numbers from 0 on")
    line = 2 * electrode_ohm
    if rz_ohm in (0, inf) or line == 0 or rz_ohm / line > 1e7:
        return inf if rz_ohm == 0 else (1 + line / rz_ohm / 3) / rz_ohm  # to 4/45 (line/rz)^2
    wanted = line / rz_ohm
    q = sqrt(wanted) if wanted < 1 else wanted  # of q tanh q = wanted, by Newton's method
    for _ in range(_STEPS):
        t = tanh(q)
        step = (q * t - wanted) / (t + q * (1 - t * t))
        q -= step
        if abs(step) <= _ROUNDING * q:
            break
    return q**2 / line


def electrode_and_leak(along: float, across: float, other: float = 1.0) -> tuple[float, float]:
    """The R [ohm] and G [S] that read as R_Y and R_Z.

    Parameters
    ----------
    along, across : float
        R_Y, above 0, and R_Z, 0 for a short all along, infinite for a tight film [ohm].
    other : float
        Resistance of the other electrode over that of R_Y's [-].

    Raises
    ------
    OutOfRange
        R_Y is not above 0, or R_Z is below 0.

    Examples
    --------
    >>> r, g = electrode_and_leak(along_ohm(700.0, 1e-3), across_ohm(700.0, 1e-3))
    >>> round(r, 6), round(g, 9)
    (700.0, 0.001)
    """
    if not (0 < along < inf and across >= 0):
        raise OutOfRange(f"readings of {along:g} and {across:g} ohm; expected R_Y above 0, and R_Z from 0 on")
    if across in (0, inf):
        return (along, 0.0) if across else (along / _along(inf, other), inf)
    q = _root(lambda q: (1 + other) / (q * tanh(q)) / _along(q, other), across / along)
    electrode = along / _along(q, other)
    return electrode, q**2 / ((1 + other) * electrode)


def _root(falling: Callable[[float], float], value: float) -> float:
    """Where a function of q falls to a value, by halving in the logarithm."""
    low, high = _SMALL, _LARGE
    while high / low > 1 + 1e-15 and low < (middle := sqrt(low * high)) < high:
        low, high = (middle, high) if falling(middle) > value else (low, middle)
    return low


WORDS = ("open electrode", "short", "leak", "dry joint", "intact", "unknown")
"""Verdicts, the gravest first; unknown where a reading is missing."""

_GRAVE = (*WORDS[:4], "unknown", "intact", "sound")
INTACT_OHM = 1e8  # highest range of a bench multimeter
REACTANCES = 10.0  # of a film: a leak of so many in parallel changes its impedance by 1/2/10**2, 0.5 %
ORDER = 10.0  # largest factor of one order of magnitude
_DRY, _OPEN, _LOW = 3.0, 100.0, 0.1  # of the expected resistance
_APART = 2.0  # factor between readings of one electrode beyond which the contact is bad


class Evidence(NamedTuple):
    """Readings of one specimen.

    Attributes
    ----------
    name : str
        Name of the specimen.
    ry_ohm, rz_ohm : tuple of float
        Readings along an electrode and between the electrodes; inf for an overload, empty if not measured [ohm].
    expected_ohm : float
        Expected resistance of an electrode [ohm]; nan if unknown.
    touching : bool
        Whether the electrodes touch as printed of this design: such a short is no fault of the print.
    plate : str
        On which it was printed; "" if unknown.
    """

    name: str
    ry_ohm: tuple[float, ...] = ()
    rz_ohm: tuple[float, ...] = ()
    expected_ohm: float = nan
    touching: bool = False
    plate: str = ""


class SignalVerdict(NamedTuple):
    """A verdict with its numbers.

    Attributes
    ----------
    word : str
        One of ``WORDS``.
    electrode : str
        "sound", "dry joint", "open electrode" or "unknown".
    film : str
        "intact", "leak", "short" or "unknown".
    ry_ohm, rz_ohm : float
        Least reading of each, nan if not measured: a contact only adds resistance, and the film is as good as its worst
        place.
    ratio : float
        R_Z over R_Y [-].
    leak_s : float
        Leakage of the whole film with that reading [S]; inf for a reading of 0.
    reasons : tuple of str
        Reasons with numbers.
    intact_ohm : float
        Least resistance of an intact film [ohm].
    """

    word: str
    electrode: str
    film: str
    ry_ohm: float
    rz_ohm: float
    ratio: float
    leak_s: float
    reasons: tuple[str, ...]
    intact_ohm: float = INTACT_OHM

    @property
    def same_order(self) -> bool | None:
        """True if R_Z is below ten times R_Y; None where one is missing."""
        return None if isnan(self.ratio) else self.ratio <= ORDER


def intact_ohm(capacitance_f: float, lowest_hz: float, meter_ohm: float = INTACT_OHM) -> float:
    r"""Least resistance of an intact film [ohm]: :math:`10 / (\omega C)`, or what the meter can show.

    A leak of resistance R in parallel with C raises the admittance's magnitude by :math:`1/(2 (\omega C R)^2)`.

    Parameters
    ----------
    capacitance_f : float
        Of the film [F]; 0 if unknown.
    lowest_hz : float
        Lowest frequency of the readout [Hz].
    meter_ohm : float
        Highest range of the meter [ohm].

    Examples
    --------
    >>> round(intact_ohm(60e-12, 1e3) / 1e6, 1), intact_ohm(0.0, 1e3)
    (26.5, 100000000.0)
    """
    return min(meter_ohm, REACTANCES / (2 * pi * lowest_hz * capacitance_f)) if capacitance_f else meter_ohm


def verdict(of: Evidence, intact_ohm: float = INTACT_OHM) -> SignalVerdict:
    """Verdict on a specimen.

    Parameters
    ----------
    of : Evidence
        Readings.
    intact_ohm : float
        Least resistance of an intact film; the meter's highest range if not given [ohm].

    Raises
    ------
    OutOfRange
        A reading that is no number, or an expected resistance that is not above 0.

    Notes
    -----
    A reading below 0 counts as 0: it comes from subtracting the meter's offset and leads.
    """
    if of.expected_ohm <= 0:
        raise OutOfRange(f"{of.name}: {of.expected_ohm:g} ohm expected of an electrode; expected a number above 0")
    if any(map(isnan, (*of.ry_ohm, *of.rz_ohm))):
        raise OutOfRange(f"{of.name}: readings {of.ry_ohm} and {of.rz_ohm} ohm; expected numbers, or none")
    ry, rz = max(min(of.ry_ohm, default=nan), 0.0), max(min(of.rz_ohm, default=nan), 0.0)  # nan stays, being first
    electrode, why_electrode = _electrode(of, ry)
    film, why_film = _film(ry, rz, of.expected_ohm, intact_ohm)
    known = not isnan(rz) and 0 <= ry < inf
    leak, ratio = leak_s(rz, ry) if known else nan, rz / ry if known and ry else nan
    word = min(electrode, film, key=_GRAVE.index)
    return SignalVerdict(word, electrode, film, ry, rz, ratio, leak, (why_electrode, why_film), intact_ohm)


def _electrode(of: Evidence, ry: float) -> tuple[str, str]:
    if isnan(ry):
        return "unknown", "no reading along the electrode"
    if ry == inf:
        return "open electrode", "the meter shows overload along the electrode"
    over, spread = ry / of.expected_ohm, max(of.ry_ohm) / ry if ry else 1.0
    compared = f"R_Y {ry:.4g} ohm is {over:.3g} times the expected {of.expected_ohm:.4g} ohm"
    if over >= _OPEN:
        return "open electrode", f"{compared}: {_OPEN:g} times and more is an interrupted track"
    if over > _DRY:
        return "dry joint", f"{compared}: more than {_DRY:g} times"
    if spread > _APART:
        return "dry joint", f"readings of R_Y differ by a factor of {spread:.3g}: more than {_APART:g}"
    if over < _LOW:
        return "unknown", f"{compared}: too little for such an electrode; is a k lost?"
    return "sound", f"R_Y {ry:.4g} ohm, expected value unknown" if isnan(over) else compared


def _film(ry: float, rz: float, expected_ohm: float, intact_ohm: float) -> tuple[str, str]:
    if isnan(rz):
        return "unknown", "no reading between the electrodes"
    if rz >= intact_ohm:
        return "intact", f"R_Z {rz:.4g} ohm is at or above the {intact_ohm:.4g} ohm of an intact film"
    line = ry if 0 <= ry < inf else expected_ohm if 0 <= expected_ohm < inf else 0.0  # no open electrode's
    if rz <= 2 * line:
        return "short", f"R_Z {rz:.4g} ohm is within the {2 * line:.4g} ohm of two electrodes"
    return (
        "leak",
        f"R_Z {rz:.4g} ohm is below the {intact_ohm:.4g} ohm of an intact film: {leak_s(rz, line):.3g} S",
    )


def expected_from(readings: Sequence[float]) -> float:
    """Expected resistance of an electrode: median of specimens with the same electrodes; nan of none, or if it is 0.

    Parameters
    ----------
    readings : sequence of float
        The least of each along its electrode, where that is finite [ohm].
    """
    return median(readings) or nan if readings else nan


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


Judged = tuple[tuple[Hashable, ...], Evidence, SignalVerdict]


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


def groups(judged: Iterable[Judged], order: float = ORDER) -> list[Group]:
    """Yield of every group, by key.

    Parameters
    ----------
    judged : iterable of (tuple, Evidence, SignalVerdict)
        Specimens, each with its key, as ("tri", 0.1).
    order : float
        R_Z over R_Y up to which a specimen counts as shorted [-].
    """
    members: dict[tuple[Hashable, ...], tuple[_Counts, array[float]]] = {}
    for key, of, v in judged:
        counts, ratios = members.setdefault(key, (Counter(), array("d")))
        counts[of.plate, v.word, of.touching, None if isnan(v.ratio) else v.ratio <= order] += 1
        if not isnan(v.ratio):
            ratios.append(v.ratio)
    keys = sorted(members, key=lambda key: [(k is None, str(k)) for k in key])
    return [_group(key, *members[key]) for key in keys]


_Plates = Counter[tuple[str, bool]]
_Counts = Counter[tuple[str, str, bool, bool | None]]  # specimens by plate, verdict, touching, and a ratio of one order


def _group(key: tuple[Hashable, ...], counts: _Counts, ratios: "array[float]") -> Group:
    words, known, both = Counter[str](), _Plates(), _Plates()
    for (plate, word, touching, low), count in counts.items():
        words[word] += count
        if not touching and word != "unknown":
            known[plate, word == "intact"] += count
        if not touching and low is not None:
            both[plate, low] += count
    return Group(key, _shared(known), _shared(both), median(ratios) if ratios else nan, words)


def _shared(such: _Plates) -> CountShare:
    """A share by plates; a specimen whose plate is not known is a plate of its own."""
    count = sum(n for (_, yes), n in such.items() if yes)
    named = {plate for plate, _ in such if plate}
    plates = [(such[plate, True], such[plate, True] + such[plate, False]) for plate in sorted(named)]
    plates += [(1, 1)] * such["", True] + [(0, 1)] * such["", False]
    return share(count, such.total(), plates=plates)


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
