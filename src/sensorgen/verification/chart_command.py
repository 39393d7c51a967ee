"""``sensorgen chart``: every model on every standard scene, time against error."""

import json
from pathlib import Path

import click

from sensorgen.cli import escaped, render, show
from sensorgen.cli.words import Ratio
from sensorgen.core.errors import UnknownName

FILES = ("chart.csv", "chart.png", "chart.html")


@click.command("chart")
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
    import csv
    import io

    from sensorgen.analysis.plots.libraries import needed
    from sensorgen.core import files as store
    from sensorgen.verification import chart
    from sensorgen.verification.chart import plot

    needed("matplotlib", "plotly")
    for name in scene:
        if name not in chart.SCENES:
            raise UnknownName("standard scene", name, chart.SCENES)
    names = scene or chart.SCENES
    with show.progress(names) as step:
        points = chart.points(names, budget, step)
    rows = [vars(one) for one in (*points, *chart.silent(names, points))]
    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    for name, content in zip(
        FILES, (text.getvalue().encode(), plot.png(points), plot.html(points).encode()), strict=True
    ):
        store.replace(Path(output) / name, content)
        if not as_json:
            render.say(Path(output) / name)
    if as_json:
        render.say(escaped(json.dumps(rows, indent=2, ensure_ascii=False)))
