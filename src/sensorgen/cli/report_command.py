"""``sensorgen report``: predicted beside measured, as one page."""

import re
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import LogFile
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.analysis.report import Report

Format = Annotated[str, Option(kind=("html", "md", "csv", "json"))]


@of_function("report")
def command(
    specimens: tuple[str, ...] = (), *, iteration: Annotated[int | None, Option(kind=click.IntRange(0))] = None,
    log: LogFile, output: str = "", how: Format = "html", pictures: Path | None = None, show_it: bool = False,
) -> None:  # fmt: skip
    """Compare predictions and measurements of specimens, of an iteration, or of everything in the log.

    One HTML file that needs no network, or Markdown, CSV or JSON with the same numbers. Prints the headline and the
    name of the file.

    Parameters
    ----------
    specimens : [SPECIMEN]...
    output, --output, -o : FILE
        File to write; report-WHICH.FORMAT here if not given, - to print.
    how, --format
        Of the file.
    iteration
        Of the design.
    pictures, --figures : FOLDER
        Write every figure there too, as PNG and SVG.
    show_it, --open
        Show the page in the browser.
    """
    from sensorgen.analysis.report import pieces
    from sensorgen.analysis.report.contents import STEPS, report

    if show_it and (how != "html" or output == "-"):
        raise BadInput("--open shows an HTML file; expected --format html and a file")
    if specimens and iteration is not None:
        raise BadInput(f"--iteration {iteration} beside specimens; expected one of the two")
    with log.opened() as rows, render.progress(STEPS) as step:
        compared = report(rows, iteration, step, specimens=specimens)
    if pictures:
        _draw(compared, pictures)
    if output == "-":
        render.write(pieces(compared, how))
        return
    path = Path(output or f"report-{_which(compared, iteration)}.{how}")
    _write(compared, path, how)
    if show_it:
        webbrowser.open(path.resolve().as_uri())


def _which(compared: "Report", iteration: int | None) -> str:
    """Iteration, first specimen, or all, as a part of a file's name."""
    if iteration is not None:
        return str(iteration)
    return re.sub(r"\W+", "-", compared.specimens[0]) if compared.specimens else "all"


def _write(compared: "Report", path: Path, how: str) -> None:
    """Write the file, and print the headline and its name."""
    from sensorgen.analysis.report import pieces
    from sensorgen.core import document, files

    with files.replacing(path) as target:
        target.writelines(piece.encode() for piece in pieces(compared, how))
    render.write(f"{line}\n" for line in document.text([*compared.headline, str(path)]))


def _draw(compared: "Report", folder: Path) -> None:
    from sensorgen.analysis.plots.static import files
    from sensorgen.core import files as store

    with render.progress([figure.key for figure in compared.figures]) as step:
        for figure in compared.figures:
            step(figure.key)
            for name, content in files(figure):
                store.replace(folder / name, content)
