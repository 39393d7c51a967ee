"""Intervals of targets before and after, and their picture: one bar each, relative to the value."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from math import log10
from typing import Annotated

import numpy as np

from sensorgen.analysis.characterise.catalogue import Target
from sensorgen.analysis.characterise.posterior import Interval95, Posterior
from sensorgen.core.document import Column

_DETERMINED = 0.5  # of an interval before, below which one after counts as measured
_LEFT, _WIDE, _ROW, _DECADES = 250, 420, 26, 2.0  # pixels, and decades to each side


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


def compared(before: Posterior, after: Posterior, wanted: Sequence[Target]) -> tuple[IntervalRow, ...]:
    """All targets, with their intervals before and after."""

    def row(target: Target, was: Interval95, now: Interval95) -> IntervalRow:
        goal = 100 * target.goal if target.goal else np.nan
        half = 100 * now.half_width() if target.goal else np.nan
        return IntervalRow(target.quantity, target.material, was.low, was.high, now.value, now.low, now.high, half,
                           goal, target.title)  # fmt: skip

    return tuple(row(target, before.interval(target), after.interval(target)) for target in wanted)


def svg(title: str, rows: Sequence[IntervalRow]) -> str:
    """The picture; quantities that may be 0 or below are left out.

    Parameters
    ----------
    title : str
        Above the bars.
    rows : sequence of IntervalRow
        In the order of reading.
    """
    shown = [row for row in rows if row.low > 0 and row.before_low > 0]
    height = 70 + _ROW * len(shown)
    parts = [
        _text(10, 20, f"{title} (95 % intervals; grey before, blue after)", 14),
        _text(10, height - 8, "times the value after"),
    ]
    for factor in (0.01, 0.1, 0.5, 1, 2, 10, 100):
        x = _at(factor)
        parts.append(f'<path d="M{x:.1f} 34V{height - 24}" stroke="#ccc"/>' + _text(x - 8, height - 8, f"x {factor:g}"))
    for k, row in enumerate(shown):
        y = 38 + _ROW * k
        parts.append(_text(10, y + 14, f"{row.quantity} of {row.material}"))
        for low, high, colour, thick in (
            (row.before_low, row.before_high, "#bbb", 14), (row.low, row.high, "#1f5fa8", 8),
        ):  # fmt: skip
            left, right = _at(low / row.value), _at(high / row.value)
            parts.append(
                f'<rect x="{left:.1f}" y="{y + 10 - thick / 2:g}" width="{max(right - left, 1.5):.1f}" '
                f'height="{thick}" fill="{colour}"/>'
            )
        half = (row.high - row.low) / 2 / row.value
        words = f"{row.value:.3g} +- {100 * half:.2g} %" if row.determined() else "not determined"
        parts.append(_text(_LEFT + _WIDE + 12, y + 14, words))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_LEFT + _WIDE + 150} {height}" '
        f'width="{_LEFT + _WIDE + 150}" height="{height}">\n<rect width="100%" height="100%" fill="#fff"/>\n'
        + "\n".join(parts)
        + "\n</svg>\n"
    )


def _at(factor: float) -> float:
    """Place of a factor on the axis [px]."""
    return _LEFT + _WIDE * (0.5 + min(max(log10(factor) / _DECADES, -1.0), 1.0) / 2)


def _text(x: float, y: float, words: str, size: int = 12) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-family="sans-serif" font-size="{size}">{html.escape(words)}</text>'
