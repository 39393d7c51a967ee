"""Findings and progress, as a person at a terminal wants to read them."""

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


def as_json(data: Any) -> None:
    """Print plain data as JSON."""
    click.echo(json_text(data), nl=False)


def json_text(data: Any) -> str:
    """Plain data as indented JSON."""
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


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
