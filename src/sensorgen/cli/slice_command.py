"""``sensorgen slice``: printer-ready G-code of a design, by a real slicer."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, render, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import OutOfRange
from sensorgen.design.walls import rule
from sensorgen.export.slicers import SLICERS, TIME_LIMIT_S

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(
        ["--slicer"], type=OneOf(SLICERS), default="prusa", show_default=True,
        help="PrusaSlicer (2.5 or later), or CuraEngine (4.13 or later).",
    ),
    click.Option(["--program"], default="", metavar="PATH", help="The slicer's program; the one on PATH if not given."),
    click.Option(
        ["--time-limit", "time_limit_s"], type=float, default=TIME_LIMIT_S, show_default=True, metavar="SECONDS",
        help="End the slicer after this time.",
    ),
    click.Option(["--out"], default="out", show_default=True, metavar="DIR", help="Folder for the designs' folders."),
    click.Option(["--force"], is_flag=True, help="Slice even if checks of the design report errors."),
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    body_options.compensate_option(),
    *render.options("json", "markdown"),
]  # fmt: skip


def _work(
    design: "Design", *, slicer: str, program: str, time_limit_s: float, out: str, force: bool, strict: bool,
    compensate: str | None,
) -> int:  # fmt: skip
    from sensorgen.export.slicing import STEPS
    from sensorgen.workflows.slice import slice_design

    if not 0 < time_limit_s < float("inf"):
        raise OutOfRange(f"--time-limit {time_limit_s:g}; expected seconds above 0")
    walls = rule(slicer, design.walls)
    design, changes = body_options.compensated(design, compensate, walls, slicer, program)
    with render.refused(design.name), show.progress(("checks", *STEPS)) as step:
        made = slice_design(
            design, Path(out), slicer, program=program, time_limit_s=time_limit_s, force=force, strict=strict,
            compensated=changes, step=step,
        )  # fmt: skip
    render.deliver(made)
    return 1 if made.refused or (made.verdict == "CHANGE" and not force) else 0


command = DesignGroup(
    _work, OWN, name="slice",
    help="Slice a design with a real slicer, and write G-code that the printer takes as it is.\n\n"
    "The file is checked, also against the design. One with errors is written as NAME.SLICER.refused.gcode, whatever "
    "--force says, and an earlier NAME.SLICER.gcode is removed: a file of that name has always passed.",
)  # fmt: skip
