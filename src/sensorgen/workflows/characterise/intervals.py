"""Intervals of targets before and after, and their picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from sensorgen.analysis.characterise.catalogue import CouponTarget
from sensorgen.analysis.characterise.posterior import CouponPosterior, Interval95
from sensorgen.analysis.plots.figure import BLUE, Axis, Curve, Figure, Panel
from sensorgen.analysis.plots.static import files
from sensorgen.core.document import Column

_DETERMINED = 0.5  # of an interval before, below which one after counts as measured
_LEAST = 0.01  # of the value: what is drawn at the least


@dataclass(frozen=True)
class IntervalRow:
    """A target before and after.

    Attributes
    ----------
    quantity, material : str
        As a material's file has them.
    value, low, high : float
        Afterwards: median and 95 % interval.
    half_width, goal : float
        Half of the interval, relative to the value, and what is wanted [%].
    before_low, before_high : float
        The 95 % interval before.
    """

    quantity: Annotated[str, Column("quantity")]
    material: Annotated[str, Column("material")]
    before_low: Annotated[float, Column("before", digits=2)]
    before_high: Annotated[float, Column("to", digits=2)]
    value: Annotated[float, Column("after", digits=3)]
    low: Annotated[float, Column("low", digits=3)]
    high: Annotated[float, Column("high", digits=3)]
    half_width: Annotated[float, Column("+-", "%", digits=2)]
    goal: Annotated[float, Column("goal", "%", digits=2)]
    title: Annotated[str, Column("meaning", hidden=True)]

    def determined(self) -> bool:
        """Test whether the readings say more than what was known before."""
        return self.high - self.low < _DETERMINED * (self.before_high - self.before_low)


def compared(
    before: CouponPosterior, after: CouponPosterior, wanted: Sequence[CouponTarget]
) -> tuple[IntervalRow, ...]:
    """All targets, with their intervals before and after."""

    def row(target: CouponTarget, was: Interval95, now: Interval95) -> IntervalRow:
        goal = 100 * target.goal if target.goal else np.nan
        half = 100 * now.half_width() if target.goal else np.nan
        return IntervalRow(target.quantity, target.material, was.low, was.high, now.value, now.low, now.high, half,
                           goal, target.title)  # fmt: skip

    return tuple(row(target, before.interval(target), after.interval(target)) for target in wanted)


def svg(title: str, rows: Sequence[IntervalRow]) -> str:
    """Intervals before and after as a picture, relative to the value after; those that reach 0 are left out.

    Parameters
    ----------
    title : str
        Above the bars.
    rows : sequence of IntervalRow
        In the order of reading.
    """
    shown = [row for row in rows if row.low > 0 and row.before_low > 0]
    names, ones = [_name(row) for row in shown], [1.0] * len(shown)
    before, after = (
        [[max(getattr(row, end) / row.value, _LEAST) for row in shown] for end in ends]
        for ends in (("before_low", "before_high"), ("low", "high"))
    )
    curves = (
        Curve("ranges", "before", ones, names, before[0], before[1]),
        Curve("points", "after", ones, names, after[0], after[1], colour=BLUE),
    )
    panel = Panel(curves, Axis("times the value after, 95 % intervals", log=True), Axis(names=tuple(names)))
    figure = Figure("intervals", title, title, {"": (panel,)})
    return next(content for name, content in files(figure) if name.endswith(".svg")).decode()


def _name(row: IntervalRow) -> str:
    """Quantity of a material with its value, as a label."""
    half = (row.high - row.low) / 2 / row.value
    words = f"{row.value:.3g} +- {100 * half:.2g} %" if row.determined() else "not determined"
    return f"{row.quantity} of {row.material}: {words}"
