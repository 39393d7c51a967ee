"""Findings, predictions and progress, as a person at a terminal wants to read them."""

import json
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from sensorgen.core.units import si as si

if TYPE_CHECKING:
    from sensorgen.checks.review import Review
    from sensorgen.core.findings import Finding
    from sensorgen.prediction.grid import ImpedanceGrid
    from sensorgen.prediction.results import Prediction
    from sensorgen.prediction.sensor_model import SensorModel

WIDTH = 80
_COLOURS = {"error": "red", "warning": "yellow", "info": "blue"}


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


def most_severe(found: Sequence["Finding"], count: int) -> list["Finding"]:
    """The first findings that matter: each rule and body once, with all its places, the severe first."""
    order = ("error", "warning", "info")
    merged: dict[tuple[str, str, str], Finding] = {}
    for f in sorted((f for f in found if not f.waiver), key=lambda f: order.index(f.severity)):
        key = (f.severity, f.rule, f.advice)
        merged[key] = replace(merged[key], count=merged[key].count + f.count) if key in merged else f
    return list(merged.values())[:count]


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


def loaded(found: "Prediction", model: "SensorModel", grid: "ImpedanceGrid", noise: float) -> Iterator[str]:
    """R and X over force and position, as lines: their ranges, how much they change, and corners at the last frequency.

    Parameters
    ----------
    found, model, grid : Prediction, SensorModel, ImpedanceGrid
        Of one body.
    noise : float
        Standard deviation of a reading, relative to abs(Z) [-].
    """
    force, at, sensor = grid.force_n, grid.position_mm, model.sensor
    touches = float(sensor.contact_m(force[-1])[0])
    grown = f", contact {touches * 1e3:.3g} mm at {force[-1]:g} N" if touches < sensor.tip_m else ""
    spread = "" if sensor.profile == "uniform" else f" ({sensor.profile}{grown})"
    yield f"{found.design}, {found.body}: {_axis(force, 'force', 'N')}, {_axis(at, 'position', 'mm')};"
    yield f"tip {sensor.tip_m * 1e3:g} mm{spread}, compression {sensor.compression.name}"
    for doubt in _doubts(model, grid):
        yield from textwrap.wrap(f"doubtful: {doubt}", WIDTH)
    yield ""
    yield f"{'':9} {'R [ohm]':^17}  {'X [ohm]':^25}  change of R  change of X"
    yield f"{'frequency':>9} {'least':>8} {'most':>8}  {'least':>12} {'most':>12} force  pos. force  pos."
    for f, z, change in zip(grid.frequency_hz, grid.impedance_ohm, grid.changes(noise), strict=True):
        r, x = z.real, z.imag
        moved = " ".join(map(_deviations, change.values()))
        yield f"{si(f, 'Hz'):>9} {r.min():8.6g} {r.max():8.6g}  {x.min():12.6g} {x.max():12.6g} {moved}"
    if len(force) > 1 or len(at) > 1:
        yield f"Changes in standard deviations of one reading, {noise:.2g} of |Z|: over force at"
        yield f"{at[len(at) // 2]:g} mm, over position at {force[-1]:g} N."
    yield ""
    yield f"R and X [ohm] at {si(grid.frequency_hz[-1], 'Hz')}"
    places = _ends_and_middle(at)
    yield f"{'':>7}" + "".join(f"{f'{at[k]:g} mm':^24}" for k in places).rstrip()
    for j in _ends_and_middle(force):
        cells = (grid.impedance_ohm[-1][j][k] for k in places)
        yield f"{f'{force[j]:g} N':>7}" + "".join(f"  {z.real:9.7g} {z.imag:12.7g}" for z in cells)


def _doubts(model: "SensorModel", grid: "ImpedanceGrid") -> Iterator[str]:
    """Of the sensor, and of pressures beyond the solved ones."""
    yield from model.doubts
    stress_pa = model.sensor.stress_pa(grid.force_n[-1], [x * 1e-3 for x in grid.position_mm])
    beyond = model.sensor.compression.doubt(float(stress_pa.max()))
    if beyond:
        yield beyond


def grid_json(found: "Prediction", model: "SensorModel", grid: "ImpedanceGrid") -> Iterator[str]:
    """Prediction and impedances as JSON, a line per key: for long lists of numbers."""
    from sensorgen.prediction.results import to_json

    data = {
        "prediction": json.loads(to_json(found)),
        "tip_mm": model.sensor.tip_m * 1e3,
        "profile": model.sensor.profile,
        "contact_mm": float(model.sensor.contact_m(grid.force_n[-1])[0]) * 1e3,
        "compression": model.law.compression.name,
        "doubts": list(_doubts(model, grid)),
        "axes": ["frequency_hz", "force_n", "position_mm"],
        "frequency_hz": list(grid.frequency_hz),
        "force_n": list(grid.force_n),
        "position_mm": list(grid.position_mm),
        "re_ohm": grid.impedance_ohm.real.tolist(),
        "im_ohm": grid.impedance_ohm.imag.tolist(),
    }
    for lead, (key, value) in zip(["{", *[","] * (len(data) - 1)], data.items(), strict=True):
        yield f"{lead}\n  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False, allow_nan=False)}"
    yield "\n}\n"


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


def as_json(data: Any) -> None:
    """Print plain data as JSON."""
    click.echo(json_text(data), nl=False)


def json_text(data: Any) -> str:
    """Plain data as indented JSON."""
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def indented(text: str) -> str:
    """JSON text with two spaces per level."""
    return json_text(json.loads(text))


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
