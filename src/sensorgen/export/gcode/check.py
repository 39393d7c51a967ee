"""Check of a G-code file on a simulated printer: faults, time, filament."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Self

from sensorgen.core.document import Facts, Part
from sensorgen.core.findings import SEVERITIES, counted
from sensorgen.design import materials
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import commands, limits
from sensorgen.export.gcode.files import Source
from sensorgen.export.gcode.found import GcodeFinding, merged
from sensorgen.export.gcode.motion import executed
from sensorgen.export.gcode.moves import Motion
from sensorgen.export.gcode.report import FileNeeds, report


@dataclass(frozen=True, kw_only=True)
class Checked(FileNeeds):
    """Needs of a file, and findings.

    Attributes
    ----------
    findings : tuple of GcodeFinding
        The severe first.
    """

    findings: tuple[GcodeFinding, ...]

    def errors(self, strict: bool = False) -> list[GcodeFinding]:
        """Findings that refuse the file; with ``strict`` also the warnings."""
        bad = SEVERITIES[: 2 if strict else 1]
        return [f for f in self.findings if f.severity in bad]

    def with_more(self, findings: Iterable[GcodeFinding]) -> Self:
        """Add further findings."""
        return replace(self, findings=merged([*self.findings, *findings]))

    def counts(self) -> dict[str, int]:
        """Number of findings of each severity [-]."""
        return {severity: sum(f.severity == severity for f in self.findings) for severity in SEVERITIES}

    def document(self) -> Iterator[Part]:
        """Findings, each with what to change, and what the file takes."""
        rows = []
        for f in self.findings:
            more = f" and {f.count - 1} more" if f.count > 1 else ""
            rows += [(f.severity, f"{f.rule}, line {f.line}{more}"), ("", f"{f.message} -> {f.advice}")]
        if rows:
            yield Facts(tuple(rows))
        yield from super().document()


@dataclass(frozen=True, kw_only=True)
class CheckedFile(Checked):
    """A checked file by its name, the printer's, and that of the design that it was checked against, or ""."""

    file: str
    printer: str
    design: str = ""

    def document(self) -> Iterator[Part]:
        """Findings, what the file takes, and how many findings there are."""
        yield from super().document()
        yield f"{self.file}: {counted(self.counts())}"


def check(
    source: Source, machine: Printer, loaded: Mapping[int, str] | None = None, *, others_empty: bool = False
) -> Checked:
    """Check a file, whoever has sliced it.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The file, its content, or its lines.
    machine : Printer
        Who is to print it.
    loaded : mapping of int to str, optional
        Material of each tool, for masses.
    others_empty : bool
        Whether nothing is on the other tools, so that they must not print.

    Raises
    ------
    BadInput
        The file cannot be read, or is no G-code.

    Examples
    --------
    >>> from sensorgen.design.printer import load_printer
    >>> found = check(["G90", "M83", "M140 S60", "G10 P9 S210"], load_printer("diabase-h5")).findings
    >>> found[0].rule, found[0].line, found[0].message
    ('tool', 4, 'tool 9 gets a temperature; diabase-h5 has 1, 2, 3, 4, 5')
    """
    return check_motion(executed(source, machine), machine, loaded, others_empty=others_empty)


def check_motion(
    motion: Motion, machine: Printer, loaded: Mapping[int, str] | None = None, *, others_empty: bool = False,
    texts: materials.Texts = materials.NO_TEXTS,
) -> Checked:  # fmt: skip
    """Check a file that was followed; see :func:`check`, and for ``texts`` :func:`sensorgen.design.materials.load`."""
    known = {*materials.names(), *texts.get("materials", ())}
    loads = {tool: materials.load(name, texts=texts) for tool, name in (loaded or {}).items() if name in known}
    findings = [*limits.check(motion, machine), *commands.check(motion, machine, loads)]
    findings += limits.check_loaded(motion, machine, loads, others_empty=others_empty)
    return Checked(**vars(report(motion, machine, dict(loaded or {}), texts)), findings=merged(findings))
