"""Verdicts and yield, and what the multimeter says of shorts by film and by shape."""

from collections.abc import Callable, Hashable, Iterator
from math import isnan

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.report.tables import Cell, Column, Table, table
from sensorgen.measure.signal.verdicts import ORDER, WORDS, Evidence
from sensorgen.measure.signal.yields import Group, Share, dependence, groups

BY: dict[str, Callable[[Evidence], tuple[Hashable, ...]]] = {
    "shape": lambda of: (of.shape or "unknown",),
    "film": lambda of: (f"{of.film_mm:g} mm" if of.film_mm is not None else "unknown",),
    "shape and film": lambda of: (of.shape or "unknown", f"{of.film_mm:g} mm" if of.film_mm is not None else "unknown"),
    "remark": lambda of: (of.remark or "none",),
}
TESTED = ("film", "shape")  # groups that are asked whether they differ
DIFFER = 0.05 / len(TESTED)  # probability by chance below which one is said to: all together by chance in 1 of 20 logs


def judged(found: Comparison, by: str) -> list[Group]:
    """Groups of one kind."""
    return groups([(row.evidence, row.verdict) for row in found.last], BY[by])


def everything(found: Comparison) -> Group:
    """All specimens as one group."""
    return groups([(row.evidence, row.verdict) for row in found.last], lambda _: ())[0]


def findings(found: Comparison) -> Iterator[str]:
    """What the groups say, in sentences."""
    whole = everything(found)
    yield from _shorted(found, whole)
    if whole.intact.total:
        yield (
            f"{whole.intact.count} of {whole.intact.total} specimens that allow a verdict, and whose electrodes do not "
            f"touch as drawn, are intact: a yield of {_range(whole.intact)}."
        )
    for by in TESTED:
        yield from _dependence(judged(found, by), by)


def _shorted(found: Comparison, whole: Group) -> Iterator[str]:
    both = [row for row in found.last if row.verdict.same_order is not None]
    if not both:
        return
    such = [row for row in both if row.verdict.same_order]
    yield (
        f"{len(such)} of {len(both)} specimens with both resistances have an R_Z of the order of R_Y or below (up to "
        f"{ORDER:g} times), {sum(row.evidence.touching for row in such)} of them shorts by design, "
        f"{sum(row.verdict.electrode != 'sound' for row in such)} beside an R_Y that is no sound electrode's. Median "
        f"R_Z / R_Y: {whole.median_ratio:.3g}."
    )
    if whole.shorted.total:
        yield (
            f"Without those whose electrodes touch as drawn: {whole.shorted.count} of {whole.shorted.total}; "
            f"{_range(whole.shorted)} of such prints are shorted or leak as much, at 95 % confidence."
        )


def _range(share: Share) -> str:
    return f"{100 * share.low:.3g} to {100 * share.high:.3g} %"


def _dependence(found: list[Group], by: str) -> Iterator[str]:
    known = [g for g in found if g.shorted.total]
    if len(known) < 2:
        return
    chance = dependence(known)
    parts = ", ".join(f"{_key(g)}: {g.shorted.count} of {g.shorted.total}" for g in known)
    differ = "differ" if chance < DIFFER else "do not differ more than chance makes them"
    yield f"By {by}: {parts}. The groups {differ} (p = {chance:.2g})."


def _key(group: Group) -> str:
    return ", ".join(map(str, group.key))


def words(found: Comparison) -> tuple[str, ...]:
    """How verdicts come about, and what is counted."""
    earlier = len(found.rows) - len(found.last)
    return (
        "The verdict is the gravest of what the readings of electrode and film show. An electrode is held against the "
        "median of its own shape. R_Z up to the two electrodes in series is what a bridge may read: a short; above, "
        "and below the meter's highest range, the film leaks.",
        "Each specimen counts once, with its last reading"
        + (f"; {earlier} earlier readings count for nothing here. " if earlier else ". ")
        + "Specimens whose electrodes touch as drawn have a verdict, but count for no share: they are shorts however "
        "well they were printed. Intervals are Clopper's and Pearson's, at 95 %. Whether groups differ is asked of "
        "film and of shape (Fisher's exact test, for more groups Freeman's and Halton's), and affirmed below "
        f"p = {DIFFER:g}, half of 0.05; every other comparison of groups here is exploratory, and proves nothing.",
    )


def tables(found: Comparison) -> tuple[Table, ...]:
    """Yield by every kind of group."""
    return tuple(_table(judged(found, by), by) for by in BY)


def _table(found: list[Group], by: str) -> Table:
    parts = by.split(" and ")
    columns = [
        *(Column(part) for part in parts), Column("specimens"), *(Column(word) for word in WORDS),
        Column("intact", "%"), Column("from", "%"), Column("to", "%"),
        Column("R_Z of the order of R_Y"), Column("of"), Column("share", "%"), Column("share from", "%"),
        Column("share to", "%"), Column("median R_Z / R_Y"),
    ]  # fmt: skip
    caption = f"Verdicts and yield by {by}"
    if by in TESTED and sum(bool(g.shorted.total) for g in found) > 1:
        caption += f"; differences in shorts as large by chance alone: p = {dependence(found):.2g}"
    return table(f"yield_by_{by.replace(' ', '_')}", caption, columns, [_row(g) for g in found])


def _row(g: Group) -> list[Cell]:
    return [
        *map(str, g.key), sum(g.words.values()), *(g.words.get(word, 0) for word in WORDS),
        *_percents(g.intact), g.shorted.count, g.shorted.total, *_percents(g.shorted),
        None if isnan(g.median_ratio) else g.median_ratio,
    ]  # fmt: skip


def _percents(of: Share) -> tuple[Cell, Cell, Cell]:
    """Share and its interval; nothing of nothing."""
    return (100 * of.share, 100 * of.low, 100 * of.high) if of.total else (None, None, None)
