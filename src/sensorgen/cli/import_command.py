"""``sensorgen import``: a sensor from another CAD program."""

from pathlib import Path

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.words import Length
from sensorgen.core.errors import BadInput


@click.command(
    "import",
    help="Import bodies drawn in another CAD program as a design: STEP, 3MF, or STL with --unit. All commands take it. "
    "Exit code 1 where electrodes touch.",
)
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--map", "maps", multiple=True, metavar="BODY=MATERIAL[@SOURCE][@TOOL]",
              help="What a body is printed of, and by which tool; * in BODY stands for anything.")  # fmt: skip
@click.option("--terminal", "terminals", multiple=True, metavar="BODY=END",
              help="Electrode of a conductor: top, middle, bottom, none; by height if not given.")  # fmt: skip
@click.option("--list", "only_list", is_flag=True, help="Print the bodies and a map to start from; write nothing.")
@click.option(
    "--unit", default="", metavar="UNIT", help="Of STL, or in place of a 3MF's: mm, cm, m, inch, foot, micron."
)
@click.option("--chord", type=Length(), default="0.01", show_default=True,
              help="How far triangles may lie from curved faces of a STEP.")  # fmt: skip
@click.option("--name", default=None, help="Name of the design; that of the file if not given.")
@click.option("--out", default=".", show_default=True, metavar="DIR", help="Folder for the design file.")
@click.option("--printer", default=None, metavar="NAME", help="A printer that is listed, or a YAML file.")
@click.option("--quality", default=None, metavar="NAME", help="A quality that is listed, or a YAML file.")
@click.option("--force", is_flag=True, help="Replace a design of that name.")
def command(
    *, files: tuple[str, ...], maps: tuple[str, ...], terminals: tuple[str, ...], only_list: bool, unit: str,
    chord: float, name: str | None, out: str, printer: str | None, quality: str | None, force: bool,
) -> int:  # fmt: skip
    """Read, repair or refuse, and write."""
    from sensorgen.core import files as store
    from sensorgen.workflows.importing import assigning, listing, reading, writing

    if not 1e-4 <= chord <= 1.0:
        raise BadInput(f"--chord {chord:g}: expected 0.0001 to 1 mm")
    assembly = reading.read([Path(file) for file in files], unit, chord)
    name = name or Path(files[0]).stem
    listed = listing.Listing.of(assembly, Path(out))
    if only_list or assembly.errors or not maps:
        render.deliver(listed)
    if assembly.errors:
        first, shown = assembly.errors[0], "nothing is imported"
        if not only_list:
            drawing = Path(out) / f"{name}-faults.svg"
            store.replace(drawing, reading.picture(assembly).encode())
            shown = f"nothing was imported, {drawing} shows where"
        raise BadInput(f"{first.body}: {first.text}; {shown}")
    if only_list:
        return 0
    if not maps:
        raise BadInput(f"no --map: nothing was imported; expected {listed.words()}")
    chosen = assigning.assign(assembly, maps, terminals, Path(out))
    more = {key: value for key, value in (("printer", printer), ("quality", quality)) if value}
    made = writing.write(assembly, chosen, name=name, folder=Path(out), more=more, replace_existing=force)
    render.deliver(made)
    return FOUND_ERRORS if made.errors else 0


command.params += render.options("json", "csv", "markdown")
