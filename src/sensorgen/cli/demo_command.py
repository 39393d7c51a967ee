"""``sensorgen demo``: the whole loop on a virtual laboratory."""

import webbrowser
from pathlib import Path

import click

from sensorgen.cli import render, show


@click.group("demo")
def command() -> None:
    """Demonstrations that need no hardware."""


def _lab(out: str, count: int, seed: int, *, show_it: bool) -> None:
    """Design, print, press, calibrate, find presses again, report: on a virtual column of sensors.

    Each virtual print has material values of its own, drawn from their ranges; the result holds what the calibration
    found beside them. All files stay in --out: plan, experiments, log, report.
    """
    from sensorgen.workflows.demo import demo

    with show.progress(["demo"]) as step:
        found = demo(Path(out), count=count, seed=seed, step=step)
    render.deliver(found)
    if show_it:
        webbrowser.open(Path(found.page).resolve().as_uri())


def _insole(out: str, seed: int, *, show_it: bool) -> None:
    """Outline, design, check, virtual print with two faults, calibration, a step, maps beside the truth, report.

    A second run follows with the design changed by the report of the first.
    """
    from sensorgen.workflows.insole import demo

    with show.progress(["demo"]) as step:
        found = demo(Path(out), seed=seed, step=step)
    render.deliver(found)
    if show_it:
        webbrowser.open(Path(found.page).resolve().as_uri())


def _common(out: str) -> list[click.Parameter]:
    """Options of every demonstration."""
    return [
        click.Option(["--out"], default=out, show_default=True, metavar="DIR", help="New or empty folder."),
        click.Option(
            ["--seed"], type=click.IntRange(0), default=1, show_default=True,
            help="Of the first virtual print; the others follow.",
        ),
        click.Option(
            ["--open/--no-open", "show_it"], default=True, show_default=True, help="Show the report in the browser."
        ),
        *render.options("json", "markdown"),
    ]  # fmt: skip


command.add_command(
    click.Command(
        "insole", callback=_insole, help=_insole.__doc__, params=_common("out/demo-insole"),
        short_help="An insole, from its outline to pressure maps beside the truth.",
    )
)  # fmt: skip
command.add_command(
    click.Command(
        "lab", callback=_lab, help=_lab.__doc__, short_help="The whole loop on a virtual column of five.",
        params=[
            click.Option(
                ["--prints", "count"], type=click.IntRange(1, 20), default=5, show_default=True,
                help="How many sensors the column has.",
            ),
            *_common("out/demo-lab"),
        ],
    )
)  # fmt: skip
