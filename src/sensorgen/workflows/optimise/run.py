"""From a target's file to its answer: table, page, and the files of the designs to print."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from itertools import product
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, PINK, Axis, Curve, Figure, Panel
from sensorgen.core import display, document
from sensorgen.core import files as store
from sensorgen.core.bounds import Bounds
from sensorgen.core.errors import SensorgenError, Unprintable, within
from sensorgen.core.parallel import in_parallel
from sensorgen.design.design import Design, make
from sensorgen.design.tip import EVEN, TOPS
from sensorgen.design.walls import rules
from sensorgen.prediction.mesh_ladder import ROUGH
from sensorgen.workflows.build import build
from sensorgen.workflows.moves import Candidate, EarlyNumber
from sensorgen.workflows.optimise import ladder
from sensorgen.workflows.optimise.front import HERE, Front, Progress, Workers, sample, search, settled, value_of, worth
from sensorgen.workflows.optimise.result import Chosen, ObjectiveSpread, Optimised, Recommended, chosen, leads, result
from sensorgen.workflows.optimise.target import NUMBERS, Space, Target, candidates, grid_mm, load, space
from sensorgen.workflows.slice import slice_design
from sensorgen.workflows.trial import trial


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
        Designs to try, chosen by :func:`sensorgen.workflows.optimise.front.sample`; 0 for all of the space.
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
    recommendations: tuple[Recommended, ...] = ()
    with within(str(path)):
        designs = space(target, path.parent) if count else candidates(target, path.parent)
    with workers.opened() as opened:
        if isinstance(designs, Space):
            found = sample(target, designs, count, opened, keep=keep, progress=progress)
        else:
            found = search(target, designs, opened, keep=keep, progress=progress)
        if built and found.front:
            recommendations = recommended(
                name, found, out, opened, keep=keep, sliced=sliced, step=lambda role: progress(role, 0, 1)
            )  # fmt: skip
    answer = result(name, found, recommendations)
    store.replace(out / f"{name}.html", page(answer).encode())
    store.replace(out / f"{name}.json", document.to_json(answer).encode())
    store.replace(out / f"{name}.csv", "".join(answer.csv()).encode())
    return answer


def _axes(result: Optimised) -> tuple[str, str]:
    """Names of the two numbers."""
    names = list(dict.fromkeys([*result.objectives, *(n for c in result.front for n in c.numbers)]))
    return names[0], names[min(1, len(names) - 1)]


def _front(result: Optimised) -> tuple[Figure, ...]:
    """Evaluated designs by two numbers, the objectives where there are two; nothing where none has both."""
    across, up = _axes(result)
    curves = tuple(
        _points(name, _COLOURS[name], shown, across, up)
        for name, some in _groups(result).items() if (shown := _known(some, across, up))
    )  # fmt: skip
    x, y = (NUMBERS[key].words for key in (across, up))
    axes = [Axis(f"{NUMBERS[key].words} [{NUMBERS[key].unit}]", log=True) for key in (across, up)]
    alt = f"Evaluated designs by {x} and {y}, with what the models leave open of {x}."
    title = f"{x.capitalize()} and {y} as printed"
    return (Figure("front", title, alt, {"": (Panel(curves, axes[0], axes[1]),)}),) if curves else ()


@display.figure.register(Optimised)
def _(of: Optimised) -> Any:
    from sensorgen.analysis.plots import static

    return static.first(of, _front(of))


def page(result: Optimised) -> str:
    """A self-contained page; raises MissingValue where Plotly is not installed."""
    blind = sum(not all(map(c.senses, _axes(result))) for c in result.designs)
    words = [f"{blind} designs that cannot sense force or cannot locate are in the table alone"] * (blind > 0)
    section = pages.PageSection("", "", _front(result), tuple(result.document()))
    return pages.page(f"Best designs: {result.name}", words, [section])


_COLOURS = {
    "no best values are better": BLUE,
    "perhaps as good, by its range": ORANGE,
    "evaluated": GREY,
    "violates a constraint": PINK,
}  # of groups of designs


def _groups(result: Optimised) -> dict[str, list[Chosen]]:
    """Designs of each group, by its name: those of the front first, then all others with numbers."""
    front = {one.number for one in result.front}
    groups: dict[str, list[Chosen]] = {name: [] for name in _COLOURS}
    for one in result.front:
        groups["no best values are better" if one.leads else "perhaps as good, by its range"].append(one)
    for one in result.designs:
        if one.numbers and one.number not in front:
            groups["violates a constraint" if one.violated else "evaluated"].append(one)
    return groups


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


Step = Callable[[str], None]


def recommended(
    name: str, found: Front, out: Path, workers: Workers = HERE, *, keep: bool = True, sliced: bool = True,
    step: Step = lambda _: None,
) -> tuple[Recommended, ...]:  # fmt: skip
    """Write the files of the designs to print into ``out``.

    Parameters
    ----------
    name : str
        Of the target; the designs' names begin with it.
    found : Searched
        The search.
    out : Path
        Folder for the designs' folders.
    workers, keep
        As of :func:`sensorgen.workflows.optimise.front.search`.
    sliced : bool
        Slice each with PrusaSlicer, where it is installed.
    step : callable
        Called with the next step.
    """
    target, rows = found.target, leads(found)
    best = {
        f"best {key.rpartition('_')[0]}": (min(rows, key=partial(worth, target, key)), key)
        for key in list(target.objectives)[:2]
    }
    made: dict[int, tuple[Candidate, Recommended]] = {}
    for role, (row, key) in (best | {"balanced": (rows[0], "")}).items():
        row, others = settled(found, row, key)
        if row.number in made:
            before = made[row.number][1]
            ties = tuple(dict.fromkeys((*before.ties, *(other.number for other in others))))
            made[row.number] = row, replace(before, role=f"{before.role}, {role}", ties=ties)
            continue
        name_ = f"{name}-{role.replace('best ', '').replace('_', '-')}"
        one = Recommended(role, replace(chosen(target, row, leads=True), name=name_))
        made[row.number] = row, replace(one, ties=tuple(other.number for other in others))
    with workers.opened() as opened:
        step("tolerances")
        robust = _robust(target, [row for row, _ in made.values()], opened, keep=keep)
        works = [(replace(one, robust=robust[n]), target, row.design, out, sliced) for n, (row, one) in made.items()]
        step("files")
        lanes = () if opened.cluster else opened.lanes  # files are written by this computer
        written = dict(in_parallel(_built, works, opened.jobs, lanes=lanes,
                                   lost=lambda k, reason: replace(works[k][0], slicer=reason)))  # fmt: skip
    return tuple(written[k] for k in range(len(works)))


def _robust(
    target: Target, rows: Sequence[Candidate], workers: Workers, *, keep: bool
) -> dict[int, dict[str, ObjectiveSpread]]:
    """Of designs by number: objectives on the coarse mesh, over walls of slicers and lengths in the plane.

    Under the top that is the worst of the design itself: another one seldom overtakes it, and takes as long.
    """
    keys = [key for key in target.objectives if key in ladder.COARSE]
    works = [(row.number, work) for row in rows for work in _variants(target, row.design, keys)]
    numbers: dict[int, list[dict[str, EarlyNumber]]] = {row.number: [] for row in rows}
    answers = workers.results(ladder.known, [work for _, work in works], "lost", keep=keep)
    for k, one in sorted(answers):  # first of its own walls
        numbers[works[k][0]].append({} if isinstance(one, str) else one)
    return {row.number: dict(_spreads(target, keys, row, numbers[row.number])) for row in rows}


def _variants(target: Target, design: Design, keys: Sequence[str]) -> Iterator[tuple[Any, ...]]:
    """Arguments of :func:`.ladder.known` for the design by its own walls, by others, and with other lengths."""
    pressed = [key for key in keys if key not in ladder.AT_REST]
    top = max(TOPS, key=partial(_under, target, design, pressed[0])) if pressed else EVEN
    by_others = ((one, rules(None)[0]) for one in within_tolerance(target, design))
    for one, rule in ((design, ""), *((design, rule) for rule in rules(None)), *by_others):
        yield one, target.query(), bool(pressed), rule, (top,), ROUGH


def _under(target: Target, design: Design, key: str, top: str) -> float:
    """An objective under a top, the lower the better, as solved for the search already."""
    numbers = ladder.known(design, target.query(), True, tops=(top,))
    return target.worth(key, numbers[key].lower) if key in numbers else -inf


_OUTLINE = ("length_mm", "width_mm")  # which lines too wide or too narrow change together


def within_tolerance(target: Target, design: Design) -> Iterator[Design]:
    """The design with its outline, and with each other varied length in the plane, changed by the tolerance."""
    data, own = design.model_dump(mode="json", exclude_unset=True, exclude={"name"}), asdict(design.params)
    varied = sorted(own.keys() & target.parameters.keys() - set(_OUTLINE))
    flat = [(n,) for n in varied if n.endswith("_mm") and grid_mm(design, n) != design.layers.layer_mm]
    for names, sign in product((_OUTLINE, *flat) if target.tolerance_mm else (), (-1, 1)):
        changes = {name: own[name] + sign * target.tolerance_mm for name in names if name in own}
        with suppress(SensorgenError):  # no such design
            yield make(data | {"parameters": data.get("parameters", {}) | changes})


def _spreads(
    target: Target, keys: Sequence[str], row: Candidate, numbers: Sequence[dict[str, EarlyNumber]]
) -> Iterator[tuple[str, ObjectiveSpread]]:
    """The value of each objective, changed by the factor that the coarse mesh has from the first of ``numbers`` on."""
    for key in keys:
        own = value_of(key, row)
        values = [(one[key].lower + one[key].upper) / 2 for one in numbers if key in one]
        if own and key in numbers[0]:
            varied = [own.value * value / values[0] for value in values]
            ends = max((own.lower, own.upper), key=partial(target.worth, key))
            yield (
                key,
                ObjectiveSpread(
                    own.value, median(varied[1:] or varied), max(varied, key=partial(target.worth, key)), ends
                ),
            )


def _built(one: Recommended, target: Target, design: Design, out: Path, sliced: bool) -> Recommended:
    """With its files, and its numbers by a real slicer, whose file decides the build, too."""
    design = make(design.model_dump(mode="json", exclude_defaults=True) | {"name": one.design.name})
    one, folder = _with_gcode(one, design, out) if sliced else one, out / design.name
    try:
        built = build(design, out, cad=False)
    except Unprintable as error:
        return replace(one, verdict="CHANGE", slicer=str(error), sliced=None)
    import yaml

    data = design.model_dump(mode="json", exclude_defaults=True)
    store.replace(out / f"{design.name}.yaml", str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True)).encode())
    one = replace(one, folder=str(folder), verdict=built.verdict)
    if one.sliced is None:
        return one
    try:
        tried = trial(design, target.query(), folder=folder, drawn=False)
    except SensorgenError as error:
        return replace(one, slicer=str(error), sliced=None)
    values = {key: NUMBERS[key].of_print(tried) for key in target.objectives}
    return replace(one, sliced={key: value for key, value in values.items() if value and key in one.design.numbers})


def _with_gcode(one: Recommended, design: Design, out: Path) -> Recommended:
    """With a file of PrusaSlicer and no numbers yet; or why there is none, unless the build says that."""
    try:
        slicer = slice_design(design, out, "prusa").slicer
    except Unprintable:
        return one
    except SensorgenError as error:
        return replace(one, slicer=str(error))
    return replace(one, sliced={}, slicer=f"PrusaSlicer {slicer.version}")
