"""Options that say which body a command means: the print (by default), its G-code, slicer or walls, or the drawing."""

import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import render, show
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import BadInput
from sensorgen.design.walls import WALLS
from sensorgen.export.slicers import SLICERS

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.design.body import Body, BodyOf
    from sensorgen.design.design import Design
    from sensorgen.workflows.compensation import Change

_BODY = "sensorgen.body"  # in the context's meta: the option that was given, and its value


def body_options() -> list[click.Parameter]:
    """``--drawn``, ``--gcode``, ``--slicer`` and ``--walls``; :func:`body_of` obeys them."""
    return [
        click.Option(
            ["--drawn"], is_flag=True, expose_value=False, callback=_choose, help="The drawing, in place of the print.",
        ),
        click.Option(
            ["--gcode"], metavar="FILE", expose_value=False, callback=_choose,
            help="The print by this file, whoever has sliced it; if not given, the G-code in out/NAME, else an "
            "estimate from the layers.",
        ),
        click.Option(
            ["--slicer"], type=OneOf(SLICERS), expose_value=False, callback=_choose, help="Slice now for the print.",
        ),
        click.Option(
            ["--walls"], type=OneOf(WALLS), expose_value=False, callback=_choose,
            help="Estimate the print for these walls alone; for all of them if not given, Arachne's as the best value.",
        ),
    ]  # fmt: skip


def _choose(ctx: click.Context, param: click.Parameter, value: str | bool | None) -> None:
    if value:
        option = param.opts[0]
        if other := ctx.meta.get(_BODY):
            raise BadInput(f"{other[0]} and {option} at once; expected one of them")
        ctx.meta[_BODY] = option, value


def body_of() -> "BodyOf":
    """Makes the body of a design that the options ask for."""
    from sensorgen.prediction import bodies

    option, value = click.get_current_context().meta.get(_BODY, ("", ""))
    ways: dict[str, BodyOf] = {
        "": bodies.default_body,
        "--drawn": _drawn,
        "--gcode": partial(bodies.from_gcode, file=value),
        "--slicer": partial(_sliced, value),
        "--walls": partial(bodies.estimated, walls=value),
    }
    return ways[option]


def _drawn(design: "Design") -> "Body":
    """The drawing, which is solid: infill that was asked for on the command line would do nothing."""
    from sensorgen.prediction import bodies

    given = click.get_current_context().params
    if given.get("infill") or given.get("infill_pattern"):
        raise BadInput("--drawn and --infill at once: a drawing is solid; leave out --drawn to predict the print")
    return bodies.drawn(design)


def compensate_option() -> click.Option:
    """``--compensate``, for commands that make files."""
    return click.Option(
        ["--compensate"], type=OneOf(("print", "bake", "stiffness")),
        help="Change the design so that what is asked for comes out: whole layers, widths of a line, electrode gap and "
        "capacitance; with bake also larger by the 20 % that the bake takes off; with stiffness as stiff, too.",
    )  # fmt: skip


def compensated(
    design: "Design", word: str | None, walls: str, slicer: str = "", program: str = ""
) -> "tuple[Design, list[Change]]":
    """The design to print, and what was changed; by a real slicer's prints where one is named, else by the estimate."""
    if word is None:
        return design, []
    from sensorgen.workflows.compensation import compensated as changed

    sliced = partial(_sliced, slicer, program=program) if slicer else None
    with show.progress(("designs",)) as step:
        found, changes = changed(
            design, walls, bake=word == "bake", stiffness=word == "stiffness", sliced=sliced, step=step
        )
    if not changes:
        render.say(f"--compensate {word}: nothing to change, by the estimate for {walls} walls", err=True)
    return found, changes


def printed_of(design: "Design") -> "Printed | None":
    """The print of a design, with its layers, by the options; as of ``default_body`` without; None for the drawing."""
    from sensorgen.asprinted.printed import body
    from sensorgen.prediction.bodies import registered, toolpath

    option, value = click.get_current_context().meta.get(_BODY, ("", ""))
    if not option and (path := toolpath(design)):
        option, value = "--gcode", str(path)
    if option == "--drawn":
        return None
    if option == "--gcode":
        return registered(design, Path(value))
    return _slice(value, design)[0] if option == "--slicer" else body(design, walls=value or design.walls)


def _sliced(slicer: str, design: "Design", program: str = "") -> "Body":
    from sensorgen.prediction import bodies

    printed, source, content = _slice(slicer, design, program)
    return bodies.sliced(design, lambda: printed, source, content)


def _slice(slicer: str, design: "Design", program: str = "") -> "tuple[Printed, str, bytes]":
    """What a real slicer prints, its name and version, and its G-code."""
    from sensorgen.asprinted.printed import body
    from sensorgen.export import slicing

    with tempfile.TemporaryDirectory() as folder, show.progress(slicing.STEPS) as step:
        made = slicing.sliced([slicing.alone(design)], slicer, Path(folder), program=program, step=step)
        content = made.ready.read_bytes()
    source = f"{made.slicer} {made.version}"
    return body(design, made.lines, slicer=source), source, content
