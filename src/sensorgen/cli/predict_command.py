"""``sensorgen predict``: what the bench should measure."""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, body_options, plan_text, prediction_text, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Length, OneOf, Ratio, Share, Values, proper
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design
    from sensorgen.prediction.plan import Plan
    from sensorgen.prediction.query import Query
    from sensorgen.prediction.results import Prediction

_WORK = ("cell, compression and line",)
Axes = tuple[Sequence[float], Sequence[float], Sequence[float]]

OWN: list[click.Parameter] = [
    click.Option(
        ["--force", "force_n"], type=Values(units.FORCE_N, zero=True),
        help="Forces as START:STOP:STEP, one, or a list [N]; 0:6:0.1 where only positions are given.",
    ),
    click.Option(
        ["--position", "position_mm"], type=Values(units.LENGTH_MM, zero=True),
        help="Positions of the tip's middle [mm]; the whole sensor in 100 steps where only forces are given.",
    ),
    click.Option(
        ["--frequencies", "frequency_hz"], type=Values(units.FREQUENCY_HZ, zero=False),
        help="Frequencies, as in 1.1kHz,2.3kHz; the thesis's seven if not given.",
    ),
    click.Option(["--tip", "tip_mm"], type=Length(), default=None, help="Length of the tip.  [default: 10 mm]"),
    click.Option(
        ["--tip-radius", "radius_mm"], type=Length(), default=None,
        help="Radius of a hard round tip across the sensor, with --profile hertz or parabola: its contact grows with "
        "the force up to the tip's length. All of the tip touches if not given.",
    ),
    click.Option(
        ["--compression"], type=OneOf(("unconfined", "bonded", "solved")),
        help="How the cell deforms: as a plate, free or bonded, or solved (needs NGSolve; seconds in a cross-section, "
        "up to minutes in 3D); if not given, solved in a cross-section.",
    ),
    click.Option(
        ["--noise"], type=Share(), default="0.1%", show_default=True,
        help="Standard error of R and of X of a reading, relative to |Z|, for the resolution.",
    ),
    click.Option(
        ["--profile"], type=OneOf(("uniform", "hertz", "parabola")), default="uniform", show_default=True,
        help="Pressure under the tip: of a flat one, of a round one on a thick body, of a round one on a thin film.",
    ),
    click.Option(
        ["--accuracy"], type=Ratio(), default=None,
        help="Of |Z|: cell, compression and line by the least expensive models that together meet it. Exit code 1 "
        "where they do not.",
    ),
    click.Option(["--explain"], is_flag=True, help="Print which models were used, and their cost and error."),
    *body_options.body_options(),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
    click.Option(["--csv", "as_csv"], is_flag=True, help="Print R and X as CSV, a row per force and position."),
    click.Option(["--plot"], metavar="DIR", help="Draw R, X, sensitivities and inverse maps there, as PNG and HTML."),
    click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the terminal."),
]  # fmt: skip


def _work(
    design: "Design", *, frequency_hz: Sequence[float] | None, force_n: Sequence[float] | None,
    position_mm: Sequence[float] | None, tip_mm: float | None, radius_mm: float | None, compression: str | None,
    profile: str, accuracy: float | None, noise: float, drawn: bool, slicer: str | None, walls: str | None, **how: Any,
) -> int:  # fmt: skip
    _refuse_two(how)
    proper("--noise", noise)
    body = body_options.body_of(drawn, slicer, walls)(design)
    from sensorgen.prediction import grid
    from sensorgen.prediction.evaluate import evaluate
    from sensorgen.prediction.query import DEFAULT, TIP_M, Query, Tip

    tip = Tip(
        TIP_M if tip_mm is None else tip_mm * units.M_PER_MM, profile,
        None if radius_mm is None else radius_mm * units.M_PER_MM,
    )  # fmt: skip
    frequencies = tuple(frequency_hz or DEFAULT.frequency_hz)
    query = Query(frequencies, tip=tip, law=compression or "", accuracy=accuracy, noise=noise)
    if force_n or position_mm or how["as_csv"] or how["plot"]:
        axes = frequencies, tuple(force_n or grid.FORCES_N), tuple(position_mm or grid.positions_mm(design))
        return _verdict(_loaded(body, query, axes, how), accuracy)
    with show.progress(_WORK) as step:
        step(_WORK[0])
        found = evaluate(body, query)
    if found.capacitance and not found.budget and (compression or tip_mm is not None or radius_mm is not None):
        raise BadInput(found.reason)
    _deliver(_text(found, how), how["output"])
    return _verdict(found, accuracy)


def _text(found: "Prediction", how: dict[str, Any]) -> Iterator[str]:
    if how["as_json"]:
        from sensorgen.prediction.results import to_json

        yield show.indented(to_json(found))
    else:
        lines = (*_explained(found.plan, how), *prediction_text.whole(found))
        yield from (f"{line}\n" for line in lines)


def _explained(plan: "Plan | None", how: dict[str, Any]) -> Iterator[str]:
    if how["explain"] and plan:
        yield from (*plan_text.lines(plan), "")


def _loaded(body: "Body", query: "Query", axes: Axes, how: dict[str, Any]) -> "Prediction":
    """Print R and X over the axes; returns the prediction at the largest force, which decides the exit code."""
    from dataclasses import replace

    from sensorgen.prediction import grid
    from sensorgen.prediction.evaluate import evaluate
    from sensorgen.prediction.planning import rough_sensor, sensor_model

    reference = grid.hardest(*axes)
    query = replace(query, force_n=reference.force_n, position_m=reference.position_m)
    position_m = [x * units.M_PER_MM for x in axes[2]]
    grid.check_presses(rough_sensor(body, query.law, query.tip).sensor, axes[1], position_m)
    with show.progress(_WORK) as step:
        step(_WORK[0])
        found = evaluate(body, query)
        model = sensor_model(body, query)[0]
    if how["plot"]:
        _plot(body.design.name, model.sensor, axes, Path(how["plot"]))
    elif how["as_csv"]:
        _deliver(grid.csv_blocks(model.sensor, *axes), how["output"], len(axes[1]) * len(axes[2]))
    elif how["as_json"]:
        _deliver(show.grid_json(found, model, grid.impedance_grid(model.sensor, *axes)), how["output"])
    else:
        z = grid.impedance_grid(model.sensor, *axes)
        lines = (
            *_explained(found.plan, how),
            *show.loaded(found, model, z, query.noise),
            "",
            *prediction_text.judgement(found),
        )
        _deliver((f"{line}\n" for line in lines), how["output"])
    return found


def _verdict(found: "Prediction", accuracy: float | None) -> int:
    """0, or 1 and a message where abs(Z) is not within the accuracy that was asked for."""
    if accuracy is None or found.capacitance is None:
        return 0
    reached = found.plan.width if found.plan else found.capacitance.model.width()
    if reached is not None and reached <= accuracy:
        return 0
    best = "error unknown" if reached in (None, float("inf")) else f"{reached:.2g}"
    parts = plan_text.shares(found.plan) if found.plan else ()
    click.echo("; ".join([f"sensorgen: accuracy {accuracy:g} not reached: {best}", *parts]), err=True)
    return FOUND_ERRORS


def _refuse_two(how: dict[str, Any]) -> None:
    given = [f"--{name.removeprefix('as_')}" for name in ("as_json", "as_csv", "plot") if how[name]]
    given += ["--output"] if how["output"] and (how["plot"] or how["explain"]) else []
    if len(given) > 1:
        raise BadInput(f"{' and '.join(given)} at once; expected one of them")
    if how["explain"] and given:
        raise BadInput(f"--explain prints text; with {given[0]} leave it out: --json has the plan too")


def _plot(name: str, sensor: Any, axes: Axes, folder: Path) -> None:
    from sensorgen.analysis import plots
    from sensorgen.core import files as store

    with show.progress(plots.STEPS) as step:
        for file, content in plots.files(sensor, *axes, name):
            step(file)
            store.replace(folder / file, content)
    for file in plots.STEPS:
        click.echo(str(folder / file))


def _deliver(pieces: Iterator[str], output: str | None, rows: int = 0) -> None:
    """Print pieces of text as they come, or write them to a file that is there when all of them are."""
    if output in (None, "-"):
        for piece in pieces:
            sys.stdout.write(piece)
        return
    from sensorgen.core import files as store
    from sensorgen.prediction.grid import ROWS

    with show.progress([f"{share} %" for share in range(101)]) as step, store.replacing(Path(str(output))) as file:
        for k, piece in enumerate(pieces):
            step(f"{100 * k * ROWS // rows if rows else 100} %")
            file.write(piece.encode())
    click.echo(output)


command = DesignGroup(
    _work, OWN, name="predict",
    help="Predict the print beside the drawing: gap, capacitance, electrode resistance, sensitivity, resolution and "
    "impedance, each with its range; with --force, --position, --csv or --plot, R and X over force, position and "
    "frequency.",
    short_help="Predict capacitance, resistance and impedance, loaded or not.",
)  # fmt: skip
