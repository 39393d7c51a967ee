"""Sections of a design as SVG: the drawing filled, the print outlined over it, layer boundaries behind."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from sensorgen.scene.drawing.view import View, views
from sensorgen.scene.scene import Outline, Scene, clipped

_PERIODS, _HEIGHTS = 2.5, 5.0  # how much is shown: periods of a pattern, or heights where nothing repeats
_WIDEST = 12.0  # width of a figure, relative to its height [-]
_MARGIN_MM = 0.04  # share of the width around the section [-]


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
    """

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
        body.name: [part for o in _cut(body, axis, at) if (part := clipped(o, shown.end_mm))]
        for body in printed.bodies
    }  # fmt: skip
    margin = _MARGIN_MM * shown.end_mm
    label = max(1, round(len(boundaries_mm) * margin / height / 0.8))
    return SectionFigure(
        f"{axis} = {at:g} mm, {shown.section.across} from 0 to {shown.end_mm:g} of {view.extent_mm:g} mm, true scale",
        (-2.2 * margin, -margin / 2, shown.end_mm + 2.7 * margin, height + margin),
        tuple(_paths(of_drawing, names, height)), tuple(_paths(of_print, names, height)),
        tuple((height - z, f"{z:g}" if k % label == 0 else "") for k, z in enumerate(boundaries_mm) if z <= height),
    )  # fmt: skip


def _cut(body: "object", axis: str, at_mm: float) -> Iterator[Outline]:
    for prism in body.prisms:  # type: ignore[attr-defined]
        yield from prism.cut(axis, at_mm)


def _paths(outlines: dict[str, list[Outline]], names: Sequence[str], height_mm: float) -> Iterable[tuple[int, str]]:
    for name, each in outlines.items():
        yield (
            names.index(name),
            "".join(
                "M" + "L".join(f"{round(u, 4):g} {round(height_mm - z, 4):g}" for u, z in outline) + "Z"
                for outline in each
            ),
        )
