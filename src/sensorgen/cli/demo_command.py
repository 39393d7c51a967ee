"""``sensorgen demo``: the whole loop on a virtual laboratory."""

import webbrowser
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import click

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import Out
from sensorgen.core.options import Option

command = click.Group("demo", help="Demonstrations that need no hardware.")
FORMS = render.options("json", "markdown", folder=True)
Prints = Annotated[int, Option(kind=click.IntRange(1, 20))]
Seed = Annotated[int, Option(kind=click.IntRange(0))]


@of_function("lab", *FORMS, group=command, short="The whole loop on a virtual column of five.")
def _lab(*, out: Out = Path("out/demo-lab"), count: Prints = 5, seed: Seed = 1, show_it: bool = True) -> None:
    """Design, print, press, calibrate, find presses again, report: on a virtual column of sensors.

    Each virtual print has material values of its own, drawn from their ranges; the result holds what the calibration
    found beside them. All files stay in --out: plan, experiments, log, report.

    Parameters
    ----------
    out
        New or empty folder.
    count, --prints
        How many sensors the column has.
    seed
        Of the first virtual print; the others follow.
    show_it, --open/--no-open
        Show the report in the browser.
    """
    from sensorgen.workflows.demo import demo

    _shown(partial(demo, out, count=count, seed=seed), show_it=show_it)


@of_function("insole", *FORMS, group=command, short="An insole, from its outline to pressure maps beside the truth.")
def _insole(*, out: Out = Path("out/demo-insole"), seed: Seed = 1, show_it: bool = True) -> None:
    """Outline, design, check, virtual print with two faults, calibration, a step, maps beside the truth, report.

    A second run follows with the design changed by the report of the first.

    Parameters
    ----------
    out
        New or empty folder.
    seed
        Of the first virtual print; the others follow.
    show_it, --open/--no-open
        Show the report in the browser.
    """
    from sensorgen.workflows.insole import demo

    _shown(partial(demo, out, seed=seed), show_it=show_it)


def _shown(demo: Callable[..., Any], *, show_it: bool) -> None:
    """Run a demonstration, deliver its result, and open its page."""
    with render.progress(["demo"]) as step:
        result = demo(step=step)
    render.deliver(result)
    if show_it:
        webbrowser.open(Path(result.page).resolve().as_uri())
