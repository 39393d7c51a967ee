"""``sensorgen export``: the printed body as a file for other programs."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, render
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Length

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(["--printed"], is_flag=True, expose_value=False, help="The print; always (build writes the drawing)."),
    click.Option(
        ["--output", "-o"], metavar="FILE",
        help="FILE.3mf or FILE.step: bodies with materials; FILE.stl: all as one, and a file for each material; "
        "FILE.vtu: voxels with materials. NAME.3mf here if not given.",
    ),
    click.Option(["--voxel", "voxel_mm"], type=Length(), help="Longest side of a voxel; half a layer if not given."),
    *body_options.body_options()[1:],
]  # fmt: skip


def _work(design: "Design", *, output: str | None, voxel_mm: float | None) -> int:
    from sensorgen.workflows.export import export

    printed, _ = body_options.printed_of(design)
    assert printed is not None  # noqa: S101  (there is no --drawn)
    render.say(printed.provenance)
    for path in export(printed, Path(output or f"{design.name}.3mf"), voxel_mm):
        render.say(path)
    return 0


command = DesignGroup(
    _work, OWN, name="export",
    help="Write the body as printed for other programs: 3MF, STEP, STL, or voxels as VTU.",
)  # fmt: skip
