"""A picture with one panel per tone, drawn without a display and the same to the byte every time."""

from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots.field import Field, Real

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import ScalarFormatter

COLUMNS = 4
_DPI = 100
_PANEL_IN = (2.85, 2.7)
_LEAST_IN = 6.5  # width of all panels, so that the title has room over few of them
_FIRST_IN = (0.6, 0.7)  # room for a scale at the right and a title


def sheet(field: Field, title: str) -> "tuple[Figure, list[Axes]]":
    """A figure and its panels, one per tone; places that are left over stay empty."""
    from matplotlib.figure import Figure

    count = len(field.frequency_hz)
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    larger = max(1.0, _LEAST_IN / (columns * _PANEL_IN[0]))
    size = (_FIRST_IN[0] + columns * larger * _PANEL_IN[0], _FIRST_IN[1] + rows * larger * _PANEL_IN[1])
    figure = Figure(figsize=size, dpi=_DPI, layout="constrained")
    figure.suptitle(title, fontsize="medium")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel in panels[count:]:
        panel.set_axis_off()
    return figure, list(panels[:count])


def png(figure: "Figure") -> bytes:
    """A figure as PNG, without the date and version that would make each run's bytes its own."""
    target = BytesIO()
    figure.savefig(target, format="png", metadata={"Software": None})
    return target.getvalue()


def outer(k: int, count: int) -> tuple[bool, bool]:
    """Whether a panel is the first of its row, and the last of its column."""
    columns = min(COLUMNS, count)
    return k % columns == 0, k + columns >= count


def plain() -> "ScalarFormatter":
    """Labels that say the whole number, not what is to be added to one at the end of the axis."""
    from matplotlib.ticker import ScalarFormatter

    return ScalarFormatter(useOffset=False)


def levels(low: float, high: float, count: int = 7) -> Real:
    """Round numbers strictly between two others."""
    from matplotlib.ticker import MaxNLocator

    found = np.asarray(MaxNLocator(count).tick_values(low, high), float)
    return found[(found > low) & (found < high)]


def chosen(values: Real, count: int) -> Iterator[int]:
    """Indices of about ``count`` values, evenly spread, ends included."""
    yield from np.unique(np.linspace(0, len(values) - 1, min(count, len(values))).round().astype(int)).tolist()
