"""``sensorgen export``: the printed body as a file for other programs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.designs import of_design
from sensorgen.core.options import Option, Without

if TYPE_CHECKING:
    from sensorgen.design.design import Design


@of_design("export")
def command(
    design: "Design", *,
    printed: bool = False,  # noqa: ARG001
    output: Path | None = None,
    voxel_mm: Annotated[float | None, Option(kind="length")] = None,
    body: Annotated[BodyChoice, Without(("drawn",))],
) -> None:  # fmt: skip
    """Write the body as printed for other programs: 3MF, STEP, STL, or voxels as VTU.

    Parameters
    ----------
    printed
        The print; always (build writes the drawing).
    output, --output, -o : FILE
        FILE.3mf or FILE.step: bodies with materials; FILE.stl: all as one, and a file for each material; FILE.vtu:
        voxels with materials. NAME.3mf here if not given.
    voxel_mm
        Longest side of a voxel; half a layer if not given.
    """
    from sensorgen.workflows.export import export

    made, _ = body.printed(design)
    assert made is not None  # noqa: S101  (there is no --drawn)
    render.say(made.provenance)
    for path in export(made, output or Path(f"{design.name}.3mf"), voxel_mm):
        render.say(path)
