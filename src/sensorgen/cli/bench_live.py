"""``sensorgen bench live``: readings through the low-pass as they come."""

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.bench_opened import Cutoff, bench
from sensorgen.cli.commands import command
from sensorgen.core import units
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.measure.readings import FileRows, Readings
    from sensorgen.measure.recording.samples import Complex

Rate = Annotated[float, Option(more={"required": True})]


@command("live", group=bench, short="Low-pass readings as they come.")
def _live(measured: str, *, rate_hz: Rate, cutoff_hz: Cutoff = None) -> None:
    """Low-pass readings as they come, row by row, onto the standard output.

    The filter begins in the steady state of the first reading and delays by 1.5 s at the thesis's cut-off. Where a
    reading is missing the one before is held, and its cells stay empty. Rows must come at an even --rate; columns
    that are no readings pass as they are.

    Parameters
    ----------
    measured : MEASURED.csv|-
    rate_hz : HZ
        Rows per second.
    """
    from sensorgen.measure.readings import readings
    from sensorgen.measure.signal.lowpass import CUTOFF_HZ, Live

    smooth = Live(rate_hz, cutoff_hz or CUTOFF_HZ)
    with readings(measured) as source:
        render.say(_header(source))
        for block in source.blocks():
            render.say("".join(_rows(block, smooth(block.impedance_ohm))), nl=False)


def _header(source: "Readings") -> str:
    tones = (units.frequency_text(float(f)) for f in source.frequency_hz)
    return ",".join([*map(_cell, source.kept), *(f"{part}_ohm_{f}" for f in tones for part in ("re", "im"))])


def _rows(block: "FileRows", smooth: "Complex") -> Iterator[str]:
    for kept, row in zip(block.kept, smooth.tolist(), strict=True):
        parts = (f"{part:.12g}" if isfinite(z.real) else "" for z in row for part in (z.real, z.imag))
        yield ",".join([*map(_cell, kept), *parts]) + "\n"


def _cell(text: str) -> str:
    """A cell as CSV; quoted where it would come apart."""
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\r\n') else text
