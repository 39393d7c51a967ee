"""Results of a check of G-code as plain data: findings with lines, needs of a file, travel over other materials."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partialmethod
from typing import TYPE_CHECKING, Annotated, ClassVar, Self

from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.findings import SEVERITIES, counted

if TYPE_CHECKING:
    from sensorgen.core.arrays import Whole

NEAR_MM = 0.12  # a nozzle within this above a line is one layer over it
FACE_MM = 0.5  # radius of the flat end of a nozzle: a guess, makers state none
LIFT_MM = 0.2  # 0.4 mm took twice the time and left no less contact
COUNTED_MM = 0.5  # a crossing is longer than this


@dataclass(frozen=True, slots=True)
class GcodeFinding:
    """One finding of one rule.

    Attributes
    ----------
    rule : str
        Name of the rule, as in ``speed``.
    severity : str
        "error", "warning" or "info".
    line : int
        First line of the file where it shows, from 1 [-].
    message : str
        What is the matter, in one sentence.
    advice : str
        What to change.
    count : int
        In how many lines it shows [-].
    """

    rule: str
    severity: str
    line: int
    message: str
    advice: str
    count: int = 1

    @classmethod
    def of(cls, rule: str, lines: "Whole", message: str, advice: str, severity: str = "error") -> "GcodeFinding":
        """A finding that shows in some lines of the file, (n,), each perhaps named more than once."""
        numbers = set(lines.tolist())
        return cls(rule, severity, min(numbers), message, advice, len(numbers))


class Findings(list[GcodeFinding]):
    """Findings of a check as it goes on."""

    def add(self, severity: str, rule: str, line: int, message: str, advice: str) -> None:
        """Add one; an error refuses the file."""
        self.append(GcodeFinding(rule, severity, line, message, advice))

    error, warning, info = partialmethod(add, "error"), partialmethod(add, "warning"), partialmethod(add, "info")


def merged(findings: Iterable[GcodeFinding]) -> tuple[GcodeFinding, ...]:
    """Findings of the same words as one, which has the first line; the severe first, and then by line.

    Bytes of the file that are no UTF-8 are written out, so that any text can hold them.
    """
    by_words: dict[tuple[str, str, str], GcodeFinding] = {}
    for given in findings:
        f = replace(given, message=given.message.encode("utf-8", "backslashreplace").decode())
        key = (f.rule, f.severity, f.message)
        old = by_words.get(key)
        by_words[key] = f if old is None else replace(old, count=old.count + f.count)
    return tuple(sorted(by_words.values(), key=lambda f: (SEVERITIES.index(f.severity), f.line, f.rule)))


@dataclass(frozen=True)
class ToolMaterial:
    """Material of one tool: filament, its part that is no body [mm] where known, volume [mm3], mass [g] where known."""

    tool: Annotated[int, Column("tool")]
    material: Annotated[str, Column("material")]
    filament_mm: Annotated[float, Column("filament", "mm")]
    purge_mm: Annotated[float | None, Column("purged", "mm")]
    volume_mm3: Annotated[float, Column("volume", "mm3")]
    mass_g: Annotated[float | None, Column("mass", "g")]


@dataclass(frozen=True)
class FileNeeds:
    """Needs of a file.

    Attributes
    ----------
    lines, moves, layers : int
        How many it has; layers as its comments count, 0 without [-].
    time_s : float
        At the feeds of the file, without acceleration, heating and changing tools: a lower bound [s].
    tools : tuple of ToolMaterial
        Each tool that prints.
    tool_changes : int
        How often another tool is taken [-].
    box_mm : tuple of two (float, float, float), or None
        Around all printed lines [mm].
    """

    PLACES: ClassVar[str] = "in the file's coordinates, tower and skirt too"

    lines: int
    moves: int
    layers: int
    time_s: float
    tools: tuple[ToolMaterial, ...]
    tool_changes: int
    box_mm: tuple[tuple[float, ...], tuple[float, ...]] | None

    def document(self) -> Iterator[Part]:
        """Tables of the file's needs."""
        facts = [
            ("time", f"{clock(self.time_s)} at its feeds, without acceleration, heating and changing tools"),
            ("tool changes", str(self.tool_changes)),
            ("layers", str(self.layers or "not counted by the file")),
        ]
        if any(tool.purge_mm is None for tool in self.tools):
            facts.append(("purged", "not counted by the file"))
        if self.box_mm:
            spans = (f"{axis} {low:g} to {high:g}" for axis, low, high in zip("xyz", *self.box_mm, strict=True))
            facts.append(("printed", f"{', '.join(spans)} mm {self.PLACES}"))
        yield Facts(tuple(facts))
        if self.tools:
            yield Table.of("tools", "", self.tools)


def clock(seconds: float) -> str:
    """A duration as hours and minutes, or minutes and seconds.

    >>> clock(59.6), clock(4000.0)
    ('1 min 00 s', '1 h 07 min')
    """
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02} s"
    return f"{whole // 3600} h {round(seconds / 60) % 60:02} min"


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


@dataclass(frozen=True)
class ToolTravel:
    """Travel of one tool over what other tools have printed."""

    tool: Annotated[int, Column("tool")]
    contact_mm: Annotated[float, Column("contact", "mm", "travel in contact with another material")]
    near_mm: Annotated[float, Column("near", "mm", f"travel up to {NEAR_MM:g} mm above it")]
    crossings: Annotated[int, Column("crossings", "", f"travels with more than {COUNTED_MM:g} mm of both")]
    unretracted: Annotated[int, Column("unretracted", "", "of these without retraction")]
    rubbing_mm: Annotated[float, Column("rubbing", "mm", "lines printed while the nozzle's face touches it")]


@dataclass(frozen=True)
class OfLayer:
    """Travel of one tool at one height."""

    z_mm: Annotated[float, Column("z", "mm")]
    tool: Annotated[int, Column("tool")]
    contact_mm: Annotated[float, Column("contact", "mm")]
    near_mm: Annotated[float, Column("near", "mm")]


@dataclass(frozen=True)
class Drags:
    """Travel over foreign material in a file, in the order of printing.

    Attributes
    ----------
    tools : tuple of ToolTravel
        Every tool that moves over another's material.
    layers : tuple of OfLayer
        Travel alone, by height of the nozzle.
    """

    tools: tuple[ToolTravel, ...]
    layers: tuple[OfLayer, ...]

    @property
    def contact_mm(self) -> float:
        """Travel in contact, of all tools [mm]."""
        return sum(t.contact_mm for t in self.tools)

    @property
    def near_mm(self) -> float:
        """Travel near, of all tools [mm]."""
        return sum(t.near_mm for t in self.tools)

    def document(self) -> Iterator[Part]:
        """Tables by tool and by layer."""
        if not self.tools:
            yield "No tool moves over what another has printed."
            return
        yield Table.of(
            "tools", f"Over what other tools have printed; radius of the nozzle's face {FACE_MM:g} mm, assumed",
            self.tools,
        )  # fmt: skip
        if self.layers:
            yield Table.of("layers", "Travel by height of the nozzle", self.layers)


@dataclass(frozen=True)
class Lifting:
    """Changes by lifts.

    Attributes
    ----------
    before, after : Drags
        Measured in the file as sliced, and as written.
    lifts, retractions : int
        Added [-].
    added_s : float
        Time that they take, without acceleration [s].
    """

    before: Drags
    after: Drags
    lifts: int
    retractions: int
    added_s: float

    def document(self) -> Iterator[Part]:
        """Before and after, in two lines."""
        if not self.before.contact_mm + self.before.near_mm:
            return
        was, now = (f"{d.contact_mm:.1f} + {d.near_mm:.1f} mm" for d in (self.before, self.after))
        rubs = "; ".join(f"tool {t.tool} {t.rubbing_mm:.0f} mm" for t in self.after.tools if t.rubbing_mm)
        yield Facts(
            (
                ("travel", f"over another tool's material, contact + near: {was} as sliced, {now} as written"),
                (
                    "lifts", f"{self.lifts} of {LIFT_MM:g} mm with {self.retractions} more retractions, "
                    f"+{self.added_s:.0f} s; lines unchanged"
                ),
                *([("rubbing", f"{rubs}: lines beside another material, which no lift changes")] if rubs else []),
            )
        )  # fmt: skip
