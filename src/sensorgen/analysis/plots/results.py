"""Figures of results: findings in the section of a sensor, sweeps, a cell under stress, and contacts of a sheet."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.analysis.plots.figure import BLUE, COLOURS, ORANGE, Axis, Curve, Figure, Map, Panel, look, scale
from sensorgen.checks.review import Review
from sensorgen.core.document import Cell, Table
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.compression import CompressionResult
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sweep import Sweep

if TYPE_CHECKING:
    from sensorgen.models.sheet import Port, PressErrors, Sheet

_SEVERITIES = {"info": BLUE, "warning": ORANGE, "error": "#d1242f"}  # the most severe on top


def findings(review: Review) -> Figure:
    """Edges of the bodies from the side, with the places of findings."""
    curves = [
        Curve("line", name, *_from_side(mesh.vertices_mm[mesh.sharp_edges()]), colour=COLOURS[2:][k % len(COLOURS[2:])])
        for k, (name, mesh) in enumerate(review.meshes.items())
    ]
    panel = Panel((*curves, *_places(review)), Axis("x [mm]"), Axis("z [mm]"))
    alt = "Bodies of the sensor from the side, and where findings are."
    return Figure("findings", f"{review.verdict}: {review.source}", alt, {"": (panel,)})


def _places(review: Review) -> Iterator[Curve]:
    """Places of findings from the side, by severity."""
    for severity, colour in _SEVERITIES.items():
        there = [f for f in review.findings if f.severity == severity and not f.waiver]
        x, z = ([f.place_mm[k] for f in there if f.place_mm] for k in (0, 2))
        text = [f.message for f in there if f.place_mm]
        yield Curve("points", severity, x, z, text=text, colour=colour)


def _from_side(ends_mm: Any) -> tuple[Any, Any]:
    """X and z of edges as one line with gaps."""
    both = ends_mm[:, :, [0, 2]]
    gaps = np.full((len(both), 1, 2), np.nan)
    x, z = np.concatenate([both, gaps], axis=1).reshape(-1, 2).T
    return x, z


def ranges(prediction: Prediction) -> Figure:
    """Range of each quantity over its best value, whole and by each cause."""
    curves = {}
    for name, bounds in prediction.quantities().items():
        if bounds and 0.0 < bounds.value < inf:
            causes = {"model": bounds.model, "print": bounds.print, "material": bounds.material, "leads": bounds.leads}
            for k, (cause, part) in enumerate({"all": bounds, **causes}.items()):
                if part and part.lower < part.upper:
                    row, ends = f"{name}: {cause}", (part.lower / bounds.value, part.upper / bounds.value)
                    curves[row] = Curve("points", "", [1.0], [row], [ends[0]], [ends[1]], colour=COLOURS[k])
    panel = Panel(tuple(curves.values()), Axis("relative to the best value", log=True), Axis(names=tuple(curves)))
    alt = "Ranges of the predicted quantities, whole and by model, print, material and leads."
    return Figure("ranges", f"{prediction.design}, {prediction.body}", alt, {"": (panel,)})


def sweep(result: Sweep[Any]) -> Figure:
    """Each number of the results over the first setting, or, under load, over the load; a line for each other value."""
    table, keys = result.table(), len(result.settings()[0])
    x = keys if len(table.cells) > len(result.results) else 0
    panels = tuple(
        _panel(table, x, y, [k for k in range(keys) if k != x])
        for y in range(keys, len(table.columns))
        if y != x and _is_shown(table, y)
    )
    title = ", ".join(table.columns[k].name for k in range(keys))
    return Figure("sweep", f"Along {title}", "Results along settings.", {"": panels}, columns=2)


def _is_shown(table: Table, y: int) -> bool:
    """True for a column of numbers for people, other than times."""
    column = table.columns[y]
    return not column.hidden and column.unit != "s" and any(_is_number(row[y]) for row in table.cells)


def _panel(table: Table, x: int, y: int, others: Sequence[int]) -> Panel:
    """A line for each combination of the other settings; marks alone where the first setting is a name."""
    groups = _grouped(table, y, others)
    column, over = table.columns[y], Axis(table.columns[x].head)
    every = np.array([row[y] for rows in groups.values() for row in rows], float)
    divisor, unit = scale(every, column.unit) if column.unit.startswith("F/") else (1.0, column.unit)
    what = Axis(f"{column.name} [{unit}]" if unit else column.name)
    if _is_number(table.cells[0][x]):
        return Panel(tuple(_lines(table, x, y, groups, divisor)), over, what)
    names = tuple(dict.fromkeys(str(row[x]) for row in table.cells))
    marks = tuple(
        Curve("points", label, [row[y] / divisor for row in rows], [str(row[x]) for row in rows], **look(k))
        for k, (label, rows) in enumerate(groups.items())
    )
    return Panel(marks, what, replace(over, names=names))


def _grouped(table: Table, y: int, others: Sequence[int]) -> dict[str, list[tuple[Any, ...]]]:
    """Rows with a number in a column, by the other settings in words."""
    groups: dict[str, list[tuple[Any, ...]]] = {}
    for row in table.cells:
        if _is_number(row[y]):
            label = ", ".join(f"{table.columns[k].name} {row[k]}" for k in others)
            groups.setdefault(label, []).append(row)
    return groups


def _lines(
    table: Table, x: int, y: int, groups: Mapping[str, Sequence[tuple[Any, ...]]], divisor: float
) -> Iterator[Curve]:
    """Lines with marks, and dotted ends of the ranges where the table has them."""
    head = table.columns[y].name
    ends = [k for k, c in enumerate(table.columns) if c.name in (f"{head}, least", f"{head}, most")]
    for k, (label, rows) in enumerate(groups.items()):
        along = [row[x] for row in rows]
        for column, dash in ((y, "solid"), *((end, "dot") for end in ends)):
            values = [row[column] / divisor for row in rows]
            yield Curve("line", "", along, values, colour=look(k)["colour"], dash=dash)
        yield Curve("points", label, along, [row[y] / divisor for row in rows], **look(k))


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, float | int) and not isinstance(cell, bool)


def compression_figure(result: CompressionResult) -> Figure:
    """Displacement and capacitance of a result over stress."""
    stress, displacement = result.stress_kpa, [d for d in result.displacement_um if d is not None]
    x = Axis("stress [kPa]", low=0.0)
    solved = stress[: len(displacement)]
    curve = (Curve("line", "", solved, displacement), Curve("points", "", solved, displacement))
    panels = [Panel(curve, x, Axis("displacement of the top [µm]", low=0.0))]
    bounds = {"lower bound": (result.lower_f_per_m2, BLUE, "triangle-up"),
              "upper bound": (result.upper_f_per_m2, ORANGE, "triangle-down")}  # fmt: skip
    at = [p for p, value in zip(stress, result.lower_f_per_m2, strict=True) if value is not None]
    if at:
        curves = tuple(
            Curve("points", name, at, [1e9 * c for c in values if c is not None], colour=colour, symbol=symbol)
            for name, (values, colour, symbol) in bounds.items()
        )
        panels.append(Panel(curves, x, Axis("capacitance [nF/m²]")))
    conditions = ", ".join(f"{key} {value}" for key, value in result.held.items())
    alt = "Displacement of the top and capacitance per area over stress."
    return Figure("compression", f"{result.model}: {conditions}", alt, {"": tuple(panels)}, columns=2)


_LEAST = 1 / 30  # of the error without information, at which the colours begin


def sheet(film: "Sheet", bounds: Mapping[str, "PressErrors"], ports: Mapping[str, Sequence["Port"]]) -> Figure:
    """Standard errors of x and y over the sheet, one column per set of contacts.

    The colours end at the error without a reading: of a uniform distribution over the sheet.

    Parameters
    ----------
    film : Sheet
        Under load.
    bounds : mapping of str to PressErrors
        By the name of the set of contacts.
    ports : mapping of str to sequence of Port
        The contacts of each set.
    """
    panels = tuple(_port_panel(film, name, bounds[name], ports[name], row) for row in (0, 1) for name in bounds)
    title = "Standard error of a load's position, outline known; contacts red; scale up to the error without a reading"
    alt = "Standard errors of x above and of y below, over the sheet, one column per set of contacts."
    return Figure("sheet", title, alt, {"": panels}, columns=len(bounds))


def _port_panel(film: "Sheet", name: str, bounds: "PressErrors", ports: Sequence["Port"], row: int) -> Panel:
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
