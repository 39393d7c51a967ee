"""``sensorgen slice``: printer-ready G-code of a design, by a real slicer."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import asprinted_text, gcode_text, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import OutOfRange
from sensorgen.export.slicers import SLICERS, TIME_LIMIT_S, WALLS

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
    click.Option(["--force"], is_flag=True, help="Slice even if checks report errors."),
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    asprinted_text.compensate_option(),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the result as JSON."),
]  # fmt: skip


def _work(
    design: "Design",
    *,
    slicer: str,
    program: str,
    time_limit_s: float,
    out: str,
    force: bool,
    strict: bool,
    compensate: str | None,
    as_json: bool,
) -> int:
    from sensorgen.core.errors import Unprintable
    from sensorgen.export.slicing import STEPS
    from sensorgen.workflows import slice as printfile

    if not 0 < time_limit_s < float("inf"):
        raise OutOfRange(f"--time-limit {time_limit_s:g}; expected seconds above 0")
    design, changes = asprinted_text.compensated(design, compensate, WALLS[slicer], silent=as_json)
    try:
        with show.progress(("checks", *STEPS)) as step:
            made = printfile.slice_design(
                design,
                Path(out),
                slicer,
                program=program,
                time_limit_s=time_limit_s,
                force=force,
                strict=strict,
                step=step,
            )
    except Unprintable as error:
        _tell_findings(design, error.findings, as_json=as_json)
        raise
    if as_json:
        show.as_json(made.as_dict() | {"compensated": changes})
        return made.code
    click.echo(f"{design.name}: {show.summary(made.review)} (sensorgen check tells them)")
    for line in (*gcode_text.findings(made.checked), *gcode_text.report(made.checked.report)):
        click.echo(line)
    for line in asprinted_text.table(made.rows):
        click.echo(line)
    show.findings(made.printed)
    click.echo(f"{made.gcode}: {made.slicer} {made.version}, {made.seconds:.1f} s; {gcode_text.summary(made.checked)}")
    return made.code


def _tell_findings(design: "Design", found: list[Any], *, as_json: bool) -> None:
    if as_json:
        show.as_json({"name": design.name, "gcode": None, "findings": [f.as_dict() for f in found]})
    else:
        show.findings(found)


command = DesignGroup(
    _work, OWN, name="slice",
    help="Slice a design with a real slicer, and write G-code that the printer takes as it is.",
    short_help="Write printer-ready G-code, by a real slicer.",
)  # fmt: skip
