"""``sensorgen draw``: the dimensioned cross-section."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, render
from sensorgen.cli.designs import DesignGroup
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(
        ["--output", "-o"],
        metavar="FILE",
        help="SVG file of the section, or HTML page of the print layer by layer; NAME.svg here if not given, - for the "
        "terminal.",
    ),
    *body_options.body_options(),
]


def _work(design: "Design", *, output: str | None) -> int:
    from sensorgen.checks.review import draw
    from sensorgen.core import files as store

    if output and output != "-" and Path(output).suffix.lower() not in ("", ".svg", ".html"):
        raise BadInput(
            f"--output {output}: the drawing is SVG, or a page of layers; expected a name in .svg or .html, or - "
            "to print the SVG"
        )
    made, held = body_options.printed_of(design)
    if output and output.lower().endswith(".html"):
        from sensorgen.analysis.plots import layers

        if made is None:
            raise BadInput(f"--output {output}: layers are those of a print; expected it without --drawn")
        store.replace(Path(output), layers.of_print(made, held.findings).encode())
        render.say(output)
        return 0
    text = draw(design, held, made.scene, made.provenance) if made else draw(design, held)
    if output == "-":
        render.say(text, nl=False)
        return 0
    path = Path(output or f"{design.name}.svg")
    store.replace(path, text.encode())
    render.say(str(path))
    render.say("findings in full: sensorgen check; in 3D and layers: sensorgen show", err=True)
    return 0


command = DesignGroup(
    _work,
    OWN,
    name="draw",
    help="Draw the cross-section, its layers and findings, as SVG; or the print layer by layer, as a page.",
)
