"""``sensorgen chart``: every model on every standard scene, time against error."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import show
from sensorgen.cli.words import Ratio
from sensorgen.core.errors import UnknownName, Unwritable

if TYPE_CHECKING:
    from sensorgen.verification.chart.measured import Point

FILES = ("chart.csv", "chart.png", "chart.html")


@click.command("chart", short_help="Draw time against error of every model.")
@click.option("--scene", multiple=True, metavar="NAME", help="A standard scene, as 'tri, 0.1 mm'; all if not given.")
@click.option(
    "--budget", type=Ratio(), default="60", show_default=True, metavar="SECONDS", help="Leave out what takes longer."
)
@click.option("--output", "-o", default="out/chart", show_default=True, metavar="DIR", help="Folder of the files.")
@click.option("--json", "as_json", is_flag=True, help="Print what was measured as JSON, too.")
def command(scene: tuple[str, ...], budget: float, output: str, as_json: bool) -> None:
    """Measure every model on every standard scene.

    Writes processor time against error, with the Pareto front marked: chart.png, chart.html to ask with the mouse,
    and chart.csv, which also says why a model is silent on a scene. The scenes are cells at rest and pressed, blocks,
    lines, sheets, stacks and printed tracks of which the answer is known from elsewhere.
    """
    from sensorgen.analysis.plots.libraries import needed
    from sensorgen.verification import chart

    needed("matplotlib", "plotly")
    for name in scene:
        if name not in chart.SCENES:
            raise UnknownName("standard scene", name, chart.SCENES)
    names = scene or chart.SCENES
    with show.progress(names) as step:
        points = chart.points(names, budget, step)
    rows = [vars(one) for one in (*points, *chart.silent(names, points))]
    _write(Path(output), points, rows)
    if as_json:
        click.echo(json.dumps(rows, indent=2, ensure_ascii=False))
    else:
        for name in FILES:
            click.echo(str(Path(output) / name))


def _write(folder: Path, points: Sequence["Point"], rows: Sequence[dict[str, Any]]) -> None:
    from sensorgen.core import files as store
    from sensorgen.verification.chart import plot as chart

    files = dict(zip(FILES, (_csv(rows).encode(), chart.png(points), chart.html(points).encode()), strict=True))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Unwritable(f"cannot write to {str(folder)!r}: {error.strerror or error}") from None
    for name, content in files.items():
        store.replace(folder / name, content)


def _csv(rows: Sequence[dict[str, Any]]) -> str:
    import csv
    import io

    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()
