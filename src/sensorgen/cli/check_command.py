"""``sensorgen check``: whether it will print."""

from typing import TYPE_CHECKING

import click

from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the findings as JSON."),
]


def _work(design: "Design", *, strict: bool, as_json: bool) -> int:
    from sensorgen.checks.review import STEPS, report, review

    with show.progress(STEPS) as step:
        held = review(design, step)
    if as_json:
        show.as_json(report(design, held))
    else:
        show.findings(held.findings)
        click.echo(f"{design.name}: {show.summary(held)}")
    return 1 if held.errors(strict) or held.lost() else 0


command = DesignGroup(_work, OWN, name="check", help="Check a design against nozzle, layers and bed.")
