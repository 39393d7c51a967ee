"""``sensorgen compress``: displacement and capacitance of a cell under pressure."""

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import body_options, options, render, settings, sweeps
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.options import option
from sensorgen.cli.words import OneOf, Png, Values
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design


OWN: list[click.Parameter] = [
    option(
        "--stress", Values(units.STRESS_KPA, zero=True), "Stresses on the top [kPa]; 0 is put before them.",
        default="0:100:10",
    ),
    options.sides(),
    options.of_design_tip(),
    option("--contact", OneOf(("frictionless", "stick")), "What faces do that touch.", default="frictionless"),
    option(
        "--model", OneOf(("press2d", "press3d", "press_round", "springs", "unconfined", "bonded", "infill")),
        "Finite elements of a cross-section, of boxes or of round bodies, springs of columns, or laws of a plate "
        "(B.49, bonded) or of infill; the first that fits if not given.",
    ),
    options.accuracy(
        "Largest relative error of the rise C(p) - C(0), as 2e-2: the coarsest mesh within it. 1e-2 is the least."
    ),
    options.explain(), *body_options.body_options(),
    options.flag("--check-mesh", "Solve on a finer mesh too, and compare."),
    options.no_cache(), *sweeps.options(),
    option("--plot", Png(), "Draw displacement and capacitance over stress.", metavar="FILE.png"),
    *render.options(),
]  # fmt: skip


def _work(
    design: "Design", *, stress: tuple[float, ...], model: str | None, accuracy: float | None, explain: bool,
    check_mesh: bool, no_cache: bool, sweep: str | None,
    jobs: int | None, cluster: str, plot: str | None, sides: str, **boundary: str,
) -> int:  # fmt: skip
    from sensorgen.prediction import compression

    if accuracy is not None and check_mesh:
        raise BadInput("--accuracy and --check-mesh at once; the first checks the mesh too, expected one of them")
    options.refuse_explain(explain, many=bool(sweep))
    if explain and accuracy is None:
        raise BadInput("--explain without --accuracy: there is no plan; expected an accuracy, as --accuracy 1e-2")
    if plot and sweep:
        raise BadInput("--plot draws one design; expected --csv or --json with --sweep")
    asked = compression.Asked(
        compression.stresses_kpa(stress), compression.boundary(sides, **boundary), model or "", accuracy or inf,
        check_mesh=check_mesh, keep=not no_cache, sides=sides,
    )  # fmt: skip
    of = body_options.body_of()
    found: Any
    if sweep:
        key, designs = settings.sweep(sweep, design)
        points = [(value, of(each)) for value, each in designs]
        with sweeps.bar(len(points)) as done:
            found = compression.sweep(key, points, asked, sweeps.at_once(jobs), done, cluster)
    else:
        with sweeps.pressing(asked.stress_kpa) as step:
            found = compression.answer(of(design), asked, step=step)
    if plot:
        from sensorgen.analysis.plots import compression as figures
        from sensorgen.analysis.plots import static
        from sensorgen.core import files

        files.replace(Path(plot), static.png(figures.figure(found)))
    render.deliver(found, before=found.explained() if explain else ())
    return render.verdict(*found.problems())


command = DesignGroup(
    _work, OWN, name="compress",
    help="Press a cell: displacement and capacitance over stress, by finite elements with contact; of a cross-section "
    "in plane strain, of boxes in 3D, of round and tapered bodies about their axis. Exit code 1 where a check says "
    "that the answer is not to be trusted.",
)  # fmt: skip
