"""``sensorgen predict``: what the bench should measure."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import WRONG_INPUT, body_options, options, render, settings, show, sweeps
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.options import option
from sensorgen.cli.words import Length, OneOf, Values, proper
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.loaded import Loaded
    from sensorgen.prediction.query import Query
    from sensorgen.prediction.results import Prediction

_WORK = ("cell, press, line",)

OWN: list[click.Parameter] = [
    option(
        "--force force_n", Values(units.FORCE_N, zero=True),
        "Forces as START:STOP:STEP, one, or a list [N]; 0:6:0.1 where only positions are given.",
    ),
    option(
        "--position position_mm", Values(units.LENGTH_MM, zero=True),
        "Positions of the tip's middle [mm]; the whole sensor in 100 steps where only forces are given.",
    ),
    options.frequencies(), options.of_design_tip(),
    option(
        "--tip-radius radius_mm", Length(),
        "Radius of a hard round tip across the sensor, with --profile hertz or parabola: its contact grows with "
        "the force up to the tip's length. All of the tip touches if not given.",
    ),
    options.compression(
        "symmetric", "infill", "free", "solved",
        about="How the cell deforms: as a plate, free or bonded, as infill of flat electrodes, or solved (needs "
        "NGSolve; seconds in a cross-section, up to minutes in 3D); if not given, solved in a "
        "cross-section.",
    ),
    options.sides(), options.noise(),
    option(
        "--profile", OneOf(("uniform", "hertz", "parabola")),
        "Pressure under the tip: of a flat one, of a round one on a thick body, of a round one on a thin film; the "
        "design's if not given.",
    ),
    options.accuracy(
        "Of |Z|: cell, compression and line by the least expensive models that together meet it. Exit code 1 where "
        "they do not."
    ),
    click.Option(["--details"], is_flag=True, help="Also print impedance, a perfect model's resolution, error budget."),
    options.explain(), *body_options.body_options(), *sweeps.options(),
    option("--plot", None, "Draw R, X, sensitivities and inverse maps there, as PNG and HTML.", metavar="DIR"),
    *render.options(csv="Print R and X as CSV, a row per force and position."),
]  # fmt: skip


def _work(
    design: "Design", *, frequency_hz: Sequence[float] | None, force_n: Sequence[float] | None,
    position_mm: Sequence[float] | None, radius_mm: float | None, compression: str | None, sides: str,
    profile: str | None, accuracy: float | None, noise: float, explain: bool, details: bool, plot: str | None,
    sweep: str | None, jobs: int | None, cluster: str,
) -> int:  # fmt: skip
    if plot:
        render.refuse_beside("--plot")
    options.refuse_explain(explain, many=bool(plot or sweep))
    proper("--noise", noise)
    if compression and sides != "bonded":
        raise BadInput("--compression and --sides at once; expected one of them")
    from sensorgen.prediction.query import DEFAULT, Query
    from sensorgen.prediction.results import Overview, Prediction

    tip = (design.crossing if design.layout else design).tip.tip()
    tip = replace(
        tip, profile=profile or tip.profile, radius_m=None if radius_mm is None else radius_mm * units.M_PER_MM
    )
    frequencies = tuple(frequency_hz or DEFAULT.frequency_hz)
    query = Query(frequencies, tip=tip, law=compression or sides * (sides != "bonded"), accuracy=accuracy, noise=noise)
    if sweep:
        return _sweep(design, sweep, query, sweeps.at_once(jobs), cluster, alone=not (force_n or position_mm or plot))
    with show.progress(_WORK) as step:
        step(_WORK[0])
        found = _asked(design, query, force_n or (), position_mm or (), everywhere=bool(plot))
    prediction = found if isinstance(found, Prediction) else found.prediction
    if plot and not isinstance(found, Prediction):
        _plot(found, Path(plot))
    else:
        whole = details or explain or accuracy or frequency_hz or found is not prediction
        render.deliver(
            found if whole else Overview(**vars(prediction)), before=prediction.explained() if explain else ()
        )
    if missing := prediction.missing():
        render.say(f"sensorgen: {missing}", err=True)
        return WRONG_INPUT
    return render.verdict(*prediction.problems(accuracy))


def _asked(
    design: "Design", query: "Query", force_n: Sequence[float], position_mm: Sequence[float], *, everywhere: bool
) -> "Prediction | Loaded":
    """The prediction, with the impedance over force and position where one of them, or CSV, is asked for."""
    from sensorgen.prediction.query import FLAT

    body = body_options.body_of()(design)
    if force_n or position_mm or everywhere or render.form() == "csv":
        from sensorgen.prediction.loaded import loaded

        return loaded(body, query, force_n, position_mm)
    from sensorgen.prediction.evaluate import evaluate

    found = evaluate(body, query)
    if found.capacitance and not found.budget and (query.law or query.tip != FLAT):
        raise BadInput(found.reason)
    return found


def _sweep(design: "Design", words: str, query: "Query", jobs: int, cluster: str, *, alone: bool) -> int:
    from sensorgen.prediction import swept_prediction

    if not alone:
        raise BadInput("--sweep predicts each design at the reference load; leave out --force, --position and --plot")
    key, designs = settings.sweep(words, design)
    of = body_options.body_of()
    with sweeps.bar(len(designs)) as done:
        found = swept_prediction.sweep(key, [(value, of(each)) for value, each in designs], query, jobs, done, cluster)
    render.deliver(found)
    return render.verdict(*found.problems())


def _plot(found: "Loaded", folder: Path) -> None:
    from sensorgen.analysis import plots
    from sensorgen.core import files

    with show.progress(plots.STEPS) as step:
        for file, content in plots.files(found.model.sensor, *found.axes, found.prediction.design):
            step(file)
            files.replace(folder / file, content)
    render.say("\n".join(str(folder / file) for file in plots.STEPS))


command = DesignGroup(
    _work, OWN, name="predict",
    help="Predict the print beside the drawing: gap, capacitance, electrode resistance, sensitivity, resolution and "
    "impedance, each with its range; with --force, --position, --csv or --plot, R and X over force, position and "
    "frequency.",
)  # fmt: skip
