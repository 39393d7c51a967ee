"""Print layer by layer: what each body covers and its colours, places of findings, travel of the nozzle; its page."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.analysis.plots import pages
from sensorgen.core.arrays import Real
from sensorgen.core.findings import Finding, numbered
from sensorgen.scene.layers import LayerRegions
from sensorgen.scene.scene import SLIVER_MM

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.design.design import Design
    from sensorgen.export.gcode.crossings import Stretches

LIGHT, DARK = "#ffffff", "#14171b"  # the page's grounds, as of page.css
LEAST = {LIGHT: 1.5, DARK: 3.2}  # contrast of a body with the ground, by WCAG 2 [-]
_APART = 0.2  # share of the ink that parts bodies of one material


def shades(colour: str, number: int) -> tuple[str, str]:
    """A material's colour for its ``number``-th body, on a light and on a dark ground.

    >>> shades("#303436", 0)
    ('#303436', '#66696a')
    """
    rgb = _rgb(colour)
    light, dark = _clear(rgb, LIGHT, 0.0), _clear(rgb, DARK, 255.0)
    towards = 255.0 if luminance(rgb) < 0.4 else 0.0
    return _hex(_moved(light, towards, number)), _hex(_moved(dark, towards, number))


def _moved(colour: tuple[float, ...], end: float, number: int) -> tuple[float, ...]:
    """The shade of the ``number``-th body."""
    share = min(_APART * number, 0.6)
    return tuple(v + (end - v) * share for v in colour)


def _clear(colour: tuple[float, ...], ground: str, end: float) -> tuple[float, ...]:
    """The colour moved towards black or white until it contrasts with the ground."""
    for step in range(101):
        moved = tuple(v + (end - v) * step / 100 for v in colour)
        if contrast(moved, _rgb(ground)) >= LEAST[ground]:
            return moved
    return colour


def contrast(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """Contrast ratio of two colours, WCAG 2.2: (L1 + 0.05) / (L2 + 0.05), from 1 to 21 [-]."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def luminance(colour: tuple[float, ...]) -> float:
    """Relative luminance of an sRGB colour of 0 to 255, WCAG 2.2 [-]."""
    linear = ((v / 255 / 12.92) if v / 255 <= 0.04045 else ((v / 255 + 0.055) / 1.055) ** 2.4 for v in colour)
    return sum(share * v for share, v in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(float(int(colour[k : k + 2], 16)) for k in (1, 3, 5))


def _hex(colour: tuple[float, ...]) -> str:
    return "#" + "".join(f"{round(v):02x}" for v in colour)


_LEVEL_MM = 5e-3  # above the top of a layer, the nozzle still prints it
_GAPS = (("in contact with", True, "#d00000"), ("one layer or less above", False, "#e07000"))


@dataclass(frozen=True)
class BodyShown:
    """A body in the legend: its role, material and tool, and its colours on a light and on a dark ground."""

    name: str
    material: str
    tool: int
    light: str
    dark: str


@dataclass(frozen=True)
class PlacedFinding:
    """A finding in the list, its number on the drawing, and the layer at which it shows, counted from 0."""

    finding: Finding
    number: int
    layer: int | None


@dataclass(frozen=True)
class Travel:
    """A kind of travel: words of the legend, its colour, whether it is shown at first, and its ways by layer.

    ``ways`` are pairs of points, (n, 2, 2), from the corner of the sensor [mm].
    """

    words: str
    colour: str
    shown: bool
    ways: Mapping[int, Real]


def bodies(design: "Design") -> tuple[BodyShown, ...]:
    """The bodies from the bed upwards, each in a shade of its material's colour."""
    rows: list[BodyShown] = []
    for body in design.printed.bodies:
        material = design.material(body.material)
        pair = shades(material.colour, sum(row.material == material.title for row in rows))
        rows.append(BodyShown(body.name.replace("_", " "), material.title, design.tool(body.material), *pair))
    return tuple(rows)


def placed(findings: Sequence[Finding], layers: Sequence[LayerRegions]) -> list[PlacedFinding]:
    """Findings with their numbers and layers."""
    tops, number = [layer.top_mm for layer in layers], numbered(findings)
    rows = []
    for f in findings:
        known = f.place_mm is not None and bool(tops)
        at = (f.layer - 1 if f.layer else bisect_right(tops, f.place_mm[2] + SLIVER_MM)) if known and f.place_mm else 0
        rows.append(PlacedFinding(f, number[f], min(at, len(tops) - 1) if known else None))
    return rows


def stack(
    layers: Sequence[LayerRegions], names: Sequence[str], size_mm: Sequence[float], listed: Sequence[PlacedFinding],
    travel: Sequence[Travel] = (),
) -> dict[str, Any]:  # fmt: skip
    """Data for the script: layers with their heights [mm], a path per body and per kind of travel, and findings."""
    return {
        "size": [*size_mm],
        "layers": [
            {
                "z": [round(layer.bottom_mm, 6), round(layer.top_mm, 6)],
                "paths": {names.index(name): pages.path(region, size_mm[1]) for name, region in layer.regions.items()},
                "ways": [_ways(kind.ways[k], size_mm[1]) if k in kind.ways else "" for kind in travel],
            }
            for k, layer in enumerate(layers)
        ],
        "findings": [
            None if at.layer is None
            else [at.layer, *(at.finding.place_mm or ()), f"{at.finding.severity}: {at.finding.message}", at.number]
            for at in listed
        ],
        "first": next((at.layer for at in listed if at.layer is not None), 0),
    }  # fmt: skip


def page(
    title: str, words: Sequence[str], shown: Sequence[BodyShown], data: Mapping[str, Any],
    listed: Sequence[PlacedFinding] = (), travel: Sequence[Travel] = (),
) -> str:  # fmt: skip
    """The page as HTML that needs nothing else.

    Parameters
    ----------
    title : str
        What is printed.
    words : sequence of str
        Paragraphs above the picture.
    shown : sequence of BodyShown
        Bodies, in the order of their names in ``data``.
    data : mapping
        As of :func:`stack`.
    found : sequence of PlacedFinding
        Listed below the picture; it opens at the layer of the first that has one.
    travel : sequence of Travel
        Drawn over the bodies, each with a box to show or hide it.
    """
    return pages.render(
        "sensorgen.analysis.plots", "layers.html", title=title, words=words, bodies=shown,
        data=pages.packed_json(data), layers=len(data["layers"]), listed=listed, travel=travel,
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
        Marked where they have a place.
    travel : mapping of str to Stretches, optional
        Travel over another tool's material in the file, on the printer's own bed, by what the file is ("as sliced"); of
        a piece in the middle of the bed. The last is shown at first.
    """
    scene, files = printed.design.printed, list((travel or {}).items())
    kinds = [kind for file in files for kind in _travel(printed, *file, shown=file is files[-1])]
    listed = placed(findings, printed.first)
    data = stack(printed.first, [body.name for body in scene.bodies], scene.size_mm, listed, kinds)
    return page(printed.design.name, [printed.provenance], bodies(printed.design), data, listed, kinds)


def _travel(printed: "Printed", when: str, stretches: "Stretches", *, shown: bool) -> Iterator[Travel]:
    """Travel in contact, and travel near, by the layer that is printed at its height."""
    scene, tops = printed.design.printed, np.array([layer.top_mm for layer in printed.first])
    corner = np.array(printed.design.machine.bed_centre_mm()) - np.array(scene.size_mm[:2]) / 2
    ways = np.stack([stretches.start_mm[:, :2], stretches.end_mm[:, :2]], axis=1) - corner
    layer = np.searchsorted(tops, stretches.start_mm[:, 2] - _LEVEL_MM).clip(0, len(tops) - 1)
    for gap, touches, colour in _GAPS:
        mine = stretches.touches == touches
        by_tool = ", ".join(
            f"{stretches.length_mm[mine & (stretches.tool == tool)].sum():.1f} mm by tool {tool}"
            for tool in np.unique(stretches.tool[mine]).tolist()
        )
        words = f"travel {gap} another tool's material, {when}: {by_tool or '0.0 mm'}"
        yield Travel(words, colour, shown, {k: ways[mine & (layer == k)] for k in np.unique(layer[mine]).tolist()})


def _ways(ends_mm: Real, height_mm: float) -> str:
    """Pairs of points, (n, 2, 2), as the data of an SVG path."""
    rows = np.round(ends_mm * [1, -1] + [0, height_mm], 3).reshape(-1, 4).tolist()
    return "".join(f"M{x0:g} {y0:g}L{x1:g} {y1:g}" for x0, y0, x1, y1 in rows)
