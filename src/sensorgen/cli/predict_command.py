"""``sensorgen predict``: what the bench should measure."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import WRONG_INPUT, options, render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.commands import ended
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Explain, Sides, Sweeping
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option, Without
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.query import FLAT, Query

if TYPE_CHECKING:
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design
    from sensorgen.prediction.loaded import Loaded

QueryOptions = Annotated[Query, Without(("force_n", "position_m", "tip", "range_kpa"))]
_WORK = ("cell, press, line",)


@dataclass(frozen=True)
class Pressing:
    """Loads, tip and sides of the sensor.

    Attributes
    ----------
    force_n
        Forces as START:STOP:STEP, one, or a list [N]; 0:6:0.1 where only positions are given.
    position_mm
        Positions of the tip's middle [mm]; the whole sensor in 100 steps where only forces are given.
    radius_mm, --tip-radius
        Radius of a hard round tip across the sensor, with --profile hertz or parabola: its contact grows with the force
        up to the tip's length. All of the tip touches if not given.
    profile
        Pressure under the tip: of a flat one, of a round one on a thick body, of a round one on a thin film; the
        design's if not given.
    """

    force_n: Annotated[tuple[float, ...], Option(zero=True)] = ()  # fmt: skip
    position_mm: Annotated[tuple[float, ...], Option(zero=True)] = ()  # fmt: skip
    radius_mm: Annotated[float | None, Option(kind="length")] = None  # fmt: skip
    sides: Sides = "bonded"
    profile: Annotated[str, Option(kind=("uniform", "hertz", "parabola"))] = ""  # fmt: skip

    def loads(self) -> bool:
        """True where forces or positions were given."""
        return bool(self.force_n or self.position_mm)

    def of(self, query: Query, design: "Design") -> Query:
        """A query with the tip of a design, and the law by its sides."""
        if query.law and self.sides != "bonded":
            raise BadInput("--compression and --sides at once; expected one of them")
        tip = (design.crossing if design.layout else design).tip.tip()
        radius_m = None if self.radius_mm is None else self.radius_mm * M_PER_MM
        tip = replace(tip, profile=self.profile or tip.profile, radius_m=radius_m)
        return replace(query, tip=tip, law=query.law or self.sides * (self.sides != "bonded"))


@of_design(
    "predict", *render.options(csv="Print R and X as CSV, a row per force and position."), tip=True,
    about="Predict the print beside the drawing: gap, capacitance, electrode resistance, sensitivity, resolution and "
    "impedance, each with its range; with --force, --position, --csv or --plot, R and X over force, position and "
    "frequency.",
)  # fmt: skip
def command(
    design: "Design", query: QueryOptions, pressing: Pressing, body: BodyChoice, sweeping: Sweeping, *,
    plot: Path | None = None, details: bool = False, explain: Explain = False,
) -> int:  # fmt: skip
    """Predict at rest and at the reference load, or over force and position.

    Parameters
    ----------
    plot : DIR
        Draw R, X, sensitivities and inverse maps there, as PNG and HTML.
    details
        Also print impedance, a perfect model's resolution, error budget.
    """
    from sensorgen.prediction.results import Prediction

    if plot:
        render.refuse_beside("--plot")
    options.refuse_explain(explain, many=bool(plot or sweeping.sweep))
    query = pressing.of(query, design)
    if sweeping.sweep:
        return _swept(design, body, query, sweeping, alone=not (pressing.loads() or plot))
    with render.progress(_WORK) as step:
        step(_WORK[0])
        result = _answer(body(design), query, pressing, whole=bool(plot))
    prediction = result if isinstance(result, Prediction) else result.prediction
    if plot:
        _plot(result, plot)
    else:
        asked = query.accuracy is not None or options.typed("frequency_hz")
        _deliver(result, detailed=any((result is not prediction, details, explain, asked)), explain=explain)
    if missing := prediction.missing():
        render.say(f"sensorgen: {missing}", err=True)
        return WRONG_INPUT
    return render.verdict(*prediction.problems(query.accuracy))


def _swept(design: "Design", body: BodyChoice, query: Query, sweeping: Sweeping, *, alone: bool) -> int:
    """A prediction at the reference load for each value of a setting."""
    from sensorgen.prediction.loaded import sweep

    if not alone:
        raise BadInput("--sweep predicts each design at the reference load; leave out --force, --position and --plot")
    return ended(sweeping.over(design, body, sweep, query))


def _answer(body: "Body", query: Query, pressing: Pressing, *, whole: bool) -> Any:
    """The prediction, with the impedance over force and position where one of them, or CSV, is asked for."""
    if pressing.loads() or whole or render.form() == "csv":
        from sensorgen.prediction.loaded import loaded

        return loaded(body, query, pressing.force_n, pressing.position_mm)
    from sensorgen.prediction.evaluate import evaluate

    prediction = evaluate(body, query)
    if prediction.capacitance and not prediction.budget and (query.law or query.tip != FLAT):
        raise BadInput(prediction.reason)
    return prediction


def _deliver(result: Any, *, detailed: bool, explain: bool) -> None:
    """Deliver a prediction, its first screen alone if it is not detailed."""
    from sensorgen.prediction.results import Overview

    before = getattr(result, "prediction", result).explained() if explain else ()
    render.deliver(result if detailed else Overview(**vars(result)), before=before)


def _plot(result: "Loaded", folder: Path) -> None:
    from sensorgen.analysis import plots
    from sensorgen.core import files

    with render.progress(plots.STEPS) as step:
        for file, content in plots.files(result.model.sensor, *result.axes, result.prediction.design):
            step(file)
            files.replace(folder / file, content)
    render.say("\n".join(str(folder / file) for file in plots.STEPS))
