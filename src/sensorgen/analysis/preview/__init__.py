"""One page that shows a design: bodies in 3D, section and layers as printed, numbers, identifiability and findings."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from markupsafe import Markup

from sensorgen.analysis.plots import layers, pages
from sensorgen.analysis.preview import geometry
from sensorgen.asprinted.printed import Printed
from sensorgen.checks.review import Review, draw
from sensorgen.core.document import Part
from sensorgen.core.findings import headline
from sensorgen.prediction.identifiability.results import GUESS, Identifiability, Rows, metres, newtons
from sensorgen.prediction.results import Changes, Prediction, Term

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
    data = geometry.block(header, {"drawn": scene, "printed": printed.scene}, names)
    sheet = draw(design, review, printed.scene, printed.provenance)
    return pages.render(
        "sensorgen.analysis.preview", "preview.html", headline=headline(design.name, review.findings, review.source),
        title=design.name, verdict=review.verdict, bodies=layers.bodies(design),
        provenance=printed.provenance, printer=f"{design.machine.name}, {design.layers.name}",
        size=" × ".join(f"{side:g}" for side in scene.size_mm), layers=len(printed.first),
        sections=geometry.figures(scene, printed.scene, names, design.layers.boundaries_mm(scene.size_mm[2])),
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
