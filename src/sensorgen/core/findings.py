"""Findings of checks, and volumes that are printed, as data and for people."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Literal, TypeVar

from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.lazy import by_key

SEVERITIES = ("error", "warning", "info")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
Item = TypeVar("Item")
Verdict = Literal["PRINT", "PRINT WITH WARNINGS", "CHANGE"]


@dataclass(frozen=True)
class Finding:
    """One finding of one rule.

    Attributes
    ----------
    rule : str
        Number and name of the rule, as in ``1-gap``.
    severity : str
        "error", "warning" or "info".
    body : str
        Name of the body, or of two, joined by " / ".
    message : str
        What is the matter, in one sentence.
    advice : str
        What to change.
    value_mm, limit_mm : float or None
        What was found and what was expected [mm].
    layer : int or None
        Number of the printed layer, from 1 at the bed [-].
    place_mm : tuple of (float, float, float) or None
        One place where it shows: x, y, z on the bed, from the sensor's corner [mm].
    count : int
        At how many places it shows [-].
    last_layer : int or None
        Where it goes on through the layers after, the last of them [-].
    waiver : str
        The design's reason to accept it, or "".
    margin_mm : float or None
        Distance of the value to the limit, negative: it is on the wrong side. From these two [mm].
    """

    rule: str
    severity: str
    body: str
    message: str
    advice: str
    value_mm: float | None = None
    limit_mm: float | None = None
    layer: int | None = None
    place_mm: tuple[float, float, float] | None = None
    count: int = 1
    last_layer: int | None = None
    waiver: str = ""
    margin_mm: float | None = None

    def __post_init__(self) -> None:
        """Derive the margin."""
        if self.value_mm is not None and self.limit_mm is not None:
            object.__setattr__(self, "margin_mm", -round(abs(self.value_mm - self.limit_mm), 9))

    @property
    def place(self) -> str:
        """Rule, body and layers, in words."""
        layers = f", layer {self.layer}" if self.layer else ""
        layers += f" to {self.last_layer}" if self.last_layer else ""
        return f"{self.rule}  {self.body}{layers}" + (f", {self.count} places" if self.count > 1 else "")

    @property
    def text(self) -> str:
        """Message: the fault, its place, and the change to make."""
        x, y, z = self.place_mm or (0.0, 0.0, 0.0)
        at = f" ({'first ' if self.count > 1 else ''}at x {x:g}, y {y:g}, z {z:g} mm)" if self.place_mm else ""
        return f"{self.message}{at} {f'accepted: {self.waiver}' if self.waiver else f'-> {self.advice}'}"


@dataclass(frozen=True)
class LayerVolume:
    """Volume of one body in one layer.

    Attributes
    ----------
    body : str
        Its name.
    layer : int
        From 1 at the bed [-].
    bottom_mm, top_mm : float
        Where the layer starts and ends [mm].
    exact_mm3, printed_mm3 : float
        Volume as drawn, and as printed [mm3].
    strips, vanished, fused : int
        Separate parts as drawn, those that are lost, and those that merge with a neighbour [-].
    place_mm : (float, float)
        Middle of the first lost part, or else of the first, at its front or left edge [mm].
    ratio : float or None
        Printed over drawn volume; None where nothing is drawn. From these two [-].
    """

    body: str
    layer: int
    bottom_mm: float
    top_mm: float
    exact_mm3: float
    printed_mm3: float
    strips: int
    vanished: int
    fused: int
    place_mm: tuple[float, float]
    ratio: float | None = None

    def __post_init__(self) -> None:
        """Derive the ratio."""
        if self.exact_mm3 > 0:
            object.__setattr__(self, "ratio", self.printed_mm3 / self.exact_mm3)

    @property
    def grown(self) -> bool:
        """True if more is printed than drawn."""
        return self.printed_mm3 > self.exact_mm3


@dataclass(frozen=True)
class Refused:
    """A design, or a plan, that is not made because of findings.

    Attributes
    ----------
    name : str
        Of the design or the plan.
    findings : tuple of Finding
        All of them.
    stopping : int
        How many of them, the first ones, are why.
    source : str
        Slicer and version, or that the print is estimated, and why.
    folder, gcode : None
        Nothing was written.
    """

    name: str
    findings: tuple[Finding, ...]
    stopping: int
    source: str = ""
    folder: None = None
    gcode: None = None

    def document(self) -> Iterator[Part]:
        """The verdict, and the findings that matter most of those that are why."""
        shown = most_severe(self.findings[: self.stopping], 3)
        source = self.source and f"; {self.source}"
        yield f"CHANGE  {self.name}: {counted(counts(self.findings))}{source}"  # warnings, too, where they stop it
        yield ""
        yield from listed(shown)
        if len(self.findings) > len(shown):
            yield ""
            yield "all of them: sensorgen check"


def listed(findings: Iterable[Finding]) -> Iterator[Part]:
    """Findings as facts, each with what to change."""
    heads = (("waived" if f.waiver else f.severity, f) for f in findings)
    if rows := tuple(row for head, f in heads for row in ((head, f.place), ("", f.text))):
        yield Facts(rows)


def table(findings: Iterable[Finding]) -> Table:
    """Findings as a table."""
    heads = ("severity", "rule", "body", "places", "finding", "advice")
    columns = (*map(Column, heads), *(Column(name, hidden=True) for name in ("layer", "last_layer", "waiver")))
    rows = (
        (f.severity, f.rule, f.body, f.count, f.message, f.advice, f.layer, f.last_layer, f.waiver) for f in findings
    )  # fmt: skip
    return Table("findings", "", columns, tuple(rows))


def counts(findings: Sequence[Finding]) -> dict[str, int]:
    """Number of findings of each severity, and of those that are waived [-]."""
    heads = ["waived" if f.waiver else f.severity for f in findings]
    return {head: heads.count(head) for head in (*SEVERITIES, "waived")}


def verdict(findings: Sequence[Finding]) -> Verdict:
    """CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT; waived findings do not count.

    >>> verdict([Finding("2-film", "warning", "film", "a single layer", "print two")])
    'PRINT WITH WARNINGS'
    """
    number = counts(findings)
    return "CHANGE" if number["error"] else "PRINT WITH WARNINGS" if number["warning"] else "PRINT"


def headline(name: str, findings: Sequence[Finding], source: str = "", *, predicted: bool = True) -> str:
    """Verdict, counts and source of all findings about a print; without numbers, of the checks alone."""
    parts = (counted(counts(findings)), source, "" if predicted else "not predicted")
    return f"{verdict(findings)}  {name}: {'; '.join(filter(None, parts))}"


def counted(counts: Mapping[str, int]) -> str:
    """Numbers of findings by severity, in words.

    >>> counted({"error": 0, "warning": 2, "info": 1}), counted({})
    ('2 warnings, 1 info', 'no findings')
    """
    words = (f"{n} {kind}{'s' if n > 1 and kind in ('error', 'warning') else ''}" for kind, n in counts.items() if n)
    return ", ".join(words) or "no findings"


def grouped(findings: Sequence[Finding]) -> list[Finding]:
    """Each sentence once, whatever its numbers: with all bodies and layers, and the worst place; the severe first.

    >>> wide = [Finding("5-width", "warning", "film", f"{w} mm wide", "widen it", w, 0.44, k, count=9)
    ...         for k, w in enumerate((0.3, 0.2, 0.4), 5)]
    >>> [(f.message, f.layer, f.last_layer, f.count) for f in grouped(wide)]
    [('0.2 mm wide', 5, 7, 27)]
    """
    return [_joined(alike) for alike in _by_sentence(findings)]


def numbered(findings: Sequence[Finding]) -> dict[Finding, int]:
    """Number of each finding among the sentences of :func:`grouped`, from 1: its number on the drawing."""
    return {f: number for number, alike in enumerate(_by_sentence(findings), 1) for f in alike}


def runs(items: Iterable[Item], number: Callable[[Item], int]) -> Iterator[list[Item]]:
    """Items whose numbers follow each other, as those of neighbouring layers, run by run.

    >>> list(runs([1, 2, 4, 7, 8], int))
    [[1, 2], [4], [7, 8]]
    """
    for _, run in groupby(enumerate(items), key=lambda pair: number(pair[1]) - pair[0]):
        yield [item for _, item in run]


def _by_sentence(findings: Sequence[Finding]) -> Iterable[list[Finding]]:
    ranked = sorted(findings, key=lambda f: (bool(f.waiver), SEVERITIES.index(f.severity)))
    return by_key(((f.severity, f.waiver, f.rule, _NUMBER.sub("0", f.message)), f) for f in ranked).values()


def _joined(alike: Sequence[Finding]) -> Finding:
    """Findings of one sentence as one, with the numbers of the worst."""
    worst = min(alike, key=lambda f: f.margin_mm or 0.0)
    layers = [k for f in alike for k in (f.layer, f.last_layer) if k is not None]
    bodies = dict.fromkeys(name for f in alike for name in f.body.split(", "))
    return replace(
        worst, body=", ".join(bodies), count=sum(f.count for f in alike), layer=min(layers, default=None),
        last_layer=max(layers) if len(set(layers)) > 1 else None,
    )  # fmt: skip


def most_severe(findings: Sequence[Finding], count: int) -> list[Finding]:
    """The first findings that matter of those that the design does not waive, each sentence once."""
    return grouped([f for f in findings if not f.waiver])[:count]
