"""Predictions and measurements of an iteration, compared: one report as HTML, Markdown, CSV and JSON.

The origin of everything in it is stated.
"""

import json
import platform
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.analysis.comparison import UNTRUSTED, Comparison, of_iteration
from sensorgen.analysis.comparison.measured import RecordedRun, runs
from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, SKY, Axis, BodyTriangles, Curve, Figure, Panel
from sensorgen.analysis.plots.pages import Drawing, PageSection
from sensorgen.analysis.report import alternating, electrodes, explained, history, recordings, yields
from sensorgen.checks.review import draw
from sensorgen.core import display, yamlfile
from sensorgen.core.document import Column, Part, Table, csv_row, plain, safe, spreadsheet
from sensorgen.core.document import markdown as document
from sensorgen.core.errors import BadInput
from sensorgen.core.lazy import by_key
from sensorgen.core.units import M_PER_MM
from sensorgen.core.version import __version__
from sensorgen.design.design import Design
from sensorgen.design.materials import SET, citations
from sensorgen.measure.log import Anchor, Log, RawFile
from sensorgen.measure.log.notes import asked
from sensorgen.prediction.identifiability.results import Identifiability, StandardErrors
from sensorgen.prediction.query import FORCE_N
from sensorgen.prediction.slices import reviewed
from sensorgen.scene.geometry.meshes import mesh

if TYPE_CHECKING:
    from sensorgen.prediction.calibration.calibration import Calibration

LIBRARIES = ("numpy", "scipy", "plotly", "matplotlib", "jinja2")


@dataclass(frozen=True)
class Origin:
    """A program, file, prediction or source."""

    kind: Annotated[str, Column("kind")]
    name: Annotated[str, Column("name")]
    which: Annotated[str, Column("which")]


def origins(log: Log, comparison: Comparison, *, brief: bool = False) -> Table:
    """Versions, the log, raw files, designs with the predictions of each, and sources of material values.

    Parameters
    ----------
    log : Log
        An open one.
    found : Comparison
        What the report is of.
    brief : bool
        Only program, log and predictions.
    """
    records, head = log.head()
    readings = Counter(r.reading.words.source for r in comparison.rows)
    predictions = [
        Origin("prediction", f"{p.design} ({p.design_id})", p.provenance) for p in comparison.predictions.values()
    ]
    program = Origin("program", "sensorgen", __version__)
    logged = Origin("log", log.path.name, f"{records} records; head {head}")
    if brief:
        return Table.of("provenance", "Program, log and prediction", (program, logged, *predictions))
    anchors = log.entries(Anchor)
    rows = [
        program, Origin("program", "Python", platform.python_version()),
        *(Origin("library", name, version(name)) for name in LIBRARIES),
        logged,
        *(Origin("anchor", a.file, f"{a.logged_at}: record {log.sequence(a.head)}, {a.head}") for a in anchors),
        *(Origin("raw file", f.name, f"SHA-256 {f.uid}, {f.size} bytes") for f in log.entries(RawFile)),
        *(Origin("source of readings", name, f"{count} readings") for name, count in sorted(readings.items())),
        *predictions, *_sources(comparison),
    ]  # fmt: skip
    return Table.of("provenance", "Programs, files, designs and sources", tuple(rows))


def _sources(comparison: Comparison) -> list[Origin]:
    values = (value for of in comparison.predictions.values() for value in of.prediction.values)
    used = by_key((value.source, f"{value.material} {value.quantity} = {value.value:.6g}") for value in values)
    known = citations() | {SET: "by the design itself"}
    return [
        Origin("source of values", name, f"{known.get(name, name)}: {', '.join(sorted(set(of)))}")
        for name, of in sorted(used.items())
    ]


STEPS = ("readings", "recordings", "residuals", "variants", "page")


@dataclass(frozen=True, eq=False)
class Report(display.Displayed):
    """A report.

    Attributes
    ----------
    iteration : int or None
        Of the design; None of specimens, or of all.
    specimens : tuple of str
        Specimens that it was asked of.
    made_at : str
        UTC.
    headline : tuple of str
        Measured against predicted, one sentence for each quantity.
    findings : tuple of str
        Further results, in sentences.
    sections : tuple of PageSection
        Residuals first.
    """

    iteration: int | None
    specimens: tuple[str, ...]
    made_at: str
    headline: tuple[str, ...]
    findings: tuple[str, ...]
    sections: tuple[PageSection, ...]

    @property
    def title(self) -> str:
        """Of the page."""
        which = f"Iteration {self.iteration}" if self.iteration is not None else "All specimens"
        return f"{', '.join(self.specimens) or which}: predicted and measured"

    def document(self) -> Iterator[Part]:
        """Headline, findings and tables."""
        yield from (*self.headline, *self.findings)
        yield from self.tables

    @property
    def figures(self) -> tuple[Figure, ...]:
        """All figures."""
        return tuple(figure for section in self.sections for figure in section.figures)

    @property
    def tables(self) -> tuple[Table, ...]:
        """All tables."""
        return tuple(table for section in self.sections for table in section.tables)


@display.figure.register(Report)
def _(of: Report) -> Any:
    from sensorgen.analysis.plots import static

    return static.first(of, of.figures)


def report(
    log: Log, iteration: int | None, step: Callable[[str], None] = lambda _: None, *, specimens: Sequence[str] = ()
) -> Report:
    """The report of an iteration or of specimens.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int or None
        Of the design; of all if None, and no specimens are given.
    step : callable
        Called with each of ``STEPS``, and with the name of each design to predict, before it is done.
    specimens : sequence of str
        Specimens as written, in place of an iteration.

    Raises
    ------
    BadInput
        The log has no readings of the iteration, or of a specimen.
    """
    step("readings")
    specimens = asked(log, iteration, specimens)
    comparison = of_iteration(log, iteration, step, specimens=specimens)
    left_out = list(comparison.left_out)
    step("recordings")
    recorded = list(runs(log, iteration, left_out, specimens=specimens))
    if not comparison.rows and not recorded:
        raise _nothing(log, ", ".join(specimens) or f"iteration {iteration}", left_out)
    step("residuals")
    data = _data(log, comparison, recorded, left_out)
    step("variants")
    sections = tuple(s for s in _sections(log, data) if any((s.tables, s.figures, s.drawings)))
    step("page")
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    return Report(iteration, specimens, made_at, _headline(data), _findings(data), sections)


@dataclass(frozen=True, eq=False)
class _ReportData:
    """Everything that a report shows."""

    comparison: Comparison
    recorded: Sequence[RecordedRun]
    explanations: Sequence[explained.Explanation]
    impedances: Sequence[recordings.ImpedanceRow]
    ac: Sequence[alternating.AcRow]
    changes: Sequence[history.HistoryRow]
    calibrated: "Sequence[Calibration]"
    left_out: Sequence[tuple[str, str]]


def _data(
    log: Log, comparison: Comparison, recorded: Sequence[RecordedRun], left_out: list[tuple[str, str]]
) -> _ReportData:  # fmt: skip
    calibrated = history.latest(log, _specimens(comparison, recorded), left_out)
    own = {one.specimen for one in calibrated}  # a calibration explains more of its recordings than one parameter can
    explanations = explained.explanations(comparison, [run for run in recorded if run.entry.specimen not in own])
    impedances = recordings.impedances(recorded, comparison)
    ac = alternating.rows(comparison)
    changes = history.rows(comparison, ac)
    return _ReportData(comparison, recorded, explanations, impedances, ac, changes, calibrated, left_out)


def _specimens(comparison: Comparison, recorded: Sequence[RecordedRun]) -> set[str]:
    return {row.reading.specimen for row in comparison.rows} | {run.entry.specimen for run in recorded}


def _headline(data: _ReportData) -> tuple[str, ...]:
    return (
        *electrodes.headline(data.comparison), *yields.headline(data.comparison), *alternating.headline(data.ac),
        *_untrusted(data.left_out), *recordings.headline(data.impedances), *_basis(data.comparison, data.recorded),
    )  # fmt: skip


def _findings(data: _ReportData) -> tuple[str, ...]:
    comparison = data.comparison
    return (
        *history.calibration_findings(data.calibrated), *yields.findings(comparison),
        *yields.direction_findings(comparison), *history.findings(data.changes), *alternating.findings(data.ac),
        *alternating.behind_leak(comparison), *electrodes.beyond_meter(comparison),
        *recordings.findings(data.recorded, data.impedances), *explained.sentences(data.explanations),
        *electrodes.findings(comparison),
    )  # fmt: skip


def _untrusted(left_out: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Specimens of shapes that did not run, in a sentence for each shape that is to be trusted."""
    for why in dict.fromkeys(why for what, why in left_out if what.startswith(UNTRUSTED)):
        names = [what for what, reason in left_out if reason == why]
        yield f"Not compared: {names[0]}{f' and {len(names) - 1} more' if names[1:] else ''}: {why}."


def _basis(comparison: Comparison, recorded: Sequence[RecordedRun]) -> Iterator[str]:
    """Summary of the measurements, in one sentence; none of a single reading."""
    if len(comparison.rows) + len(recorded) > 1:
        specimens = len(_specimens(comparison, recorded))
        yield (
            f"Basis: {len(comparison.rows)} readings and {len(recorded)} recordings; specimens: {specimens}; "
            f"designs: {len(comparison.predictions)}."
        )


def _nothing(log: Log, of: str, left_out: Sequence[tuple[str, str]]) -> BadInput:
    iterations = sorted({s.iteration for s in log.specimens() if s.iteration is not None})
    known = ", ".join(map(str, iterations)) or "none"
    lost = "; ".join(f"{what}: {why}" for what, why in left_out)
    return BadInput(
        f"the log has no readings of {of}{f' ({lost})' if lost else ''}; iterations in it: {known}. "
        "Log some with: sensorgen log add SPECIMEN --y 0.65k --z OL"
    )


def _sections(log: Log, data: _ReportData) -> Iterator[PageSection]:
    """All sections in order; those without tables, figures and drawings are not shown."""
    comparison, recorded = data.comparison, data.recorded
    brief = len(comparison.rows) <= 1 and not recorded
    notes = yamlfile.read(Path(__file__).with_name("notes.yaml"))
    told: dict[str, Any] = {} if brief else notes
    direct = [electrodes.readings(comparison)] if comparison.direct else []
    at_rest = Table.some("impedance", "Impedance at rest and its prediction, by frequency", data.impedances)
    figures = (*electrodes.figures(comparison), *recordings.residuals(data.impedances))
    parts = (*direct, *at_rest, *(told.get("measured", ()) if direct else ()))
    yield PageSection("measured", "Measured and predicted", figures, parts)
    figures = tuple(alternating.figures(data.ac))
    parts = (*Table.some("ac", "AC readings and their prediction as printed, by frequency", data.ac), *notes["ac"])
    yield PageSection("ac", "Capacitance and impedance by frequency", figures, parts)
    verdicts = yields.parts(comparison, told.get("verdicts", ()))
    yield PageSection("verdicts", "Verdicts and yield", yields.figures(comparison), verdicts)
    parts = Table.some("changes", "Bake, shrinkage and defects, and the change that they made", data.changes)
    yield PageSection("changes", "Bake, shrinkage and defects", (), (*parts, *told.get("changes", ())))
    parts = Table.some("explained", "Share of the residuals that one parameter explains", data.explanations)
    yield PageSection("explained-by", "Which parameter explains the residuals", (), (*parts, *notes["explained-by"]))
    calibrated = [history.calibration_row(one) for one in data.calibrated]
    parts = (*Table.some("calibrations", "Specimens by their calibration", calibrated), *notes["calibrated"])
    yield PageSection("calibrated", "Calibrated specimens", (), parts)
    yield PageSection("recorded", "Recordings", tuple(recordings.figures(recorded)), recordings.facts(recorded))
    figures = () if brief else tuple(_variants(comparison))
    yield PageSection("variants", "The variants", figures, identifiability(comparison), _drawings(comparison))
    caption, columns = "What was left out, or taken with care, and why", (Column("what"), Column("why"))
    omitted = (Table("left_out", caption, columns, data.left_out),) if data.left_out else ()
    yield PageSection("left-out", "What was left out, and why", parts=omitted)
    yield PageSection("provenance", "Provenance", parts=(origins(log, comparison, brief=brief),))


def html(report: Report) -> Iterator[str]:
    """One page that needs nothing else."""
    yield pages.page(
        report.title, (), report.sections, headline=report.headline, findings=report.findings, made_at=report.made_at
    )


def markdown(report: Report) -> Iterator[str]:
    """Headings, sentences and tables."""
    return (f"{line}\n" for line in _lines(report))


def _lines(report: Report) -> Iterator[str]:
    lines = [f"# {safe(report.title)}", "", *(f"**{safe(text)}**  " for text in report.headline), ""]
    yield from (*lines, *(f"- {safe(text)}" for text in report.findings))
    for section in report.sections:
        yield from ("", f"## {safe(section.title)}", "")
        yield from (f"- {safe(v.design)} (design {v.design_id}): {safe(v.words)}" for v in section.drawings)
        yield from document(section.parts)
    yield from ("", f"Made {report.made_at}.")


def comma_separated(report: Report) -> Iterator[str]:
    """Every cell of every table in a row of its own: table, row, column, unit, value."""
    yield "table,row,column,unit,value\n"
    for table in report.tables:
        heads = [csv_row((column.name, column.unit, "")).rstrip() for column in table.columns]
        for number, row in enumerate(table.cells, 1):
            cells = ((head, csv_row([spreadsheet(cell)])) for head, cell in zip(heads, row, strict=True))
            yield "".join(f"{table.key},{number},{head}{cell}" for head, cell in cells)


class _Listed(list[Any]):
    """Rows that JSON's encoder reads one after the other."""

    def __init__(self, rows: Iterator[Any], count: int) -> None:
        super().__init__()
        self._rows, self._count = rows, count

    def __iter__(self) -> Iterator[Any]:
        return self._rows

    def __len__(self) -> int:
        return self._count


def as_json(report: Report) -> Iterator[str]:
    """Everything but the figures."""

    def of_table(t: Table) -> dict[str, Any]:
        rows = _Listed(([*map(plain, row)] for row in t.cells), len(t.cells))
        columns = [{"name": c.name, "unit": c.unit, "about": c.about} for c in t.columns]
        return {"key": t.key, "caption": t.caption, "columns": columns, "rows": rows}

    sections = [
        {
            "key": s.key, "title": s.title, "notes": s.notes, "tables": [*map(of_table, s.tables)],
            "variants": [{"design": v.design, "design_id": v.design_id, "words": v.words} for v in s.drawings],
        }
        for s in report.sections
    ]  # fmt: skip
    content = {
        "title": report.title, "iteration": report.iteration, "made_at": report.made_at, "headline": report.headline,
        "findings": report.findings, "sections": sections,
    }  # fmt: skip
    yield from json.JSONEncoder(ensure_ascii=False, indent=1, allow_nan=False).iterencode(content)
    yield "\n"


def pieces(content: Report, how: str) -> Iterator[str]:
    """A report as pieces of text, one after the other; ``how`` is one of ``FORMATS``."""
    return _WRITERS[how](content)


_WRITERS = {"html": html, "md": markdown, "csv": comma_separated, "json": as_json}
FORMATS = tuple(_WRITERS)


_STRETCH = (1.0, 1.0, 10.0)


@dataclass(frozen=True)
class IdentifiabilityRow:
    """Least standard errors of force and position of a design, and the verdict."""

    design: Annotated[str, Column("design")]
    force_n: Annotated[float, Column("error of force, perfect model", "N")]
    position_mm: Annotated[float, Column("error of position, perfect model", "mm")]
    correlation: Annotated[float, Column("correlation")]
    bench_n: Annotated[float, Column("error of force, after 30 known presses", "N")]
    bench_mm: Annotated[float, Column("error of position, after 30 known presses", "mm")]
    verdict: Annotated[str, Column("verdict")]


def _drawings(comparison: Comparison) -> tuple[Drawing, ...]:
    """Every variant of which a specimen was printed, with its prediction in words."""
    sheets = []
    for name, body in comparison.bodies.items():
        of, design = comparison.predictions[name], body.design
        r, c = of.ry_ohm, of.prediction.capacitance
        words = (
            f"electrode resistance {r.words() if r else 'unknown'}",
            f"capacitance {c.words()}" if c else f"no capacitance: {of.prediction.reason}",
            of.provenance,
        )
        sheets.append(Drawing(name, design.id(), draw(design, reviewed(design)), "; ".join(words)))
    return tuple(sheets)


def identifiability(comparison: Comparison) -> tuple[Table, ...]:
    """A row for each variant with a prediction."""
    rows = []
    for name, of in comparison.predictions.items():
        card = of.prediction.identifiability
        force, place, together = _known(card)
        bench_force, bench_place, _ = _known(card and card.calibrated)
        verdict = card.verdict if card else of.prediction.reason or "no prediction"
        rows.append(IdentifiabilityRow(name, force, place, together, bench_force, bench_place, verdict))
    caption = f"Standard errors of {FORCE_N:g} N in the middle, predicted, by seven frequencies (Cramér-Rao)"
    return Table.some("identifiability", caption, rows)


def _known(of: StandardErrors | None) -> tuple[float, float, float]:
    """Standard errors of force [N] and position [mm], and their correlation; nan where unknown."""
    values = (of.sigma_force_n, of.sigma_position_m, of.correlation) if of else (None, None, None)
    force, place, together = (nan if value is None else value for value in values)
    return force, place / M_PER_MM, together


def _variants(comparison: Comparison) -> Iterator[Figure]:
    """Standard errors over position for three forces, and the bodies; of every variant, one at a time."""
    cards = {name: of.prediction.identifiability for name, of in comparison.predictions.items()}
    known = {name: errors(card) for name, card in cards.items() if card}
    if known:
        yield Figure(
            "identifiability-map", "Predicted standard errors of force and position",
            "Least standard error (Cramér-Rao) of force above, of position below, over the position of the load, for "
            "the frequencies and noise of the prediction. Dashed: required. Gaps: undefined.", known, "variant",
        )  # fmt: skip
    if comparison.bodies:
        axes = Axis("x [mm]"), Axis("y [mm]"), Axis("z [mm]")
        yield Figure(
            "bodies", f"Bodies, height x {_STRETCH[2]:g}",
            "The bodies of the chosen variant, to be turned with the mouse, their height enlarged. The drawings show "
            "them in section.",
            {name: (Panel(tuple(_bodies(body.design)), *axes),) for name, body in comparison.bodies.items()}, "variant",
            stretch=_STRETCH,
        )  # fmt: skip


def errors(card: Identifiability) -> tuple[Panel, Panel]:
    """Standard errors over position [mm], for a weak, a middling and the greatest force."""
    over, required = card.map, card.required
    place, panels = [x / M_PER_MM for x in over.position_m], []
    for quantity, unit, sigma, needed, per in (
        ("force", "N", over.sigma_force_n, required.sigma_force_n, 1.0),
        ("position", "mm", over.sigma_position_m, required.sigma_position_m, M_PER_MM),
    ):
        curves = [
            Curve("line", f"{over.force_n[k]:g} N", place, [nan if v is None else v / per for v in sigma[k]],
                  colour=colour)
            for k, colour in zip((1, len(sigma) // 2, len(sigma) - 1), (SKY, BLUE, ORANGE), strict=True)
        ]  # fmt: skip
        need = [nan if needed is None else needed / per] * 2
        curves.append(Curve("line", "required", [place[0], place[-1]], need, colour=GREY, dash="dash"))
        y = Axis(f"error of {quantity} [{unit}]", log=True)
        panels.append(Panel(tuple(curves), Axis("position of the tip's centre [mm]"), y))
    return panels[0], panels[1]


def _bodies(design: Design) -> Iterator[BodyTriangles]:
    """The bodies of the sensor in use, as triangles."""
    for body in design.in_use.bodies:
        body_mesh = mesh(body)
        name, colour = body.name.replace("_", " "), design.material(body.material).colour
        yield BodyTriangles(name, body_mesh.vertices_mm, body_mesh.triangles, colour)
