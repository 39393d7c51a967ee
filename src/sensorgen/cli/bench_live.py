"""``sensorgen bench live``: readings through the low-pass as they come."""

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING

import click

from sensorgen.cli import render
from sensorgen.cli.log_words import made
from sensorgen.cli.words import Values, one
from sensorgen.core import units

if TYPE_CHECKING:
    from sensorgen.measure.readings import Block, Readings
    from sensorgen.measure.recording.samples import Complex


def _live(measured: str, rate_hz: tuple[float, ...], cutoff_hz: tuple[float, ...] | None) -> None:
    """Low-pass readings as they come, row by row, onto the standard output.

    The filter begins in the steady state of the first reading and delays by 1.5 s at the thesis's cut-off. Where a
    reading is missing the one before is held, and its cells stay empty. Rows must come at an even --rate; columns
    that are no readings pass as they are.
    """
    from sensorgen.measure.readings import readings
    from sensorgen.measure.signal.lowpass import CUTOFF_HZ, Live

    smooth = Live(one("--rate", rate_hz), one("--cutoff", cutoff_hz) if cutoff_hz else CUTOFF_HZ)
    with readings(measured) as source:
        render.say(_header(source))
        for block in source.blocks():
            render.say("".join(_rows(block, smooth(block.impedance_ohm))), nl=False)


def _header(source: "Readings") -> str:
    tones = (units.frequency_text(float(f)) for f in source.frequency_hz)
    return ",".join([*map(_cell, source.kept), *(f"{part}_ohm_{f}" for f in tones for part in ("re", "im"))])


def _rows(block: "Block", smooth: "Complex") -> Iterator[str]:
    for kept, row in zip(block.kept, smooth.tolist(), strict=True):
        parts = (f"{part:.12g}" if isfinite(z.real) else "" for z in row for part in (z.real, z.imag))
        yield ",".join([*map(_cell, kept), *parts]) + "\n"


def _cell(text: str) -> str:
    """A cell as CSV; quoted where it would come apart."""
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\r\n') else text


command = made(
    _live, "live", "Low-pass readings as they come.",
    click.Argument(["measured"], metavar="MEASURED.csv|-"),
    click.Option(
        ["--rate", "rate_hz"], type=Values(units.FREQUENCY_HZ, zero=False), metavar="HZ", required=True,
        help="Rows per second.",
    ),
    click.Option(
        ["--cutoff", "cutoff_hz"], type=Values(units.FREQUENCY_HZ, zero=False), metavar="HZ",
        help="Of the low-pass; the thesis's 0.2727 Hz if not given.",
    ),
)  # fmt: skip
