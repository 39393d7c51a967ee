"""The print of a design: sliced now, with the report about its G-code; and the one list of findings of all commands."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sensorgen.asprinted import printed as asprinted
from sensorgen.checks import bridges
from sensorgen.checks.review import LOST, Review, Step, advised, review
from sensorgen.checks.volumes import LayerVolume
from sensorgen.core.errors import MissingValue
from sensorgen.core.findings import Finding, grouped
from sensorgen.core.version import __version__
from sensorgen.design.design import Design
from sensorgen.design.values import permittivities, resistivities
from sensorgen.design.walls import WALLS, rule
from sensorgen.export.gcode.results import Checked, Lifting
from sensorgen.export.slicers import SLICERS, TIME_LIMIT_S, TITLES
from sensorgen.prediction.print_files import NONE, PrintFile, at_hand
from sensorgen.prediction.results import unpredicted

if TYPE_CHECKING:
    from pydantic import TypeAdapter

    from sensorgen.export.gcode.drags import Lifted

GCODE = "13-gcode"  # rule of what the check of a G-code file reports


@dataclass(frozen=True)
class Slicer:
    """Name and version of a slicer."""

    name: str
    version: str

    @property
    def words(self) -> str:
        """Source of findings about its print."""
        return f"sliced by {TITLES.get(self.name, self.name)} {self.version}"


@dataclass(frozen=True)
class Volumes:
    """Printed over exact volume per body and layer, and findings about what the lines print."""

    layers: tuple[LayerVolume, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True, kw_only=True)
class SliceReport(Checked):
    """G-code of a design alone on the bed; without run times, so that equal slicing gives equal bytes.

    Attributes
    ----------
    box_mm : tuple of two (float, float, float), or None
        Around the lines of the sensor, from its corner: tower and skirt apart [mm].
    name, design : str
        Name and identity of the design.
    sha256 : str
        Of the file.
    refused : bool
        True where the check of the G-code has errors.
    slicer : Slicer
        Slicer of the file.
    sensorgen, printer, quality : str
        Version of sensorgen; the printer and the quality.
    printed : Volumes
        Volumes as printed.
    lifting : Lifting
        Travel over other tools' material before and after lifts.
    """

    PLACES: ClassVar[str] = "from the sensor's corner, as all places above; without tower and skirt"

    name: str
    design: str
    sha256: str
    refused: bool
    slicer: Slicer
    sensorgen: str
    printer: str
    quality: str
    printed: Volumes
    lifting: Lifting

    def of_print(self) -> list[Finding]:
        """Findings about the file and what it prints, in the form of the checks' findings."""
        of_file = (
            Finding(GCODE, f.severity, f"{f.rule}, line {f.line}", f.message, f.advice, count=f.count)
            for f in self.findings
        )
        return [*self.printed.findings, *of_file]


@dataclass(frozen=True, eq=False)
class NewSlice:
    """A print sliced now.

    Attributes
    ----------
    report : SliceReport
        About the file.
    content : bytes
        The file.
    printed : asprinted.Printed
        By the first convention for a line's width.
    lifted : Lifted
        The file, followed.
    """

    report: SliceReport
    content: bytes
    printed: asprinted.Printed
    lifted: "Lifted"

    def record(self) -> dict[str, Any]:
        """The report as plain data."""
        record: dict[str, Any] = adapter().dump_python(self.report, mode="json")
        return record


def slice_now(
    design: Design, slicer: str, *, program: str = "", time_limit_s: float = TIME_LIMIT_S, strict: bool = False,
    step: Callable[[str], None] = lambda _: None,
) -> NewSlice:  # fmt: skip
    """Slice a design alone in the middle of the bed, and check the G-code, also against the design.

    Parameters and errors as of :func:`sensorgen.export.slicing.sliced`; with ``strict`` warnings refuse the file, too.
    """
    from sensorgen.asprinted import agreement, pinholes
    from sensorgen.export import slicing
    from sensorgen.export.gcode.check import check_motion

    with tempfile.TemporaryDirectory() as stage:
        made = slicing.sliced(
            [slicing.alone(design)], slicer, Path(stage), program=program, time_limit_s=time_limit_s, step=step
        )
        content = made.ready.read_bytes()
    printer, loaded = design.machine, {design.tool(name): name for name in design.used()}
    printed = asprinted.nominal(design, made.lines, f"{made.slicer} {made.version}")
    checked = check_motion(made.lifted.motion, printer, loaded, others_empty=True, texts=design.own).with_more(
        agreement.check(
            design, made.lines, made.lifted.motion, printer.bed_centre_mm(), alone=True, lines=printed.lines
        )
    )
    findings, box = printed.findings(), None
    if printed.lines and len(printed.lines.number):
        ends = np.concatenate([printed.lines.start_mm, printed.lines.end_mm])
        low, high = (tuple(round(v, 3) for v in corner.tolist()) for corner in (ends.min(0), ends.max(0)))
        box = ((*low, printed.first[0].bottom_mm), (*high, printed.first[-1].top_mm))
        films = pinholes.of_lines(design, printed.lines, widths=(1.0,), most_layers=pinholes.MOST_LAYERS)
        findings += design.waived([*pinholes.findings(films)])
    report = SliceReport(
        **(vars(checked) | {"box_mm": box}), name=design.name, design=design.id(), sha256=sha256(content).hexdigest(),
        refused=bool(checked.errors(strict)), slicer=Slicer(made.slicer, made.version), sensorgen=__version__,
        printer=printer.name, quality=design.layers.name,
        printed=Volumes(tuple(printed.rows), (*made.findings, *findings)), lifting=made.lifted.lifting,
    )  # fmt: skip
    return NewSlice(report, content, printed, made.lifted)


@cache
def adapter() -> "TypeAdapter[SliceReport]":
    """The report as plain data, and back."""
    from pydantic import TypeAdapter

    return TypeAdapter(SliceReport)


SHORT, IDLE = "1-short", "10-waiver"


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

    def printed(self, design: Design, walls: str = "") -> asprinted.Printed:
        """The print that the findings are about."""
        walls = walls or rule("prusa", design.walls)
        return self.file.printed(design) if self.file else asprinted.body(design, walls=walls)

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
    if drawn.meshes and all(f.rule != SHORT for f in drawn.findings):
        shorts = [f for f in asprinted.body(design, walls=walls).findings() if f.rule == SHORT]
    return combined(design, drawn, f"estimated ({WALLS[walls]}){why and f': {why}'}", shorts)


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
    replaced = (IDLE,) if source.startswith("estimated") else (IDLE, LOST, bridges.RULE)
    names = [parameter.name for parameter in fields(design.params)]
    try:
        permittivities(design), resistivities(design)
    except MissingValue as error:
        own.append(unpredicted(str(error)))
    findings = [*own, *(advised(f, names) for f in of_print), *(f for f in drawn.findings if f.rule not in replaced)]
    findings = list(map(partial(_at_crossing, design), findings))
    waived = [f if f.rule == GCODE else w for f, w in zip(findings, design.waived(findings), strict=True)]
    listed = grouped([*waived, *design.idle_waivers(findings)])
    return PrintReview(drawn.meshes, listed, source, drawn=drawn, file=file)
