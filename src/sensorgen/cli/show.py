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
    from sensorgen.checks.review import Review
    from sensorgen.core.findings import Finding

WIDTH = 80
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
    for line in prediction_lines(predicted):
        click.echo(line)


def prediction_lines(predicted: Mapping[str, Any]) -> Iterator[str]:
    """The main numbers of a prediction, as lines."""
    if predicted["capacitance_f"] is None:
        yield f"no capacitance is predicted: {predicted['reason']}"
        return
    r = predicted["electrode_resistance_ohm"]
    rows = {
        "capacitance": _between(predicted["capacitance_f"], "F"),
        "electrodes": f"top {si(r['top'], 'ohm')}, bottom {si(r['bottom'], 'ohm')} end to end",
        "corner frequency": _between(predicted["corner_frequency_hz"], "Hz"),
    }
    yield from (f"{name:17}{value}" for name, value in rows.items())
    yield f"{'impedance at':>17}  {'Re [ohm]':>11}   {'Im [ohm]':>11}   Im at the bounds of C"
    for tone in predicted["impedance_ohm"]:
        low, high = tone["im_range"]
        yield f"{si(tone['frequency_hz'], 'Hz'):>17}  {tone['re']:11.5g}   {tone['im']:11.5g}   {low:.4g} .. {high:.4g}"


def presses(predicted: Mapping[str, Any], moves: Sequence[Mapping[str, float | None]]) -> Iterator[str]:
    """R and X over force and position, as lines: their ranges, how far they move, and corners at the highest tone."""
    force, at = predicted["force_n"], predicted["position_mm"]
    law, profile = predicted["model"]["compression"], predicted["profile"]
    touches = predicted["contact_mm"]
    grown = f", {touches:.3g} mm of it touch at {force[-1]:g} N" if touches < predicted["tip_mm"] else ""
    spread = "" if profile == "uniform" else f" ({profile}{grown})"
    yield f"{predicted['design']}: {_axis(force, 'force', 'N')}, {_axis(at, 'position', 'mm')};"
    yield f"tip {predicted['tip_mm']:g} mm{spread}, compression {law}"
    for doubt in predicted["doubts"]:
        yield from textwrap.wrap(f"doubtful: {doubt}", WIDTH)
    yield ""
    yield f"{'':9} {'R [ohm]':^17}  {'X [ohm]':^25}  R moves by  X moves by"
    yield f"{'tone':>9} {'least':>8} {'most':>8}  {'least':>12} {'most':>12} force  pos. force  pos."
    for f, re, im, move in zip(predicted["frequency_hz"], predicted["re_ohm"], predicted["im_ohm"], moves, strict=True):
        (r, most_r), (x, most_x) = ((min(map(min, v)), max(map(max, v))) for v in (re, im))
        moved = " ".join(map(_deviations, move.values()))
        yield f"{si(f, 'Hz'):>9} {r:8.6g} {most_r:8.6g}  {x:12.6g} {most_x:12.6g} {moved}"
    if len(force) > 1 or len(at) > 1:
        yield f"Moves are in deviations of one reading, {predicted['noise']:.2g} of |Z|: by force at"
        yield f"{at[len(at) // 2]:g} mm, by position at {force[-1]:g} N. Below about 1 a reading alone does not tell."
    yield ""
    yield f"R and X [ohm] at {si(predicted['frequency_hz'][-1], 'Hz')}"
    places = _ends_and_middle(at)
    yield f"{'':>7}" + "".join(f"{f'{at[k]:g} mm':^24}" for k in places).rstrip()
    for j in _ends_and_middle(force):
        cells = ((predicted["re_ohm"][-1][j][k], predicted["im_ohm"][-1][j][k]) for k in places)
        yield f"{f'{force[j]:g} N':>7}" + "".join(f"  {re:9.7g} {im:12.7g}" for re, im in cells)


def _deviations(value: float | None) -> str:
    if value is None:
        return "    -"
    return f"{value:5.2f}" if value < 100 else f"{value:5.3g}"


def _axis(values: Sequence[float], name: str, unit: str) -> str:
    if len(values) == 1:
        return f"{name} {values[0]:g} {unit}"
    return f"{len(values)} {name}s {values[0]:g} to {values[-1]:g} {unit}"


def _ends_and_middle(values: Sequence[float]) -> list[int]:
    return sorted({0, len(values) // 2, len(values) - 1})


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
    click.echo(json_text(data), nl=False)


def json_text(data: Any) -> str:
    """Plain data as indented JSON."""
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def json_lines(data: Mapping[str, Any]) -> Iterator[str]:
    """Plain data as JSON, a line per key: for long lists of numbers."""
    for lead, (key, value) in zip(["{", *[","] * (len(data) - 1)], data.items(), strict=True):
        yield f"{lead}\n  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False, allow_nan=False)}"
    yield "\n}\n"


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
