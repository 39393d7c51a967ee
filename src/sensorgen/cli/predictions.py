"""``sensorgen predict|cell|compress``: what the bench should measure, and capacitance at rest and under pressure."""

from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import WRONG_INPUT, options, render
from sensorgen.cli.commands import ended
from sensorgen.cli.designs import BodyChoice, of_design
from sensorgen.cli.options import Explain, NoCache, Sides, Sweeping
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option, Without
from sensorgen.core.units import FREQUENCY_HZ, M_PER_MM
from sensorgen.prediction.query import FLAT, Query

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.compression import PressQuestion
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
def predict_command(
    design: "Design", query: QueryOptions, pressing: Pressing, body: BodyChoice, sweeping: Sweeping, *,
    plot: Path | None = None, details: bool = False, explain: Explain = False,
) -> int:  # fmt: skip
    """Predict at rest and at the reference load, or over force and position.

    Parameters
    ----------
    plot : DIR
        Draw R, X, sensitivities and inverse maps there, as PNG and HTML.
    details
        Also print impedance, a perfect model's resolution, remedies, error budget.
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
        result = _answer(design, body, query, pressing, whole=bool(plot))
    prediction = result if isinstance(result, Prediction) else result.prediction
    if plot:
        _plot(result, plot)
    else:
        asked = query.accuracy is not None or (options.typed("frequency_hz") and result is prediction)
        _deliver(result, detailed=any((details, explain, asked)), explain=explain)
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


def _answer(design: "Design", body: BodyChoice, query: Query, pressing: Pressing, *, whole: bool) -> Any:
    """The prediction, with the impedance over force and position where one of them, or CSV, is asked for."""
    if pressing.loads() or whole or render.form() == "csv":
        from sensorgen.prediction.loaded import loaded

        return loaded(body(design), query, pressing.force_n, pressing.position_mm)
    from sensorgen.prediction import bodies
    from sensorgen.prediction.evaluate import ahead, evaluate

    with ahead(partial(bodies.drawn, design), query, wanted=not body.drawn):
        prediction = evaluate(body(design), query)
    if prediction.capacitance and not prediction.budget and (query.law or query.tip != FLAT):
        raise BadInput(prediction.reason)
    return prediction


def _deliver(result: Any, *, detailed: bool, explain: bool) -> None:
    """Deliver a prediction, loaded or not, its first screen alone if it is not detailed."""
    before = getattr(result, "prediction", result).explained() if explain else ()
    render.deliver(result, before=before, shown=None if detailed else result.overview())


def _plot(result: "Loaded", folder: Path) -> None:
    from sensorgen.analysis.plots import results as plots
    from sensorgen.core import files

    with render.progress(plots.STEPS) as step:
        for file, content in plots.files(result.model.sensor, *result.axes, result.prediction.design):
            step(file)
            files.replace(folder / file, content)
    render.say("\n".join(str(folder / file) for file in plots.STEPS))


Frequency = Annotated[float | None, Option(kind=FREQUENCY_HZ)]


@of_design(
    "cell", *render.options(),
    about="Certified bounds of the capacitance per area, by the least expensive model within the accuracy. Exit code 1 "
    "where none reaches it.",
)  # fmt: skip
def cell_command(
    design: "Design", *, accuracy: Annotated[float | None, Option(kind="ratio")] = None, model: str = "",
    frequency_hz: Frequency = None, explain: Explain = False, no_cache: NoCache = False,
    body: BodyChoice, sweeping: Sweeping,
) -> int:  # fmt: skip
    """Bounds of one design, or of each of a sweep.

    Parameters
    ----------
    accuracy
        Relative width of the bounds, as in all commands; if not given, 1e-3 for a cross-section, 1e-2 in 3D, 2.5e-2
        where an electrode leaves part of the plan open.
    model : NAME
        Ask this model only: columns.
    frequency_hz
        Of the field, where a dielectric leaks: --set resistivity_x60=1e8; a loss_x60=0.02 needs none.
    """
    from sensorgen.prediction import capacitance_answer as cell

    options.refuse_explain(explain, many=bool(sweeping.sweep))
    asked = cell.CapacitanceQuestion(accuracy, model, not no_cache, frequency_hz)
    if sweeping.sweep:
        return ended(sweeping.over(design, body, cell.sweep, asked))
    bounds = cell.answer(body(design), asked)
    return ended(bounds, before=bounds.explained() if explain else ())


MODELS = ("press2d", "press3d", "press_round", "springs", "unconfined", "bonded", "infill")


@dataclass(frozen=True)
class PressOptions:
    """Stresses, boundary conditions and accuracy.

    Attributes
    ----------
    stress
        Stresses on the top [kPa]; 0 is put before them.
    contact
        What faces do that touch.
    model
        Finite elements of a cross-section, of boxes or of round bodies, springs of columns, or laws of a plate (B.49,
        bonded) or of infill; the first that fits if not given.
    accuracy
        Largest relative error of the rise C(p) - C(0), as 2e-2: the coarsest mesh within it. 1e-2 is the least.
    check_mesh
        Solve on a finer mesh too, and compare.
    """

    stress: Annotated[tuple[float, ...], Option(kind=units.STRESS_KPA, typed="0:100:10", zero=True)] = ()
    sides: Sides = "bonded"
    contact: Annotated[str, Option(kind=("frictionless", "stick"))] = "frictionless"
    model: Annotated[str, Option(kind=MODELS)] = ""  # fmt: skip
    accuracy: Annotated[float | None, Option(kind="ratio")] = None
    check_mesh: bool = False
    no_cache: NoCache = False

    def __post_init__(self) -> None:
        """Refuse two checks of the mesh."""
        if self.accuracy is not None and self.check_mesh:
            raise BadInput("--accuracy and --check-mesh at once; the first checks the mesh too, expected one of them")

    def asked(self) -> "PressQuestion":
        """The question as the solvers take it."""
        from sensorgen.prediction import compression

        return compression.PressQuestion(
            compression.stresses_kpa(self.stress), compression.boundary(self.sides, contact=self.contact), self.model,
            self.accuracy or inf, check_mesh=self.check_mesh, keep=not self.no_cache, sides=self.sides,
        )  # fmt: skip


@of_design(
    "compress", *render.options(), tip=True,
    about="Press a cell: displacement and capacitance over stress, by finite elements with contact; of a cross-section "
    "in plane strain, of boxes in 3D, of round and tapered bodies about their axis. Exit code 1 where a check says "
    "that the answer is not to be trusted.",
)  # fmt: skip
def compress_command(
    design: "Design", question: PressOptions, body: BodyChoice, sweeping: Sweeping, *, explain: Explain = False,
    plot: Annotated[Path | None, Option(kind="png")] = None,
) -> int:  # fmt: skip
    """Press one design, or each of a sweep.

    Parameters
    ----------
    plot : FILE.png
        Draw displacement and capacitance over stress.
    """
    from sensorgen.prediction import compression

    options.refuse_explain(explain, many=bool(sweeping.sweep))
    if explain and question.accuracy is None:
        raise BadInput("--explain without --accuracy: there is no plan; expected an accuracy, as --accuracy 1e-2")
    if plot and sweeping.sweep:
        raise BadInput("--plot draws one design; expected --csv or --json with --sweep")
    asked = question.asked()
    if sweeping.sweep:
        return ended(sweeping.over(design, body, compression.sweep, asked))
    with render.pressing(asked.stress_kpa) as step:
        result: Any = compression.answer(body(design), asked, step=step)
    if plot:
        from sensorgen.analysis.plots import results as figures
        from sensorgen.analysis.plots import static
        from sensorgen.core import files

        files.replace(plot, static.png(figures.compression_figure(result)))
    return ended(result, before=result.explained() if explain else ())
