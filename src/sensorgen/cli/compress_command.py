"""``sensorgen compress``: displacement and capacitance of a cell under pressure."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, body_options, compress_text, plan_text, settings, show, sweeps
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf, Ratio, Values
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design
    from sensorgen.prediction.compression import Asked

Data = dict[str, Any]


def _choice(flag: str, name: str, choices: list[str], about: str) -> click.Option:
    return click.Option([flag, name], type=OneOf(choices), default=choices[0], show_default=True, help=about)


OWN: list[click.Parameter] = [
    click.Option(
        ["--stress"], type=Values(units.STRESS_KPA, zero=True), default="0:100:10", show_default=True,
        help="Stresses on the top [kPa]; 0 is put before them.",
    ),
    _choice("--base", "base", ["bonded", "sliding"], "Boundary condition of the bottom."),
    _choice("--sides", "period", ["fixed", "free"], "Sides: fixed, or free to move (with --base sliding)."),
    _choice("--top", "top", ["even", "rigid"], "Even pressure, or a stiff plate."),
    _choice("--contact", "contact", ["frictionless", "stick"], "What faces do that touch."),
    click.Option(
        ["--model"], type=OneOf(["press2d", "press3d", "springs", "unconfined", "bonded"]), default=None,
        help="Finite elements of a cross-section or of boxes, springs of columns, or laws of a plate, free to widen "
        "sideways (B.49) or bonded; the first that fits if not given.",
    ),
    click.Option(
        ["--accuracy"], type=Ratio(), default=None,
        help="How far the bounds of C may be apart, the error of the mesh in them: the coarsest mesh that will do.",
    ),
    click.Option(["--explain"], is_flag=True, help="With --accuracy: print the plan, and what came of it."),
    *body_options.body_options(),
    click.Option(["--check-mesh"], is_flag=True, help="Solve on a finer mesh too, and compare."),
    click.Option(["--no-cache"], is_flag=True, help="Solve anew, and keep nothing."),
    *sweeps.options(),
    click.Option(["--plot"], metavar="FILE.png", help="Draw displacement and capacitance over stress."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the curve as JSON."),
    click.Option(["--csv", "as_csv"], is_flag=True, help="Print a sweep as CSV."),
]  # fmt: skip


def _work(
    design: "Design", *, stress: tuple[float, ...], model: str | None, accuracy: float | None, check_mesh: bool,
    no_cache: bool, drawn: bool, slicer: str | None, walls: str | None, sweep: str | None, jobs: int | None,
    **how: Any,
) -> int:  # fmt: skip
    from sensorgen.prediction import compression as compressed

    _refuse_pairs(accuracy, how, check_mesh=check_mesh, swept=bool(sweep))
    _refuse_plot(how["plot"])
    held = compressed.BoundaryConditions(**{f.name: how[f.name] for f in fields(compressed.BoundaryConditions)})
    asked = compressed.Asked(
        compressed.stresses_kpa(stress), held, model or "", accuracy or inf, check_mesh=check_mesh, keep=not no_cache
    )
    key, designs = settings.sweep(sweep, design) if sweep else ("", [("", design)])
    of = body_options.body_of(drawn, slicer, walls)
    points = [of(each) for _, each in designs]
    if sweep:
        return _many(key, [value for value, _ in designs], points, asked, sweeps.at_once(jobs), how)
    return _one(points[0], asked, how)


def _one(body: "Body", asked: "Asked", how: Data) -> int:
    from sensorgen.prediction import compression as compressed

    if how["explain"]:
        click.echo("\n".join(plan_text.lines(compressed.planned(body, asked))) + "\n")
    with _bar(asked.stress_kpa) as step:
        data = compressed.answer(body, asked, step=step)
    if how["plot"]:
        from sensorgen.analysis.plots import compression
        from sensorgen.core import files as store

        store.replace(Path(how["plot"]), compression.png(data))
    if how["as_json"]:
        show.as_json(data)
    else:
        click.echo("\n".join(compress_text.lines(data, explain=how["explain"])))
    return _verdict(data)


def _many(key: str, values: Sequence[Any], points: "Sequence[Body]", asked: "Asked", jobs: int, how: Data) -> int:
    from sensorgen.prediction import sweep as swept

    with sweeps.bar(len(points)) as done:
        found = swept.answers(points, asked, jobs, done)
    rows = [
        {key: value, "design": body.design.name} | ({"model": None, "reason": data} if isinstance(data, str) else data)
        for value, body, data in zip(values, points, found, strict=True)
    ]
    if how["as_json"]:
        show.as_json(rows)
    elif how["as_csv"]:
        click.echo(sweeps.rows_csv(key, compress_text.loads(rows), compress_text.COLUMNS), nl=False)
    else:
        click.echo("\n".join(compress_text.table(key, rows)))
    return _verdicts(rows)


def _refuse_pairs(accuracy: float | None, how: Data, *, check_mesh: bool, swept: bool) -> None:
    if accuracy is not None and check_mesh:
        raise BadInput("--accuracy and --check-mesh at once; the first checks the mesh too, expected one of them")
    if how["explain"] and (swept or how["as_json"]):
        raise BadInput("--explain is for people, and one design; --json holds the plan too")
    if how["explain"] and accuracy is None:
        raise BadInput("--explain without --accuracy: there is no plan; expected an accuracy, as --accuracy 1e-2")
    if how["as_json"] and how["as_csv"]:
        raise BadInput("--json and --csv at once; expected one of them")
    if how["as_csv"] and not swept:
        raise BadInput("--csv is for a sweep, as --sweep dielectric_mm=0.05:0.2:0.05; expected --json")
    if how["plot"] and swept:
        raise BadInput("--plot draws one design; expected --csv or --json with --sweep")


def _refuse_plot(plot: str | None) -> None:
    """A picture that could not be made, before the long work."""
    if not plot:
        return
    if not plot.lower().endswith(".png"):
        raise BadInput(f"--plot {plot}: expected a file that ends in .png")
    from sensorgen.analysis.plots.libraries import needed

    needed("matplotlib")


def _verdict(data: Data) -> int:
    """0 where every check held, and every accuracy was reached; else what did not, and 1."""
    wrong = _wrong(data)
    for message in wrong:
        click.echo(f"sensorgen: {message}", err=True)
    return FOUND_ERRORS if wrong else 0


def _verdicts(rows: Sequence[Data]) -> int:
    """The same along a sweep: what is wrong with the first, and with how many."""
    wrong = [(row["design"], message) for row in rows for message in _wrong(row)[:1]]
    if not wrong:
        return 0
    more = f" ({len(wrong)} of {len(rows)} like this)" if len(wrong) > 1 else ""
    click.echo(f"sensorgen: {wrong[0][0]}: {wrong[0][1]}{more}", err=True)
    return FOUND_ERRORS


def _wrong(data: Data) -> list[str]:
    """Why an answer is not what was asked for."""
    if data["model"] is None:
        return [f"no answer: {data['reason']}"]
    wrong = [f"not to be trusted: {fault}" for fault in data["faults"]]
    if data.get("reached", True):
        return wrong
    best = data["relative_width"]
    said = "error unknown" if best is None else f"{best:.2g}"
    return [*wrong, f"accuracy {data['accuracy']:g} not reached: {said}"]


@contextmanager
def _bar(stresses: tuple[float, ...]) -> Iterator[Callable[[float], None]]:
    """A progress bar that stands at the highest stress reached so far, only for a person."""
    with click.progressbar(
        length=len(stresses), file=sys.stderr, hidden=not sys.stderr.isatty(), label="pressing"
    ) as bar:
        bar.render_progress()
        yield lambda reached_pa: bar.update(max(sum(1e3 * kpa <= reached_pa for kpa in stresses) - bar.pos, 0))


command = DesignGroup(
    _work, OWN, name="compress",
    help="Press a cell: displacement and capacitance over stress, by finite elements with contact; of a cross-section "
    "in plane strain, of boxes in 3D. Exit code 1 where a check says that the answer is not to be trusted.",
    short_help="Displacement and capacitance under stress.",
)  # fmt: skip
