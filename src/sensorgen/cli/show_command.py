"""``sensorgen show``: a design as one page."""

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import options, render, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    options.of_design_tip(),
    click.Option(["--output", "-o"], metavar="FILE", help="Page to write; NAME.html here if not given."),
    click.Option(["--no-open"], is_flag=True, help="Write the page without opening it in the browser."),
]


def _work(design: "Design", *, output: str | None, no_open: bool) -> int:
    from sensorgen.core import files
    from sensorgen.workflows.preview import STEPS, page_of

    path = Path(output or f"{design.name}.html")
    if path.suffix.lower() not in (".html", ".htm"):
        raise BadInput(f"--output {output}: the page is HTML; expected a name in .html")
    with show.progress(STEPS) as step:
        files.replace(path, page_of(design, step=step).encode())
    render.say(str(path))
    if not no_open and not webbrowser.open(path.resolve().as_uri()):
        render.say(f"sensorgen: no browser to open {path} in; open it by hand, or use --no-open", err=True)
    return 0


command = DesignGroup(
    _work, OWN, name="show",
    help="Show a design as one offline page: bodies in 3D, section, layers as printed, numbers and findings.",
)  # fmt: skip
