"""``sensorgen show|draw|export``: a design as a page, a drawing, or the printed body as a file for other programs."""

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.designs import of_design
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option, Without

if TYPE_CHECKING:
    from sensorgen.design.design import Design


@of_design("show", tip=True)
def show_command(design: "Design", *, output: Path | None = None, no_open: bool = False) -> None:
    """Show a design as one offline page: bodies in 3D, section, layers as printed, numbers and findings.

    Parameters
    ----------
    output, --output, -o : FILE
        Page to write; NAME.html here if not given.
    no_open
        Write the page without opening it in the browser.
    """
    from sensorgen.workflows.decision import PAGE_STEPS, page_of

    path = output or Path(f"{design.name}.html")
    if path.suffix.lower() not in (".html", ".htm"):
        raise BadInput(f"--output {output}: the page is HTML; expected a name in .html")
    with render.progress(PAGE_STEPS) as step:
        page = page_of(design, step=step)
    render.file(path, page)
    if not no_open and not webbrowser.open(path.resolve().as_uri()):
        render.say(f"sensorgen: no browser to open {path} in; open it by hand, or use --no-open", err=True)


@of_design("draw")
def draw_command(design: "Design", *, output: str = "", body: BodyChoice) -> None:
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


@of_design("export")
def export_command(
    design: "Design", *,
    printed: bool = False,  # noqa: ARG001
    output: Path | None = None,
    voxel_mm: Annotated[float | None, Option(kind="length")] = None,
    body: Annotated[BodyChoice, Without(("drawn",))],
) -> None:  # fmt: skip
    """Write the body as printed for other programs: 3MF, STEP, STL, or voxels as VTU.

    Parameters
    ----------
    printed
        The print; always (build writes the drawing).
    output, --output, -o : FILE
        FILE.3mf or FILE.step: bodies with materials; FILE.stl: all as one, and a file for each material; FILE.vtu:
        voxels with materials. NAME.3mf here if not given.
    voxel_mm
        Longest side of a voxel; half a layer if not given.
    """
    from sensorgen.workflows.export import export

    body_printed, _ = body.printed(design)
    assert body_printed is not None  # noqa: S101  (there is no --drawn)
    render.say(body_printed.provenance)
    for path in export(body_printed, output or Path(f"{design.name}.3mf"), voxel_mm):
        render.say(path)
