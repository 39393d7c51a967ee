"""``sensorgen bench hysteresis``: how far the way down of each press lies from its way up."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import bench_opened, show
from sensorgen.cli.log_text import visible
from sensorgen.cli.log_words import as_json as json_option
from sensorgen.cli.log_words import made
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.signal.hysteresis import Hysteresis
    from sensorgen.measure.signal.run import Processed

_PARTS = ("R", "X")
_LAW = "smooth"


def _hysteresis(
    what: str, rig_file: str | None, threshold_n: float, plot: str | None, *, as_json: bool, **how: Any
) -> None:
    """Show how far readings on the way down of each press lie from those on its way up, at the same force.

    For presses that go up and down again over some seconds, with the rig's log that measured the force. The distance is
    the largest one, over the span of the readings, with the standard error that noise gives it.
    Drift is taken out by a law of time alone: what the film remembers of presses is what is looked for.
    """
    from sensorgen.measure.signal.hysteresis import of_presses

    if not how["keep_drift"]:
        how["law"] = how["law"] or _LAW
    worked, rig = bench_opened.worked_up(what, rig_file, **how)
    if rig is None:
        raise BadInput(f"{what}: no log of a rig; expected one with the force, with --rig FILE")
    found = of_presses(worked, threshold_n)
    files = [_drawn(worked, found.ways, bench_opened.name_of(what), plot)] if plot else []
    if as_json:
        tones = worked.recording.tones_hz.tolist()
        presses = [_data(at, way) for at, way in found.ways.items()]
        show.as_json({"tones_hz": tones, "presses": presses, "left_out": list(found.left_out), "files": files})
        return
    for line in (*_lines(worked, found.ways), *found.left_out, *files):
        click.echo(visible(line))


def _lines(worked: "Processed", ways: "dict[float, Hysteresis]") -> Iterator[str]:
    """A line for each press: R and X at the first and at the last tone."""
    tones = worked.recording.tones_hz.tolist()
    ends = sorted({0, len(tones) - 1})
    heads = [f"{part} {units.frequency_text(tones[k])}" for k in ends for part in _PARTS]
    yield f"{'start [s]':>9} {'to [N]':>6}" + "".join(f" {head + ' ±':>15} {'at [N]':>6}" for head in heads)
    for at, way in ways.items():
        columns = [k + part * len(tones) for k in ends for part in (0, 1)]
        said = (f" {f'{way.share[c]:.2%} {way.error[c]:.2%}':>15} {way.at_n[c]:6.2f}" for c in columns)
        yield f"{at:9.2f} {way.force_n[-1]:6.2f}" + "".join(said)


def _data(start_s: float, way: "Hysteresis") -> dict[str, Any]:
    """For programs: of R, then of X, tone by tone."""
    half = len(way.share) // 2
    return {"time_s": start_s, "force_n": [float(way.force_n[0]), float(way.force_n[-1])]} | {
        f"{name}_{part}": getattr(way, name)[k * half : (k + 1) * half].tolist()
        for name in ("share", "error", "at_n", "lost")
        for k, part in enumerate(("re", "im"))
    }


def _drawn(worked: "Processed", ways: "dict[float, Hysteresis]", name: str, plot: str) -> str:
    from sensorgen.analysis.plots import recordings, static
    from sensorgen.core import files as store

    if not plot.lower().endswith(".png"):
        raise BadInput(f"--plot {plot}: expected a file that ends in .png")
    store.replace(Path(plot), static.png(recordings.hysteresis(ways, worked.recording.tones_hz, name)))
    return plot


command = made(
    _hysteresis, "hysteresis", "Show how far ways up and down of presses lie apart.",
    click.Argument(["what"], metavar="RECORDING_FILE|NUMBER"),
    click.Option(["--rig", "rig_file"], metavar="FILE", help="The rig's log that belongs to RECORDING_FILE."),
    *bench_opened.options(),
    click.Option(
        ["--threshold", "threshold_n"], type=click.FloatRange(0, min_open=True), default=0.2, show_default=True,
        metavar="N", help="Force from which on the tip presses.",
    ),
    click.Option(["--plot"], metavar="FILE.png", help="Draw the ways up and down over the force."),
    json_option(),
)  # fmt: skip
