"""``sensorgen import``: a sensor from another CAD program."""

from pathlib import Path
from typing import Annotated, Any

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import Out
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

Chord = Annotated[float, Option(kind="length", typed="0.01")]


@of_function(
    "import", *render.options(folder=True),
    about="Import bodies drawn in another CAD program as a design: STEP, 3MF, or STL with --unit. All commands take "
    "it. Exit code 1 where electrodes touch.",
)  # fmt: skip
def command(
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
    from sensorgen.workflows.importing import assigning, reading, writing

    if not 1e-4 <= chord <= 1.0:
        raise BadInput(f"--chord {chord:g}: expected 0.0001 to 1 mm")
    assembly = reading.read(list(files), unit, chord)
    name = name or files[0].stem
    if only_list or assembly.errors or not maps:
        return _listed(assembly, out, None if only_list else out / f"{name}-faults.svg")
    bodies = assigning.assign(assembly, maps, terminals, out)
    more = dict(word for word in (("printer", printer), ("quality", quality)) if word[1])
    design = writing.write(assembly, bodies, name=name, folder=out, more=more, replace_existing=force)
    render.deliver(design)
    return FOUND_ERRORS if design.errors else 0


def _listed(assembly: Any, folder: Path, drawing: Path | None) -> int:
    """List bodies that are not imported, and raise the reason unless a list is all that was asked for."""
    from sensorgen.core import files
    from sensorgen.workflows.importing import assigning, reading

    listed = assigning.BodyListing.of(assembly, folder)
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
