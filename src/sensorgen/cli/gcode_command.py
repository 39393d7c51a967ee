"""``sensorgen gcode``: files for the printer, whoever has sliced them."""

import click

from sensorgen.cli import render
from sensorgen.cli.words import completed

DEFAULT = "diabase-h5"


def _printers() -> list[str]:
    from sensorgen.design.printer import printer_names

    return printer_names()


def _check(file: str, design: str | None, printer: str | None, materials: tuple[str, ...], *, strict: bool) -> int:
    """Simulate the printer with a file: commands, position, tool, temperatures, limits.

    Says what would go wrong, with lines, and what the print takes: time, filament and mass of each tool, tool
    changes, purging. With a design also whether the file prints it: heights, missing layers, material of each body,
    volumes, widths of lines, purging, and what stands beside the sensor. Ends with 1 if there are errors, with 2 if
    the file cannot be read or prints something else.
    """
    from pathlib import Path

    from sensorgen.core.errors import BadInput
    from sensorgen.design.design import load
    from sensorgen.design.printer import load_printer
    from sensorgen.export.gcode.check import CheckedFile
    from sensorgen.export.gcode.check import check as checked

    drawn = load(Path(design)) if design else None
    machine = drawn.machine if drawn else load_printer(printer or DEFAULT)
    if drawn and printer and load_printer(printer).name != machine.name:
        raise BadInput(f"--printer {printer}: {design} is for {machine.name}; expected one of them")
    loaded = {drawn.tool(name): name for name in drawn.used()} if drawn else {}
    loaded |= _loaded(materials, machine.tool_numbers)
    found = checked(Path(file), machine, loaded, others_empty=drawn is not None)
    if drawn:
        from sensorgen.asprinted import agreement

        try:
            found = found.with_more(agreement.check_file(drawn, Path(file)))
        except BadInput as error:
            raise error.within(file) from None
    render.deliver(CheckedFile(**vars(found), file=file, printer=machine.name, design=drawn.name if drawn else ""))
    return 1 if found.errors(strict) else 0


def _loaded(words: tuple[str, ...], tools: tuple[int, ...]) -> dict[int, str]:
    """Material of each tool that was named."""
    from sensorgen.cli.settings import pairs
    from sensorgen.core.errors import BadInput
    from sensorgen.design import materials

    found = {}
    for tool, name in pairs(words, "--material"):
        if not tool.isdecimal() or int(tool) not in tools:
            raise BadInput(
                f"--material {tool}={name}: {tool!r} is no tool; the printer has {', '.join(map(str, tools))}"
            )
        found[int(tool)] = materials.load(name).name
    return found


command = click.Group(
    "gcode", help="Check G-code, whoever has sliced it.",
    commands=[
        click.Command(
            "check", callback=_check, help=_check.__doc__,
            short_help="Simulate the printer: what would go wrong, and what it takes.",
            params=[
                click.Argument(["file"], metavar="FILE"),
                click.Option(["--design"], metavar="FILE", help="The design that the file is to print, as YAML."),
                click.Option(
                    ["--printer"], metavar="NAME", shell_complete=completed(_printers),
                    help=f"A printer that is listed, or a YAML file; the design's, or {DEFAULT}, if not given.",
                ),
                click.Option(
                    ["--material", "materials"], multiple=True, metavar="TOOL=NAME",
                    help="What a tool prints, for mass, temperatures and melt rate; if not given, the printer's usual "
                    "material, for the mass alone.",
                ),
                click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
                *render.options(),
            ],
        )
    ],
)  # fmt: skip
