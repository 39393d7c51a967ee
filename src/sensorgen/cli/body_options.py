"""Options that say which body a command means: the print (by default), its slicer or walls, or the drawing."""

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import show
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import BadInput
from sensorgen.design.walls import WALLS
from sensorgen.export.slicers import SLICERS

if TYPE_CHECKING:
    from sensorgen.asprinted.compensation import Change
    from sensorgen.asprinted.printed import Printed
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design


def body_options() -> list[click.Parameter]:
    """``--drawn``, ``--slicer`` and ``--walls``."""
    return [
        click.Option(["--drawn"], is_flag=True, help="The drawing, in place of the print."),
        click.Option(
            ["--slicer"], type=OneOf(SLICERS),
            help="Slice now for the print; if not given, the G-code in out/NAME, else an estimate from the layers.",
        ),
        click.Option(
            ["--walls"], type=OneOf(WALLS),
            help="Estimate the print for these walls alone; for all of them if not given, Arachne's as the best value.",
        ),
    ]  # fmt: skip


def body_of(drawn: bool, slicer: str | None, walls: str | None) -> "Callable[[Design], Body]":
    """Makes the body of a design that the options ask for; raises BadInput for two of them at once."""
    given = [name for name, value in (("--drawn", drawn), ("--slicer", slicer), ("--walls", walls)) if value]
    if len(given) > 1:
        raise BadInput(f"{' and '.join(given)} at once; expected one of them")
    from sensorgen.prediction import bodies

    if drawn:
        return bodies.drawn
    if slicer:
        return partial(_sliced, slicer)
    if walls:
        return partial(bodies.estimated, walls=walls)
    return bodies.default_body


def compensate_option() -> click.Option:
    """``--compensate``, for commands that make files."""
    return click.Option(
        ["--compensate"], type=OneOf(("print", "bake")),
        help="Change the design so that what is asked for comes out: whole layers, widths of a line, the electrode "
        "gap; with bake also larger by the 20 % that the bake takes off.",
    )  # fmt: skip


def compensated(design: "Design", word: str | None, walls: str) -> "tuple[Design, list[Change]]":
    """The design to print, and what was changed."""
    if word is None:
        return design, []
    from sensorgen.asprinted.compensation import compensated as changed

    found, changes = changed(design, walls, bake=word == "bake")
    if not changes:
        click.echo(f"--compensate {word}: nothing to change, by the estimate for {walls} walls", err=True)
    return found, changes


def printed_of(design: "Design", slicer: str | None, walls: str | None) -> "Printed":
    """The print of a design, with its layers: sliced now, or estimated."""
    from sensorgen.asprinted.printed import body

    if slicer and walls:
        raise BadInput("--slicer and --walls at once; expected one: the slicer's profile says what walls it makes")
    return _slice(slicer, design)[0] if slicer else body(design, walls=walls or "arachne")


def _sliced(slicer: str, design: "Design") -> "Body":
    from sensorgen.prediction import bodies

    printed, source, content = _slice(slicer, design)
    return bodies.sliced(design, lambda: printed, source, content)


def _slice(slicer: str, design: "Design") -> "tuple[Printed, str, bytes]":
    """What a real slicer prints, its name and version, and its G-code."""
    from sensorgen.asprinted.printed import body
    from sensorgen.export import slicing

    with tempfile.TemporaryDirectory() as folder, show.progress(slicing.STEPS) as step:
        made = slicing.sliced([slicing.alone(design)], slicer, Path(folder), step=step)
        content = made.ready.read_bytes()
    source = f"{made.slicer} {made.version}"
    return body(design, made.lines, slicer=source), source, content
