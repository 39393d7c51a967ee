"""The variants of an iteration: drawings, bodies, and whether each can sense force and position."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import nan
from typing import Annotated, Any

from sensorgen.analysis.comparison import Comparison, Predicted
from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, SKY, Axis, Body, Curve, Figure, Panel
from sensorgen.analysis.report.tables import Column, Table
from sensorgen.checks.review import draw, review
from sensorgen.core.units import M_PER_MM
from sensorgen.design import materials
from sensorgen.design.design import Design
from sensorgen.prediction.identifiability import FORCE_N
from sensorgen.scene.geometry.meshes import mesh

_STRETCH = (1.0, 1.0, 10.0)
_F_PER_PF = 1e-12


@dataclass(frozen=True)
class Variant:
    """A variant on the page.

    Attributes
    ----------
    design, design_id : str
        Name and identity.
    svg : str
        Its drawing.
    words : str
        Its prediction.
    """

    design: str
    design_id: str
    svg: str
    words: str


@dataclass(frozen=True)
class IdentifiabilityRow:
    """Least standard errors of force and position of a design, and the verdict."""

    design: Annotated[str, Column("design")]
    force_n: Annotated[float, Column("standard error of force", "N")]
    position_mm: Annotated[float, Column("standard error of position", "mm")]
    correlation: Annotated[float, Column("correlation")]
    verdict: Annotated[str, Column("verdict")]


def variants(found: Comparison) -> tuple[Variant, ...]:
    """Every variant that a specimen was printed of."""
    return tuple(
        Variant(name, design.id(), draw(design, review(design)), _words(found.predictions[name]))
        for name, design in found.designs.items()
    )


def _words(of: Predicted) -> str:
    r, c = of.ry_ohm, of.capacitance_f
    parts = [
        f"electrode resistance {r.lower:.4g} to {r.upper:.4g} ohm" if r else "electrode resistance unknown",
        f"capacitance {c.lower / _F_PER_PF:.4g} to {c.upper / _F_PER_PF:.4g} pF"
        if c
        else f"no capacitance: {of.reason}",
        of.provenance,
    ]
    return "; ".join(parts)


def identifiability(found: Comparison) -> tuple[Table, ...]:
    """A row for each variant with a prediction."""
    rows = tuple(
        _row(name, of.prediction.identifiability or {"reason": of.reason}) for name, of in found.predictions.items()
    )
    caption = f"Predicted identifiability of {FORCE_N:g} N in the middle, by seven frequencies (Cramér-Rao)"
    return (Table("identifiability", caption, rows),) if rows else ()


def _row(name: str, card: Mapping[str, Any]) -> IdentifiabilityRow:
    force, place, together = (
        float(value) if isinstance(value := card.get(key), int | float) else nan
        for key in ("sigma_force_n", "sigma_position_m", "correlation")
    )
    verdict = card.get("verdict") or card.get("reason") or "no prediction"
    return IdentifiabilityRow(name, force, place / M_PER_MM, together, str(verdict))


def figures(found: Comparison) -> Iterator[Figure]:
    """Standard errors over position for three forces, and the bodies; of every variant, one at a time."""
    cards = {name: of.prediction.identifiability or {} for name, of in found.predictions.items()}
    known = {name: errors(card) for name, card in cards.items() if card.get("map")}
    if known:
        yield Figure(
            "identifiability-map", "Predicted standard errors of force and position",
            "Least standard error (Cramér-Rao) of force above, of position below, over the position of the load, for "
            "the frequencies and noise of the prediction. Dashed: required. Gaps: undefined.", known, "variant",
        )  # fmt: skip
    if found.designs:
        axes = Axis("x [mm]"), Axis("y [mm]"), Axis("z [mm]")
        yield Figure(
            "bodies", f"Bodies, height x {_STRETCH[2]:g}",
            "The bodies of the chosen variant, to be turned with the mouse, their height enlarged. The drawings show "
            "them in section.",
            {name: (Panel(tuple(_bodies(design)), *axes),) for name, design in found.designs.items()}, "variant",
            stretch=_STRETCH,
        )  # fmt: skip


def errors(card: Mapping[str, Any]) -> tuple[Panel, Panel]:
    """Standard errors of an identifiability card over position [mm], for a weak, a middling and the greatest force."""
    over, required = card["map"], card["required"]
    forces, place = over["force_n"], [x / M_PER_MM for x in over["position_m"]]
    panels = []
    for quantity, unit, key, per in (
        ("force", "N", "sigma_force_n", 1.0),
        ("position", "mm", "sigma_position_m", M_PER_MM),
    ):
        curves = [
            Curve("line", f"{forces[k]:g} N", place, [nan if v is None else v / per for v in over[key][k]],
                  colour=colour)
            for k, colour in zip((1, len(forces) // 2, len(forces) - 1), (SKY, BLUE, ORANGE), strict=True)
        ]  # fmt: skip
        need = [required[key] / per] * 2
        curves.append(Curve("line", "required", [place[0], place[-1]], need, colour=GREY, dash="dash"))
        y = Axis(f"error of {quantity} [{unit}]", log=True)
        panels.append(Panel(tuple(curves), Axis("position of the tip's centre [mm]"), y))
    return panels[0], panels[1]


def _bodies(design: Design) -> Iterator[Body]:
    """The bodies of the sensor in use, as triangles."""
    for body in design.in_use.bodies:
        made = mesh(body)
        yield Body(body.name.replace("_", " "), made.vertices_mm, made.triangles, materials.load(body.material).colour)
