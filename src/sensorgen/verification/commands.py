"""Commands for developers: ``sensorgen chart``, ``sensorgen thesis``."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import arguments, options_of
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import BodyChoice, DesignGroup
from sensorgen.core.display import escaped
from sensorgen.core.errors import BadInput, NotInstalled, UnknownName
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.verification.chart.results import Chart

QUANTITIES = ("capacitance", "compression", "line", "prediction")


Quantities = Annotated[tuple[str, ...], Option(kind=QUANTITIES)]
Force = Annotated[float, Option(kind="ratio", typed="5")]
Budget = Annotated[float, Option(kind="ratio", typed="5")]


def _of_design(
    design: "Design", *, quantity: Quantities = (), force_n: Force, budget: Budget, body: BodyChoice,
    output: Path = Path("out/chart"),
) -> int:  # fmt: skip
    """Measure the models that apply to a design.

    Parameters
    ----------
    quantity
        Of these alone; may be given several times.
    force_n : N
        Force in the middle, on a tip of 10 mm.
    budget : SECONDS
        Leave out each step that should take longer.
    output, --output, -o : DIR
        Folder of the files.
    """
    from sensorgen.analysis.plots.figure import needed
    from sensorgen.core.document import to_json
    from sensorgen.prediction.query import Query
    from sensorgen.verification.chart import design as of_design

    needed("matplotlib", "plotly")
    keys = quantity or QUANTITIES
    with render.progress(keys) as step:
        measured = of_design.chart(body(design), Query(force_n=force_n), keys, budget_s=budget, step=step)
    names = _written(measured, output, {"chart.json": to_json(measured).encode()})
    render.deliver(measured)
    if not render.form():
        render.say("\n".join(names))
    return render.verdict(*measured.problems())


def _written(chart: "Chart", output: Path, contents: dict[str, bytes]) -> list[str]:
    """Names of the files of a chart, beside further ones."""
    from sensorgen.verification.chart import plot

    contents["chart.csv"] = chart.csv().encode()
    if chart.points:
        contents["chart.png"] = plot.png(chart)
    contents["chart.html"] = plot.html(chart).encode()
    if overview := plot.overview(chart):
        contents["overview.png"] = overview
    return render.written(output, contents.items())


def _of_scenes(
    *, scene: tuple[str, ...] = (), budget: Annotated[float, Option(kind="ratio", typed="60")] = 60.0,
    output: Path = Path("out/chart"), as_json: bool = False,
) -> None:  # fmt: skip
    """Measure the models on standard scenes.

    Parameters
    ----------
    scene : NAME
        Without a design: a standard scene, as 'tri, 0.1 mm'; all if not given.
    budget : SECONDS
        Leave out what takes longer.
    output, --output, -o : DIR
        Folder of the files.
    as_json, --json
        Print what was measured as JSON, too.
    """
    from sensorgen.analysis.plots.figure import needed
    from sensorgen.core.document import to_json
    from sensorgen.verification.chart import scenes as standard

    needed("matplotlib", "plotly")
    for name in scene:
        if name not in standard.SCENES:
            raise UnknownName("standard scene", name, standard.SCENES)
    names = scene or tuple(standard.SCENES)
    with render.progress(names) as step:
        measured = standard.chart(names, budget, step)
    where = _written(measured, output, {})
    render.say(escaped(to_json(measured)) if as_json else "\n".join(where))


def _begin(**given: Any) -> None:
    """Without a design, the standard scenes; before one, no options."""
    context = click.get_current_context()
    if context.invoked_subcommand is None:
        _of_scenes(**arguments(_of_scenes, given))
        return
    for option in context.command.params:
        if option.name and context.get_parameter_source(option.name) is not click.core.ParameterSource.DEFAULT:
            word = option.opts[0]
            raise BadInput(f"{word} stands before the design; write {context.command_path} DESIGN {word} ...")


chart_command = DesignGroup(
    "chart", _of_design, *render.options(file=False), params=options_of(_of_scenes), callback=_begin,
    invoke_without_command=True,
    help="""Measure speed against accuracy of every model.

    With a design: every model that applies to it, and scikit-fem, NGSolve, FastCap, scikit-rf and ngspice where they
    are installed, for its capacitance, compression, line and whole prediction; time (cold and warm), memory and error
    against the best answer of another program. Writes chart.html, chart.png, chart.json and chart.csv.

    Without one: every model on every standard scene of which the answer is known from elsewhere. Writes overview.png,
    chart.png, chart.html and chart.csv, which also says why a model is silent on a scene.""",
)  # fmt: skip


FORMATS = ("html", "md", "json")


@of_function("thesis")
def thesis_command(
    *, output: Path = Path("out/thesis"), formats: Annotated[tuple[str, ...], Option(kind=FORMATS)] = ("html", "md")
) -> int:
    """Compute every numbered equation, table and figure of the thesis, and say how far it agrees.

    Ends with 1 where a value differs for an unknown reason. What takes long is solved once and kept.

    Parameters
    ----------
    output, --output, -o : DIR
        Folder of thesis.html and the like.
    formats, --format
        What to write; may be given several times.
    """
    from sensorgen.verification import thesis
    from sensorgen.verification.thesis.items import CHAPTERS, UNEXPLAINED, WORDS

    if find_spec("ngsolve") is None:  # other models would answer, and differ
        raise NotInstalled("thesis needs the solver NGSolve: pip install 'sensorgen[fem]'")
    with render.progress(CHAPTERS) as step:
        rows = thesis.rows(step)
    documents: dict[str, Callable[[Sequence[thesis.ReproducedItem]], str]] = {
        "html": thesis.html, "md": thesis.markdown,
        "json": lambda rows: json.dumps(thesis.plain(rows), indent=2, ensure_ascii=False) + "\n",
    }  # fmt: skip
    for name in dict.fromkeys(formats):
        file = output / f"thesis.{name}"
        render.file(file, documents[name](rows))
    counts = Counter(row.verdict.word for row in rows)
    render.say(", ".join(f"{counts[word]} {word}" for word in WORDS if counts[word]))
    for row in rows:
        if row.verdict.word == UNEXPLAINED:
            render.say(f"sensorgen: {row.name()}: {row.verdict.text()}", err=True)
    return FOUND_ERRORS if counts[UNEXPLAINED] else 0
