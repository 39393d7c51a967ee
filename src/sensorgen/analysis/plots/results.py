"""Figures of results that notebooks show: findings in the section of a sensor, and sweeps."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from sensorgen.analysis.plots.figure import BLUE, COLOURS, ORANGE, Axis, Curve, Figure, Panel, look, scale
from sensorgen.analysis.preview.geometry import edges
from sensorgen.checks.review import Review
from sensorgen.core.document import Cell, Table
from sensorgen.prediction.sweep import Sweep

_SEVERITIES = {"info": BLUE, "warning": ORANGE, "error": "#d1242f"}  # the most severe on top


def findings(found: Review) -> Figure:
    """Edges of the bodies from the side, with the places of findings."""
    curves = [
        Curve("line", name, *_from_side(mesh.vertices_mm, edges(mesh)), colour=COLOURS[2 + k % (len(COLOURS) - 2)])
        for k, (name, mesh) in enumerate(found.meshes.items())
    ]
    for severity, colour in _SEVERITIES.items():
        there = [f for f in found.findings if f.severity == severity and f.place_mm and not f.waiver]
        x, z = ([f.place_mm[k] for f in there if f.place_mm] for k in (0, 2))
        curves.append(Curve("points", severity, x, z, text=[f.message for f in there], colour=colour))
    panel = Panel(tuple(curves), Axis("x [mm]"), Axis("z [mm]"))
    alt = "Bodies of the sensor from the side, and where findings are."
    return Figure("findings", f"{found.verdict}: {found.source}", alt, {"": (panel,)})


def _from_side(vertices_mm: Any, ends: Any) -> tuple[Any, Any]:
    """X and z of edges as one line with gaps."""
    both = vertices_mm[ends][:, :, [0, 2]]
    gaps = np.full((len(both), 1, 2), np.nan)
    x, z = np.concatenate([both, gaps], axis=1).reshape(-1, 2).T
    return x, z


def sweep(found: Sweep[Any]) -> Figure:
    """Each number of the results over the first setting, or, under load, over the load; a line for each other value."""
    table, keys = found.table(), len(found.settings()[0])
    x = keys if len(table.cells) > len(found.results) else 0
    panels = tuple(
        _panel(table, x, y, [k for k in range(keys) if k != x])
        for y, column in enumerate(table.columns)
        if y >= keys
        and y != x
        and not column.hidden
        and column.unit != "s"
        and any(_is_number(row[y]) for row in table.cells)
    )
    title = ", ".join(table.columns[k].name for k in range(keys))
    return Figure("sweep", f"Along {title}", "Results along settings.", {"": panels}, columns=2)


def _panel(table: Table, x: int, y: int, others: Sequence[int]) -> Panel:
    groups: dict[tuple[Cell, ...], list[tuple[Any, ...]]] = {}
    for row in table.cells:
        if _is_number(row[y]):
            groups.setdefault(tuple(row[k] for k in others), []).append(row)
    names = tuple(dict.fromkeys(str(row[x]) for row in table.cells)) if not _is_number(table.cells[0][x]) else ()
    head = table.columns[y].name
    ends = [k for k, c in enumerate(table.columns) if c.name in (f"{head}, least", f"{head}, most")]  # dotted
    values_of = np.array([row[y] for rows in groups.values() for row in rows], float)
    unit = table.columns[y].unit
    divisor, prefixed = scale(values_of, unit) if unit.startswith("F/") else (1.0, unit)
    what, over = Axis(f"{head} [{prefixed}]" if prefixed else head), Axis(table.columns[x].head, names=names)

    def curves() -> Iterator[Curve]:
        for k, (chosen, rows) in enumerate(groups.items()):
            label = ", ".join(f"{table.columns[o].name} {v}" for o, v in zip(others, chosen, strict=True))
            along, values = [str(row[x]) if names else row[x] for row in rows], [row[y] / divisor for row in rows]
            if names:
                yield Curve("points", label, values, along, **look(k))
                continue
            yield Curve("line", "", along, values, colour=look(k)["colour"])
            for end in ends:
                yield Curve(
                    "line", "", along, [row[end] / divisor for row in rows], colour=look(k)["colour"], dash="dot"
                )
            yield Curve("points", label, along, values, **look(k))

    return Panel(tuple(curves()), *((what, over) if names else (over, what)))


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, float | int) and not isinstance(cell, bool)
