"""A design to its G-code file: checked as a design, sliced, and checked again as G-code."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

from sensorgen.analysis.plots import layers as pages
from sensorgen.asprinted import agreement, pinholes
from sensorgen.asprinted.printed import nominal
from sensorgen.checks import volumes
from sensorgen.checks.volumes import Row
from sensorgen.core import document
from sensorgen.core import files as store
from sensorgen.core.document import Part
from sensorgen.core.errors import Unprintable
from sensorgen.core.findings import Finding, counted, counts, listed
from sensorgen.core.version import __version__
from sensorgen.design.design import Design
from sensorgen.design.walls import rule
from sensorgen.export.gcode.check import Checked, check_motion
from sensorgen.export.gcode.drags import Lifting
from sensorgen.export.slicers import SLICERS, TIME_LIMIT_S
from sensorgen.export.slicing import Step, alone, sliced
from sensorgen.workflows import compensation
from sensorgen.workflows.compensation import Change
from sensorgen.workflows.reviewed import reviewed


@dataclass(frozen=True)
class Slicer:
    """Name and version of a slicer."""

    name: str
    version: str


@dataclass(frozen=True)
class Volumes:
    """Printed over exact volume per body and layer, and findings of rule 7 and of the slicer's profile."""

    layers: tuple[Row, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True, kw_only=True)
class Printed(Checked):
    """G-code of a design, as in the JSON beside it; without run times, so that equal slicing gives equal bytes.

    Attributes
    ----------
    name, design : str
        Name and identity of the design.
    gcode, sha256 : str
        The file for the printer, and its SHA-256.
    refused : bool
        Whether the check of the G-code found errors.
    slicer : Slicer
        Who sliced it.
    sensorgen, printer, quality : str
        Version of sensorgen; the printer and the quality.
    design_findings : tuple of Finding
        What the checks of the design found.
    printed : Volumes
        Volumes as printed.
    lifting : Lifting
        Travel over other tools' material before and after lifts.
    compensated : tuple of Change
        How the design differs from the one that was asked for.
    """

    name: str
    design: str
    gcode: str
    refused: bool
    sha256: str
    slicer: Slicer
    sensorgen: str
    printer: str
    quality: str
    design_findings: tuple[Finding, ...]
    printed: Volumes
    lifting: Lifting
    compensated: tuple[Change, ...] = ()

    @property
    def lost(self) -> bool:
        """Whether a body is missing from a layer against the will of the design."""
        return any(f.severity == "error" and not f.waiver for f in self.printed.findings)

    def document(self) -> Iterator[Part]:
        """Findings about design, file and print, and what the file takes."""
        yield from compensation.document(self.compensated)
        yield f"{self.name}, drawn: {counted(counts(self.design_findings))} (sensorgen check shows them)"
        yield from super().document()
        yield volumes.table(self.printed.layers)
        yield from listed(self.printed.findings)
        yield from self.lifting.document()
        verdict = "refused; " if self.refused else ""
        yield f"{self.gcode}: {verdict}{self.slicer.name} {self.slicer.version}; {counted(self.counts())}"


def slice_design(
    design: Design,
    out: Path,
    slicer: str,
    *,
    program: str = "",
    time_limit_s: float = TIME_LIMIT_S,
    force: bool = False,
    strict: bool = False,
    compensated: Sequence[Change] = (),
    step: Step = lambda _: None,
) -> Printed:
    """Write ``out/<name>/<name>.<slicer>.gcode``, and beside it ``.json`` with what was found and made.

    A file in which the check finds errors, on its own or against the design, gets the name
    ``<name>.<slicer>.refused.gcode``. Either takes the place of both that an earlier run has left: what has the usual
    name is always the last one sliced, and passed.

    Parameters
    ----------
    design : Design
        What to print, alone in the middle of the bed.
    out : Path
        Folder that holds the designs' folders.
    slicer : str
        ``prusa`` or ``cura``.
    program : str
        Path of the slicer; "" for the one on PATH.
    time_limit_s : float
        How long the slicer may take [s].
    force : bool
        Slice even if checks of the design report errors; those of the G-code refuse it none the less.
    strict : bool
        Take warnings for errors.
    compensated : sequence of Change
        How the design differs from the one that was asked for, for the record.
    step : callable
        Called with the next step, for a progress display.

    Raises
    ------
    Unprintable
        The checks of the design found errors; nothing was written.
    SlicerFailed, BadInput, UnknownName
        See :func:`sensorgen.export.slicing.sliced`.
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    step("checks")
    held = reviewed(design, walls=rule(slicer, design.walls) if slicer in SLICERS else "")
    if held.errors(strict) and not force:
        raise Unprintable(held.findings, held.errors(strict))
    with tempfile.TemporaryDirectory() as stage:
        made = sliced([alone(design)], slicer, Path(stage), program=program, time_limit_s=time_limit_s, step=step)
        content = made.ready.read_bytes()
    machine, loaded = design.machine, {design.tool(name): name for name in design.used()}
    printed = nominal(design, made.lines, f"{made.slicer} {made.version}")
    checked = check_motion(made.lifted.motion, machine, loaded, others_empty=True, texts=design.own).with_more(
        agreement.check(
            design, made.lines, made.lifted.motion, machine.bed_centre_mm(), alone=True, lines=printed.lines
        )
    )
    layers, findings = printed.rows, printed.findings()
    if printed.lines and len(printed.lines.number):
        films = pinholes.of_lines(design, printed.lines, widths=(1.0,), most_layers=pinholes.MOST_LAYERS)
        findings += design.waived([*pinholes.findings(films)])
        travel = {"as sliced": made.lifted.before, "as written": made.lifted.after}
        page = pages.of_print(printed, findings, {when: found.stretches() for when, found in travel.items()})
    else:
        page = ""
    stopped, stem = bool(checked.errors(strict)), f"{design.name}.{slicer}"
    passed, refused = (f"{stem}.gcode", f"{stem}.gcode.json"), (f"{stem}.refused.gcode", f"{stem}.refused.json")
    names, others = (refused, passed) if stopped else (passed, refused)
    result = Printed(
        **vars(checked), name=design.name, design=design.id(), gcode=names[0], refused=stopped,
        sha256=sha256(content).hexdigest(), slicer=Slicer(made.slicer, made.version), sensorgen=__version__,
        printer=design.machine.name, quality=design.layers.name, design_findings=tuple(held.sliced().findings),
        printed=Volumes(tuple(layers), (*made.findings, *findings)), lifting=made.lifted.lifting,
        compensated=tuple(compensated),
    )  # fmt: skip
    return _written(result, out / design.name, content, page, others)


def _written(result: Printed, folder: Path, content: bytes, page: str, others: tuple[str, ...]) -> Printed:
    """Put the files in place, and take away those that an earlier run has left under the other name."""
    store.replace(folder / result.gcode, content)
    stem = result.gcode.removesuffix(".gcode").removesuffix(".refused")
    note = f"{stem}.refused.json" if result.refused else f"{result.gcode}.json"
    store.replace(folder / note, document.to_json(result).encode())
    if page:
        store.replace(folder / f"{stem}.layers.html", page.encode())
    for old in others:
        (folder / old).unlink(missing_ok=True)
    return replace(result, gcode=str(folder / result.gcode))
