"""A design sliced now: its G-code, and the report about it."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from sensorgen.checks.review import GCODE
from sensorgen.core.findings import Finding, LayerVolume
from sensorgen.core.records import adapter
from sensorgen.core.version import __version__
from sensorgen.design.design import Design
from sensorgen.design.walls import TITLES
from sensorgen.export.gcode.results import Checked, Lifting
from sensorgen.export.slicers import TIME_LIMIT_S

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.export.gcode.crossings import Lifted


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
    printed : Printed
        By the first convention for a line's width.
    lifted : Lifted
        The file, followed.
    """

    report: SliceReport
    content: bytes
    printed: "Printed"
    lifted: "Lifted"

    def record(self) -> dict[str, Any]:
        """The report as plain data."""
        record: dict[str, Any] = adapter(SliceReport).dump_python(self.report, mode="json")
        return record


def slice_now(
    design: Design, slicer: str, *, program: str = "", time_limit_s: float = TIME_LIMIT_S, strict: bool = False,
    step: Callable[[str], None] = lambda _: None,
) -> NewSlice:  # fmt: skip
    """Slice a design alone in the middle of the bed, and check the G-code, also against the design.

    Parameters and errors as of :func:`sensorgen.export.slicing.sliced`; with ``strict`` warnings refuse the file, too.
    """
    import numpy as np

    from sensorgen.asprinted import agreement, pinholes
    from sensorgen.asprinted.printed import nominal
    from sensorgen.export import slicing
    from sensorgen.export.gcode.check import check_motion

    with tempfile.TemporaryDirectory() as stage:
        made = slicing.sliced(
            [slicing.alone(design)], slicer, Path(stage), program=program, time_limit_s=time_limit_s, step=step
        )
        content = made.ready.read_bytes()
    printer, loaded = design.machine, {design.tool(name): name for name in design.used()}
    printed = nominal(design, made.lines, f"{made.slicer} {made.version}")
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
