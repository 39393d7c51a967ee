"""``sensorgen draw``: the dimensioned cross-section."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup

if TYPE_CHECKING:
    from sensorgen.design import Design

OWN: list[click.Parameter] = [
    click.Option(
        ["--output", "-o"], metavar="FILE", help="SVG file to write; NAME.svg here if not given, - for the terminal."
    )
]


def _work(design: "Design", *, output: str | None) -> int:
    from sensorgen import store
    from sensorgen.build import draw
    from sensorgen.review import STEPS, review

    with show.progress(STEPS) as step:
        text = draw(design, review(design, step))
    if output == "-":
        click.echo(text, nl=False)
        return 0
    path = Path(output or f"{design.name}.svg")
    store.replace(path, text.encode())
    click.echo(str(path))
    return 0


command = DesignGroup(_work, OWN, name="draw", help="Draw the cross-section, its layers and findings, as SVG.")
