"""Figures as data with units: ``static`` draws them as PNG and SVG, ``interactive`` as data for Plotly's script."""

import importlib.util
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import MissingValue
from sensorgen.core.units import prefix

BLUE, ORANGE, GREEN, PINK, YELLOW, SKY, GREY = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a8f98",
)  # fmt: skip
PURPLE, BROWN, DARK = "#7a5195", "#8c564b", "#555555"
COLOURS = (BLUE, ORANGE, GREEN, PINK, YELLOW, SKY, PURPLE, BROWN, DARK)
SYMBOLS = (
    "circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x", "triangle-left", "triangle-right",
)  # fmt: skip
MOST_POINTS = 1600  # of a drawn curve: more than a figure is wide

Values = Sequence[float] | Sequence[str] | Real


@dataclass(frozen=True)
class Axis:
    """An axis.

    Attributes
    ----------
    title : str
        Quantity with its unit.
    log : bool
        Whether it is logarithmic.
    names : tuple of str
        Categories in order, if the axis has names instead of numbers.
    low, high : float
        Fixed ends; nan for automatic ones.
    """

    title: str = ""
    log: bool = False
    names: tuple[str, ...] = ()
    low: float = nan
    high: float = nan


@dataclass(frozen=True, eq=False)
class Curve:
    """Points or a line, ranges along x, or bars along x that are stacked.

    Attributes
    ----------
    kind : str
        What is drawn.
    name : str
        For the legend; "" for none.
    x, y : sequence
        Numbers, or names of the axis.
    low, high : sequence of float
        Ends of ranges, or of error bars along x.
    text : sequence of str
        Remark on each point, shown under the mouse.
    colour, symbol, dash : str
        Symbols of ``SYMBOLS``, "-open" appended for hollow ones; dash is "solid", "dash" or "dot".
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


@dataclass(frozen=True, eq=False)
class Map:
    """A quantity in colours over a plane.

    Attributes
    ----------
    x, y : array
        Axes (n,) and (m,) of a grid; or the place of each value, in the shape of ``values``.
    values : (m, n) array
        Or one value for each place.
    label : str
        Quantity with its unit.
    low, high : float
        Ends of the colour scale; of all values if nan.
    log : bool
        Whether the colour scale is logarithmic; small values then stand out.
    levels : tuple of float
        Values along which lines are drawn: the first solid, the others dashed.
    """

    x: Real
    y: Real
    values: Real
    label: str = ""
    low: float = nan
    high: float = nan
    log: bool = False
    levels: tuple[float, ...] = ()

    @property
    def extent(self) -> tuple[float, float]:
        """Least and largest value; 0 and 1 where there are none."""
        finite = self.values[np.isfinite(self.values)]
        return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)

    @property
    def span(self) -> tuple[float, float]:
        """Ends of the colour scale, symmetric about 0 where there are values of both signs."""
        low, high = (most if isnan(end) else end for end, most in zip((self.low, self.high), self.extent, strict=True))
        return (-max(-low, high), max(-low, high)) if low < 0 < high else (low, high)

    @property
    def signed(self) -> bool:
        """True where the colour scale has a neutral middle."""
        return self.span[0] < 0 < self.span[1]


@dataclass(frozen=True, eq=False)
class BodyTriangles:
    """A body as triangles [mm]."""

    name: str
    vertices_mm: Real
    triangles: NDArray[np.int32]
    colour: str


@dataclass(frozen=True, eq=False)
class Panel:
    """Axes with what is drawn in them.

    Attributes
    ----------
    content : tuple
        Curves and maps, or bodies alone.
    x, y, z : Axis
        Across, upwards, and the third one of bodies.
    title : str
        Over the panel.
    equal : bool
        Whether both axes have one scale.
    """

    content: tuple[Curve | Map | BodyTriangles, ...]
    x: Axis = Axis()
    y: Axis = Axis()
    z: Axis = Axis()
    title: str = ""
    equal: bool = False

    @property
    def solid(self) -> bool:
        """True for a panel of bodies, in three dimensions."""
        return isinstance(self.content[0], BodyTriangles) if self.content else False


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure, with one set of panels to choose among several.

    Attributes
    ----------
    key : str
        Name of its files, and its anchor.
    title, alt : str
        What it is, and what there is to see in it, for those who do not see it.
    choices : mapping of str to tuple of Panel
        By the name that one chooses; the first is shown.
    chooser : str
        What is chosen, "" where there is one choice only.
    columns : int
        Panels beside each other in a picture; a page has them above each other.
    beside : bool
        Whether each panel of a picture has a legend of its own, to its right.
    stretch : (float, float, float)
        By how much bodies are drawn larger along x, y and z [-].
    """

    key: str
    title: str
    alt: str
    choices: Mapping[str, tuple[Panel, ...]]
    chooser: str = ""
    columns: int = 1
    beside: bool = False
    stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @classmethod
    def by_frequency(
        cls, key: str, title: str, alt: str, frequency_hz: Iterable[float],
        panels: Callable[[int, str], Iterable[Panel]], columns: int,
    ) -> Self:  # fmt: skip
        """A figure to choose a frequency in, whose panels are made from its number and its name."""
        choices = {at: tuple(panels(k, at)) for k, at in enumerate(map(frequency, frequency_hz))}
        return cls(key, title, alt, choices, "frequency", columns)


def look(k: int) -> dict[str, str]:
    """Colour and symbol of the k-th curve: no two of the first 81 are alike."""
    return {"colour": COLOURS[(k + k // len(SYMBOLS)) % len(COLOURS)], "symbol": SYMBOLS[k % len(SYMBOLS)]}


def scale(values: Real, unit: str) -> tuple[float, str]:
    """Divisor and unit that leave up to three digits before the point.

    Parameters
    ----------
    values : array
        In ``unit``.
    unit : str
        Without a prefix.

    Examples
    --------
    >>> scale(np.array([2300.0, -1100.0]), "Ω/mm")
    (1000.0, 'kΩ/mm')
    """
    name, divisor = prefix(float(np.nanmax(np.abs(values), initial=0.0)))
    return divisor, name.replace("u", "µ") + unit


def frequency(frequency_hz: float) -> str:
    """A frequency for a heading.

    Examples
    --------
    >>> frequency(99700.0)
    '99.7 kHz'
    """
    divisor, unit = scale(np.asarray(frequency_hz), "Hz")
    return f"{frequency_hz / divisor:g} {unit}"


def thinned(values: Real, most: int = MOST_POINTS) -> NDArray[np.intp]:
    """Samples that draw the same curve with fewer points: the least and the largest of each stretch, and the last one.

    Parameters
    ----------
    values : (n,) array
        What is drawn over even time; nan where nothing is.
    most : int
        Points, about: each of ``most / 2`` stretches keeps its least and its largest value, in their order.

    Examples
    --------
    >>> thinned(np.array([0.0, 5.0, 1.0, 1.0, -3.0, 1.0]), most=4).tolist()
    [0, 1, 3, 4, 5]
    """
    if len(values) <= most:
        return np.arange(len(values))
    width = -(-len(values) // (most // 2))
    rows = np.pad(values, (0, -len(values) % width), constant_values=np.nan).reshape(-1, width)
    starts = np.arange(len(rows)) * width
    low = np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1) + starts
    high = np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1) + starts
    samples = np.unique(np.concatenate([low, high, [len(values) - 1]]))
    return np.asarray(samples[samples < len(values)])


def thinned_together(z: Complex, which: Mask | None = None) -> NDArray[np.intp]:
    """Samples of which the curves of both parts of each column are :func:`thinned`, among those of ``which``."""
    columns = (column if which is None else column[which] for column in z.T)
    samples = [thinned(part) for column in columns for part in (column.real, column.imag)]
    return np.unique(np.concatenate(samples))


def needed(*names: str) -> None:
    """Refuse to go on without a library.

    Raises
    ------
    MissingValue
        It is not installed.
    """
    missing = [name for name in names if importlib.util.find_spec(name) is None]
    if missing:
        raise MissingValue(f"plots need {' and '.join(missing)}: pip install {' '.join(missing)}")
