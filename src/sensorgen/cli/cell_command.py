"""``sensorgen cell``: capacitance per area between certified bounds, for one design or along a sweep."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, body_options, cell_text, plan_text, settings, show, sweeps
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Ratio, Values, one
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.units import FREQUENCY_HZ, LENGTH_MM

if TYPE_CHECKING:
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design
    from sensorgen.prediction.capacitance_answer import Asked

Data = dict[str, Any]
Points = Sequence[tuple[Any, "Design"]]

FORMULA = "thesis-"  # how the names of formulas begin

OWN: list[click.Parameter] = [
    click.Option(
        ["--accuracy"], type=Ratio(), default=None,
        help="Relative width of the bounds; 1e-3 for a cross-section and 1e-2 in 3D if not given, as in all commands.",
    ),
    click.Option(["--model"], metavar="NAME", default="", help="Ask this model only: columns, thesis-3.35."),
    click.Option(
        ["--frequency"], type=Values(FREQUENCY_HZ, zero=False), default=None,
        help="Of the field, where a dielectric leaks: --set resistivity_x60=1e8; a loss_x60=0.02 needs none.",
    ),
    click.Option(
        ["--press", "press_mm"], type=Values(LENGTH_MM, zero=True), default=None,
        help="Displacement of the top, as 20um or 0:0.05:0.01, for formulas of it; solved: compress.",
    ),
    click.Option(["--explain"], is_flag=True, help="Print the plan, and what came of it."),
    click.Option(["--no-cache"], is_flag=True, help="Solve anew, and keep nothing."),
    *body_options.body_options(),
    *sweeps.options(),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
    click.Option(["--csv", "as_csv"], is_flag=True, help="Print a sweep as CSV."),
    click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the terminal."),
]  # fmt: skip


def _work(
    design: "Design", *, accuracy: float | None, model: str, no_cache: bool, frequency: tuple[float, ...] | None,
    drawn: bool, slicer: str | None, walls: str | None,
    sweep: str | None, jobs: int | None, press_mm: tuple[float, ...] | None, **how: Any,
) -> int:  # fmt: skip
    from sensorgen.prediction.capacitance_answer import Asked

    formula = model.startswith(FORMULA)
    _refuse_pairs(how, many=bool(sweep or (formula and press_mm)))
    asked = Asked(accuracy, model, not no_cache, one("--frequency", frequency) if frequency else None)
    key, points = settings.sweep(sweep, design) if sweep else ("", [("", design)])
    if formula:
        return _formula(key, points, asked, press_mm, how)
    if press_mm:
        raise BadInput("--press is for formulas, as --model thesis-3.1.2; solved, under a stress: sensorgen compress")
    of = body_options.body_of(drawn, slicer, walls)
    if sweep:
        return _many(key, [(value, of(each)) for value, each in points], asked, sweeps.at_once(jobs), how)
    return _one(of(design), asked, how)


def _refuse_pairs(how: Data, *, many: bool) -> None:
    if how["as_json"] and how["as_csv"]:
        raise BadInput("--json and --csv at once; expected one of them")
    if how["as_csv"] and not many:
        raise BadInput("--csv is for a sweep, as --sweep dielectric_mm=0.05:0.2:0.05; expected --json")
    if how["explain"] and (many or how["as_json"]):
        raise BadInput("--explain is for people, and one design; --json holds the plan too")


def _one(body: "Body", asked: "Asked", how: Data) -> int:
    from sensorgen.prediction import capacitance_answer as bounds

    if how["explain"]:
        _print_plan(body, asked)
    data = bounds.answer(body, asked)
    lines = (f"{line}\n" for line in cell_text.lines(data, explain=how["explain"]))
    _deliver([show.json_text(data)] if how["as_json"] else lines, how["output"])
    return _verdict([data])


def _many(key: str, points: "Sequence[tuple[Any, Body]]", asked: "Asked", jobs: int, how: Data) -> int:
    from sensorgen.prediction import capacitance_answer as bounds

    with sweeps.bar(len(points)) as done:
        found = bounds.answers([body for _, body in points], asked, jobs, done)
    rows = [{key: value} | data for (value, _), data in zip(points, found, strict=True)]
    if how["as_json"]:
        _deliver([show.json_text(rows)], how["output"])
    else:
        csv = how["as_csv"]
        _deliver([sweeps.rows_csv(key, rows, cell_text.COLUMNS)] if csv else cell_text.table(key, rows), how["output"])
    return _verdict(found)


def _formula(key: str, points: Points, asked: "Asked", press_mm: tuple[float, ...] | None, how: Data) -> int:
    """A formula alone, along a sweep, or along presses."""
    from sensorgen.prediction import thesis_formulas as formulas

    if asked.model not in formulas.NAMES:
        raise UnknownName("formula", asked.model, formulas.NAMES)
    if how["explain"]:
        raise BadInput(f"--explain: {asked.model} is asked alone, there is no plan; leave out --model")
    presses: tuple[float | None, ...] = press_mm or (None,)
    if not key and len(presses) == 1:
        data = formulas.answer(points[0][1], asked, presses[0])
        _deliver([show.json_text(data)] if how["as_json"] else cell_text.formula_lines(data), how["output"])
        return 0
    if key and len(presses) > 1:
        raise BadInput("--sweep and several values of --press at once; expected one of them")
    sweep = points if key else [(press, points[0][1]) for press in presses]
    found = formulas.answers([design for _, design in sweep], asked, presses * (len(sweep) // len(presses)))
    rows = [{key or "press_mm": value} | data for (value, _), data in zip(sweep, found, strict=True)]
    _deliver(_formula_rows(key or "press_mm", rows, asked.model, how), how["output"])
    return 0 if all(row["model"] for row in rows) else FOUND_ERRORS


def _formula_rows(key: str, rows: Sequence[Data], model: str, how: Data) -> Iterable[str]:
    if how["as_json"]:
        return [show.json_text(rows)]
    if how["as_csv"]:
        return [sweeps.rows_csv(key, rows, cell_text.OF_FORMULAS)]
    return cell_text.formula_table(key, rows, model)


def _verdict(found: Sequence[Data]) -> int:
    """0 where every accuracy was reached; else say the worst, and 1."""
    late = [data for data in found if not data.get("reached")]
    if not late:
        return 0
    worst = max(late, key=lambda data: data.get("relative_width", float("inf")))
    if worst["model"] is None:
        message = f"{worst['design']} has no answer: {worst['reason']}"
    else:
        message = f"{worst['design']}: {_shortfall(worst)}"
    more = f" ({len(late)} of {len(found)} like this)" if len(late) > 1 else ""
    click.echo(f"sensorgen: {message}{more}", err=True)
    return FOUND_ERRORS


def _shortfall(data: Data) -> str:
    """The best that was reached, and what other models said."""
    why = f"; {'; '.join(data['refused'])}" if data["refused"] else ""
    return f"accuracy {data['accuracy']:g} not reached: {data['relative_width']:.2g}, by {data['model']}{why}"


def _print_plan(body: "Body", asked: "Asked") -> None:
    from sensorgen.prediction import capacitance as planner
    from sensorgen.prediction import losses

    scene = body.cells.first()
    width = planner.default_width(scene) if asked.width is None else asked.width
    click.echo(f"plan for a relative width of {width:g}")
    for c in planner.weighed(scene, width, asked.model, bool(losses.set_losses(body.design))):
        click.echo(f"  {c.model:10}{plan_text.expectation(c):32}{c.passed_over}".rstrip())


def _deliver(pieces: Iterable[str], output: str | None) -> None:
    """Print, or write a file at once."""
    text = "".join(pieces)
    if output in (None, "-"):
        click.echo(text, nl=False)
        return
    from sensorgen.core import files as store

    store.replace(Path(str(output)), text.encode())
    click.echo(output)


command = DesignGroup(
    _work, OWN, name="cell",
    help="Certified bounds of the capacitance per area, by the least expensive model within the accuracy. Exit code 1 "
    "where none reaches it.",
    short_help="Capacitance between certified bounds.",
)  # fmt: skip
