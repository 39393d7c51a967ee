"""From a target's file to its answer: table, page, and the files of the designs to print."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, PINK, Axis, Curve, Figure, Panel
from sensorgen.core import document
from sensorgen.core import files as store
from sensorgen.core.bounds import Bounds
from sensorgen.core.errors import within
from sensorgen.workflows.optimise.front import HERE, Progress, Workers, search
from sensorgen.workflows.optimise.recommend import recommended
from sensorgen.workflows.optimise.result import Chosen, Optimised, Recommended, result
from sensorgen.workflows.optimise.sample import sample
from sensorgen.workflows.optimise.space import Space, candidates, space
from sensorgen.workflows.optimise.target import NUMBERS, load


def optimise(
    word: str | Path, out: Path, workers: Workers = HERE, *, count: int = 0, keep: bool = True, built: bool = True,
    sliced: bool = True, tip: Mapping[str, Any] | None = None, progress: Progress = lambda *_: None,
) -> Optimised:  # fmt: skip
    """The best printable designs for a target; page, JSON and CSV are written into ``out``.

    Parameters
    ----------
    word : str or Path
        The target, as of :func:`sensorgen.workflows.optimise.target.load`.
    out : Path
        Folder of all files.
    count : int
        Designs to try, chosen by :func:`sensorgen.workflows.optimise.sample.sample`; 0 for all of the space.
    workers, keep, progress
        As of :func:`sensorgen.workflows.optimise.front.search`.
    built, sliced : bool
        Build the recommended designs, and slice them.
    tip : mapping, optional
        Keys of the tip, in place of the design's.

    Raises
    ------
    SensorgenError
        A target that is none, or an empty or too large space; a cluster that goes away.
    """
    path = Path(word)
    target, name = load(word, tip), path.stem
    chosen: tuple[Recommended, ...] = ()
    with within(str(path)):
        designs = space(target, path.parent) if count else candidates(target, path.parent)
    with workers.opened() as opened:
        if isinstance(designs, Space):
            found = sample(target, designs, count, opened, keep=keep, progress=progress)
        else:
            found = search(target, designs, opened, keep=keep, progress=progress)
        if built and found.front:
            chosen = recommended(
                name, found, out, opened, keep=keep, sliced=sliced, step=lambda role: progress(role, 0, 1)
            )  # fmt: skip
    answer = result(name, found, chosen)
    store.replace(out / f"{name}.html", page(answer).encode())
    store.replace(out / f"{name}.json", document.to_json(answer).encode())
    store.replace(out / f"{name}.csv", "".join(answer.csv()).encode())
    return answer


def page(result: Optimised) -> str:
    """A self-contained page; raises MissingValue where Plotly is not installed."""
    names = list(dict.fromkeys([*result.objectives, *(n for c in result.front for n in c.numbers)]))
    across, up = names[0], names[min(1, len(names) - 1)]
    curves = tuple(
        _points(name, colour, shown, across, up)
        for name, (colour, some) in _groups(result).items() if (shown := _known(some, across, up))
    )  # fmt: skip
    x, y = (NUMBERS[key].words for key in (across, up))
    axes = [Axis(f"{NUMBERS[key].words} [{NUMBERS[key].unit}]", log=True) for key in (across, up)]
    alt = f"Evaluated designs by {x} and {y}, with what the models leave open of {x}."
    figures = (
        (Figure("front", f"{x.capitalize()} and {y} as printed", alt, {"": (Panel(curves, axes[0], axes[1]),)}),)
        if curves
        else ()
    )
    blind = sum(not (c.senses(across) and c.senses(up)) for c in result.designs)
    words = [f"{blind} designs that cannot sense force or cannot locate are in the table alone"] * (blind > 0)
    section = pages.PageSection("", "", figures, tuple(result.document()))
    return pages.page(f"Best designs: {result.name}", words, [section])


def _groups(result: Optimised) -> dict[str, tuple[str, list[Chosen]]]:
    """Colour and designs of each group, by its name."""
    front = {c.number for c in result.front}
    others = [c for c in result.designs if c.numbers and (c.violated or c.number not in front)]
    return {
        "no best values are better": (BLUE, [c for c in result.front if c.leads]),
        "perhaps as good, by its range": (ORANGE, [c for c in result.front if not c.leads]),
        "evaluated": (GREY, [c for c in others if not c.violated]),
        "violates a constraint": (PINK, [c for c in others if c.violated]),
    }


def _known(some: list[Chosen], *keys: str) -> list[Chosen]:
    """Designs with a number for both axes: one that cannot locate has none."""
    return [c for c in some if all(k in c.numbers and c.numbers[k].value > 0 and c.senses(k) for k in keys)]


def _points(name: str, colour: str, shown: list[Chosen], across: str, up: str) -> Curve:
    x: list[Bounds] = [c.numbers[across] for c in shown]
    return Curve(
        "points", name, [b.value for b in x], [c.numbers[up].value for c in shown], low=[b.model.lower for b in x],
        high=[b.model.upper for b in x], colour=colour,
        text=[f"{c.number}: " + ", ".join(f"{k} {v}" for k, v in c.values.items()) for c in shown],
    )  # fmt: skip
