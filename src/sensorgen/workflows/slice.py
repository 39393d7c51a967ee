"""A design to its G-code file: checked as a design, sliced, and checked again as G-code."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sensorgen.analysis.plots import layers as pages
from sensorgen.checks import volumes
from sensorgen.checks.review import review
from sensorgen.core import document
from sensorgen.core import files as store
from sensorgen.core.display import Displayed
from sensorgen.core.document import Part
from sensorgen.core.errors import SensorgenError, Unprintable
from sensorgen.core.findings import Finding, Verdict, headline, listed
from sensorgen.design.design import Design
from sensorgen.design.walls import SLICERS, rule
from sensorgen.export.gcode.results import FileNeeds
from sensorgen.export.slicers import TIME_LIMIT_S
from sensorgen.export.slicing import Step
from sensorgen.prediction.new_slice import NewSlice, SliceReport, slice_now
from sensorgen.prediction.print_files import NONE, PrintFile
from sensorgen.prediction.slices import PrintReview, combined, of_own_machine, reviewed
from sensorgen.workflows.build import json_bytes
from sensorgen.workflows.trial import Adjustment, compensation


@dataclass(frozen=True, kw_only=True)
class SlicedFile(SliceReport, Displayed):
    """G-code of a design, as in the JSON beside it.

    Attributes
    ----------
    gcode : str
        The file for the printer.
    verdict : str
        CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT.
    all_findings : tuple of Finding
        About drawing, file and print, as every command lists them.
    compensated : tuple of Adjustment
        How the design differs from the one that was asked for.
    """

    gcode: str
    verdict: Verdict
    all_findings: tuple[Finding, ...]
    compensated: tuple[Adjustment, ...] = ()

    def document(self) -> Iterator[Part]:
        """Verdict, findings about design, file and print, and what the file takes."""
        yield from compensation(self.compensated)
        yield headline(self.name, self.all_findings, self.slicer.words)
        yield from listed(self.all_findings)
        yield from FileNeeds.document(self)
        yield volumes.table(self.printed.layers)
        yield from self.lifting.document()
        yield f"{self.gcode}: {'refused; ' * self.refused}{self.slicer.name} {self.slicer.version}"


def slice_design(
    design: Design,
    out: Path,
    slicer: str,
    *,
    program: str = "",
    time_limit_s: float = TIME_LIMIT_S,
    force: bool = False,
    strict: bool = False,
    compensated: Sequence[Adjustment] = (),
    step: Step = lambda _: None,
) -> SlicedFile:
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
    compensated : sequence of Adjustment
        How the design differs from the one that was asked for, for the record; it is written too, as ``design.json``.
    step : callable
        Called with the next step, for a progress display.

    Raises
    ------
    Unprintable
        The checks of the design, or with ``strict`` of its print, found errors; nothing was written.
    SlicerFailed, BadInput, UnknownName
        See :func:`sensorgen.export.slicing.sliced`.
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    step("checks")
    drawn = review(design, walls=rule(slicer, design.walls) if slicer in SLICERS else "")
    if (drawn.errors(strict) or of_own_machine(design)) and not force:
        whole = _reviewed(design, slicer, program)
        raise Unprintable(whole.findings, whole.errors(strict), whole.source)
    sliced = slice_now(design, slicer, program=program, time_limit_s=time_limit_s, strict=strict, step=step)
    report = sliced.report
    whole = combined(design, drawn, report.slicer.words, report.of_print(), PrintFile(sliced.record(), sliced.content))
    if strict and whole.errors(strict) and not (force or report.refused):
        raise Unprintable(whole.findings, whole.errors(strict), whole.source)
    stem = f"{design.name}.{slicer}"
    names, others = _names(stem, refused=report.refused)
    result = SlicedFile(
        **vars(report), gcode=names[0], verdict=whole.verdict, all_findings=tuple(whole.findings),
        compensated=tuple(compensated),
    )  # fmt: skip
    changed = json_bytes(design.model_dump(mode="json")) if compensated else b""
    folder = out / design.name
    _put(folder, {
        names[0]: sliced.content, "design.json": changed, names[1]: document.to_json(result).encode(),
        f"{stem}.layers.html": _page(sliced, whole.findings).encode(),
    }, others)  # fmt: skip
    return replace(result, gcode=str(folder / names[0]))


def _names(stem: str, *, refused: bool) -> tuple[tuple[str, str], tuple[str, str]]:
    """Names of G-code and record, and those that a run of the other outcome has left."""
    passed, other = (f"{stem}.gcode", f"{stem}.gcode.json"), (f"{stem}.refused.gcode", f"{stem}.refused.json")
    return (other, passed) if refused else (passed, other)


def _put(folder: Path, files: Mapping[str, bytes], others: Sequence[str]) -> None:
    """Put files that have content in place, and take away those that an earlier run has left under the other name."""
    for name, content in files.items():
        if content:
            store.replace(folder / name, content)
    for old in others:
        (folder / old).unlink(missing_ok=True)


def _page(sliced: NewSlice, findings: Sequence[Finding]) -> str:
    """Layers of a print as a page; "" of nothing."""
    if not (sliced.printed.lines and len(sliced.printed.lines.number)):
        return ""
    travel = {"as sliced": sliced.lifted.before, "as written": sliced.lifted.after}
    return pages.of_print(sliced.printed, findings, {when: course.stretches() for when, course in travel.items()})


def _reviewed(design: Design, slicer: str, program: str) -> PrintReview:
    """All findings as the other commands have them: by this slicer where it slices."""
    try:
        return reviewed(design, slicer="" if program else slicer)
    except SensorgenError:
        return reviewed(design, slicer=NONE)
