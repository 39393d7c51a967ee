"""``sensorgen cell``: capacitance per area between certified bounds, for one design or along a sweep."""

from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import body_options, options, render, settings, sweeps
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Values, one
from sensorgen.core.errors import BadInput
from sensorgen.core.units import FREQUENCY_HZ, LENGTH_MM

if TYPE_CHECKING:
    from sensorgen.design.design import Design

FORMULA = "thesis-"  # how the names of formulas begin

OWN: list[click.Parameter] = [
    options.accuracy(
        "Relative width of the bounds; 1e-3 for a cross-section and 1e-2 in 3D if not given, as in all commands."
    ),
    click.Option(["--model"], metavar="NAME", default="", help="Ask this model only: columns, thesis-3.35."),
    options.option(
        "--frequency", Values(FREQUENCY_HZ, zero=False),
        "Of the field, where a dielectric leaks: --set resistivity_x60=1e8; a loss_x60=0.02 needs none.",
    ),
    options.option(
        "--press press_mm", Values(LENGTH_MM, zero=True),
        "Displacement of the top, as 20um or 0:0.05:0.01, for formulas of it; solved: compress.",
    ),
    options.explain(), options.no_cache(), *body_options.body_options(), *sweeps.options(), *render.options(),
]  # fmt: skip


def _work(
    design: "Design", *, accuracy: float | None, model: str, frequency: tuple[float, ...] | None,
    press_mm: tuple[float, ...] | None, explain: bool, no_cache: bool,
    sweep: str | None, jobs: int | None, cluster: str,
) -> int:  # fmt: skip
    from sensorgen.prediction import capacitance_answer as cell

    options.refuse_explain(explain, many=bool(sweep))
    asked = cell.Asked(accuracy, model, not no_cache, one("--frequency", frequency) if frequency else None)
    key, points = settings.sweep(sweep, design) if sweep else ("", [("", design)])
    of = body_options.body_of()
    found: Any
    if model.startswith(FORMULA):
        from sensorgen.prediction import thesis_formulas as formulas

        if explain:
            raise BadInput(f"--explain: {model} is asked alone, there is no plan; leave out --model")
        presses = press_mm or ()
        if key or len(presses) > 1:
            found = formulas.sweep(key, points, asked, presses)
        else:
            found = formulas.answer(design, asked, presses[0] if presses else None)
    elif press_mm:
        raise BadInput("--press is for formulas, as --model thesis-3.1.2; solved, under a stress: sensorgen compress")
    elif sweep:
        with sweeps.bar(len(points)) as done:
            found = cell.sweep(
                key, [(value, of(each)) for value, each in points], asked, sweeps.at_once(jobs), done, cluster
            )
    else:
        found = cell.answer(of(design), asked)
    render.deliver(found, before=found.explained() if explain else ())
    return render.verdict(*found.problems())


command = DesignGroup(
    _work, OWN, name="cell",
    help="Certified bounds of the capacitance per area, by the least expensive model within the accuracy. Exit code 1 "
    "where none reaches it.",
)  # fmt: skip
