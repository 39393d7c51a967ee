"""Design rule check: exact gap, valid bodies, and the findings of every rule about a design on its printer."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from hashlib import sha256
from typing import TYPE_CHECKING

from sensorgen.core import cache
from sensorgen.core.display import Displayed
from sensorgen.core.document import Part, Table, comma_separated
from sensorgen.core.findings import Finding, Verdict, counted, counts, headline, listed, table, verdict
from sensorgen.core.records import adapter
from sensorgen.design.design import Design
from sensorgen.design.printer import tower
from sensorgen.design.walls import rule

if TYPE_CHECKING:  # a review that is stored does without NumPy
    from sensorgen.scene.geometry.meshes import Mesh
    from sensorgen.scene.scene import Scene

Step = Callable[[str], None]
STEPS = ("meshes", "checks", "validity")
LOST, GCODE = "7-printed", "13-gcode"  # rules of what the print loses, and of the check of its file
_WIDENED = ("2-printed-gap", "5-width", LOST)  # rules that larger widths or a longer period satisfy


@dataclass(frozen=True, eq=False)
class Review(Displayed):
    """All findings about a design, with their source; ``fits`` is False where no bed holds it."""

    design: Design = field(repr=False)
    findings: list[Finding]
    source: str = "rules of the drawing"
    fits: bool = True

    @cached_property
    def meshes(self) -> "dict[str, Mesh]":
        """The printed bodies, by name."""
        return _meshes(self.design)

    def document(self) -> Iterator[Part]:
        """Verdict, then the findings."""
        yield f"{self.verdict}: {counted(self.counts())}; {self.source}"
        yield from listed(self.findings)

    def table(self) -> Table:
        """The findings."""
        return table(self.findings)

    def errors(self, strict: bool = False) -> list[Finding]:
        """Findings that stop a build: errors, and when ``strict`` warnings, that the design does not waive.

        What is lost in slicing stops nothing unless ``strict``: the files are written, as G-code is.
        """
        open_ones = [f for f in self.findings if not f.waiver]
        if strict:
            return [f for f in open_ones if f.severity in ("error", "warning")]
        return [f for f in open_ones if f.severity == "error" and f.rule != LOST]

    @property
    def verdict(self) -> Verdict:
        """CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT."""
        return verdict(self.findings)

    def counts(self) -> dict[str, int]:
        """Number of findings of each severity, and of those that are waived."""
        return counts(self.findings)


def review(design: Design, step: Step = lambda _: None, walls: str = "") -> Review:
    """Check a design as it lies on the bed, or read what was found before.

    Whether bodies overlap is looked at last, and only when nothing else is wrong: it takes longest.

    Parameters
    ----------
    design : Design
        What to check.
    step : callable
        Called with the next step, for a progress display.
    walls : str
        Of the slicer, one of :data:`sensorgen.checks.estimate.RULES`; those that PrusaSlicer makes if not given.

    Raises
    ------
    SensorgenError
        A name or value of the design is missing.
    """
    walls = walls or rule("prusa", design.walls)
    decides = repr((design.machine, design.layers, design.regions, design.waivers))
    question = {
        "what": "review", "design": design.id(), "walls": walls, "decides": sha256(decides.encode()).hexdigest()
    }  # fmt: skip
    findings = adapter(list[Finding])
    if (known := cache.known(question)) is not None:
        return Review(design, findings.validate_python(known["findings"]), fits=known["fits"])
    result = _computed(design, step, walls)
    cache.keep(question, {"findings": findings.dump_python(result.findings, mode="json"), "fits": result.fits})
    return result


def _computed(design: Design, step: Step, walls: str) -> Review:
    from sensorgen.checks import estimate, rules
    from sensorgen.scene.geometry import meshes

    misfit = design.waived(list(rules.bed_findings(design.printed, design.machine)))
    if any(not f.waiver for f in misfit):  # a sensor that no bed holds may be too large to mesh, too
        step("checks")
        return Review(design, misfit, fits=False)
    scene = design.printed
    step("meshes")
    meshed = _meshes(design)
    step("checks")
    gap_mm = meshes.electrode_gap_mm(scene, meshed)
    findings = rules.findings(scene, design.machine, design.layers, gap_mm, walls, estimate.lines(design))
    findings += _crowding(design)
    findings = [advised(f, [p.name for p in fields(design.params)]) for f in findings]
    if not any(f.severity == "error" and f.rule != LOST for f in findings):
        step("validity")
        advice = "change the parameters; if they make sense, this is a fault of sensorgen: report it"
        faults = meshes.faults(scene, meshed)
        findings = [*(Finding("0-body", "error", body, what, advice) for body, what in faults), *findings]
    return Review(design, design.waived(findings) + design.idle_waivers(findings))


def advised(finding: Finding, parameters: list[str]) -> Finding:
    """A finding whose advice names parameters that the shape has."""
    wider = [name for name in parameters if name in ("period_mm", "tip_mm") or name.endswith("_width_mm")]
    if finding.rule in _WIDENED and finding.severity != "info" and wider:
        what, comma, more = finding.advice.partition(",")
        return replace(finding, advice=f"{what} (increase {' or '.join(wider)}){comma}{more}")
    films = " or ".join(name for name in parameters if name.endswith("dielectric_mm"))
    return replace(finding, advice=finding.advice.replace("dielectric_mm", films)) if films else finding


def _meshes(design: Design) -> "dict[str, Mesh]":
    from sensorgen.scene.geometry import meshes

    return {body.name: meshes.mesh(body) for body in design.printed.bodies}


def _crowding(design: Design) -> list[Finding]:
    """A sensor that stands where the slicers put the prime tower, without which no tool change prints well."""
    place = tower(design.machine, design.layers, len(design.used()))
    free = [place.x_mm - design.machine.bed_centre_mm()[0], place.y_mm - design.machine.bed_centre_mm()[1]]
    reach = [size / 2 for size in design.printed.size_mm[:2]]
    if reach[0] <= free[0] or reach[1] <= free[1]:
        return []
    length, width = (round(2 * limit, 3) for limit in free)
    return [
        Finding(
            "8-bed", "warning", "sensor",
            f"it reaches into the far right corner, where the prime tower of {place.side_mm:g} mm stands",
            f"keep it shorter than {length:g} mm or narrower than {width:g} mm, or move the tower in the slicer",
            reach[0], round(free[0], 9),
        )
    ]  # fmt: skip


@dataclass(frozen=True)
class CheckReport:
    """The findings about a print, as in ``check.json``.

    Attributes
    ----------
    name, design : str
        Name and identity of the design.
    printer, quality : str
        What it was checked for.
    verdict : str
        CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT.
    source : str
        Slicer and version, or that the print is estimated, and why.
    counts : dict of str to int
        Findings of each severity, and waived ones.
    findings : tuple of Finding
        All of them.
    """

    name: str
    design: str
    printer: str
    quality: str
    verdict: Verdict
    source: str
    counts: dict[str, int]
    findings: tuple[Finding, ...]

    def document(self) -> Iterator[Part]:
        """Verdict, then the findings."""
        yield headline(self.name, self.findings, self.source)
        yield from listed(self.findings)

    def csv(self) -> Iterator[str]:
        """The findings as a table."""
        yield comma_separated(table(self.findings))


def report(design: Design, reviewed: Review) -> CheckReport:
    """The findings as data."""
    return CheckReport(
        design.name, design.id(), design.machine.name, design.layers.name, reviewed.verdict, reviewed.source,
        reviewed.counts(), tuple(reviewed.findings),
    )  # fmt: skip


def draw(design: Design, reviewed: Review, printed: "Scene | None" = None, source: str = "") -> str:
    """The drawing of the cross-section, as SVG, with what is printed outlined over it if that is given."""
    from sensorgen.scene import drawing

    scene = design.printed
    names = {body.material for body in scene.bodies}
    notes = [
        f"{reviewed.verdict}; {reviewed.source}",
        f"{design.machine.name}, {design.layers.name}, printed {design.orientation}",
        *([f"green outlines: {source}"] if source else []),
    ]
    known = {name: (design.material(name).title, design.material(name).colour) for name in sorted(names)}
    return drawing.svg(
        scene, design.name, design.layers.boundaries_mm(scene.size_mm[2]), reviewed.findings, known, notes, printed
    )
