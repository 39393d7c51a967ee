"""Tables and figures of results, as a notebook shows them."""

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from sensorgen.checks.review import Review
from sensorgen.core import display
from sensorgen.core.bounds import Bounds
from sensorgen.design.design import Design
from sensorgen.prediction.results import Prediction

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "") -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(row(cells, "td") for cells in rows)
    return f"<table><caption>{escape(caption)}</caption>{row(head, 'th')}{body}</table>"


def _bounds(bounds: Bounds | None) -> str:
    return "-" if bounds is None else f"{bounds.value:.4g} {bounds.unit} ({bounds.lower:.3g} to {bounds.upper:.3g})"


@display.html.register(Prediction)
def _(found: Prediction) -> str:
    columns = [found.drawn, found] if found.drawn else [found]
    quantities = {
        "electrode gap": [p.gap for p in columns],
        "capacitance": [p.capacitance for p in columns],
        **{f"{end} electrode": [p.resistance.get(end) for p in columns] for end in found.resistance},
        "sensitivity": [p.sensitivity for p in columns],
    }
    rows = [[name, *map(_bounds, values)] for name, values in quantities.items()]
    return _table(["", *(p.body for p in columns)], rows, f"{found.design}: {found.reason or found.status}")


@display.html.register(Review)
def _(found: Review) -> str:
    rows = [(f.severity, f.rule, f.body, str(f.count), f.message, f.advice) for f in found.findings]
    return _table(("severity", "rule", "body", "places", "finding", "advice"), rows)


@display.html.register(Design)
def _(design: Design) -> str:
    from sensorgen.checks.review import draw, review

    return draw(design, review(design))


@display.figure.register(Prediction)
def _(found: Prediction) -> "Figure":
    """Relative range of each quantity: model, print and material."""
    from matplotlib.figure import Figure

    quantities = {"capacitance": found.capacitance, **{f"{e} electrode": r for e, r in found.resistance.items()}}
    shown = {name: b for name, b in quantities.items() if b and b.value}
    made = Figure(figsize=(7, 0.7 * len(shown) + 1.2), layout="constrained")
    axes = made.subplots()
    for k, bounds in enumerate(shown.values()):
        for shift, (kind, part) in enumerate(
            {"model": bounds.model, "print": bounds.print, "material": bounds.material}.items()
        ):
            ends = [part.lower / bounds.value, part.upper / bounds.value]
            axes.plot(ends, [k + 0.2 * (shift - 1)] * 2, "|-", color=f"C{shift}", label=kind if k == 0 else "")
    axes.set_yticks(range(len(shown)), list(shown))
    axes.set_xscale("log")
    axes.set_xlabel("relative to the best value")
    axes.legend()
    axes.set_title(f"{found.design}, {found.body}")
    return made
