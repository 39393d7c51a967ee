"""``sensorgen report``: predicted beside measured, as one page."""

import re
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import log_words, render, show
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.analysis.report import Report

FORMATS = ("html", "md", "csv", "json")


def _work(
    specimens: tuple[str, ...],
    iteration: int | None,
    file: str | None,
    output: str | None,
    how: str,
    pictures: str | None,
    *,
    show_it: bool,
) -> int:
    """Compare predictions and measurements of specimens, of an iteration, or of everything in the log.

    One HTML file that needs no network, or Markdown, CSV or JSON with the same numbers. Prints the headline and the
    name of the file.
    """
    from sensorgen.analysis.report import pieces
    from sensorgen.analysis.report.contents import STEPS, report
    from sensorgen.core import document
    from sensorgen.core import files as store

    if show_it and (how != "html" or output == "-"):
        raise BadInput("--open shows an HTML file; expected --format html and a file")
    if specimens and iteration is not None:
        raise BadInput(f"--iteration {iteration} beside specimens; expected one of the two")
    with log_words.opened(file) as log, show.progress(STEPS) as step:
        made = report(log, iteration, step, specimens=specimens)
    if pictures:
        _draw(made, Path(pictures))
    if output == "-":
        render.write(pieces(made, how))
        return 0
    which = iteration if iteration is not None else re.sub(r"\W+", "-", made.specimens[0]) if made.specimens else "all"
    path = Path(output or f"report-{which}.{how}")
    with store.replacing(path) as target:
        target.writelines(piece.encode() for piece in pieces(made, how))
    render.write(f"{line}\n" for line in document.text([*made.headline, str(path)]))
    if show_it:
        webbrowser.open(path.resolve().as_uri())
    return 0


def _draw(made: "Report", folder: Path) -> None:
    from sensorgen.analysis.plots.static import files
    from sensorgen.core import files as store

    with show.progress([figure.key for figure in made.figures]) as step:
        for figure in made.figures:
            step(figure.key)
            for name, content in files(figure):
                store.replace(folder / name, content)


command = click.Command(
    "report", callback=_work, help=_work.__doc__,
    params=[
        click.Argument(["specimens"], metavar="[SPECIMEN]...", nargs=-1),
        click.Option(["--iteration"], type=click.IntRange(0), help="Of the design."),
        log_words.where(),
        click.Option(
            ["--output", "-o"], metavar="FILE", help="File to write; report-WHICH.FORMAT here if not given, - to print."
        ),
        click.Option(["--format", "how"], type=OneOf(FORMATS), default="html", show_default=True, help="Of the file."),
        click.Option(["--figures", "pictures"], metavar="FOLDER", help="Write every figure there too, as PNG and SVG."),
        click.Option(["--open", "show_it"], is_flag=True, help="Show the page in the browser."),
    ],
)  # fmt: skip
