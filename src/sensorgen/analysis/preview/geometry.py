"""Geometry for the page: sections as SVG paths, and surfaces as a compressed block of whole numbers.

The block is a JSON header, its length before it, then for every body the differences of vertices [um], of the corners
of triangles and of the ends of edges. Patterns that repeat become repeated bytes, which gzip stores once.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sensorgen.core.arrays import Whole
from sensorgen.scene.drawing.view import View, views
from sensorgen.scene.geometry.meshes import Mesh, mesh
from sensorgen.scene.scene import AXES, Outline, Scene, clipped

UM_PER_MM = 1000
_PERIODS, _HEIGHTS = 2.5, 5.0  # how much is shown: periods of a pattern, or heights where nothing repeats
_WIDEST = 12.0  # width of a figure, relative to its height [-]
_MARGIN = 0.04  # share of the width around the section [-]


@dataclass(frozen=True)
class SectionFigure:
    """A section for the page.

    Attributes
    ----------
    caption : str
        Where it is cut, and how much is shown.
    box : tuple of float
        Left, top, width and height of the picture [mm].
    drawn, printed : tuple of (int, str)
        Number of the body and SVG path, y downwards from the sensor's top [mm].
    boundaries : tuple of (float, str)
        Heights of the layers in the picture [mm], and a label for some of them.
    across : int
        Axis along the section, 0 for x [-].
    end_mm, top_mm : float
        How much of it is shown, and the height of its upper edge [mm].
    """

    across: int
    end_mm: float
    top_mm: float
    caption: str
    box: tuple[float, float, float, float]
    drawn: tuple[tuple[int, str], ...]
    printed: tuple[tuple[int, str], ...]
    boundaries: tuple[tuple[float, str], ...]


def figures(drawn: Scene, printed: Scene, names: Sequence[str], boundaries_mm: Sequence[float]) -> list[SectionFigure]:
    """The sections that the drawing shows too."""
    return [_figure(view, drawn, printed, names, boundaries_mm) for view in views(drawn)]


def _figure(
    view: View, drawn: Scene, printed: Scene, names: Sequence[str], boundaries_mm: Sequence[float]
) -> SectionFigure:
    height = max(drawn.size_mm[2], printed.size_mm[2])
    length = _PERIODS * view.repeat_mm() or _HEIGHTS * height
    end = min(max(length, 2 * height), _WIDEST * height, view.extent_mm)
    shown = replace(view, end_mm=round(end, 2))
    axis, at = shown.normal, shown.section.at_mm
    of_drawing: dict[str, list[Outline]] = {}
    for body, outline in shown.regions:
        of_drawing.setdefault(body.name, []).append(outline)
    of_print = {
        body.name: [part for p in body.pieces for o in p.cut(axis, at) if (part := clipped(o, shown.end_mm))]
        for body in printed.bodies
    }  # fmt: skip
    margin = _MARGIN * shown.end_mm
    label = max(1, round(len(boundaries_mm) * margin / height / 0.8))
    return SectionFigure(
        AXES.index(shown.section.across), shown.end_mm, height,
        f"{axis} = {at:g} mm, {shown.section.across} from 0 to {shown.end_mm:g} of {view.extent_mm:g} mm, true scale",
        (-2.2 * margin, -margin / 2, shown.end_mm + 2.7 * margin, height + margin),
        tuple(_paths(of_drawing, names, height)), tuple(_paths(of_print, names, height)),
        tuple((height - z, f"{z:g}" if k % label == 0 else "") for k, z in enumerate(boundaries_mm) if z <= height),
    )  # fmt: skip


def _paths(outlines: dict[str, list[Outline]], names: Sequence[str], height_mm: float) -> Iterator[tuple[int, str]]:
    for name, each in outlines.items():
        yield (
            names.index(name),
            "".join(
                "M" + "L".join(f"{round(u, 4):g} {round(height_mm - z, 4):g}" for u, z in outline) + "Z"
                for outline in each
            ),
        )


def block(header: Mapping[str, Any], scenes: Mapping[str, Scene], names: Sequence[str]) -> bytes:
    """The block, with the number of vertices, triangles and edges of each body of each scene in its header."""
    counts: dict[str, list[list[int]]] = {}
    blocks: list[bytes] = []
    for kind, scene in scenes.items():
        bodies = {body.name: body for body in scene.bodies}
        counts[kind] = []
        for name in names:
            parts = _parts(mesh(bodies[name])) if name in bodies else (np.empty((0, 3), np.int64),) * 3
            counts[kind].append([len(part) for part in parts])
            vertices, triangles, ends = parts
            steps = (np.diff(vertices, axis=0, prepend=0), np.diff(triangles.ravel(), prepend=0),
                     np.diff(ends.ravel(), prepend=0))  # fmt: skip
            blocks += [step.astype("<i4").tobytes() for step in steps]
    head = json.dumps({**header, "counts": counts}, separators=(",", ":"), allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    return b"".join([len(head).to_bytes(4, "little"), head, *blocks])


def _parts(shell: Mesh) -> tuple[Whole, Whole, Whole]:
    """Vertices [um], triangles, and the edges between faces."""
    vertices = np.round(shell.vertices_mm * UM_PER_MM).astype(np.int64)
    return vertices, shell.triangles.astype(np.int64), shell.sharp_edges()
