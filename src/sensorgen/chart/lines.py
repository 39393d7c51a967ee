"""Models of the pressed line on a plate whose impedance is known to 17 digits.

The error is the larger one of abs(Z) and of Re Z by itself, at the worst tone: Re Z, which tells where the press is, is
a thousandth of abs(Z) at low tones, and is lost first.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from sensorgen.chart.measured import Point, timed
from sensorgen.errors import OutOfRange
from sensorgen.models import line, line_abcd, line_closed, line_ladder, sheet, stack
from sensorgen.models._line_inputs import read
from sensorgen.models.sheet import Patch, Sheet
from sensorgen.units import EPS0_F_PER_M

# The plate of Table 3.1, pressed by 3 N in its middle.
PLATE = {
    "L_m": 0.1, "W_m": 0.01, "H_top_m": 3e-4, "H_bottom_m": 3e-4, "rho_top_ohm_m": 0.07, "rho_bottom_ohm_m": 0.2,
    "d_m": 6e-4, "eps_r": 4.68, "E_Pa": 6e6, "L_p_m": 0.01, "F_N": 3.0, "x_p_left_edge_m": 0.045,
}  # fmt: skip

# Impedance [ohm] by frequency [Hz]: transfer matrices in 60 digits.
STANDARD: dict[str, dict[float, complex]] = {
    "line, seven tones": {
        1.1e3: 3000.3727298841273 - 2093949.0417808136j,
        2.3e3: 3000.3715445141763 - 1001455.2752495972j,
        5.3e3: 3000.3649204154106 - 434597.15912340827j,
        10.1e3: 3000.3434447099399 - 228061.65201439313j,
        19.9e3: 3000.2580348134131 - 115761.42355379636j,
        49.9e3: 2999.64993089581 - 46198.143984803854j,
        99.7e3: 2997.4895813800539 - 23180.507246802561j,
    },
    "line, 1 mHz to 100 MHz": {
        1e-3: 3000.3730814279532 - 2303343000759.7946j,
        1.0: 3000.3730814276627 - 2303343000.7605758j,
        1e6: 2748.5461764976843 - 2986.339472756103j,
        1e8: 322.02875456248957 - 322.02875461574191j,
    },
}

_LADDERS = (1, 10, 100, 1000, 10_000)  # cells per section
_GRIDS = (20, 40, 80)  # cells along the sheet
_DIGITS = 2.0**-53  # no error is less than this

Model = Callable[..., Any]


def points(name: str, budget_s: float) -> list[Point]:
    """Measure every model of the line.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A ladder gets no more cells where that would take longer, ten times the last one taken as a guess [s].
    """
    return [*_closed(name), *_grown(name, budget_s)]


def _closed(name: str) -> Iterator[Point]:
    models: dict[str, Model] = {
        "line": line.impedance,
        "line_abcd": line_abcd.impedance,
        "line_closed": line_closed.impedance,
        "line_closed, B.48 as printed": partial(line_closed.impedance, "B.48"),
        "line_closed, uniform": line_closed.uniform,
        "line_closed, R and C in series": line_closed.series,
        "stack of one film": _stack,
    }
    for model, work in models.items():
        try:
            yield _point(name, model, work)
        except OutOfRange:
            continue  # it has no number there


def _grown(name: str, budget_s: float) -> Iterator[Point]:
    """Ladders and grids, from coarse to fine."""
    for model, work, cells in (("line_ladder", line_ladder.impedance, _LADDERS), ("sheet", _sheet, _GRIDS)):
        for number in cells:
            try:
                point = _point(name, model, partial(work, number), f"{number} cells, ")
            except OutOfRange:
                break  # current reaches less deep than a cell
            yield point
            if point.seconds * 10 > budget_s:
                break


def _stack(**inputs: Any) -> Any:
    """Two tracks and the film between them."""
    sections = read(inputs).sections()
    tracks = [[0.5 * r, 0.5 * r] for r in sections.r_ohm_per_m]  # what a loop runs through is their sum
    return stack.impedance(tracks, [[y] for y in sections.y_s_per_m], sections.length_m)[..., 0, 0]


def _sheet(cells: int, **inputs: Any) -> Any:
    """Two sheets with contacts all along one edge, pressed across their whole width."""
    p = inputs
    resistances = p["rho_top_ohm_m"] / p["H_top_m"], p["rho_bottom_ohm_m"] / p["H_bottom_m"]
    plate = Sheet(p["L_m"], p["W_m"], resistances, EPS0_F_PER_M * p["eps_r"] / p["d_m"])
    thinner = 1 / (1 - p["F_N"] / (p["W_m"] * p["L_p_m"] * p["E_Pa"]))
    press = Patch(p["x_p_left_edge_m"], 0.0, p["L_p_m"], p["W_m"], thinner)
    contacts = plate.edge("top", "left"), plate.edge("bottom", "left")
    return sheet.impedance(plate, [contacts], p["f_Hz"], press, cells)[:, 0, 0]


def _point(name: str, model: str, work: Model, said: str = "") -> Point:
    tones = np.array(list(STANDARD[name]))
    known = np.array(list(STANDARD[name].values()))
    found, seconds = timed(lambda: work(**PLATE, f_Hz=tones))
    whole = float(np.max(abs(found - known) / abs(known)))
    real = float(np.max(abs(found.real - known.real) / abs(known.real)))
    words = f"{said}abs(Z) off by {whole:.2g}, Re Z by {real:.2g}"
    return Point(name, model, max(whole, real, _DIGITS), seconds, words)
