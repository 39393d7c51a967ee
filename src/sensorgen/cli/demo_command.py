"""``sensorgen demo``: the whole loop on a virtual laboratory."""

import webbrowser
from pathlib import Path
from typing import Annotated

import click

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import Out
from sensorgen.core.options import Option

command = click.Group("demo", help="Demonstrations that need no hardware.")
Prints = Annotated[int, Option(kind=click.IntRange(1, 20))]
Seed = Annotated[int, Option(kind=click.IntRange(0))]


@of_function(
    "lab",
    *render.options("json", "markdown", folder=True),
    group=command,
    short="The whole loop on a virtual column of five.",
)
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

    with render.progress(["demo"]) as step:
        loop = demo(out, count=count, seed=seed, step=step)
    render.deliver(loop)
    if show_it:
        webbrowser.open(Path(loop.page).resolve().as_uri())


@of_function(
    "insole", *render.options("json", "markdown", folder=True), group=command,
    short="An insole, from its outline to pressure maps beside the truth.",
)  # fmt: skip
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

    with render.progress(["demo"]) as step:
        steps = demo(out, seed=seed, step=step)
    render.deliver(steps)
    if show_it:
        webbrowser.open(Path(steps.page).resolve().as_uri())
