"""One page that shows a design: bodies in 3D, section and layers as printed, numbers, identifiability and findings."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from sensorgen.analysis.plots import pages
from sensorgen.analysis.preview import geometry, shades
from sensorgen.asprinted.printed import Printed
from sensorgen.checks.review import Review, draw
from sensorgen.core.document import Part
from sensorgen.core.findings import SEVERITIES, Finding, headline
from sensorgen.prediction.identifiability.results import metres, newtons
from sensorgen.prediction.results import Changes, Prediction, Term
from sensorgen.scene.scene import SLIVER_MM

_SEEN = 1.0  # per cent: shorter bars are left out


@dataclass(frozen=True)
class BodyShown:
    """A body in the legend: its role, material and tool, and its colours on a light and on a dark ground."""

    name: str
    material: str
    tool: int
    light: str
    dark: str


@dataclass(frozen=True)
class Listed:
    """A finding in the list, and the layer at which it shows, counted from 0."""

    finding: Finding
    layer: int | None


def page(
    printed: Printed, held: Review, predicted: Prediction, numbers: Iterable[Part],
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
    shown = tuple(_bodies(printed))
    listed = [_placed(f, printed) for f in held.findings]
    names = [body.name for body in scene.bodies]
    data = geometry.block(
        {
            "size": scene.size_mm,
            "layers": list(_layers(printed, names, listed)),
            "first": next((at.layer for at in listed if at.layer is not None), 0),
        },
        {"drawn": scene, "printed": printed.scene},
        names,
    )
    sheet = draw(design, held, printed.scene, printed.provenance)
    return pages.render(
        "sensorgen.analysis.preview", "preview.html", headline=headline(design.name, held.findings, held.source),
        title=design.name, verdict=held.verdict, bodies=shown,
        provenance=printed.provenance, printer=f"{design.machine.name}, {design.layers.name}",
        size=" × ".join(f"{side:g}" for side in scene.size_mm), layers=len(printed.first),
        sections=geometry.figures(scene, printed.scene, names, design.layers.boundaries_mm(scene.size_mm[2])),
        sheet=sheet, data=pages.packed(data),
        numbers=[*numbers], advice=[*advice], listed=listed, severities=SEVERITIES,
        known=predicted.identifiability, maps=shades.maps(predicted.identifiability),
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
        if max(force, place) >= _SEEN:
            yield Bar(term, (newtons(c.force_n), metres(c.position_m)), (force, place))


def _bodies(printed: Printed) -> Iterator[BodyShown]:
    """The bodies from the bed upwards, each in a shade of its material's colour."""
    before: list[str] = []
    for body in printed.design.printed.bodies:
        material = printed.design.material(body.material)
        light, dark = shades.shades(material.colour, before.count(body.material))
        before.append(body.material)
        yield BodyShown(
            body.name.replace("_", " "), material.title, printed.design.tool(body.material), light, dark
        )  # fmt: skip


def _placed(finding: Finding, printed: Printed) -> Listed:
    tops = [layer.top_mm for layer in printed.first]
    if not finding.place_mm or not tops:
        return Listed(finding, None)
    number = finding.layer - 1 if finding.layer else bisect_right(tops, finding.place_mm[2] + SLIVER_MM)
    return Listed(finding, min(number, len(tops) - 1))


def _layers(printed: Printed, names: Sequence[str], listed: Sequence[Listed]) -> Iterator[dict[str, object]]:
    """Of each layer its heights [mm], the SVG path of each body, and the findings with their places [mm]."""
    width = printed.design.printed.size_mm[1]
    for k, layer in enumerate(printed.first):
        marks = [
            [*at.finding.place_mm[:2], f"{at.finding.severity}: {at.finding.message}"]
            for at in listed if at.layer == k and at.finding.place_mm
        ]  # fmt: skip
        paths = {names.index(name): pages.path(region, width) for name, region in layer.regions.items()}
        yield {"z": [round(layer.bottom_mm, 6), round(layer.top_mm, 6)], "paths": paths, "marks": marks}
