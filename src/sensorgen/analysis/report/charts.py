"""Figures of a report as plain data: what is drawn, whoever draws it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

BLUE, ORANGE, GREEN, PINK, YELLOW, SKY, GREY = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a8f98",
)  # fmt: skip
Values = Sequence[float] | Sequence[str] | NDArray[np.float64]


@dataclass(frozen=True)
class Axis:
    """An axis with its unit."""

    title: str
    log: bool = False
    names: tuple[str, ...] = ()  # in order, where it has names instead of numbers
    low: float = nan  # ends, where they are given
    high: float = nan


@dataclass(frozen=True, eq=False)
class Trace:
    """Something drawn in a figure.

    Attributes
    ----------
    kind : str
        Points, a line, ranges from ``low`` to ``high`` along x, or bars along x that are stacked.
    name : str
        For the legend; "" for none.
    x, y : sequence
        Where; numbers, or names of the axis.
    low, high : sequence of float
        Ends of ranges, or of error bars about points, along x.
    text : sequence of str
        What to say of each point.
    colour, symbol, dash : str
        How.
    row : int
        Which of the panels above each other, from 0.
    """

    kind: Literal["points", "line", "ranges", "bars"]
    name: str
    x: Values
    y: Values
    low: Values = ()
    high: Values = ()
    text: Sequence[str] = ()
    colour: str = BLUE
    symbol: str = "circle"
    dash: str = "solid"
    row: int = 0


@dataclass(frozen=True, eq=False)
class Body:
    """A body as triangles [mm]."""

    name: str
    vertices_mm: NDArray[np.float64]
    triangles: NDArray[np.int32]
    colour: str


@dataclass(frozen=True, eq=False)
class Relief:
    """A surface over position and force."""

    position_mm: NDArray[np.float64]
    force_n: NDArray[np.float64]
    values: NDArray[np.float64]


Content = tuple[Trace, ...] | tuple[Body, ...] | tuple[Relief, ...]


@dataclass(frozen=True, eq=False)
class Chart:
    """A figure, with one content to choose among several.

    Attributes
    ----------
    key : str
        Name of its files, and its anchor.
    title, alt : str
        What it is, and what there is to see in it, for those who do not see it.
    choices : mapping of str to contents
        By the name that one chooses; the first is shown.
    x : Axis
        Across.
    y : tuple of Axis
        Upwards, one for each panel.
    chooser : str
        What is chosen, "" where there is one content only.
    stretch : (float, float, float)
        By how much bodies are drawn larger along x, y and z [-].
    """

    key: str
    title: str
    alt: str
    choices: dict[str, Content]
    x: Axis = field(default=Axis(""))
    y: tuple[Axis, ...] = (Axis(""),)
    chooser: str = ""
    stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def solid(self) -> bool:
        """Whether it has three dimensions."""
        return not isinstance(next(iter(self.choices.values()))[0], Trace)
