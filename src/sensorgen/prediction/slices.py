"""The print of a design: the one list of findings of all commands, by a real slicer where one is there."""

from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.checks.review import GCODE, LOST, Review, Step, advised, review
from sensorgen.core.errors import MissingValue
from sensorgen.core.findings import Finding, grouped
from sensorgen.design.design import Design
from sensorgen.design.values import permittivities, resistivities
from sensorgen.design.walls import SLICERS, WALLS, rule
from sensorgen.prediction.print_files import NONE, PrintFile, at_hand
from sensorgen.prediction.results import unpredicted

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed

SHORT, IDLE, UNSUPPORTED = "1-short", "10-waiver", "9-support"


@dataclass(frozen=True, eq=False, kw_only=True)
class PrintReview(Review):
    """All findings about a print, each sentence once, and their source.

    Attributes
    ----------
    drawn : Review
        Findings about the drawing, with an estimate of rule 7.
    file : PrintFile or None
        The G-code; None for an estimate.
    """

    drawn: Review
    file: PrintFile | None

    def printed(self, design: Design, walls: str = "") -> "Printed":
        """The print that the findings are about."""
        walls = walls or rule("prusa", design.walls)
        return self.file.printed(design) if self.file else _estimated(design, walls)

    def errors(self, strict: bool = False) -> list[Finding]:
        """Findings that stop a build: errors of the drawing, and when ``strict`` all errors and warnings."""
        of_print = (LOST, GCODE) if any(f.rule == SHORT for f in self.drawn.findings) else (LOST, GCODE, SHORT)
        return [f for f in super().errors(strict) if strict or f.rule not in of_print]


def reviewed(
    design: Design, step: Step = lambda _: None, slicer: str = "", folder: Path | None = None, walls: str = ""
) -> PrintReview:  # fmt: skip
    """All findings about the print of a design, for every command: by G-code where a slicer is there.

    Parameters
    ----------
    design : Design
        What is printed.
    step : callable
        Called with the next step, for a progress display.
    slicer, folder
        As of :func:`at_hand`.
    walls : str
        For an estimate, one of ``WALLS``; the design's if not given.
    """
    drawn = review(design, step, walls or (rule(slicer, design.walls) if slicer in SLICERS else ""))
    step("slicing")
    file, why = at_hand(design, folder, NONE if walls else slicer, step)
    if file:
        return combined(design, drawn, file.report.slicer.words, file.report.of_print(), file)
    return estimated(design, drawn, walls, why)


def estimated(design: Design, drawn: Review, walls: str = "", why: str = "") -> PrintReview:
    """Findings about a drawing and about its print by the rules of slicers."""
    walls, shorts = walls or rule("prusa", design.walls), list[Finding]()
    if drawn.fits and all(f.rule != SHORT for f in drawn.findings):
        shorts = [f for f in _estimated(design, walls).findings() if f.rule == SHORT]
    return combined(design, drawn, f"estimated ({WALLS[walls]}){why and f': {why}'}", shorts)


def _estimated(design: Design, walls: str) -> "Printed":
    from sensorgen.asprinted import printed

    return printed.body(design, walls=walls)


def of_own_machine(design: Design) -> list[Finding]:
    """Faults of a printer or quality of the user's own; what ships is tested."""
    if not design.own.keys() & {"printers", "qualities"}:
        return []
    from sensorgen.export import machine

    return machine.of_design(design)


def _at_crossing(design: Design, finding: Finding) -> Finding:
    """A finding about an array with the name of the crossing at which it shows, if it does at one."""
    if not finding.place_mm or not design.layout:
        return finding
    x, y, _ = (at * (1 - design.shrinkage) for at in finding.place_mm)
    name = design.layout.crossing(x, design.drawn.size_mm[1] - y if design.orientation == "upside-down" else y)
    return replace(finding, message=f"{finding.message} ({name})") if name else finding


def combined(
    design: Design, drawn: Review, source: str, of_print: list[Finding], file: PrintFile | None = None
) -> PrintReview:  # fmt: skip
    """Findings about a drawing and about its print as one list.

    Parameters
    ----------
    design, drawn : Design, Review
        What is printed, and findings about the drawing.
    source : str
        Of the print.
    of_print : list of Finding
        About the print; where it is no estimate, in place of rule 7 and of unsupported lines by the drawing.
    file : PrintFile, optional
        The print's G-code.
    """
    own = of_own_machine(design)
    replaced = (IDLE,) if source.startswith("estimated") else (IDLE, LOST, UNSUPPORTED)
    names = [parameter.name for parameter in fields(design.params)]
    try:
        permittivities(design), resistivities(design)
    except MissingValue as error:
        own.append(unpredicted(str(error)))
    findings = [*own, *(advised(f, names) for f in of_print), *(f for f in drawn.findings if f.rule not in replaced)]
    findings = list(map(partial(_at_crossing, design), findings))
    waived = [f if f.rule == GCODE else w for f, w in zip(findings, design.waived(findings), strict=True)]
    listed = grouped([*waived, *design.idle_waivers(findings)])
    return PrintReview(design, listed, source, drawn.fits, drawn=drawn, file=file)
