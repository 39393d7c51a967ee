"""Body that a command means: the print (by default), its G-code, slicer or walls, or the drawing."""

from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import render
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option
from sensorgen.design.walls import WALLS
from sensorgen.export.slicers import SLICERS

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design
    from sensorgen.prediction.slices import PrintReview
    from sensorgen.workflows.compensation import Adjustment


@dataclass(frozen=True)
class BodyChoice:
    """Body that is meant, by one option at most; the body of a design by a call.

    Attributes
    ----------
    drawn
        The drawing, in place of the print.
    gcode : FILE
        The print by this file, whoever has sliced it; if not given, the G-code in out/NAME, else by the slicer that is
        installed (SENSORGEN_SLICER: prusa, cura or none), else an estimate.
    slicer
        Slice now for the print.
    walls
        Estimate the print for these walls alone; for all of them if not given, Arachne's as the best value.
    """

    drawn: bool = False
    gcode: str = ""  # fmt: skip
    slicer: Annotated[str, Option(kind=tuple(SLICERS))] = ""
    walls: Annotated[str, Option(kind=tuple(WALLS))] = ""

    def __post_init__(self) -> None:
        """Refuse two bodies at once."""
        given = [f"--{one.name}" for one in fields(self) if getattr(self, one.name)]
        if len(given) > 1:
            raise BadInput(f"{given[0]} and {given[1]} at once; expected one of them")

    def __call__(self, design: "Design") -> "Body":
        """The body of a design."""
        from sensorgen.prediction import bodies

        if self.drawn:
            given = click.get_current_context().params
            if given.get("infill") or given.get("infill_pattern"):  # which would do nothing
                raise BadInput(
                    "--drawn and --infill at once: a drawing is solid; leave out --drawn to predict the print"
                )
            return bodies.drawn(design)
        if self.gcode:
            return bodies.from_gcode(design, self.gcode)
        if self.slicer:
            return sliced(self.slicer, design)
        return bodies.estimated(design, self.walls) if self.walls else bodies.default_body(design)

    def printed(self, design: "Design") -> "tuple[Printed | None, PrintReview]":
        """The print of a design, None for the drawing, and all findings about it."""
        from sensorgen.checks.review import STEPS, review
        from sensorgen.prediction import bodies, slices

        with render.progress((*STEPS, "slicing")) as step:
            if self.gcode:
                printed = bodies.registered(design, Path(self.gcode))
                return printed, slices.combined(design, review(design, step), printed.provenance, printed.findings())
            findings = slices.reviewed(design, step, self.slicer, walls=self.walls)
            return None if self.drawn else findings.printed(design, self.walls), findings


Compensate = Annotated[
    str,
    Option(
        "Change the design so that what is asked for comes out: whole layers, widths of a line, electrode gap and "
        "capacitance; with bake also larger by the 20 % that the bake takes off; with stiffness as stiff, too.",
        kind=("print", "bake", "stiffness"),
    ),
]


def compensated(
    design: "Design", word: str, walls: str, slicer: str = "", program: str = "",
) -> "tuple[Design, list[Adjustment]]":  # fmt: skip
    """The design to print, and what was changed; by a real slicer's prints where one is named, else by the estimate."""
    if not word:
        return design, []
    from sensorgen.workflows.compensation import compensated as changed

    with render.progress(("designs",)) as step:
        printable, changes = changed(
            design, walls, bake=word == "bake", stiffness=word == "stiffness",
            sliced=partial(sliced, slicer, program=program) if slicer else None, step=step,
        )  # fmt: skip
    if not changes:
        render.say(f"--compensate {word}: nothing to change, by the estimate for {walls} walls", err=True)
    return printable, changes


def sliced(slicer: str, design: "Design", program: str = "") -> "Body":
    """The print of a design by a slicer."""
    from sensorgen.export import slicing
    from sensorgen.prediction import bodies, print_files

    with render.progress(slicing.STEPS) as step:
        return bodies.of_file(design, print_files.at_hand(design, None, slicer, step, program)[0])
