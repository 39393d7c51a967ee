"""``sensorgen gcode``: files for the printer, whoever has sliced them."""

from typing import TYPE_CHECKING

import click

from sensorgen.cli import render
from sensorgen.cli.words import completed

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.design.printer import Printer

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
    from sensorgen.design.design import own_texts
    from sensorgen.export.gcode.check import CheckedFile, check_motion
    from sensorgen.export.gcode.motion import executed

    drawn, machine = _subject(design, printer)
    loaded = {drawn.tool(name): name for name in drawn.used()} if drawn else {}
    named = _loaded(materials, machine.tool_numbers)
    loaded |= named
    motion = executed(Path(file), machine)
    own = drawn.own if drawn else {}
    texts = {**own, "materials": {**own_texts(named.values()).get("materials", {}), **own.get("materials", {})}}
    found = check_motion(motion, machine, loaded, others_empty=drawn is not None, texts=texts)
    if drawn:
        from sensorgen.asprinted import agreement

        try:
            found = found.with_more(agreement.check_motion(drawn, motion))
        except BadInput as error:
            raise error.within(file) from None
    render.deliver(CheckedFile(**vars(found), file=file, printer=machine.name, design=drawn.name if drawn else ""))
    return 1 if found.errors(strict) else 0


def _drags(file: str, design: str | None, printer: str | None) -> int:
    """Measure where the nozzle travels over what another tool has printed, in the order of printing.

    Travel in contact can draw a conductor over a dielectric. Counted are the centre of the nozzle in contact with
    another material, and up to 0.12 mm above it; and lines during which the nozzle's face touches another material.
    With a design also the insulation that would be left to the other electrode if such a strand conducted. sensorgen
    slice lifts the nozzle over such places.
    """
    from pathlib import Path

    drawn, machine = _subject(design, printer)
    if drawn:
        from sensorgen.asprinted import strands

        render.deliver(strands.drags(drawn, Path(file)))
    else:
        from sensorgen.export.gcode import drags

        render.deliver(drags.drags(Path(file), machine))
    return 0


def _pinholes(file: str, design: str, log: str | None, pictures: str | None) -> int:
    """Search the film of a print for through-holes, and estimate the probability that a print is shorted.

    Lines are taken as round at their sides, at the width of the file and 5 and 10 % less. The probability has an
    interval, stated assumptions, and the verdicts of the log on prints of the same shape and film; without any it
    follows from series 23 of the thesis.
    """
    from pathlib import Path

    from sensorgen.analysis.shorts import risk
    from sensorgen.cli import log_words
    from sensorgen.core import files as store
    from sensorgen.design.design import load

    if log:
        with log_words.opened(log) as opened:
            found, figure = risk(load(Path(design)), Path(file), opened)
    else:
        found, figure = risk(load(Path(design)), Path(file))
    if pictures:
        from sensorgen.analysis.plots.static import files

        for name, content in files(figure):
            store.replace(Path(pictures) / name, content)
    render.deliver(found)
    return 0


def _subject(design: str | None, printer: str | None) -> "tuple[Design | None, Printer]":
    """Design that a file prints, as far as it is known, and on which printer."""
    from pathlib import Path

    from sensorgen.core.errors import BadInput
    from sensorgen.design.design import load
    from sensorgen.design.printer import load_printer

    if not design:
        return None, load_printer(printer or DEFAULT)
    drawn = load(Path(design))
    if printer and load_printer(printer).name != drawn.machine.name:
        raise BadInput(f"--printer {printer}: {design} is for {drawn.machine.name}; expected one of them")
    return drawn, drawn.machine


def _loaded(words: tuple[str, ...], tools: tuple[int, ...]) -> dict[int, str]:
    """Material of each tool that was named."""
    from sensorgen.cli.settings import pairs
    from sensorgen.core.errors import BadInput
    from sensorgen.design.design import material

    found = {}
    for tool, name in pairs(words, "--material"):
        if not tool.isdecimal() or int(tool) not in tools:
            raise BadInput(
                f"--material {tool}={name}: {tool!r} is no tool; the printer has {', '.join(map(str, tools))}"
            )
        found[int(tool)] = material(name).name
    return found


_FILE = click.Argument(["file"], metavar="FILE")
_SUBJECT: list[click.Parameter] = [
    _FILE,
    click.Option(["--design"], metavar="FILE", help="The design that the file prints, as YAML."),
    click.Option(
        ["--printer"], metavar="NAME", shell_complete=completed(_printers),
        help=f"A printer that is listed, or a YAML file; the design's, or {DEFAULT}, if not given.",
    ),
]  # fmt: skip

command = click.Group(
    "gcode", help="Check G-code, whoever has sliced it.",
    commands=[
        click.Command(
            "check", callback=_check, help=_check.__doc__,
            short_help="Simulate the printer: what would go wrong, and what it takes.",
            params=[
                *_SUBJECT,
                click.Option(
                    ["--material", "materials"], multiple=True, metavar="TOOL=NAME",
                    help="What a tool prints, for mass, temperatures and melt rate; if not given, the printer's usual "
                    "material, for the mass alone.",
                ),
                click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
                *render.options(),
            ],
        ),
        click.Command(
            "drags", callback=_drags, help=_drags.__doc__,
            short_help="Measure travel over what another tool has printed.", params=[*_SUBJECT, *render.options()],
        ),
        click.Command(
            "pinholes", callback=_pinholes, help=_pinholes.__doc__,
            short_help="Search a film for through-holes; probability of a short.",
            params=[
                _FILE,
                click.Option(["--design"], metavar="FILE", required=True, help="The design, as YAML."),
                click.Option(["--log"], metavar="FILE", help="The log with verdicts of earlier prints."),
                click.Option(["--figures", "pictures"], metavar="FOLDER", help="Write a plan there, PNG and SVG."),
                *render.options(),
            ],
        ),
    ],
)  # fmt: skip
