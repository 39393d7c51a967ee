"""``sensorgen report``: predicted beside measured, as one page."""

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import log_words, show
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.analysis.report import Report

FORMATS = ("html", "md", "csv", "json")


def _work(
    iteration: int, file: str | None, output: str | None, how: str, pictures: str | None, *, show_it: bool
) -> int:
    """Set what was predicted beside what was measured, and say how far apart they are.

    One HTML file that needs no network, or Markdown, CSV or JSON with the same numbers. An iteration without readings
    makes a report that says so.
    """
    from sensorgen.analysis.report import report, written
    from sensorgen.core import files as store

    if show_it and (how != "html" or output == "-"):
        raise BadInput("--open shows an HTML file; expected --format html and a file")
    with log_words.opened(file) as log:
        made = report(log, iteration)
    text = written(made, how)
    if pictures:
        _draw(made, Path(pictures))
    if output == "-":
        click.echo(text, nl=False)
        return 0
    path = Path(output or f"report-{iteration}.{how}")
    store.replace(path, text.encode())
    click.echo(str(path))
    if show_it:
        webbrowser.open(path.resolve().as_uri())
    return 0


def _draw(made: "Report", folder: Path) -> None:
    from sensorgen.analysis.report.pictures import files
    from sensorgen.core import files as store

    with show.progress([chart.key for chart in made.charts]) as step:
        for chart in made.charts:
            step(chart.key)
            for name, content in files(chart):
                store.replace(folder / name, content)


command = click.Command(
    "report", callback=_work, help=_work.__doc__, short_help="Set predicted beside measured, as one page.",
    params=[
        click.Option(["--iteration"], type=click.IntRange(0), required=True, help="Of the design."),
        log_words.where(),
        click.Option(
            ["--output", "-o"], metavar="FILE", help="File to write; report-N.FORMAT here if not given, - to print."
        ),
        click.Option(["--format", "how"], type=OneOf(FORMATS), default="html", show_default=True, help="Of the file."),
        click.Option(["--figures", "pictures"], metavar="FOLDER", help="Write every figure there too, as PNG and SVG."),
        click.Option(["--open", "show_it"], is_flag=True, help="Show the page in the browser."),
    ],
)  # fmt: skip
