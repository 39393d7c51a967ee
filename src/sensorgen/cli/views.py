"""``sensorgen show|draw|export|import``: a design as a page, a drawing or a file for other programs, and out of one."""

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import BodyChoice, of_design
from sensorgen.cli.options import Out
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option, Without

if TYPE_CHECKING:
    from sensorgen.design.design import Design

Chord = Annotated[float, Option(kind="length", typed="0.01")]


@of_function(
    "import", *render.options(folder=True),
    about="Import bodies drawn in another CAD program as a design: STEP, 3MF, or STL with --unit. All commands take "
    "it. Exit code 1 where electrodes touch.",
)  # fmt: skip
def import_command(
    files: tuple[Path, ...], *, maps: tuple[str, ...] = (), terminals: tuple[str, ...] = (), only_list: bool = False,
    unit: str = "", chord: Chord, name: str = "", out: Out = Path(), printer: str = "", quality: str = "",
    force: bool = False,
) -> int:  # fmt: skip
    """Read, repair or refuse, and write.

    Parameters
    ----------
    files : FILE...
    maps, --map : BODY=MATERIAL[@SOURCE][@TOOL]
        What a body is printed of, and by which tool; * in BODY stands for anything.
    terminals, --terminal : BODY=END
        Electrode of a conductor: top, middle, bottom, none; by height if not given.
    only_list, --list
        Print the bodies and a map to start from; write nothing.
    unit : UNIT
        Of STL, or in place of a 3MF's: mm, cm, m, inch, foot, micron.
    chord
        How far triangles may lie from curved faces of a STEP.
    name
        Name of the design; that of the file if not given.
    out
        Folder for the design file.
    printer : NAME
        A printer that is listed, or a YAML file.
    quality : NAME
        A quality that is listed, or a YAML file.
    force
        Replace a design of that name.
    """
    from sensorgen.workflows.importing import assign, reading, write

    if not 1e-4 <= chord <= 1.0:
        raise BadInput(f"--chord {chord:g}: expected 0.0001 to 1 mm")
    assembly, design_name = reading.read(list(files), unit, chord), name or files[0].stem
    more = dict(word for word in (("printer", printer), ("quality", quality)) if word[1])
    if only_list or assembly.errors or not maps:
        options = {"unit": unit, "chord": f"{chord:g}" * (chord != reading.CHORD_MM), "name": name} | more
        return _listed(assembly, out, None if only_list else out / f"{design_name}-faults.svg", files, options)
    bodies = assign(assembly, maps, terminals, out)
    design = write(assembly, bodies, name=design_name, folder=out, more=more, replace_existing=force)
    render.deliver(design)
    return FOUND_ERRORS if design.errors else 0


def _listed(
    assembly: Any, folder: Path, drawing: Path | None, named: tuple[Path, ...], options: dict[str, str]
) -> int:  # fmt: skip
    """List bodies that are not imported, and raise the reason unless a list is all that was asked for."""
    from sensorgen.core import files
    from sensorgen.workflows.importing import BodyListing, reading

    typed = [*map(str, named), *(word for key, value in options.items() if value for word in (f"--{key}", value))]
    listed = BodyListing.of(assembly, folder, typed)
    render.deliver(listed)
    if assembly.errors:
        first, where = assembly.errors[0], "nothing is imported"
        if drawing:
            files.replace(drawing, reading.picture(assembly).encode())
            where = f"nothing was imported, {drawing} shows where"
        raise BadInput(f"{first.body}: {first.text}; {where}")
    if drawing:
        raise BadInput(f"no --map: nothing was imported; expected {listed.words()}")
    return 0


@of_design("show", tip=True)
def show_command(design: "Design", *, output: Path | None = None, no_open: bool = False) -> None:
    """Show a design as one offline page: bodies in 3D, section, layers as printed, numbers and findings.

    Parameters
    ----------
    output, --output, -o : FILE
        Page to write; NAME.html here if not given.
    no_open
        Write the page without opening it in the browser.
    """
    from sensorgen.workflows.decision import PAGE_STEPS, page_of

    path = output or Path(f"{design.name}.html")
    if path.suffix.lower() not in (".html", ".htm"):
        raise BadInput(f"--output {output}: the page is HTML; expected a name in .html")
    with render.progress(PAGE_STEPS) as step:
        page = page_of(design, step=step)
    render.file(path, page)
    if not no_open and not webbrowser.open(path.resolve().as_uri()):
        render.say(f"sensorgen: no browser to open {path} in; open it by hand, or use --no-open", err=True)


@of_design("draw")
def draw_command(design: "Design", *, output: str = "", body: BodyChoice) -> None:
    """Draw the cross-section, its layers and findings, as SVG; or the print layer by layer, as a page.

    Parameters
    ----------
    output, --output, -o : FILE
        SVG file of the section, or HTML page of the print layer by layer; NAME.svg here if not given, - for the
        terminal.
    """
    from sensorgen.checks.review import draw

    if output != "-" and Path(output).suffix.lower() not in ("", ".svg", ".html"):
        raise BadInput(
            f"--output {output}: the drawing is SVG, or a page of layers; expected a name in .svg or .html, or - "
            "to print the SVG"
        )
    printed, review = body.printed(design)
    if output.lower().endswith(".html"):
        from sensorgen.analysis.plots import layers

        if printed is None:
            raise BadInput(f"--output {output}: layers are those of a print; expected it without --drawn")
        render.file(Path(output), layers.of_print(printed, review.findings))
        return
    svg = draw(design, review, printed.scene, printed.provenance) if printed else draw(design, review)
    if output == "-":
        render.say(svg, nl=False)
    else:
        render.file(Path(output or f"{design.name}.svg"), svg)
        render.say("findings in full: sensorgen check; in 3D and layers: sensorgen show", err=True)


@of_design("export")
def export_command(
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

    body_printed, _ = body.printed(design)
    assert body_printed is not None  # noqa: S101  (there is no --drawn)
    render.say("\n".join((body_printed.provenance, *(f"doubtful: {doubt}" for doubt in body_printed.doubts))))
    for path in export(body_printed, output or Path(f"{design.name}.3mf"), voxel_mm):
        render.say(path)
