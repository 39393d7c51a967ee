"""A page that shows a print layer by layer: what each body covers, with the layer below it faint, and marked places."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sensorgen.analysis.plots.pages import render
from sensorgen.design import materials
from sensorgen.scene.layers import LayerRegions, Region, parts

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed

_COARSE_MM = 5e-3  # by which an outline may be moved to spare corners


@dataclass(frozen=True)
class Mark:
    """A place on a layer, counted from 0, from the corner of the sensor [mm], and what is there."""

    layer: int
    place_mm: tuple[float, float]
    text: str


@dataclass(frozen=True)
class Shown:
    """One layer as the page draws it: its title, and an SVG path per body."""

    title: str
    paths: Mapping[str, str]
    marks: Sequence[Mark]


def page(
    title: str,
    layers: Sequence[LayerRegions],
    colours: Mapping[str, tuple[str, str]],
    words: Sequence[str] = (),
    marks: Sequence[Mark] = (),
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
    """
    extent = shapely.total_bounds([region for layer in layers for region in layer.regions.values()])
    shown = [
        Shown(
            f"layer {k + 1} of {len(layers)}, {layer.bottom_mm:.3g} to {layer.top_mm:.3g} mm",
            {name: path(layer.regions[name], extent[3]) for name in colours if name in layer.regions},
            [mark for mark in marks if mark.layer == k],
        )
        for k, layer in enumerate(layers)
    ]
    first = marks[0].layer if marks else 0
    size = (float(extent[2]), float(extent[3]))
    return render(
        "sensorgen.analysis.plots", "layers.html", title=title, words=words, shown=shown, first=first, size=size,
        colours=colours, marks=marks,
    )  # fmt: skip


def of_print(printed: "Printed", marks: Sequence[Mark] = ()) -> str:
    """The page of a print, each body with its material and tool.

    Parameters
    ----------
    printed : Printed
        Estimated, or by G-code.
    marks : sequence of Mark
        As of :func:`page`.
    """
    design, colours = printed.design, {}
    for body in design.printed.bodies:
        material = materials.load(body.material)
        words = f"{body.name.replace('_', ' ')}, {material.title}, tool {design.tool(body.material)}"
        colours[body.name] = (words, material.colour)
    return page(design.name, printed.first, colours, [printed.provenance], marks)


def path(region: Region, height_mm: float) -> str:
    """A region as the data of an SVG path, y upwards from the bottom of the picture [mm]."""
    return "".join(_rings(shapely.simplify(region, _COARSE_MM), height_mm))


def _rings(region: Region, height_mm: float) -> Iterator[str]:
    for part in parts(region):
        for ring in (part.exterior, *part.interiors):
            corners = np.round(shapely.get_coordinates(ring)[:-1], 3)
            yield "M" + "L".join(f"{x:g} {round(height_mm - y, 3):g}" for x, y in corners.tolist()) + "Z"
