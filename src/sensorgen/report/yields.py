"""Verdicts and yield, and what the multimeter says of shorts by film and by shape."""

from collections.abc import Callable, Hashable, Iterator
from math import isnan

from sensorgen.comparison import Comparison
from sensorgen.process.verdicts import WORDS, Evidence
from sensorgen.process.yields import Group, dependence, groups
from sensorgen.report.tables import Cell, Column, Table, table

BY: dict[str, Callable[[Evidence], tuple[Hashable, ...]]] = {
    "shape": lambda of: (of.shape or "unknown",),
    "film": lambda of: (f"{of.film_mm:g} mm" if of.film_mm is not None else "unknown",),
    "shape and film": lambda of: (of.shape or "unknown", f"{of.film_mm:g} mm" if of.film_mm is not None else "unknown"),
    "remark": lambda of: (of.remark or "none",),
}
ALMOST = 0.05  # probability by chance below which groups are said to differ


def judged(found: Comparison, by: str) -> list[Group]:
    """Groups of one kind."""
    return groups([(row.evidence, row.verdict) for row in found.rows], BY[by])


def everything(found: Comparison) -> Group:
    """All specimens as one group."""
    return groups([(row.evidence, row.verdict) for row in found.rows], lambda _: ())[0]


def findings(found: Comparison) -> Iterator[str]:
    """What the groups say, in sentences."""
    whole = everything(found)
    if whole.shorted.total:
        s = whole.shorted
        yield (
            f"{s.count} of {s.total} readings with both resistances have an R_Z of the order of R_Y or below (up to "
            f"ten times): {_percent(s.low)} to {_percent(s.high)} of such prints are shorted or leak as much, at 95 % "
            f"confidence. Median R_Z / R_Y: {whole.median_ratio:.3g}."
        )
    yield (
        f"{whole.intact.count} of {whole.intact.total} readings that allow a verdict are of an intact specimen: a "
        f"yield of {_percent(whole.intact.low)} to {_percent(whole.intact.high)}."
    )
    for by in ("film", "shape"):
        yield from _dependence(judged(found, by), by)


def _dependence(found: list[Group], by: str) -> Iterator[str]:
    known = [g for g in found if g.shorted.total]
    if len(known) < 2:
        return
    chance = dependence(known)
    parts = ", ".join(f"{_key(g)}: {g.shorted.count} of {g.shorted.total}" for g in known)
    differ = "differ" if chance < ALMOST else "do not differ more than chance makes them"
    yield f"By {by}: {parts}. The groups {differ} (exact test, p = {chance:.2g})."


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _key(group: Group) -> str:
    return ", ".join(map(str, group.key))


def words() -> tuple[str, ...]:
    """How verdicts come about."""
    return (
        "The verdict is the gravest of what the readings of electrode and film show. An electrode is held against the "
        "median of its own shape. R_Z up to the two electrodes in series is what a bridge may read: a short; above, "
        "and below the meter's highest range, the film leaks. Intervals are Clopper's and Pearson's, at 95 %.",
    )


def tables(found: Comparison) -> tuple[Table, ...]:
    """Yield by every kind of group."""
    return tuple(_table(judged(found, by), by) for by in BY)


def _table(found: list[Group], by: str) -> Table:
    parts = by.split(" and ")
    columns = [
        *(Column(part) for part in parts), Column("readings"), *(Column(word) for word in WORDS),
        Column("intact", "%"), Column("from", "%"), Column("to", "%"),
        Column("R_Z of the order of R_Y"), Column("of"), Column("share", "%"), Column("share from", "%"),
        Column("share to", "%"), Column("median R_Z / R_Y"),
    ]  # fmt: skip
    caption = f"Verdicts and yield by {by}"
    if len(found) > 1 and sum(bool(g.shorted.total) for g in found) > 1 and by != "remark":
        caption += f"; differences in shorts as large by chance alone: p = {dependence(found):.2g}"
    return table(f"yield_by_{by.replace(' ', '_')}", caption, columns, [_row(g) for g in found])


def _row(g: Group) -> list[Cell]:
    return [
        *map(str, g.key), sum(g.words.values()), *(g.words.get(word, 0) for word in WORDS),
        100 * g.intact.share, 100 * g.intact.low, 100 * g.intact.high, g.shorted.count, g.shorted.total,
        100 * g.shorted.share, 100 * g.shorted.low, 100 * g.shorted.high,
        None if isnan(g.median_ratio) else g.median_ratio,
    ]  # fmt: skip
