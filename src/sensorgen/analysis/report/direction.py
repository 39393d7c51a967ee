"""Electrode resistance by direction of the cogs: one shape and film, along the length or across it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import comb, nan
from statistics import geometric_mean, median
from typing import Annotated

from sensorgen.analysis.comparison import Compared, Comparison
from sensorgen.analysis.report.electrodes import usable
from sensorgen.analysis.report.yields import film_text
from sensorgen.core.document import Column, Table

_ORDERS = 20_000  # that are enumerated
LEVEL = 0.05  # p value below which a difference is affirmed, divided by the number of tests


@dataclass(frozen=True)
class DirectionRow:
    """Two directions of one shape and film."""

    shape: Annotated[str, Column("shape")]
    film: Annotated[str, Column("film")]
    first: Annotated[str, Column("first direction")]
    specimens: Annotated[int, Column("specimens")]
    first_ohm: Annotated[float, Column("median electrode resistance", "ohm")]
    second: Annotated[str, Column("second direction")]
    others: Annotated[int, Column("specimens of the second")]
    second_ohm: Annotated[float, Column("median of the second", "ohm")]
    ratio: Annotated[float, Column("second / first")]
    predicted: Annotated[float, Column("ratio predicted", "", "as printed, and as the films leak")]
    p: Annotated[float, Column("p", "", "Wilcoxon rank-sum test of the plates' medians")]


def rows(comparison: Comparison) -> list[DirectionRow]:
    """A row for each shape and film with both directions, two specimens of each at least."""
    last = {row.reading.specimen: row for row in usable(comparison)}
    groups: dict[tuple[str, float | None], dict[str, list[Compared]]] = {}
    for row in last.values():
        if axes := row.evidence.axes:
            groups.setdefault((row.evidence.shape, row.evidence.film_mm), {}).setdefault(axes, []).append(row)
    tests = []
    for (shape, film_mm), by in sorted(groups.items(), key=lambda item: (item[0][0], item[0][1] is None, item[0][1])):
        if len(by) == 2 and min(map(len, by.values())) > 1:
            (first, ones), (second, others) = sorted(by.items())
            one, other, p = median(_by_plate(ones)), median(_by_plate(others)), rank_p(*map(_by_plate, (ones, others)))
            tests.append(DirectionRow(
                shape, film_text(film_mm), first, len(ones), one, second, len(others), other, other / one,
                _predicted(others) / _predicted(ones), p,
            ))  # fmt: skip
    return tests


def _by_plate(of: Sequence[Compared]) -> list[float]:
    """Electrode resistances [ohm]: of the specimens of one plate, which are not independent, their median."""
    plates: dict[str, list[float]] = {}
    for row in of:
        plates.setdefault(row.evidence.plate or row.reading.specimen, []).append(row.verdict.ry_ohm)
    return [median(values) for values in plates.values()]


def _predicted(of: Sequence[Compared]) -> float:
    """Of the networks that were measured, as films leak [ohm]."""
    values = [bounds.value for row in of if (bounds := row.expected_ohm)]
    return geometric_mean(values) if values else nan


def table(comparison: Comparison) -> Table | None:
    """The rows as a table; None without any."""
    tests = rows(comparison)
    return Table.of("direction", "Electrode resistance by direction of the cogs", tests) if tests else None


def findings(comparison: Comparison) -> Iterator[str]:
    """Shapes and films of which the directions differ, each in a sentence; and how many do not."""
    tests = rows(comparison)
    level = LEVEL / max(len(tests), 1)
    differing = [row for row in tests if row.p < level]
    for row in differing:
        yield (
            f"Direction: {row.shape} {row.second} has {row.ratio:.2g} times the electrode resistance of {row.shape} "
            f"{row.first}, film {row.film} (medians of {row.others} and {row.specimens} sensors; p = {row.p:.2g}, "
            f"affirmed below {level:.2g}); predicted as printed {row.predicted:.2g}."
        )
    if len(tests) > len(differing):
        yield f"Direction: no significant difference in {len(tests) - len(differing)} of {len(tests)} shapes and films."


def rank_p(one: Sequence[float], other: Sequence[float]) -> float:
    """Two-sided p value of the rank-sum test: exact, with ties too; asymptotic beyond 20 000 orders.

    >>> round(rank_p([0.68, 0.6, 0.63, 0.67, 0.68], [0.36, 0.435, 0.5, 0.5, 0.45]), 6)  # 2 of 252
    0.007937
    """
    from scipy.stats import PermutationMethod, mannwhitneyu

    exact = comb(len(one) + len(other), len(one)) <= _ORDERS
    return float(mannwhitneyu(one, other, method=PermutationMethod(_ORDERS) if exact else "asymptotic").pvalue)
