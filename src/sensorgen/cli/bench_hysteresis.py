"""``sensorgen bench hysteresis``: distance of the way down of each press from its way up."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import bench_opened, render
from sensorgen.cli.bench_opened import Opening, Rig, bench
from sensorgen.cli.commands import command
from sensorgen.cli.words import NumberRange
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.core.document import Documented

_LAW = "smooth"
Threshold = Annotated[float, Option(kind=NumberRange(0, min_open=True))]


@command(
    "hysteresis", *render.options("json", "markdown"), group=bench,
    short="Show how far ways up and down of presses lie apart.",
)  # fmt: skip
def _hysteresis(
    what: str, *, rig_file: Rig = None, opening: Opening, threshold_n: Threshold = 0.2,
    plot: Annotated[Path | None, Option(kind="png")] = None,
) -> "Documented":  # fmt: skip
    """Show how far readings on the way down of each press lie from those on its way up, at the same force.

    For presses that go up and down again over some seconds, with the rig's log that measured the force. The distance is
    the largest one, over the span of the readings, with the standard error that noise gives it.
    Drift is taken out by a law of time alone: what the film remembers of presses is what is looked for.

    Parameters
    ----------
    what : RECORDING_FILE|NUMBER
    threshold_n : N
        Force from which on the tip presses.
    plot : FILE.png
        Draw the ways up and down over the force.
    """
    from sensorgen.measure.signal.hysteresis import of_presses
    from sensorgen.measure.signal.results import of_ways

    if not opening.keep_drift:
        opening = replace(opening, law=opening.law or _LAW)
    run, rig = opening.processed(what, rig_file)
    if rig is None:
        raise BadInput(f"{what}: no log of a rig; expected one with the force, with --rig FILE")
    presses = of_presses(run, threshold_n)
    if plot:
        from sensorgen.analysis.plots import recordings, static
        from sensorgen.core import files

        figure = recordings.hysteresis(presses.ways, run.recording.tones_hz, bench_opened.name_of(what))
        files.replace(plot, static.png(figure))
    return of_ways(run.recording.tones_hz, presses, [str(plot)] if plot else [])
