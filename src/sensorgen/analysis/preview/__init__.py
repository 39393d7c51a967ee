"""One page that shows a design: bodies in 3D, section and layers as printed, numbers, identifiability and findings.

Geometry for the page: sections as SVG paths, and surfaces as a compressed block of whole numbers.

The block is a JSON header, its length before it, then for every body the differences of vertices [um], of the corners
of triangles and of the ends of edges. Patterns that repeat become repeated bytes, which gzip stores once.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from sensorgen.analysis.plots import layers, pages
from sensorgen.asprinted.printed import Printed
from sensorgen.checks.review import Review, draw
from sensorgen.core.document import Part
from sensorgen.core.findings import headline
from sensorgen.core.lazy import by_key
from sensorgen.prediction.identifiability.results import GUESS, Identifiability, Rows, metres, newtons
from sensorgen.prediction.results import Changes, Prediction, Term
from sensorgen.scene.drawing.paper import ViewFrame
from sensorgen.scene.drawing.view import View, views
from sensorgen.scene.geometry.meshes import mesh
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
    start_mm, end_mm, top_mm : float
        The part of it that is shown, and the height of its upper edge [mm].
    """

    across: int
    start_mm: float
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
    end = round(min(max(length, 2 * height), _WIDEST * height, view.extent_mm), 2)
    shown = view.first(end)
    axis, at, start = shown.normal, shown.section.at_mm, shown.start_mm
    of_drawing = by_key((body.name, outline) for body, outline in shown.regions)
    of_print = {
        body.name: [part for p in body.pieces for o in p.cut(axis, at) if (part := clipped(o, shown.end_mm, start))]
        for body in printed.bodies
    }  # fmt: skip
    margin = _MARGIN * end
    label = max(1, round(len(boundaries_mm) * margin / height / 0.8))
    return SectionFigure(
        AXES.index(shown.section.across), start, shown.end_mm, height,
        f"{axis} = {at:g} mm, {shown.section.across} from {start:g} to {shown.end_mm:g} of {view.extent_mm:g} mm, "
        "true scale",
        (-2.2 * margin, -margin / 2, end + 2.7 * margin, height + margin),
        tuple(_paths(of_drawing, names, height, start)), tuple(_paths(of_print, names, height, start)),
        tuple((height - z, f"{z:g}" if k % label == 0 else "") for k, z in enumerate(boundaries_mm) if z <= height),
    )  # fmt: skip


def _paths(
    outlines: dict[str, list[Outline]], names: Sequence[str], height_mm: float, start_mm: float
) -> Iterator[tuple[int, str]]:
    frame = ViewFrame(0.0, height_mm, 0.0, 0.0, 1.0, 1.0, start_mm)
    for name, each in outlines.items():
        yield names.index(name), "".join(map(frame.outline, each))


def block(header: Mapping[str, Any], scenes: Mapping[str, Scene], names: Sequence[str]) -> bytes:
    """The block, with the number of vertices, triangles and edges of each body of each scene in its header."""
    counts: dict[str, list[list[int]]] = {}
    blocks: list[bytes] = []
    for kind, scene in scenes.items():
        bodies = {body.name: body for body in scene.bodies}
        counts[kind] = []
        for name in names:
            parts = (np.empty((0, 3), np.int64),) * 3
            if name in bodies:
                shell = mesh(bodies[name])
                um = np.round(shell.vertices_mm * UM_PER_MM).astype(np.int64)
                parts = um, shell.triangles.astype(np.int64), shell.sharp_edges()  # the edges between faces
            counts[kind].append([len(part) for part in parts])
            vertices, triangles, ends = parts
            steps = (np.diff(vertices, axis=0, prepend=0), np.diff(triangles.ravel(), prepend=0),
                     np.diff(ends.ravel(), prepend=0))  # fmt: skip
            blocks += [step.astype("<i4").tobytes() for step in steps]
    head = json.dumps({**header, "counts": counts}, separators=(",", ":"), allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    return b"".join([len(head).to_bytes(4, "little"), head, *blocks])


_SEEN = 0.1  # per cent: smaller effects are left out


def page(
    printed: Printed, review: Review, predicted: Prediction, numbers: Iterable[Part],
    advice: Iterable[Part] = (),
) -> str:  # fmt: skip
    """The page as HTML that needs nothing else.

    Parameters
    ----------
    printed : Printed
        The print; its drawing is shown beside it.
    held : Review
        Findings about the design.
    predicted : Prediction
        Of the print.
    numbers : iterable of Part
        The numbers that decide, drawn beside printed.
    advice : iterable of Part
        Changes that were tried, if any were.
    """
    design, scene = printed.design, printed.design.printed
    names, listed = [body.name for body in scene.bodies], layers.placed(review.findings, printed.first)
    header = layers.stack(printed.first, names, scene.size_mm, listed)
    data = block(header, {"drawn": scene, "printed": printed.scene}, names)
    sheet = draw(design, review, printed.scene, printed.provenance)
    return pages.render(
        "sensorgen.analysis.preview", "preview.html",
        headline=headline(design.name, review.findings, review.source, predicted=predicted.status != "not predicted"),
        title=design.name, verdict=review.verdict, bodies=layers.bodies(design),
        provenance=printed.provenance, printer=f"{design.machine.name}, {design.layers.name}",
        size=" × ".join(f"{side:g}" for side in scene.size_mm), layers=len(printed.first),
        sections=figures(scene, printed.scene, names, design.layers.boundaries_mm(scene.size_mm[2])),
        sheet=Markup(sheet),  # noqa: S704 - our own drawing, which escapes its text
        data=pages.packed(data),
        numbers=[*numbers], advice=[*advice], listed=listed,
        known=predicted.identifiability, maps=maps(predicted.identifiability),
        reason=predicted.reason, assumptions=predicted.assumptions, tornado=tuple(_tornado(predicted)),
    )  # fmt: skip


@dataclass(frozen=True)
class Bar:
    """An assumption, and by how much a press is read wrongly at the ends of its range: in words, and as shares [%]."""

    term: Term
    words: tuple[str, str]
    shares: tuple[float, float]


def _tornado(predicted: Prediction) -> Iterator[Bar]:
    """Assumptions, the largest effect first, as shares of the load and of the sensor's length."""
    budget = predicted.budget
    for term in budget.by_press() if budget else ():
        c = term.changes or Changes()
        shares = c.force_n / budget.force_n, c.position_m / (2 * budget.position_m)  # type: ignore[union-attr]
        force, place = (min(100.0, round(100 * share, 1)) for share in shares)
        if max(force, place) >= _SEEN or term.turns or term.at_rest():
            words = newtons(c.force_n) if force else "–", metres(c.position_m) if place else "–"
            yield Bar(term, words, (force, place))


@dataclass(frozen=True)
class MapSquare:
    """Column and row in the picture, grade from 0, and the value in words."""

    column: int
    row: int
    grade: int
    words: str


@dataclass(frozen=True)
class ErrorMapShown:
    """A map: what it shows, what counts as resolved, numbers of columns and rows, and its cells."""

    title: str
    required: str
    columns: int
    rows: int
    cells: tuple[MapSquare, ...]
    ends: tuple[str, str, str, str]  # of the position and of the force axis


def maps(known: Identifiability | None) -> tuple[ErrorMapShown, ...]:
    """Both maps; none where nothing is known."""
    if known is None or not known.map.force_n:
        return ()
    of, need = known.map, known.required
    force, length = max(abs(f) for f in of.force_n), max(of.position_m)
    return (
        _map(known, "force", of.sigma_force_n, need.sigma_force_n or 0.0, GUESS * force),
        _map(known, "position", of.sigma_position_m, need.sigma_position_m or 0.0, GUESS * length),
    )


def _map(known: Identifiability, quantity: str, sigma: Rows, need: float, useless: float) -> ErrorMapShown:
    of, words = known.map, newtons if quantity == "force" else metres
    cells = []
    for r, (force, row) in enumerate(zip(of.force_n, sigma, strict=True)):
        for c, (place, value) in enumerate(zip(of.position_m, row, strict=True)):
            if not force:
                continue
            grade = 3 if value is None else 0 if value <= need else 1 if value < useless else 2
            shown = "undefined" if value is None else words(value) if grade < 2 else "no information"
            cells.append(MapSquare(c, len(of.force_n) - 1 - r, grade, f"{force:g} N at {place * 1e3:.3g} mm: {shown}"))
    ends = (f"{min(of.position_m) * 1e3:g}", f"{max(of.position_m) * 1e3:g} mm", f"{min(of.force_n):g}",
            f"{max(of.force_n):g} N")  # fmt: skip
    rows = len(of.force_n) - (0.0 in of.force_n)
    return ErrorMapShown(
        f"error of {quantity}", f"{words(need)} or better", len(of.position_m), rows, tuple(cells), ends
    )
