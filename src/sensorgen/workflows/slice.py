"""A design to its G-code file: checked as a design, sliced, and checked again as G-code."""

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sensorgen.asprinted.printed import rule7
from sensorgen.checks.review import Review, review
from sensorgen.checks.volumes import Row
from sensorgen.core import files as store
from sensorgen.core.errors import Unprintable
from sensorgen.core.findings import Finding
from sensorgen.core.version import __version__
from sensorgen.design.design import Design
from sensorgen.export.gcode.check import Checked, check
from sensorgen.export.slicers import TIME_LIMIT_S, WALLS
from sensorgen.export.slicing import Sliced, Step, alone, sliced


@dataclass(frozen=True)
class Printed:
    """What slicing a design has left behind.

    Attributes
    ----------
    gcode : Path
        The file for the printer.
    slicer, version : str
        Who sliced it.
    seconds, own_seconds : float
        Time that the slicer took, and that everything around it took [s].
    review : Review
        What the checks of the design found.
    checked : Checked
        What the check of the file found, and what it takes.
    sha256 : str
        Of the file.
    rows, printed : tuple of Row, tuple of Finding
        Printed over exact volume per body and layer, and what rule 7 says of it.
    forced : bool
        Whether errors of the design were to be accepted.
    """

    design: Design
    gcode: Path
    slicer: str
    version: str
    seconds: float
    own_seconds: float
    review: Review
    checked: Checked
    sha256: str
    rows: tuple[Row, ...]
    printed: tuple[Finding, ...]
    forced: bool

    @property
    def code(self) -> int:
        """Exit code: 1 where the printer's file has errors, or a body is missing from a layer against the will [-]."""
        lost = any(f.severity == "error" and not f.waiver for f in self.printed) and not self.forced
        return 1 if lost or self.checked.errors() else 0

    def as_dict(self) -> dict[str, Any]:
        """Plain data, for JSON; times are not in it, so that equal slicing gives equal bytes."""
        return {
            "name": self.design.name,
            "design": self.design.id(),
            "gcode": str(self.gcode),
            "sha256": self.sha256,
            "slicer": {"name": self.slicer, "version": self.version},
            "sensorgen": __version__,
            "printer": self.design.machine.name,
            "quality": self.design.layers.name,
            "design_findings": [f.as_dict() for f in self.review.findings],
            "printed": {
                "layers": [row.as_dict() for row in self.rows],
                "findings": [f.as_dict() for f in self.printed],
            },
            **self.checked.as_dict(),
        }


def slice_design(
    design: Design,
    out: Path,
    slicer: str,
    *,
    program: str = "",
    time_limit_s: float = TIME_LIMIT_S,
    force: bool = False,
    strict: bool = False,
    step: Step = lambda _: None,
) -> Printed:
    """Write ``out/<name>/<name>.<slicer>.gcode``, and beside it ``.json`` with what was found and made.

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
        Slice even if checks report errors.
    strict : bool
        Take warnings for errors.
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
    held = review(design, walls=WALLS.get(slicer, "arachne"))
    if held.errors(strict) and not force:
        raise Unprintable(held.findings)
    folder = out / design.name
    target = folder / f"{design.name}.{slicer}.gcode"
    with tempfile.TemporaryDirectory() as stage:
        made = sliced([alone(design)], slicer, Path(stage), program=program, time_limit_s=time_limit_s, step=step)
        content = made.ready.read_bytes()
        loaded = {design.tool(name): name for name in design.used()}
        held = held.sliced()
        checked = check(made.ready, design.machine, loaded, others_empty=True)
        rows = rule7(design, made.lines)
    result = _printed(design, target, made, held, (checked, *rows), content, forced=force)
    store.replace(target, content)
    text = json.dumps(result.as_dict() | {"gcode": target.name}, indent=2, ensure_ascii=False) + "\n"
    store.replace(folder / f"{target.name}.json", text.encode())
    return result


def _printed(
    design: Design,
    target: Path,
    made: Sliced,
    held: Review,
    found: tuple[Checked, list[Row], list[Finding]],
    content: bytes,
    *,
    forced: bool,
) -> Printed:
    from hashlib import sha256

    checked, rows, printed = found

    return Printed(
        design, target, made.slicer, made.version, made.seconds, made.own_seconds, held, checked,
        sha256(content).hexdigest(), tuple(rows), tuple(printed), forced,
    )  # fmt: skip
