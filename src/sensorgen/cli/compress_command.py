"""``sensorgen compress``: how a cell gives way under stress, and what that does to its capacitance."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen import units
from sensorgen.cli import FOUND_ERRORS, asprinted_text, plan_text, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf, Ratio, Values
from sensorgen.errors import BadInput
from sensorgen.plan import plain

if TYPE_CHECKING:
    from sensorgen.design import Design

Data = dict[str, Any]


def _choice(flag: str, name: str, choices: list[str], about: str) -> click.Option:
    return click.Option([flag, name], type=OneOf(choices), default=choices[0], show_default=True, help=about)


OWN: list[click.Parameter] = [
    click.Option(
        ["--stress"], type=Values(units.STRESS_KPA, zero=True), default="0:100:10", show_default=True,
        help="Stresses on the top [kPa]; 0 is put before them.",
    ),
    _choice("--base", "base", ["bonded", "sliding"], "How the bottom is held."),
    _choice("--sides", "period", ["fixed", "free"], "Whether its sides stay, or give way (with --base sliding)."),
    _choice("--top", "top", ["even", "rigid"], "Even pressure, or a stiff plate."),
    _choice("--contact", "contact", ["frictionless", "stick"], "What faces do that touch."),
    click.Option(
        ["--model"], type=OneOf(["press2d", "press3d", "springs"]), default=None,
        help="Finite elements of a cross-section or of boxes, or springs of columns; the first that fits if not given.",
    ),
    click.Option(
        ["--accuracy"], type=Ratio(), default=None,
        help="How far the bounds of C may be apart, the error of the mesh in them: the coarsest mesh that will do.",
    ),
    click.Option(["--explain"], is_flag=True, help="With --accuracy: print the plan, and what came of it."),
    *asprinted_text.printed_options("Press what is printed in place of what is drawn; feet that were lost hang free."),
    click.Option(["--check-mesh"], is_flag=True, help="Solve on a finer mesh too, and compare."),
    click.Option(["--no-cache"], is_flag=True, help="Solve anew, and keep nothing."),
    click.Option(["--plot"], metavar="FILE.png", help="Draw displacement and capacitance over stress."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the curve as JSON."),
]  # fmt: skip


def _work(
    design: "Design", *, stress: tuple[float, ...], model: str | None, accuracy: float | None, check_mesh: bool,
    no_cache: bool, as_printed: bool, slicer: str | None, walls: str | None, explain: bool, plot: str | None,
    as_json: bool, **held: str,
) -> int:  # fmt: skip
    from sensorgen import compressed

    asprinted_text.refuse_strays(as_printed=as_printed, slicer=slicer, walls=walls)
    _refuse_pairs(accuracy, check_mesh=check_mesh, explain=explain, as_json=as_json)
    _refuse_plot(plot)
    stresses = compressed.stresses_kpa(stress)
    asked = compressed.Asked(
        stresses, compressed.Held(**held), model or "", accuracy or inf, check_mesh=check_mesh, keep=not no_cache
    )
    print_of = asprinted_text.printed(design, slicer, walls) if as_printed else None
    if explain:
        click.echo("\n".join(plan_text.planned(plain(compressed.planned(design, asked, print_of)))) + "\n")
    with _bar(stresses) as step:
        data = compressed.answer(design, asked, printed=print_of, step=step)
    if plot:
        from sensorgen import store
        from sensorgen.plots import compression

        store.replace(Path(plot), compression.png(data))
    if as_json:
        show.as_json(data)
    else:
        _table(data, explain=explain)
    return _verdict(data)


def _refuse_pairs(accuracy: float | None, *, check_mesh: bool, explain: bool, as_json: bool) -> None:
    if accuracy is not None and check_mesh:
        raise BadInput("--accuracy and --check-mesh at once; the first checks the mesh too, expected one of them")
    if explain and accuracy is None:
        raise BadInput("--explain without --accuracy: there is no plan; expected an accuracy, as --accuracy 1e-2")
    if explain and as_json:
        raise BadInput("--explain is for people, and --json is not; it holds the plan too")


def _refuse_plot(plot: str | None) -> None:
    """A picture that could not be made, before the long work."""
    if not plot:
        return
    if not plot.lower().endswith(".png"):
        raise BadInput(f"--plot {plot}: expected a file that ends in .png")
    from sensorgen.plots.libraries import needed

    needed("matplotlib")


def _verdict(data: Data) -> int:
    """0 where every check held, and every accuracy was reached; else what did not, and 1."""
    for fault in data["faults"]:
        click.echo(f"sensorgen: not to be trusted: {fault}", err=True)
    if data.get("reached", True):
        return FOUND_ERRORS if data["faults"] else 0
    best = data["relative_width"]
    said = "nobody knows how near it is" if best is None else f"the best is {best:.2g}"
    click.echo(f"sensorgen: an accuracy of {data['accuracy']:g} was not reached; {said}", err=True)
    return FOUND_ERRORS


def _table(data: Data, *, explain: bool) -> None:
    if explain:
        click.echo("\n".join(plan_text.measured(data["plan"])) + "\n")
    click.echo(f"{'stress [kPa]':>12}  {'displacement [um]':>17}  capacitance [pF/m2]")
    rows = zip(*(data[k] for k in ("stress_kpa", "displacement_um", "lower_f_per_m2", "upper_f_per_m2")), strict=True)
    for stress, moved, lower, upper in rows:
        bounds = f"{lower * 1e12:.7g} to {upper * 1e12:.7g}" if lower is not None else "not known"
        click.echo(f"{stress:12.4g}  {moved:17.4g}  {bounds}")
    if "accuracy" in data and data["relative_width"] is not None:
        click.echo(f"bounds apart by {data['relative_width']:.2g} at worst, {data['accuracy']:g} wanted")
    held = ", ".join(f"{key} {value}" for key, value in data["held"].items())
    click.echo(f"{data['model']}, converged up to {data['converged_kpa']:.4g} kPa; {held}")
    if "printed" in data:
        click.echo(f"as printed: {data['printed']}")
    for doubt in data["doubts"]:
        click.echo(f"doubt: {doubt}")


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
