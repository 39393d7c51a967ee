"""The designs to print: the best of the first two objectives and the best compromise, built, checked and sliced."""

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from sensorgen.core import files as store
from sensorgen.core.bounds import Bounds
from sensorgen.core.errors import SensorgenError, Unprintable
from sensorgen.core.parallel import remembered, said
from sensorgen.design.body import Body
from sensorgen.design.design import Design, make
from sensorgen.design.walls import rules
from sensorgen.export.slicers import PROGRAMS
from sensorgen.export.slicers.run import find
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.query import Query
from sensorgen.workflows.build import build
from sensorgen.workflows.optimise.result import Recommended, Spread, chosen, leads
from sensorgen.workflows.optimise.search import HERE, Row, Searched, Workers
from sensorgen.workflows.optimise.space import grid_mm
from sensorgen.workflows.optimise.target import NUMBERS, Target
from sensorgen.workflows.slice import slice_design
from sensorgen.workflows.trial import Numbers, trial

Step = Callable[[str], None]


def recommended(
    name: str, found: Searched, out: Path, workers: Workers = HERE, *, keep: bool = True, sliced: bool = True,
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
        As of :func:`sensorgen.workflows.optimise.search.search`.
    sliced : bool
        Slice each with PrusaSlicer, where it is installed.
    step : callable
        Called with the next step.
    """
    made: dict[int, Recommended] = {}
    rows = leads(found)
    worth = {row.number: _worth(found.target, row) for row in rows}
    keys = list(found.target.objectives)
    roles = {
        f"best {key.rpartition('_')[0]}": next(r for r in rows if worth[r.number][key] == least)
        for key, least in ((key, min(each[key] for each in worth.values())) for key in keys[:2])
    }
    roles["balanced"] = rows[0]
    for role, row in roles.items():
        if row.number in made:
            made[row.number] = replace(made[row.number], role=f"{made[row.number].role}, {role}")
            continue
        step(role)
        design = _named(row.design, f"{name}-{role.replace('best ', '').replace('_', '-')}")
        one = Recommended(role, replace(chosen(found.target, row, leads=True), name=design.name))
        one = replace(one, robust=_robust(found.target, row, workers, keep=keep))
        made[row.number] = _built(one, found.target, design, out, sliced=sliced)
    return tuple(made.values())


def _worth(target: Target, row: Row) -> dict[str, float]:
    trial_ = row.trial
    numbers = {k: NUMBERS[k].of(trial_.printed, trial_.toolpath) for k in target.objectives} if trial_ else {}
    return {key: target.worth(key, b.value) for key, b in numbers.items() if b}


def _named(design: Design, name: str) -> Design:
    return make(design.model_dump(mode="json", exclude_defaults=True) | {"name": name})


def _robust(target: Target, row: Row, workers: Workers, *, keep: bool) -> dict[str, Spread]:
    """Objectives that an estimate has, over walls of slicers and lengths in the plane."""
    keys = [key for key in target.objectives if not NUMBERS[key].of_path]
    inputs: list[tuple[Any, ...]] = [(row.design, rule, target.query()) for rule in rules(None)]
    for name, value in asdict(row.design.params).items():
        if name.endswith("_mm") and name in target.parameters and target.tolerance_mm:
            if grid_mm(row.design, name) == row.design.layers.layer_mm:
                continue
            data = row.design.model_dump(mode="json", exclude_unset=True, exclude={"name"})
            for sign in (-1, 1):
                parameters = data.get("parameters", {}) | {name: value + sign * target.tolerance_mm}
                inputs.append((make(data | {"parameters": parameters}), rules(None)[0], target.query()))
    attempt = partial(said, one_way, refused=(SensorgenError,))
    found = [
        n
        for _, n in remembered(
            attempt, inputs, workers.jobs, cluster=workers.cluster, keep=keep, lost=lambda *_: "lost"
        )
    ]
    made = {}
    for key in keys:
        own = NUMBERS[key].of(row.trial.printed) if row.trial else None
        values = [b.value for n in found if isinstance(n, Numbers) and (b := NUMBERS[key].of(n))]
        if own and values:
            worst = max((*values, own.value), key=partial(target.worth, key))
            ends = max((own.lower, own.upper), key=partial(target.worth, key))
            made[key] = Spread(own.value, median(values), worst, ends)
    return made


def one_way(design: Design, rule: str, query: Query) -> Numbers:
    """Numbers of a design printed by one rule for walls."""
    body: Body = bodies.estimated(design, rule)
    return Numbers.of(evaluate(body, query, beside=False))


def _built(one: Recommended, target: Target, design: Design, out: Path, *, sliced: bool) -> Recommended:
    """With its files, and its numbers by a real slicer."""
    folder = out / design.name
    try:
        built = build(design, out, cad=False)
    except Unprintable as error:
        return replace(one, verdict="CHANGE", slicer=str(error))
    store.replace(out / f"{design.name}.yaml", _yaml(design))
    one = replace(one, folder=str(folder), verdict=built.verdict)
    try:
        find(*PROGRAMS["prusa"])
    except SensorgenError as error:
        return replace(one, slicer=str(error)) if sliced else one
    if not sliced:
        return one
    try:
        printed = slice_design(design, out, "prusa")
        tried = trial(design, target.query(), folder=folder, drawn=False)
    except SensorgenError as error:
        return replace(one, slicer=str(error))
    numbers: dict[str, Bounds] = {}
    for key in target.objectives:
        value = NUMBERS[key].of(tried.printed, tried.toolpath)
        if value and key in one.design.numbers:
            numbers[key] = value
    return replace(one, sliced=numbers, slicer=f"PrusaSlicer {printed.slicer.version}")


def _yaml(design: Design) -> bytes:
    import yaml

    data = design.model_dump(mode="json", exclude_defaults=True)
    return str(yaml.safe_dump(data, sort_keys=False, allow_unicode=True)).encode()
