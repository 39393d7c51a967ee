"""``sensorgen check``: whether it will print."""

from typing import TYPE_CHECKING

import click

from sensorgen.cli import render, show
from sensorgen.cli.designs import DesignGroup

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    *render.options(),
]


def _work(design: "Design", *, strict: bool) -> int:
    from sensorgen.checks.review import STEPS, report, review

    with show.progress(STEPS) as step:
        held = review(design, step)
    render.deliver(report(design, held))
    return 1 if held.errors(strict) or held.lost() else 0


command = DesignGroup(_work, OWN, name="check", help="Check a design against nozzle, layers and bed.")
