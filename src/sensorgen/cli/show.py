"""Findings, predictions and progress, as a person at a terminal wants to read them."""

import json
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from sensorgen.findings import Finding
    from sensorgen.review import Review

_COLOURS = {"error": "red", "warning": "yellow", "info": "blue"}
_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


def findings(found: Sequence["Finding"]) -> None:
    """Print findings, the severe first, each with what to change."""
    width = min(shutil.get_terminal_size((110, 24)).columns, 120)
    for f in found:
        head = "waived" if f.waiver else f.severity
        click.echo(
            click.style(f"{head:8}", fg=_COLOURS.get(head), bold=head == "error") + f"{f.rule}  {f.body}{_where(f)}"
        )
        after = f"accepted: {f.waiver}" if f.waiver else f"-> {f.advice}"
        click.echo(
            textwrap.fill(f"{f.message}{_place(f)} {after}", width, initial_indent=" " * 8, subsequent_indent=" " * 8)
        )


def _where(f: "Finding") -> str:
    layers = f", layer {f.layer}" if f.layer else ""
    layers += f" to {f.last_layer}" if f.last_layer else ""
    places = f", {f.count} places" if f.count > 1 else ""
    return layers + places


def _place(f: "Finding") -> str:
    if not f.place_mm:
        return ""
    x, y, z = f.place_mm
    return f" ({'first ' if f.count > 1 else ''}at x {x:g}, y {y:g}, z {z:g} mm)"


def summary(review: "Review") -> str:
    """How many findings there are, in words."""
    counts = [(n, kind) for kind, n in review.counts().items() if n]
    return (
        ", ".join(f"{n} {kind}{'s' if n > 1 and kind in ('error', 'warning') else ''}" for n, kind in counts)
        or "no findings"
    )


def prediction(predicted: Mapping[str, Any]) -> None:
    """Print the main numbers of a prediction."""
    if predicted["capacitance_f"] is None:
        click.echo(f"no capacitance is predicted: {predicted['reason']}")
        return
    r = predicted["electrode_resistance_ohm"]
    rows = {
        "capacitance": _between(predicted["capacitance_f"], "F"),
        "electrodes": f"top {si(r['top'], 'ohm')}, bottom {si(r['bottom'], 'ohm')} end to end",
        "corner frequency": _between(predicted["corner_frequency_hz"], "Hz"),
    }
    for name, value in rows.items():
        click.echo(f"{name:17}{value}")
    click.echo(f"{'impedance at':>17}  {'Re [ohm]':>11}   {'Im [ohm]':>11}   Im at the bounds of C")
    for tone in predicted["impedance_ohm"]:
        low, high = tone["im_range"]
        click.echo(
            f"{si(tone['frequency_hz'], 'Hz'):>17}  {tone['re']:11.5g}   {tone['im']:11.5g}   {low:.4g} .. {high:.4g}"
        )


def _between(bounds: Mapping[str, float], unit: str) -> str:
    if bounds["upper"] == bounds["lower"]:
        return si(bounds["lower"], unit)
    return f"{si(bounds['lower'], unit)} to {si(bounds['upper'], unit)}"


def si(value: float, unit: str) -> str:
    """A value with an SI prefix, to four digits.

    >>> si(6.29e-11, "F"), si(2333.3, "ohm"), si(0.0, "F")
    ('62.9 pF', '2.333 kohm', '0 F')
    """
    powers = [p for p in _PREFIXES if value and abs(value) >= 10.0**p]
    power = max(powers, default=0 if not value else min(_PREFIXES))
    return f"{value / 10.0**power:.4g} {_PREFIXES[power]}{unit}"


def as_json(data: Any) -> None:
    """Print plain data as JSON."""
    click.echo(json.dumps(data, indent=2, ensure_ascii=False))


@contextmanager
def progress(steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """A bar that moves with the named steps and is gone afterwards; only for a person."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda _: None
        return
    started = time.monotonic()

    def step(name: str) -> None:
        done = steps.index(name) if name in steps else 0
        bar = "#" * (20 * done // max(1, len(steps) - 1))
        seconds = time.monotonic() - started
        click.echo(f"\r[{bar:20}] {seconds:4.1f} s  {name:12}", nl=False, err=True)

    try:
        yield step
    finally:
        click.echo("\r" + " " * 50 + "\r", nl=False, err=True)
