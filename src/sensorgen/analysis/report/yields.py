"""Verdicts and yield by film and by shape, as the multimeter shows them; resistance by direction of the cogs."""

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from math import comb, inf, isfinite, nan
from statistics import geometric_mean, median
from typing import Annotated

from sensorgen.analysis.comparison import Compared, Comparison
from sensorgen.analysis.comparison.measured import Words
from sensorgen.analysis.plots.figure import BLUE, BROWN, GREY, MOST_POINTS, PURPLE, Axis, Curve, Figure, Panel
from sensorgen.analysis.report.alternating import BAKED
from sensorgen.analysis.report.electrodes import VERDICT_COLOURS, reasons, usable
from sensorgen.core.document import Cell, Column, Part, Table
from sensorgen.core.lazy import by_key
from sensorgen.measure.signal.verdicts import ORDER, REACTANCES, WORDS, CountShare, Group, dependence, groups
from sensorgen.prediction.query import TONES_HZ

_LOOKS = {  # none with the colour of a verdict
    "tri": {"colour": BLUE, "symbol": "circle"}, "rect": {"colour": PURPLE, "symbol": "square"},
    "reference": {"colour": BROWN, "symbol": "diamond"},
}  # fmt: skip
_OTHER = {"colour": BROWN, "symbol": "x"}


def film_text(film_mm: float | None) -> str:
    """Thickness of a film, as tables have it."""
    return "unknown" if film_mm is None else f"{film_mm:g} mm"


BY: dict[str, Callable[[Words], tuple[Hashable, ...]]] = {
    "shape": lambda of: (of.shape or "unknown",),
    "film": lambda of: (film_text(of.film_mm),),
    "shape and film": lambda of: (of.shape or "unknown", film_text(of.film_mm)),
    "direction": lambda of: (of.shape or "unknown", of.axes or "unknown"),
    "bake": lambda of: (BAKED[of.baked],),
    "plate": lambda of: (of.batch or "unknown",),
    "defect": lambda of: (of.defects or "none",),
    "remark": lambda of: (of.remark or "none",),
}
TESTED = ("film", "shape")  # groups that are tested for a difference
_OVERLOAD = "The median R_Z is an overload."
DIFFER = 0.05 / len(TESTED)  # p value below which one is affirmed: together wrong in 1 of 20 logs


@dataclass(frozen=True)
class YieldRow:
    """Specimens that have something in common."""

    by: Annotated[str, Column("grouped by")]
    group: Annotated[str, Column("group")]
    specimens: Annotated[int, Column("specimens")]
    open_electrode: Annotated[int, Column("open electrode")]
    short: Annotated[int, Column("short")]
    leak: Annotated[int, Column("leak")]
    dry_joint: Annotated[int, Column("dry joint")]
    intact: Annotated[int, Column("intact")]
    unknown: Annotated[int, Column("unknown")]
    yield_percent: Annotated[
        Cell, Column("yield", "%", "intact specimens of those with a verdict; without designs that are printed shorted")
    ]
    yield_from: Annotated[Cell, Column("yield from", "%", "95 % confidence")]
    yield_to: Annotated[Cell, Column("yield to", "%", "95 % confidence")]
    shorted: Annotated[int, Column("low film resistance", "", f"at most {ORDER:g} times the electrode's")]
    total: Annotated[int, Column("of", "", "specimens with both resistances; without designs that are printed shorted")]
    share_percent: Annotated[Cell, Column("share", "%")]
    share_from: Annotated[Cell, Column("share from", "%", "95 % confidence")]
    share_to: Annotated[Cell, Column("share to", "%", "95 % confidence")]
    median_ratio: Annotated[float, Column("median film / electrode", "", "ratio of the two resistances")]


def judged(comparison: Comparison, by: str) -> list[Group]:
    """Groups of one kind."""
    rows = comparison.by_bake if by == "bake" else comparison.last
    return groups((BY[by](row.reading.words), row.evidence, row.verdict) for row in rows)


def everything(comparison: Comparison) -> Group:
    """All specimens as one group."""
    return groups(((), row.evidence, row.verdict) for row in comparison.last)[0]


def headline(comparison: Comparison) -> Iterator[str]:
    """The yield, in one sentence."""
    if not comparison.last:
        return
    whole = everything(comparison).intact
    if len(comparison.last) == 1:
        row = comparison.last[0]
        limit = f" (film intact from {_intact(comparison)} on)" if row.verdict.film in ("intact", "leak") else ""
        yield f"Verdict of {row.reading.specimen}: {row.verdict.word}{limit}."
    elif whole.total:
        which = "None" if not whole.count else "All" if whole.count == whole.total else f"{whole.count}"
        verb = "is" if whole.count in (0, 1) and which != "All" else "are"
        yield (
            f"{which} of the {whole.total} testable sensors {verb} intact (film from {_intact(comparison)} on): yield "
            f"{_range(whole)}, 95 % confidence."
        )


def _intact(comparison: Comparison) -> str:
    """Least resistances of intact films, in words."""
    ends = [of(row.verdict.intact_ohm for row in comparison.last) / 1e6 for of in (min, max)]
    return " to ".join(dict.fromkeys(f"{value:.3g}" for value in ends)) + " Mohm"


def findings(comparison: Comparison) -> Iterator[str]:
    """Shorts and leaks of all sensors, and of groups."""
    both = comparison.last.where(lambda row: row.verdict.same_order is not None)
    if len(both) < 2:
        return
    such, whole = both.where(lambda row: bool(row.verdict.same_order)), everything(comparison)
    design = sum(row.evidence.touching for row in such)
    implausible = sum(row.verdict.electrode != "sound" for row in such)
    kinds = ((design, "by design"), (implausible, "with an implausible electrode"))
    of = ", ".join(f"{count} {words}" for count, words in kinds if count)
    ratio = f"Median ratio {whole.median_ratio:.3g}." if isfinite(whole.median_ratio) else _OVERLOAD
    yield (
        f"{len(such)} of {len(both)} sensors have a low film resistance{of and f' ({of})'}: at most {ORDER:g} times "
        f"the electrode's. {ratio}"
    )
    yield from _parted(comparison)
    if design and whole.shorted.total:
        yield (
            f"Without those shorted by design: {whole.shorted.count} of {whole.shorted.total}, {_range(whole.shorted)} "
            "of such prints, 95 % confidence."
        )
    yield from _differences(comparison)


def _differences(comparison: Comparison) -> Iterator[str]:
    """Shares of the groups of each kind, and whether they differ; nothing of a single group."""
    for by in TESTED:
        known = [g for g in judged(comparison, by) if g.shorted.total]
        if len(known) > 1:
            chance = dependence(known)
            counts = ", ".join(f"{_name(g)}: {g.shorted.count} of {g.shorted.total}" for g in known)
            differ = "a significant difference" if chance < DIFFER else "no significant difference"
            yield f"Low film resistance by {by}: {counts}; {differ} (p = {chance:.2g})."


def _parted(comparison: Comparison) -> Iterator[str]:
    """Specimens whose electrodes touch as drawn, judged by their gap as printed."""
    parted = comparison.last.where(lambda row: bool(row.predicted and row.predicted.parted))
    judged = [row for row in parted if row.verdict.same_order is not None]
    orders = [bool(row.verdict.same_order) for row in judged]
    if orders:
        gaps = {row.predicted.design: row.predicted.prediction.gap for row in judged if row.predicted}
        gap = "; ".join(f"{name} {bounds.words()}" for name, bounds in sorted(gaps.items()) if bounds)
        yield (
            f"Electrodes that touch as drawn, but have a gap as printed ({gap}): {sum(orders)} of {len(orders)} such "
            "sensors have a low film resistance."
        )


def _range(share: CountShare) -> str:
    high = f"{100 * share.high:.2g}" if share.count < share.total else "100"
    return f"{100 * share.low:.2g} to {high} %"


def _name(group: Group) -> str:
    return ", ".join(map(str, group.key))


def notes(comparison: Comparison, texts: Sequence[str]) -> Iterator[str]:
    """Notes on the rules of verdicts and, where there are several specimens, of counts."""
    count = len(comparison.direct) - len(comparison.last)
    earlier = f"; {count} earlier readings are not counted" if count else ""
    for text in texts[: 1 if len(comparison.last) == 1 else None]:
        yield text.format(
            reactances=REACTANCES, khz=TONES_HZ[0] / 1e3, change_percent=50 / REACTANCES**2, earlier=earlier,
            differ=DIFFER,
        )  # fmt: skip


def parts(comparison: Comparison, texts: Sequence[str]) -> tuple[Part, ...]:
    """Tables of verdicts, with notes; nothing without DC readings."""
    if not comparison.direct:
        return ()
    tables = [table(comparison)] if len(comparison.last) > 1 else []
    directions = Table.some("direction", "Electrode resistance by direction of the cogs", rows(comparison))
    return (*tables, *directions, reasons(comparison), *notes(comparison, texts))


def table(comparison: Comparison) -> Table:
    """Verdicts, yield and shorts of all specimens, and by each grouping that has more than one group."""
    rows = [_row("all", "all", everything(comparison))]
    for by in BY:
        known = judged(comparison, by)
        alone = by == "shape and film" and any(len(judged(comparison, part)) < 2 for part in TESTED)
        rows += [_row(by, _name(g), g) for g in known if len(known) > 1 and not alone]
    return Table.of("yield", "Verdicts and yield", tuple(rows))


def _row(by: str, name: str, g: Group) -> YieldRow:
    opened, short, leak, dry, intact, unknown = (g.words.get(word, 0) for word in WORDS)
    return YieldRow(
        by, name, sum(g.words.values()), opened, short, leak, dry, intact, unknown, *_percents(g.intact),
        g.shorted.count, g.shorted.total, *_percents(g.shorted), g.median_ratio,
    )  # fmt: skip


def _percents(of: CountShare) -> tuple[Cell, Cell, Cell]:
    return (100 * of.share, 100 * of.low, 100 * of.high) if of.total else (None, None, None)


def figures(comparison: Comparison) -> tuple[Figure, ...]:
    """Film resistance over the electrode's, and verdicts and shorts by shape and film; none of one specimen."""
    if len(comparison.last) < 2:
        return ()
    known = judged(comparison, "shape and film")
    return (*_ratios(comparison), _counts(known), *_shares(known))


def _by_shape(rows: Sequence[Compared]) -> Iterator[Curve]:
    """Resistances of the readings, each shape with its look."""
    for shape, here in sorted(by_key((row.reading.shape, row) for row in rows).items()):
        yield Curve(
            "points", shape, [r.verdict.ry_ohm for r in here], [r.verdict.rz_ohm for r in here],
            text=[f"{r.reading.specimen}: {r.verdict.word}" for r in here], **_LOOKS.get(shape, _OTHER),
        )  # fmt: skip


def _ratios(comparison: Comparison) -> Iterator[Figure]:
    known = comparison.rows.where(lambda r: isfinite(r.verdict.ratio) and r.verdict.rz_ohm > 0)
    if not known:
        return
    every, rows = len(known), list(known[:: -(-len(known) // MOST_POINTS)])
    ohms = [r.verdict.ry_ohm for r in rows]
    ends = [min(ohms) / 1.5, max(ohms) * 1.5]
    curves = [
        Curve("line", f"film = {factor:g} x electrode", ends, [factor * x for x in ends], colour=GREY, dash=dash)
        for factor, dash in ((2.0, "solid"), (ORDER, "dash"))
    ]
    curves += _by_shape(rows)
    zero, overload = (sum(r.verdict.rz_ohm == value for r in comparison.rows) for value in (0, inf))
    x, y = Axis("electrode resistance [ohm]", log=True), Axis("film resistance [ohm]", log=True)
    yield Figure(
        "shorts", "Film resistance over electrode resistance",
        f"Both logarithmic, for {len(rows)} of {every} readings. Below the solid line a bridge explains the reading; "
        f"below the dashed one the film's is low. Not on the axis: {zero} readings of 0 ohm, {overload} "
        "of overload.", {"": (Panel(tuple(curves), x, y),)},
    )  # fmt: skip


def _counts(known: Sequence[Group]) -> Figure:
    names = tuple(map(_name, known))
    curves = tuple(
        Curve("bars", word, [float(g.words.get(word, 0)) for g in known], names, colour=VERDICT_COLOURS[word])
        for word in WORDS if any(g.words.get(word) for g in known)
    )  # fmt: skip
    alt = "Number of specimens of each shape and film with each verdict."
    return Figure("verdict-counts", "Verdicts by shape and film", alt,
                  {"": (Panel(curves, Axis("specimens"), Axis(names=names)),)})  # fmt: skip


def _shares(known: Sequence[Group]) -> Iterator[Figure]:
    known = [g for g in known if g.shorted.total]
    if not known:
        return
    names, shares = tuple(map(_name, known)), [g.shorted for g in known]
    curve = Curve(
        "points", "share, 95 % confidence", [100 * s.share for s in shares], names, [100 * s.low for s in shares],
        [100 * s.high for s in shares], [f"{s.count} of {s.total}" for s in shares],
    )  # fmt: skip
    panel = Panel((curve,), Axis("share [%]", low=0.0, high=102.0), Axis(names=names))
    alt = f"Share of specimens whose film resistance is at most {ORDER:g} times the electrode's, with exact intervals."
    yield Figure("shorted", "Low film resistance, by shape and film", alt, {"": (panel,)})


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
    groups = by_key(((w.shape, w.film_mm), row) for row in last.values() if (w := row.reading.words).axes)
    tests = []
    for (shape, film_mm), of in sorted(groups.items(), key=lambda item: (item[0][0], item[0][1] is None, item[0][1])):
        by = by_key((row.reading.words.axes, row) for row in of)
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
    plates = by_key((row.evidence.plate or row.reading.specimen, row.verdict.ry_ohm) for row in of)
    return [median(values) for values in plates.values()]


def _predicted(of: Sequence[Compared]) -> float:
    """Of the networks that were measured, as films leak [ohm]."""
    values = [bounds.value for row in of if (bounds := row.expected_ohm)]
    return geometric_mean(values) if values else nan


def direction_findings(comparison: Comparison) -> Iterator[str]:
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
    method = PermutationMethod(n_resamples=_ORDERS) if exact else "asymptotic"
    return float(mannwhitneyu(one, other, method=method).pvalue)
