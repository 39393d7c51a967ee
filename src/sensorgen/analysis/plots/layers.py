"""A page that shows a print layer by layer: what each body covers, with the layer below it faint, and marked places."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sensorgen.analysis.plots.pages import path, render
from sensorgen.core.arrays import Real
from sensorgen.core.findings import SEVERITIES, Finding
from sensorgen.scene.layers import LayerRegions
from sensorgen.scene.scene import SLIVER_MM

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.export.gcode.crossings import Stretches

_LEVEL_MM = 5e-3  # above the top of a layer, the nozzle still prints it
_GAPS = (("in contact with", True, "#d00000"), ("one layer or less above", False, "#e07000"))


@dataclass(frozen=True)
class Mark:
    """A place on a layer, counted from 0, from the corner of the sensor [mm], and what is there."""

    layer: int
    place_mm: tuple[float, float]
    text: str


@dataclass(frozen=True)
class Travel:
    """A kind of travel: what the legend calls it, its colour, whether it is shown at first, and its ways by layer.

    ``ways`` are pairs of points, (n, 2, 2), from the corner of the sensor [mm].
    """

    words: str
    colour: str
    shown: bool
    ways: Mapping[int, Real]


@dataclass(frozen=True)
class Shown:
    """One layer as the page draws it: its title, an SVG path per body, marks, and a path per kind of travel."""

    title: str
    paths: Mapping[str, str]
    marks: Sequence[Mark]
    ways: Sequence[str]


def page(
    title: str,
    layers: Sequence[LayerRegions],
    colours: Mapping[str, tuple[str, str]],
    words: Sequence[str] = (),
    marks: Sequence[Mark] = (),
    travel: Sequence[Travel] = (),
) -> str:
    """The page as HTML that needs nothing else.

    Parameters
    ----------
    title : str
        What is printed.
    layers : sequence of LayerRegions
        From the bed upwards.
    colours : mapping of str to (str, str)
        What the legend calls a body, and its colour (``#rrggbb``), by its name; bodies are drawn in this order.
    words : sequence of str
        Paragraphs above the picture.
    marks : sequence of Mark
        Places to be seen, as shorts; the page opens at the layer of the first.
    travel : sequence of Travel
        Drawn over the bodies, each with a box to show or hide it.
    """
    extent = shapely.total_bounds([region for layer in layers for region in layer.regions.values()])
    shown = [
        Shown(
            f"layer {k + 1} of {len(layers)}, {layer.bottom_mm:.3g} to {layer.top_mm:.3g} mm",
            {name: path(layer.regions[name], extent[3]) for name in colours if name in layer.regions},
            [mark for mark in marks if mark.layer == k],
            [_ways(kind.ways[k], extent[3]) if k in kind.ways else "" for kind in travel],
        )
        for k, layer in enumerate(layers)
    ]
    first = marks[0].layer if marks else 0
    size = (float(extent[2]), float(extent[3]))
    return render(
        "sensorgen.analysis.plots", "layers.html", title=title, words=words, shown=shown, first=first, size=size,
        colours=colours, marks=marks, travel=travel,
    )  # fmt: skip


def of_print(
    printed: "Printed", findings: Sequence[Finding] = (), travel: "Mapping[str, Stretches] | None" = None
) -> str:
    """The page of a print, each body with its material and tool.

    Parameters
    ----------
    printed : Printed
        Estimated, or by G-code.
    findings : sequence of Finding
        Marked where they have a place, the errors first.
    travel : mapping of str to Stretches, optional
        Travel over another tool's material in the file, on the printer's own bed, by what the file is ("as sliced"); of
        a piece in the middle of the bed. The last is shown at first.
    """
    design, colours = printed.design, {}
    for body in design.printed.bodies:
        material = design.material(body.material)
        words = f"{body.name.replace('_', ' ')}, {material.title}, tool {design.tool(body.material)}"
        colours[body.name] = (words, material.colour)
    placed = sorted((f for f in findings if f.place_mm), key=lambda f: SEVERITIES.index(f.severity))
    tops = [layer.top_mm for layer in printed.first]
    marks = []
    for f in placed:
        x, y, z = f.place_mm or (0.0, 0.0, 0.0)
        number = f.layer - 1 if f.layer else min(bisect_right(tops, z + SLIVER_MM), len(tops) - 1)
        marks.append(Mark(number, (x, y), f"{f.severity}: {f.message}"))
    files = list((travel or {}).items())
    kinds = [kind for file in files for kind in _travel(printed, *file, shown=file is files[-1])]
    return page(design.name, printed.first, colours, [printed.provenance], marks, kinds)


def _travel(printed: "Printed", when: str, found: "Stretches", *, shown: bool) -> Iterator[Travel]:
    """Travel in contact, and travel near, by the layer that is printed at its height."""
    scene, tops = printed.design.printed, np.array([layer.top_mm for layer in printed.first])
    corner = np.array(printed.design.machine.bed_centre_mm()) - np.array(scene.size_mm[:2]) / 2
    ways = np.stack([found.start_mm[:, :2], found.end_mm[:, :2]], axis=1) - corner
    layer = np.searchsorted(tops, found.start_mm[:, 2] - _LEVEL_MM).clip(0, len(tops) - 1)
    for gap, touches, colour in _GAPS:
        mine = found.touches == touches
        by_tool = ", ".join(
            f"{found.length_mm[mine & (found.tool == tool)].sum():.1f} mm by tool {tool}"
            for tool in np.unique(found.tool[mine]).tolist()
        )
        words = f"travel {gap} another tool's material, {when}: {by_tool or '0.0 mm'}"
        yield Travel(words, colour, shown, {k: ways[mine & (layer == k)] for k in np.unique(layer[mine]).tolist()})


def _ways(ends_mm: Real, height_mm: float) -> str:
    """Pairs of points, (n, 2, 2), as the data of an SVG path."""
    rows = np.round(ends_mm * [1, -1] + [0, height_mm], 3).reshape(-1, 4).tolist()
    return "".join(f"M{x0:g} {y0:g}L{x1:g} {y1:g}" for x0, y0, x1, y1 in rows)
