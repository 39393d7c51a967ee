"""The variants of an iteration: drawings and bodies."""

from collections.abc import Iterator
from dataclasses import dataclass

from sensorgen.analysis.comparison import Comparison, Predicted
from sensorgen.analysis.report.charts import Body
from sensorgen.checks.review import draw, review
from sensorgen.design import materials
from sensorgen.design.design import Design
from sensorgen.scene.geometry.meshes import mesh


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
        What it is and should measure.
    """

    design: str
    design_id: str
    svg: str
    words: str


def variants(found: Comparison) -> tuple[Variant, ...]:
    """Every variant that a specimen was printed of."""
    return tuple(
        Variant(name, design.id(), draw(design, review(design)), _words(found.predictions[name]))
        for name, design in found.designs.items()
    )


def _words(of: Predicted) -> str:
    r, c = of.ry_ohm, of.capacitance_f
    parts = [
        f"R_Y {r.lower:.4g} to {r.upper:.4g} ohm" if r else "R_Y unknown",
        f"C {c.lower * 1e12:.4g} to {c.upper * 1e12:.4g} pF" if c else f"no capacitance: {of.reason}",
        of.provenance,
    ]
    return "; ".join(parts)


def bodies(design: Design) -> Iterator[Body]:
    """The bodies of the sensor in use, as triangles."""
    for body in design.in_use.bodies:
        made = mesh(body)
        yield Body(body.name.replace("_", " "), made.vertices_mm, made.triangles, materials.load(body.material).colour)
