"""``sensorgen compress``: how a cell gives way under stress, and what that does to its capacitance."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen import units
from sensorgen.cli import FOUND_ERRORS, asprinted_text, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf, Values
from sensorgen.errors import BadInput

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
    *asprinted_text.printed_options("Press what is printed in place of what is drawn; feet that were lost hang free."),
    click.Option(["--check-mesh"], is_flag=True, help="Solve on a finer mesh too, and compare."),
    click.Option(["--no-cache"], is_flag=True, help="Solve anew, and keep nothing."),
    click.Option(["--plot"], metavar="FILE.png", help="Draw displacement and capacitance over stress."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the curve as JSON."),
]  # fmt: skip


def _work(
    design: "Design", *, stress: tuple[float, ...], model: str | None, check_mesh: bool, no_cache: bool,
    plot: str | None, as_json: bool, as_printed: bool, slicer: str | None, walls: str | None, **held: str,
) -> int:  # fmt: skip
    from sensorgen import compressed

    asprinted_text.refuse_strays(as_printed=as_printed, slicer=slicer, walls=walls)
    stresses = compressed.stresses_kpa(stress)
    if plot:
        if not plot.lower().endswith(".png"):
            raise BadInput(f"--plot {plot}: expected a file that ends in .png")
        from sensorgen.plots.libraries import needed

        needed("matplotlib")
    print_of = asprinted_text.printed(design, slicer, walls) if as_printed else None
    with _bar(stresses) as step:
        data = compressed.answer(
            design, stresses, compressed.Held(**held), model or "", check_mesh=check_mesh, keep=not no_cache, step=step,
            printed=print_of,
        )  # fmt: skip
    if plot:
        from sensorgen import store
        from sensorgen.plots import compression

        store.replace(Path(plot), compression.png(data))
    if as_json:
        show.as_json(data)
    else:
        _table(data)
    return _verdict(data)


def _verdict(data: Data) -> int:
    """0 where every check held; else what did not, and 1."""
    for fault in data["faults"]:
        click.echo(f"sensorgen: not to be trusted: {fault}", err=True)
    return FOUND_ERRORS if data["faults"] else 0


def _table(data: Data) -> None:
    click.echo(f"{'stress [kPa]':>12}  {'displacement [um]':>17}  capacitance [pF/m2]")
    rows = zip(*(data[k] for k in ("stress_kpa", "displacement_um", "lower_f_per_m2", "upper_f_per_m2")), strict=True)
    for stress, moved, lower, upper in rows:
        bounds = f"{lower * 1e12:.7g} to {upper * 1e12:.7g}" if lower is not None else "not known"
        click.echo(f"{stress:12.4g}  {moved:17.4g}  {bounds}")
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
