"""``sensorgen draw``: the dimensioned cross-section."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(
        ["--output", "-o"], metavar="FILE", help="SVG file to write; NAME.svg here if not given, - for the terminal."
    ),
    *body_options.body_options(),
]


def _work(design: "Design", *, output: str | None) -> int:
    from sensorgen.checks.review import STEPS, draw, review
    from sensorgen.core import files as store

    if output and output != "-" and Path(output).suffix.lower() not in ("", ".svg"):
        raise BadInput(f"--output {output}: the drawing is SVG; expected a name that ends in .svg, or - to print it")
    made = body_options.printed_of(design)
    with show.progress(STEPS) as step:
        held = review(design, step)
    if made:
        held = replace(held, findings=[*made.findings(), *held.sliced().findings])
    text = draw(design, held, made.scene, made.provenance) if made else draw(design, held)
    if output == "-":
        click.echo(text, nl=False)
        return 0
    path = Path(output or f"{design.name}.svg")
    store.replace(path, text.encode())
    click.echo(str(path))
    return 0


command = DesignGroup(_work, OWN, name="draw", help="Draw the cross-section, its layers and findings, as SVG.")
