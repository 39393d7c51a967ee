"""``sensorgen cell``: capacitance per area between bounds as near as asked, for one design or along a sweep."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, settings, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Ratio, Values, one
from sensorgen.errors import BadInput
from sensorgen.units import FREQUENCY_HZ

if TYPE_CHECKING:
    from sensorgen.bounds import Asked
    from sensorgen.design import Design

Data = dict[str, Any]

ACCURACY = 1e-3
QUANTITIES = {
    "relative_permittivity": "relative permittivity",
    "loss_tangent": "loss tangent",
    "resistivity_ohm_m": "resistivity [ohm m]",
}
COLUMNS = (
    "lower_f_per_m2",
    "upper_f_per_m2",
    "loss_lower_f_per_m2",
    "loss_upper_f_per_m2",
    "relative_width",
    "model",
    "seconds",
    "reached",
    "reason",
)

OWN: list[click.Parameter] = [
    click.Option(
        ["--accuracy"], type=Ratio(), default=str(ACCURACY), show_default=True,
        help="How far the bounds may be apart, as a share of their middle.",
    ),
    click.Option(["--model"], metavar="NAME", default="", help="Ask this model only, as columns, or thesis-3.35."),
    click.Option(
        ["--frequency"], type=Values(FREQUENCY_HZ, zero=False), default=None,
        help="Of the field, where a dielectric leaks: --set resistivity_x60=1e8; a loss_x60=0.02 needs none.",
    ),
    click.Option(["--explain"], is_flag=True, help="Print the plan, and what came of it."),
    click.Option(["--no-cache"], is_flag=True, help="Solve anew, and keep nothing."),
    click.Option(
        ["--sweep"], metavar="KEY=VALUES",
        help="Answer for each value of one setting: dielectric_mm=0.05:0.2:0.05, or eps_x60=3,4,5.",
    ),
    click.Option(
        ["--jobs"], type=click.IntRange(1, 64), default=None, metavar="N",
        help="Processes at once in a sweep; one for each core if not given.",
    ),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
    click.Option(["--csv", "as_csv"], is_flag=True, help="Print a sweep as CSV."),
    click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the terminal."),
]  # fmt: skip


def _work(
    design: "Design", *, accuracy: float, model: str, no_cache: bool, frequency: tuple[float, ...] | None,
    sweep: str | None, jobs: int | None, **how: Any,
) -> int:  # fmt: skip
    from sensorgen.bounds import Asked

    _refuse_pairs(sweep, how)
    asked = Asked(accuracy, model, not no_cache, one("--frequency", frequency) if frequency else None)
    if sweep is None:
        return _one(design, asked, how)
    key, points = settings.sweep(sweep, design)
    return _many(key, points, asked, jobs or os.cpu_count() or 1, how)


def _refuse_pairs(sweep: str | None, how: Data) -> None:
    if how["as_json"] and how["as_csv"]:
        raise BadInput("--json and --csv at once; expected one of them")
    if how["as_csv"] and sweep is None:
        raise BadInput("--csv is for a sweep, as --sweep dielectric_mm=0.05:0.2:0.05; expected --json")
    if how["explain"] and (sweep or how["as_json"]):
        raise BadInput("--explain is for people, and one design; --json holds the plan too")


def _one(design: "Design", asked: "Asked", how: Data) -> int:
    from sensorgen import bounds
    from sensorgen.models import thesis_cells

    if asked.model in thesis_cells.NAMED:
        return _formula(bounds.formula(design, asked.model), how)
    if how["explain"]:
        _print_plan(design, asked)
    data = bounds.answer(design, asked)
    lines = [show.json_text(data)] if how["as_json"] else (f"{line}\n" for line in _lines(data, explain=how["explain"]))
    _deliver(lines, how["output"])
    return _verdict([data])


def _formula(data: Data, how: Data) -> int:
    lines = [
        f"{data['design']}: {data['value_f_per_m2']:.10g} F/m2 by {data['model']}\n",
        f"{data['reason']}\n",
    ]
    _deliver([show.json_text(data)] if how["as_json"] else lines, how["output"])
    return 0


def _many(key: str, points: Sequence[tuple[float | str, "Design"]], asked: "Asked", jobs: int, how: Data) -> int:
    from sensorgen import bounds

    with _bar(len(points)) as done:
        found = bounds.answers([design for _, design in points], asked, jobs, done)
    rows = [{key: value} | data for (value, _), data in zip(points, found, strict=True)]
    if how["as_json"]:
        _deliver([show.json_text(rows)], how["output"])
    else:
        _deliver(_csv(key, rows) if how["as_csv"] else _table(key, rows), how["output"])
    return _verdict(found)


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
    return (
        f"an accuracy of {data['accuracy']:g} was not reached; the best is {data['relative_width']:.2g}, "
        f"by {data['model']}{why}"
    )


def _lines(data: Data, *, explain: bool) -> Iterator[str]:
    low, high = data["lower_f_per_m2"], data["upper_f_per_m2"]
    if explain:
        yield "measured"
        yield from (f"  {line}" for line in _measured(data["plan"]))
        yield ""
    yield f"{data['design']}: {show.si(low * data['area_m2'], 'F')} to {show.si(high * data['area_m2'], 'F')}"
    yield f"{'per area':12}{low:.10g} to {high:.10g} F/m2"
    if "loss_lower_f_per_m2" in data:
        yield from _loss(data)
    yield f"{'apart by':12}{data['relative_width']:.2g} of their middle, {data['accuracy']:g} wanted"
    when = ", known from before" if data["known"] else ""
    yield f"{'model':12}{data['model']}, {data['seconds']:.2g} s{when}"
    for quantity in dict.fromkeys(v["quantity"] for v in data["values"]):
        here = [v for v in data["values"] if v["quantity"] == quantity]
        values = ", ".join(f"{v['material']} {v['value']:g} ({v['source']})" for v in here)
        yield f"{'with':12}{QUANTITIES[quantity]} of {values}"


def _loss(data: Data) -> Iterator[str]:
    low, high = data["loss_lower_f_per_m2"], data["loss_upper_f_per_m2"]
    at = f" at {show.si(data['frequency_hz'], 'Hz')}" if data["frequency_hz"] else ""
    yield f"{'loss':12}{low:.10g} to {high:.10g} F/m2, minus the imaginary part{at}"
    if data["tan_delta"]:
        yield f"{'tan delta':12}{data['tan_delta'][0]:.6g} to {data['tan_delta'][1]:.6g}"


def _print_plan(design: "Design", asked: "Asked") -> None:
    from sensorgen import losses, planner

    click.echo(f"plan for an accuracy of {asked.width:g}")
    lossy = bool(losses.set_losses(design))
    for c in planner.weighed(design.in_use, asked.width, asked.model, lossy):
        click.echo(f"  {c.model:10}{_expectation(vars(c)):28}{c.passed_over}".rstrip())
    click.echo("  the first that does is taken; cheap ones are asked first in any case")


def _measured(plan: Iterable[Data]) -> Iterator[str]:
    for c in plan:
        came = f"{c['width']:.2g} in {_seconds(c['seconds'])}" if c["seconds"] is not None else "not asked"
        yield f"{c['model']:10}{came:28}{c['passed_over']}".rstrip()


def _expectation(candidate: Data) -> str:
    if candidate["expected_width"] is None:
        return "never measured"
    return f"about {candidate['expected_width']:.2g} in {_seconds(candidate['expected_seconds'])}"


def _seconds(value: float) -> str:
    return show.si(float(f"{value:.2g}"), "s")


def _table(key: str, rows: Sequence[Data]) -> Iterator[str]:
    yield f"{key:>16}  {'lower [F/m2]':>16}  {'upper [F/m2]':>16}  {'apart by':>9}  {'seconds':>8}  model\n"
    for row in rows:
        if row["model"] is None:
            yield f"{_cell(row[key]):>16}  no answer: {row['reason']}\n"
        else:
            yield (
                f"{_cell(row[key]):>16}  {row['lower_f_per_m2']:16.9g}  {row['upper_f_per_m2']:16.9g}  "
                f"{row['relative_width']:9.2g}  {row['seconds']:8.2g}  {row['model']}\n"
            )


def _csv(key: str, rows: Sequence[Data]) -> Iterator[str]:
    import csv
    import io

    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([key, *COLUMNS])
    table.writerows([_cell(row[key]), *(_cell(row.get(name)) for name in COLUMNS)] for row in rows)
    yield text.getvalue()


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return repr(value)
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


@contextmanager
def _bar(length: int) -> Iterator[Callable[[], None]]:
    """A progress bar on the terminal, only for a person."""
    with click.progressbar(length=length, file=sys.stderr, hidden=not sys.stderr.isatty(), label="solving") as bar:
        bar.render_progress()
        yield lambda: bar.update(1)


def _deliver(pieces: Iterable[str], output: str | None) -> None:
    """Print, or write a file at once."""
    text = "".join(pieces)
    if output in (None, "-"):
        click.echo(text, nl=False)
        return
    from sensorgen import store

    store.replace(Path(str(output)), text.encode())
    click.echo(output)


command = DesignGroup(
    _work, OWN, name="cell",
    help="Bound the capacitance per area from both sides, by the cheapest model that is as near as asked. Exit code 1 "
    "where none is.",
    short_help="Capacitance between bounds as near as asked.",
)  # fmt: skip
