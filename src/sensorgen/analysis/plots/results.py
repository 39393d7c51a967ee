"""Figures of results that notebooks show: findings in the section of a sensor, and sweeps."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from sensorgen.analysis.plots.figure import BLUE, COLOURS, ORANGE, Axis, Curve, Figure, Panel, look, scale
from sensorgen.checks.review import Review
from sensorgen.core.document import Cell, Table
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sweep import Sweep

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
