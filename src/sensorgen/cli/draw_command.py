"""``sensorgen draw``: the dimensioned cross-section."""

from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.cli import render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.designs import of_design
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design


@of_design("draw")
def command(design: "Design", *, output: str = "", body: BodyChoice) -> None:
    """Draw the cross-section, its layers and findings, as SVG; or the print layer by layer, as a page.

    Parameters
    ----------
    output, --output, -o : FILE
        SVG file of the section, or HTML page of the print layer by layer; NAME.svg here if not given, - for the
        terminal.
    """
    from sensorgen.checks.review import draw

    if output != "-" and Path(output).suffix.lower() not in ("", ".svg", ".html"):
        raise BadInput(
            f"--output {output}: the drawing is SVG, or a page of layers; expected a name in .svg or .html, or - "
            "to print the SVG"
        )
    printed, review = body.printed(design)
    if output.lower().endswith(".html"):
        from sensorgen.analysis.plots import layers

        if printed is None:
            raise BadInput(f"--output {output}: layers are those of a print; expected it without --drawn")
        render.file(Path(output), layers.of_print(printed, review.findings))
        return
    svg = draw(design, review, printed.scene, printed.provenance) if printed else draw(design, review)
    if output == "-":
        render.say(svg, nl=False)
    else:
        render.file(Path(output or f"{design.name}.svg"), svg)
        render.say("findings in full: sensorgen check; in 3D and layers: sensorgen show", err=True)
