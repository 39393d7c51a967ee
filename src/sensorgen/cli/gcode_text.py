"""What a check of G-code says, as a person at a terminal wants to read it."""

import shutil
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from sensorgen.export.gcode.check import Checked
    from sensorgen.export.gcode.found import Found
    from sensorgen.export.gcode.report import Report

_COLOURS = {"error": "red", "warning": "yellow", "info": "blue"}


def findings(checked: "Checked") -> Iterator[str]:
    """The findings, the severe first, each with what to change."""
    width = min(shutil.get_terminal_size((110, 24)).columns, 120)
    for f in checked.findings:
        yield f"{click.style(f'{f.severity:8}', fg=_COLOURS[f.severity], bold=f.severity == 'error')}{_place(f)}"
        text = f"{f.message} -> {f.advice}"
        yield textwrap.fill(text, width, initial_indent=" " * 8, subsequent_indent=" " * 8)


def _place(f: "Found") -> str:
    return f"{f.rule}, line {f.line}" + (f" and {f.count - 1} more" if f.count > 1 else "")


def summary(checked: "Checked") -> str:
    """How many findings there are, in words."""
    counts = [f"{n} {kind}{'s' if n > 1 and kind != 'info' else ''}" for kind, n in checked.counts().items() if n]
    return ", ".join(counts) or "no findings"


def report(found: "Report") -> Iterator[str]:
    """What the file takes."""
    yield f"{'time':14}{clock(found.time_s)} at its feeds, without acceleration, heating and changing tools"
    yield f"{'tool changes':14}{found.tool_changes}"
    yield f"{'layers':14}{found.layers or 'not counted by the file'}"
    if found.box_mm:
        (x0, y0, z0), (x1, y1, z1) = found.box_mm
        yield f"{'printed':14}x {x0:g} to {x1:g}, y {y0:g} to {y1:g}, z {z0:g} to {z1:g} mm"
    if found.tools:
        yield f"{'tool':6}{'material':12}{'filament [mm]':>14}{'mass [g]':>10}{'purged [mm]':>13}"
    for tool in found.tools:
        mass = "?" if tool.mass_g is None else f"{tool.mass_g:.2f}"
        yield f"T{tool.tool:<5}{tool.material or '?':12}{tool.filament_mm:14.1f}{mass:>10}{tool.purge_mm:13.1f}"


def clock(seconds: float) -> str:
    """A duration as hours and minutes, or minutes and seconds.

    >>> clock(59.6), clock(4000.0)
    ('1 min 00 s', '1 h 07 min')
    """
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02} s"
    return f"{whole // 3600} h {round(seconds / 60) % 60:02} min"
