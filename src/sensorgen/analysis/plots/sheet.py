"""Maps of how well a load is located on a sheet."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import Axis, Curve, Figure, Map, Panel
from sensorgen.core.units import M_PER_MM

if TYPE_CHECKING:
    from sensorgen.models.sheet import Port, PressErrors, Sheet

_LEAST = 1 / 30  # of the error without information, at which the colours begin


def png(film: "Sheet", bounds: Mapping[str, "PressErrors"], ports: Mapping[str, Sequence["Port"]]) -> bytes:
    """Standard errors of x and y over the sheet, one column per set of contacts, as PNG.

    The colours end at the error without a reading: of a uniform distribution over the sheet.

    Parameters
    ----------
    film : Sheet
        Under load.
    bounds : mapping of str to PressErrors
        By the name of the set of contacts.
    ports : mapping of str to sequence of Port
        The contacts of each set.

    Raises
    ------
    MissingValue
        Matplotlib is not installed.
    """
    panels = tuple(_panel(film, name, bounds[name], ports[name], row) for row in (0, 1) for name in bounds)
    title = "Standard error of a load's position, outline known; contacts red; scale up to the error without a reading"
    alt = "Standard errors of x above and of y below, over the sheet, one column per set of contacts."
    return static.png(Figure("sheet", title, alt, {"": panels}, columns=len(bounds)))


def _panel(film: "Sheet", name: str, bounds: "PressErrors", ports: Sequence["Port"], row: int) -> Panel:
    none_mm = bounds.guess_m[row] / M_PER_MM
    sigma_mm = bounds.sigma(outline=True)[..., 1 + row].T / M_PER_MM
    shown = np.clip(sigma_mm, none_mm * _LEAST, none_mm)
    drawn = Map(bounds.x_m / M_PER_MM, bounds.y_m / M_PER_MM, shown, f"error of {'xy'[row]} [mm]", none_mm * _LEAST,
                none_mm, log=True)  # fmt: skip
    contacts = []
    for plus, _ in ports:
        (left, right), (front, back) = ((a / M_PER_MM for a in span) for span in (plus.x_m, plus.y_m))
        outline = [left, right, right, left, left], [front, front, back, back, front]
        contacts.append(Curve("line", "", *outline, colour="#ff0000"))
    x, y = (Axis(f"{axis} [mm]", low=0.0, high=size / M_PER_MM)
            for axis, size in (("x", film.length_m), ("y", film.width_m)))  # fmt: skip
    return Panel((drawn, *contacts), x, y, title="" if row else name, equal=True)
