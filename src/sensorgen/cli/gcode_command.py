"""``sensorgen gcode``: files for the printer, whoever has sliced them."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.commands import completed, pairs
from sensorgen.cli.options import LogFile, Strict
from sensorgen.core.errors import BadInput, within
from sensorgen.core.options import Argument, Option

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.design.design import Design
    from sensorgen.design.printer import Printer

DEFAULT = "diabase-h5"
command = click.Group("gcode", help="Check G-code, whoever has sliced it.")


def _printers() -> list[str]:
    from sensorgen.design.printer import printer_names

    return printer_names()


@dataclass(frozen=True)
class Subject:
    """File, and what it prints on which printer, as far as it is known.

    Attributes
    ----------
    file : FILE
    design : FILE
        The design that the file prints, as YAML.
    printer : NAME
        A printer that is listed, or a YAML file; the design's, or diabase-h5, if not given.
    """

    file: Annotated[Path, Argument()]
    design: Path | None = None
    printer: Annotated[str, Option(more={"shell_complete": completed(_printers)})] = ""

    def loaded(self) -> "tuple[Design | None, Printer]":
        """Design and printer."""
        from sensorgen.design.design import load
        from sensorgen.design.printer import load_printer

        if not self.design:
            return None, load_printer(self.printer or DEFAULT)
        drawn = load(self.design)
        if self.printer and load_printer(self.printer).name != drawn.machine.name:
            raise BadInput(f"--printer {self.printer}: {self.design} is for {drawn.machine.name}; expected one of them")
        return drawn, drawn.machine


@of_function(
    "check", *render.options(), group=command, short="Simulate the printer: what would go wrong, and what it takes."
)
def _check(subject: Subject, *, materials: tuple[str, ...] = (), strict: Strict = False) -> int:
    """Simulate the printer with a file: commands, position, tool, temperatures, limits.

    Says what would go wrong, with lines, and what the print takes: time, filament and mass of each tool, tool
    changes, purging. With a design also whether the file prints it: heights, missing layers, material of each body,
    volumes, widths of lines, purging, and what stands beside the sensor. Ends with 1 if there are errors, with 2 if
    the file cannot be read or prints something else.

    Parameters
    ----------
    materials, --material : TOOL=NAME
        What a tool prints, for mass, temperatures and melt rate; if not given, the printer's usual material, for the
        mass alone.
    """
    from sensorgen.export.gcode.check import check_motion
    from sensorgen.export.gcode.motion import executed
    from sensorgen.export.gcode.results import CheckedFile

    drawn, machine = subject.loaded()
    named = _loaded(materials, machine.tool_numbers)
    loaded = ({drawn.tool(name): name for name in drawn.used()} if drawn else {}) | named
    motion = executed(subject.file, machine)
    report = check_motion(motion, machine, loaded, others_empty=drawn is not None, texts=_texts(drawn, named))
    if drawn:
        from sensorgen.asprinted import agreement

        with within(str(subject.file)):
            report = report.with_more(agreement.check_motion(drawn, motion))
    name = drawn.name if drawn else ""
    render.deliver(CheckedFile(**vars(report), file=str(subject.file), printer=machine.name, design=name))
    return 1 if report.errors(strict) else 0


@of_function("drags", *render.options(), group=command, short="Measure travel over what another tool has printed.")
def _drags(subject: Subject) -> "Documented":
    """Measure where the nozzle travels over what another tool has printed, in the order of printing.

    Travel in contact can draw a conductor over a dielectric. Counted are the centre of the nozzle in contact with
    another material, and up to 0.12 mm above it; and lines during which the nozzle's face touches another material.
    With a design also the insulation that would be left to the other electrode if such a strand conducted. sensorgen
    slice lifts the nozzle over such places.
    """
    drawn, machine = subject.loaded()
    if drawn:
        from sensorgen.asprinted import nozzle

        return nozzle.drags(drawn, subject.file)
    from sensorgen.export.gcode import crossings

    return crossings.drags(subject.file, machine)


@of_function(
    "pinholes", *render.options(), group=command, short="Search a film for through-holes; probability of a short."
)
def _pinholes(
    file: Path, *, design: Annotated[Path, Option(more={"required": True})], log: Path | None = None,
    pictures: Path | None = None,
) -> "Documented":  # fmt: skip
    """Search the film of a print for through-holes, and estimate the probability that a print is shorted.

    Lines are taken as round at their sides, at the width of the file and 5 and 10 % less. The probability has an
    interval, stated assumptions, and the verdicts of the log on prints of the same shape and film; without any it
    follows from series 23 of the thesis.

    Parameters
    ----------
    file : FILE
    design : FILE
        The design, as YAML.
    log : FILE
        The log with verdicts of earlier prints.
    pictures, --figures : FOLDER
        Write a plan there, PNG and SVG.
    """
    from sensorgen.analysis.shorts import risk
    from sensorgen.design.design import load

    verdicts = [LogFile(log).of_command()] if log else []
    shorts, figure = risk(load(design), file, *verdicts)
    if pictures:
        from sensorgen.analysis.plots.static import files

        render.written(pictures, files(figure))
    return shorts


def _loaded(words: tuple[str, ...], tools: tuple[int, ...]) -> dict[int, str]:
    """Material of each tool that was named."""
    from sensorgen.design.design import material

    loaded = {}
    for tool, name in pairs(words, "--material"):
        if not tool.isdecimal() or int(tool) not in tools:
            raise BadInput(
                f"--material {tool}={name}: {tool!r} is no tool; the printer has {', '.join(map(str, tools))}"
            )
        loaded[int(tool)] = material(name).name
    return loaded


def _texts(drawn: "Design | None", named: dict[int, str]) -> Any:
    """Texts of the files that do not ship, of the design and of the materials that were named."""
    from sensorgen.design.design import own_texts

    texts = drawn.own if drawn else {}
    materials = own_texts(named.values()).get("materials", {})
    return {**texts, "materials": {**materials, **texts.get("materials", {})}}
