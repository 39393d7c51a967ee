"""``sensorgen show``: a design as one page."""

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.cli import render, show
from sensorgen.cli.designs import of_design
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design


@of_design("show", tip=True)
def command(design: "Design", *, output: Path | None = None, no_open: bool = False) -> None:
    """Show a design as one offline page: bodies in 3D, section, layers as printed, numbers and findings.

    Parameters
    ----------
    output, --output, -o : FILE
        Page to write; NAME.html here if not given.
    no_open
        Write the page without opening it in the browser.
    """
    from sensorgen.workflows.preview import STEPS, page_of

    path = output or Path(f"{design.name}.html")
    if path.suffix.lower() not in (".html", ".htm"):
        raise BadInput(f"--output {output}: the page is HTML; expected a name in .html")
    with show.progress(STEPS) as step:
        page = page_of(design, step=step)
    render.file(path, page)
    if not no_open and not webbrowser.open(path.resolve().as_uri()):
        render.say(f"sensorgen: no browser to open {path} in; open it by hand, or use --no-open", err=True)
