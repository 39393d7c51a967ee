"""``sensorgen slice``: printer-ready G-code of a design, by a real slicer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import body_options, render
from sensorgen.cli.body_options import Compensate
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Out, Strict, TimeLimit
from sensorgen.core.options import Option
from sensorgen.design.walls import rule
from sensorgen.export.slicers import SLICERS, TIME_LIMIT_S

if TYPE_CHECKING:
    from sensorgen.design.design import Design


@of_design("slice", *render.options("json", "markdown"))
def command(
    design: "Design", *, slicer: Annotated[str, Option(kind=tuple(SLICERS))] = "prusa", program: str = "",
    time_limit_s: TimeLimit = TIME_LIMIT_S, out: Out = Path("out"), force: bool = False, strict: Strict = False,
    compensate: Compensate = "",
) -> int:  # fmt: skip
    """Slice a design with a real slicer, and write G-code that the printer takes as it is.

    The file is checked, also against the design. One with errors is written as NAME.SLICER.refused.gcode, whatever
    --force says, and an earlier NAME.SLICER.gcode is removed: a file of that name has always passed.

    Parameters
    ----------
    slicer
        PrusaSlicer (2.5 or later), or CuraEngine (4.13 or later).
    program : PATH
        The slicer's program; the one on PATH if not given.
    force
        Slice even if checks of the design report errors.
    """
    from sensorgen.export.slicing import STEPS
    from sensorgen.workflows.slice import slice_design

    walls = rule(slicer, design.walls)
    design, changes = body_options.compensated(design, compensate, walls, slicer, program)
    with render.refused(design.name), render.progress(("checks", *STEPS)) as step:
        gcode = slice_design(
            design, out, slicer, program=program, time_limit_s=time_limit_s, force=force, strict=strict,
            compensated=changes, step=step,
        )  # fmt: skip
    render.deliver(gcode)
    return 1 if gcode.refused or (gcode.verdict == "CHANGE" and not force) else 0
