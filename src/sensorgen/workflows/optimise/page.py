"""The front as one page: every evaluated design in the plane of the first two objectives, and the tables."""

from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, Axis, Curve, Figure, Panel
from sensorgen.core.bounds import Bounds
from sensorgen.workflows.optimise.result import Chosen, Optimised
from sensorgen.workflows.optimise.target import NUMBERS


def page(found: Optimised) -> str:
    """A self-contained page; raises MissingValue where Plotly is not installed."""
    names = [*found.objectives, *({n: 0 for c in found.front for n in c.numbers})]
    across, up = list(dict.fromkeys(names))[:2] if len(set(names)) > 1 else (names[0], names[0])
    front = {c.number for c in found.front}
    groups = (
        ("leads", BLUE, [c for c in found.front if c.leads]),
        ("on the front by its interval", ORANGE, [c for c in found.front if not c.leads]),
        ("evaluated", GREY, [c for c in found.designs if c.numbers and c.number not in front and not c.violated]),
        ("violates a constraint", "#cc79a7", [c for c in found.designs if c.numbers and c.violated]),
    )
    blind = sum(not all(c.senses(k) for k in (across, up)) for c in found.designs)
    curves = tuple(_points(name, colour, some, across, up) for name, colour, some in groups if _known(some, across, up))
    x, y = (NUMBERS[key].words for key in (across, up))
    panel = Panel(curves, *(Axis(f"{NUMBERS[key].words} [{NUMBERS[key].unit}]", log=True) for key in (across, up)))
    alt = f"Evaluated designs by {x} and {y}, with what the models leave open of {x}."
    figures = (Figure("front", f"{x.capitalize()} and {y} as printed", alt, {"": (panel,)}),) if curves else ()
    words = [f"{blind} designs that cannot sense force or cannot locate are in the table alone"] * (blind > 0)
    section = pages.Section("", "", figures, tuple(found.document()))
    return pages.page(f"Best designs: {found.name}", words, [section])


def _known(some: list[Chosen], *keys: str) -> list[Chosen]:
    """Designs with a number for both axes: one that cannot locate has none."""
    return [c for c in some if all(k in c.numbers and c.numbers[k].value > 0 and c.senses(k) for k in keys)]


def _points(name: str, colour: str, some: list[Chosen], across: str, up: str) -> Curve:
    shown = _known(some, across, up)
    x: list[Bounds] = [c.numbers[across] for c in shown]
    return Curve(
        "points", name, [b.value for b in x], [c.numbers[up].value for c in shown], low=[b.model.lower for b in x],
        high=[b.model.upper for b in x], colour=colour,
        text=[f"{c.number}: " + ", ".join(f"{k} {v}" for k, v in c.values.items()) for c in shown],
    )  # fmt: skip
