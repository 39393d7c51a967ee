"""``sensorgen bench hysteresis``: how far the way down of each press lies from its way up."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import bench_opened, render
from sensorgen.cli.log_words import made
from sensorgen.cli.words import NumberRange, Png
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.signal.hysteresis import Hysteresis
    from sensorgen.measure.signal.run import Processed

_LAW = "smooth"


def _hysteresis(what: str, rig_file: str | None, threshold_n: float, plot: str | None, **how: Any) -> None:
    """Show how far readings on the way down of each press lie from those on its way up, at the same force.

    For presses that go up and down again over some seconds, with the rig's log that measured the force. The distance is
    the largest one, over the span of the readings, with the standard error that noise gives it.
    Drift is taken out by a law of time alone: what the film remembers of presses is what is looked for.
    """
    from sensorgen.measure.signal.hysteresis import of_presses
    from sensorgen.measure.signal.results import of_ways

    if not how["keep_drift"]:
        how["law"] = how["law"] or _LAW
    worked, rig = bench_opened.worked_up(what, rig_file, **how)
    if rig is None:
        raise BadInput(f"{what}: no log of a rig; expected one with the force, with --rig FILE")
    found = of_presses(worked, threshold_n)
    files = [_drawn(worked, found.ways, bench_opened.name_of(what), plot)] if plot else []
    render.deliver(of_ways(worked.recording.tones_hz, found, files))


def _drawn(worked: "Processed", ways: "dict[float, Hysteresis]", name: str, plot: str) -> str:
    from sensorgen.analysis.plots import recordings, static
    from sensorgen.core import files as store

    store.replace(Path(plot), static.png(recordings.hysteresis(ways, worked.recording.tones_hz, name)))
    return plot


command = made(
    _hysteresis, "hysteresis", "Show how far ways up and down of presses lie apart.",
    click.Argument(["what"], metavar="RECORDING_FILE|NUMBER"),
    click.Option(["--rig", "rig_file"], metavar="FILE", help="The rig's log that belongs to RECORDING_FILE."),
    *bench_opened.options(),
    click.Option(
        ["--threshold", "threshold_n"], type=NumberRange(0, min_open=True), default=0.2, show_default=True,
        metavar="N", help="Force from which on the tip presses.",
    ),
    click.Option(["--plot"], type=Png(), metavar="FILE.png", help="Draw the ways up and down over the force."),
    *render.options("json", "markdown"),
)  # fmt: skip
