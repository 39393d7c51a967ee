"""G-code of a design, that of its folder or else sliced, now or before; the report about it is read when it is used.

A design is sliced once: its G-code is stored by design, profile, slicer and version.
"""

import os
import shutil
import zlib
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core import cache as stored
from sensorgen.core.errors import SensorgenError, UnknownName
from sensorgen.core.records import adapter
from sensorgen.design.design import Design
from sensorgen.design.packs import profiles
from sensorgen.design.walls import PROGRAMS, SLICERS

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.prediction.new_slice import SliceReport

Step = Callable[[str], None]
VARIABLE = "SENSORGEN_SLICER"  # environment: prusa, cura, or none for estimates; the first that is installed if not set
NONE = "none"
OUT = Path("out")  # folder of the designs' folders, where build and slice write, unless told otherwise
_LAST: "dict[tuple[str, ...], Printed]" = {}  # body of the file that was read last
_LIMIT_S = 300.0  # for a decision


@dataclass(frozen=True, eq=False)
class PrintFile:
    """A G-code file of a design: its report as plain data, its text, and the file's name, "" for one from the cache."""

    record: Mapping[str, Any]
    content: bytes
    name: str = ""

    @cached_property
    def report(self) -> "SliceReport":
        """The report about the file."""
        from sensorgen.prediction.new_slice import SliceReport

        report: SliceReport = adapter(SliceReport).validate_python(self.record)
        return report

    @property
    def source(self) -> str:
        """Slicer, version and file."""
        slicer = self.record["slicer"]
        return ", ".join(filter(None, (f"{slicer['name']} {slicer['version']}", self.name)))

    def printed(self, design: Design) -> "Printed":
        """Body that the lines print."""
        from sensorgen.asprinted import printed as asprinted
        from sensorgen.export.gcode import motion

        key = (self.record["sha256"], self.source, design.id())
        if key not in _LAST:  # pictures, pages and the prediction of one print ask in turn
            _LAST.clear()
            _LAST[key] = asprinted.body(design, motion.read(self.content, design.machine), slicer=self.source)
        return _LAST[key]


def deciding() -> str:
    """Name of the slicer that decides; ``none`` where none is installed.

    Raises
    ------
    UnknownName
        The environment names another one.
    """
    word = os.environ.get(VARIABLE, "")
    if word and word not in (*SLICERS, NONE):
        raise UnknownName(f"slicer in {VARIABLE}", word, (*SLICERS, NONE))
    return word or next((name for name in SLICERS if shutil.which(PROGRAMS[name][0])), NONE)


def at_hand(
    design: Design, folder: Path | None = None, slicer: str = "", step: Step = lambda _: None, program: str = ""
) -> tuple[PrintFile | None, str]:  # fmt: skip
    """G-code of a design: that of its folder, else sliced, now or before; or None, and why the print is estimated.

    Parameters
    ----------
    design : Design
        What is printed.
    folder : Path, optional
        With the design's files; ``out/NAME`` in the working folder if not given.
    slicer : str
        One of ``SLICERS``, whatever the folder has, or ``none``; the deciding one if not given.
    step : callable
        Called with the next step, for a progress display.
    program : str
        Path of the slicer's program; that on PATH if not given.

    Raises
    ------
    SensorgenError
        A slicer that is given is missing, or fails.
    """
    if slicer:
        return (None, "") if slicer == NONE else _by_slicer(design, slicer, step, program)
    if file := in_folder(design, folder):
        return file, ""
    decides = deciding()
    if decides == NONE:
        return None, "" if os.environ.get(VARIABLE) else "no slicer installed"
    try:
        return _by_slicer(design, decides, step, program)
    except SensorgenError as error:
        return None, str(error)


def _by_slicer(design: Design, slicer: str, step: Step, program: str) -> tuple[PrintFile | None, str]:
    """G-code of a design by a slicer, now or before; or None, and why it is not sliced."""
    from sensorgen.export.slicers.run import find

    program = find(*PROGRAMS[slicer], program)
    question = _question(design, slicer, program)
    if stored.known(question) is None and not _fits(design):
        return None, "it does not fit the bed"

    def work() -> dict[str, Any]:
        from sensorgen.prediction.new_slice import slice_now

        sliced = slice_now(design, slicer, program=program, time_limit_s=_LIMIT_S, step=step)
        return {"report": sliced.record(), "gcode": b64encode(zlib.compress(sliced.content, 1)).decode()}

    entry = stored.answer(question, work)
    return PrintFile(entry["report"] | {"name": design.name}, zlib.decompress(b64decode(entry["gcode"]))), ""


def _fits(design: Design) -> bool:
    """Test whether a design fits the bed, or a waiver says so."""
    from sensorgen.checks import rules

    return all(f.waiver for f in design.waived(list(rules.bed_findings(design.printed, design.machine))))


def _question(design: Design, slicer: str, program: str) -> dict[str, Any]:
    """All that decides a slice and its findings: files and values that a profile is written by, not its text."""
    from sensorgen.export.slicers import versions
    from sensorgen.export.slicers.loads import loads

    changed = Path(program).stat().st_mtime_ns
    version = tuple(
        stored.answer(
            {"what": "version", "program": program, "changed": changed},
            lambda: list(versions.of_program(slicer, program)),
        )
    )
    files = sorted(path for path in profiles().rglob("*") if path.is_file())
    waivers = [waiver.model_dump() for waiver in design.waivers]
    decides = repr((design.machine, design.layers, loads(design), waivers, [path.read_bytes() for path in files]))
    return {
        "what": "slice", "design": design.id(), "slicer": slicer, "version": version, "program": program,
        "changed": changed, "profile": sha256(decides.encode()).hexdigest(),
    }  # fmt: skip


def in_folder(design: Design, folder: Path | None = None) -> PrintFile | None:
    """The sliced file of this very design in a folder, ``out/NAME`` if not given; its record is beside it."""
    folder = folder or OUT / design.name
    if not (os.path.isdir(folder) and any(folder.glob("*.gcode.json"))):  # noqa: PTH112 - a name too long
        return None
    from sensorgen.prediction.new_slice import SliceReport

    known = adapter(SliceReport)
    for note in sorted(folder.glob("*.gcode.json")):
        try:
            content = note.with_suffix("").read_bytes()
            report = known.validate_json(note.read_bytes())
            if report.design == design.id() and report.sha256 == sha256(content).hexdigest():
                return PrintFile(known.dump_python(report, mode="json"), content, note.with_suffix("").name)
        except (OSError, ValueError):  # no file of ours
            continue
    return None
