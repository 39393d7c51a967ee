"""The variants of an iteration: drawings, bodies, and whether each can sense force and position."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import nan
from typing import Annotated

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, SKY, Axis, BodyTriangles, Curve, Figure, Panel
from sensorgen.analysis.plots.pages import Drawing
from sensorgen.checks.review import draw
from sensorgen.core.document import Column, Table
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.prediction.identifiability.results import Identifiability, StandardErrors
from sensorgen.prediction.query import FORCE_N
from sensorgen.prediction.slices import reviewed
from sensorgen.scene.geometry.meshes import mesh

_STRETCH = (1.0, 1.0, 10.0)


@dataclass(frozen=True)
class IdentifiabilityRow:
    """Least standard errors of force and position of a design, and the verdict."""

    design: Annotated[str, Column("design")]
    force_n: Annotated[float, Column("error of force, perfect model", "N")]
    position_mm: Annotated[float, Column("error of position, perfect model", "mm")]
    correlation: Annotated[float, Column("correlation")]
    bench_n: Annotated[float, Column("error of force, after 30 known presses", "N")]
    bench_mm: Annotated[float, Column("error of position, after 30 known presses", "mm")]
    verdict: Annotated[str, Column("verdict")]


def drawings(comparison: Comparison) -> tuple[Drawing, ...]:
    """Every variant of which a specimen was printed, with its prediction in words."""
    sheets = []
    for name, body in comparison.bodies.items():
        of, design = comparison.predictions[name], body.design
        r, c = of.ry_ohm, of.prediction.capacitance
        words = (
            f"electrode resistance {r.words() if r else 'unknown'}",
            f"capacitance {c.words()}" if c else f"no capacitance: {of.reason}",
            of.provenance,
        )
        sheets.append(Drawing(name, design.id(), draw(design, reviewed(design)), "; ".join(words)))
    return tuple(sheets)


def identifiability(comparison: Comparison) -> tuple[Table, ...]:
    """A row for each variant with a prediction."""
    rows = []
    for name, of in comparison.predictions.items():
        card = of.prediction.identifiability
        force, place, together = _known(card)
        bench_force, bench_place, _ = _known(card and card.calibrated)
        verdict = card.verdict if card else of.reason or "no prediction"
        rows.append(IdentifiabilityRow(name, force, place, together, bench_force, bench_place, verdict))
    caption = f"Standard errors of {FORCE_N:g} N in the middle, predicted, by seven frequencies (Cramér-Rao)"
    return (Table.of("identifiability", caption, rows),) if rows else ()


def _known(of: StandardErrors | None) -> tuple[float, float, float]:
    """Standard errors of force [N] and position [mm], and their correlation; nan where unknown."""
    values = (of.sigma_force_n, of.sigma_position_m, of.correlation) if of else (None, None, None)
    force, place, together = (nan if value is None else value for value in values)
    return force, place / M_PER_MM, together


def figures(comparison: Comparison) -> Iterator[Figure]:
    """Standard errors over position for three forces, and the bodies; of every variant, one at a time."""
    cards = {name: of.prediction.identifiability for name, of in comparison.predictions.items()}
    known = {name: errors(card) for name, card in cards.items() if card}
    if known:
        yield Figure(
            "identifiability-map", "Predicted standard errors of force and position",
            "Least standard error (Cramér-Rao) of force above, of position below, over the position of the load, for "
            "the frequencies and noise of the prediction. Dashed: required. Gaps: undefined.", known, "variant",
        )  # fmt: skip
    if comparison.bodies:
        axes = Axis("x [mm]"), Axis("y [mm]"), Axis("z [mm]")
        yield Figure(
            "bodies", f"Bodies, height x {_STRETCH[2]:g}",
            "The bodies of the chosen variant, to be turned with the mouse, their height enlarged. The drawings show "
            "them in section.",
            {name: (Panel(tuple(_bodies(body.design)), *axes),) for name, body in comparison.bodies.items()}, "variant",
            stretch=_STRETCH,
        )  # fmt: skip


def errors(card: Identifiability) -> tuple[Panel, Panel]:
    """Standard errors over position [mm], for a weak, a middling and the greatest force."""
    over, required = card.map, card.required
    place, panels = [x / M_PER_MM for x in over.position_m], []
    for quantity, unit, sigma, needed, per in (
        ("force", "N", over.sigma_force_n, required.sigma_force_n, 1.0),
        ("position", "mm", over.sigma_position_m, required.sigma_position_m, M_PER_MM),
    ):
        curves = [
            Curve("line", f"{over.force_n[k]:g} N", place, [nan if v is None else v / per for v in sigma[k]],
                  colour=colour)
            for k, colour in zip((1, len(sigma) // 2, len(sigma) - 1), (SKY, BLUE, ORANGE), strict=True)
        ]  # fmt: skip
        need = [nan if needed is None else needed / per] * 2
        curves.append(Curve("line", "required", [place[0], place[-1]], need, colour=GREY, dash="dash"))
        y = Axis(f"error of {quantity} [{unit}]", log=True)
        panels.append(Panel(tuple(curves), Axis("position of the tip's centre [mm]"), y))
    return panels[0], panels[1]


def _bodies(design: Design) -> Iterator[BodyTriangles]:
    """The bodies of the sensor in use, as triangles."""
    for body in design.in_use.bodies:
        body_mesh = mesh(body)
        name, colour = body.name.replace("_", " "), design.material(body.material).colour
        yield BodyTriangles(name, body_mesh.vertices_mm, body_mesh.triangles, colour)
