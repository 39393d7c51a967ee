"""Predictions and measurements of an iteration, compared: one report as HTML, Markdown, CSV and JSON.

The origin of everything in it is stated.
"""

import csv
import io
import json
import platform
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.analysis.comparison import UNTRUSTED, Comparison, known_iterations, of_iteration
from sensorgen.analysis.comparison.measured import RecordedRun, runs
from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import Figure
from sensorgen.analysis.plots.pages import PageSection
from sensorgen.analysis.report import alternating, electrodes, explained, history, recordings, variants, yields
from sensorgen.core.document import Column, Part, Table, plain, safe, spreadsheet
from sensorgen.core.document import markdown as document
from sensorgen.core.errors import BadInput
from sensorgen.core.version import __version__
from sensorgen.design.materials import SET, citations
from sensorgen.measure.log import Anchor, Log, RawFile
from sensorgen.measure.log.notes import specimen as named

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
    used: dict[str, set[str]] = {}
    for of in comparison.predictions.values():
        for value in of.prediction.values:
            used.setdefault(value.source, set()).add(f"{value.material} {value.quantity} = {value.value:.6g}")
    known = citations() | {SET: "by the design itself"}
    return [
        Origin("source of values", name, f"{known.get(name, name)}: {', '.join(sorted(values))}")
        for name, values in sorted(used.items())
    ]


STEPS = ("readings", "recordings", "residuals", "variants", "page")


@dataclass(frozen=True)
class LeftOut:
    """Something that could not be used, and the reason."""

    what: Annotated[str, Column("what")]
    why: Annotated[str, Column("why")]


@dataclass(frozen=True, eq=False)
class Report:
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

    @property
    def figures(self) -> tuple[Figure, ...]:
        """All figures."""
        return tuple(figure for section in self.sections for figure in section.figures)

    @property
    def tables(self) -> tuple[Table, ...]:
        """All tables."""
        return tuple(table for section in self.sections for table in section.tables)


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
    specimens = tuple(named(name, log).specimen for name in specimens)
    comparison = of_iteration(log, iteration, step, specimens=specimens)
    left_out = list(comparison.left_out)
    step("recordings")
    recorded = list(runs(log, iteration, left_out, specimens=specimens))
    if not comparison.rows and not recorded:
        raise _nothing(log, ", ".join(specimens) or f"iteration {iteration}", left_out)
    step("residuals")
    names = {row.reading.specimen for row in comparison.rows} | {run.entry.specimen for run in recorded}
    calibrated = history.latest(log, names, left_out)
    explanations = _explanations(comparison, recorded, calibrated)
    impedances = recordings.impedances(recorded, comparison) if recorded else None
    ac = alternating.rows(comparison)
    changes = history.rows(comparison, ac)
    headline = (
        *electrodes.headline(comparison), *yields.headline(comparison), *alternating.headline(ac),
        *_untrusted(left_out),
    )  # fmt: skip
    findings = (
        *history.calibration_findings(calibrated), *yields.findings(comparison),
        *yields.direction_findings(comparison), *history.findings(changes), *alternating.findings(ac),
        *alternating.behind_leak(comparison), *electrodes.beyond_meter(comparison),
        *recordings.findings(recorded, impedances), *explained.sentences(explanations),
        *electrodes.findings(comparison),
    )  # fmt: skip
    step("variants")
    sections = list(_sections(log, comparison, recorded, explanations, impedances, ac, changes, calibrated, left_out))
    step("page")
    return Report(
        iteration, specimens, datetime.now(UTC).isoformat(timespec="seconds"),
        (*headline, *recordings.headline(impedances), *_basis(comparison, recorded, len(names))), findings,
        tuple(s for s in sections if any((s.tables, s.figures, s.drawings))),
    )  # fmt: skip


def _untrusted(left_out: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Specimens of shapes that did not run, in a sentence for each shape that is to be trusted."""
    for why in dict.fromkeys(why for what, why in left_out if what.startswith(UNTRUSTED)):
        names = [what for what, reason in left_out if reason == why]
        yield f"Not compared: {names[0]}{f' and {len(names) - 1} more' if names[1:] else ''}: {why}."


def _basis(comparison: Comparison, recorded: Sequence[RecordedRun], specimens: int) -> Iterator[str]:
    """Summary of the measurements, in one sentence; none of a single reading."""
    if len(comparison.rows) + len(recorded) > 1:
        yield (
            f"Basis: {len(comparison.rows)} readings and {len(recorded)} recordings; specimens: {specimens}; "
            f"designs: {len(comparison.predictions)}."
        )


def _nothing(log: Log, of: str, left_out: Sequence[tuple[str, str]]) -> BadInput:
    known = ", ".join(map(str, known_iterations(log))) or "none"
    lost = "; ".join(f"{what}: {why}" for what, why in left_out)
    return BadInput(
        f"the log has no readings of {of}{f' ({lost})' if lost else ''}; iterations in it: {known}. "
        "Log some with: sensorgen log add SPECIMEN --y 0.65k --z OL"
    )


def _explanations(
    comparison: Comparison, recorded: Sequence[RecordedRun], calibrated: "Sequence[Calibration]"
) -> list[explained.Explanation]:  # fmt: skip
    """Effect of each parameter; a calibration explains more of its specimen's recordings than one parameter can."""
    own = {one.specimen for one in calibrated}
    return explained.explanations(comparison, [run for run in recorded if run.entry.specimen not in own])


def _sections(
    log: Log, comparison: Comparison, recorded: Sequence[RecordedRun], explanations: Sequence[explained.Explanation],
    impedances: Table | None, ac: Sequence[alternating.AcRow], changes: Sequence[history.HistoryRow],
    calibrated: "Sequence[Calibration]", left_out: Sequence[tuple[str, str]],
) -> Iterator[PageSection]:  # fmt: skip
    alone = len(comparison.rows) <= 1 and not recorded  # a short page
    figures = (*electrodes.figures(comparison), *(recordings.residuals(impedances) if impedances else ()))
    tables = (*([electrodes.readings(comparison)] if comparison.direct else ()), *([impedances] if impedances else ()))
    parts: tuple[Part, ...]
    notes: tuple[str, ...] = electrodes.NOTES if comparison.direct and not alone else ()
    yield PageSection("measured", "Measured and predicted", figures, (*tables, *notes))
    if ac:
        parts = (alternating.table(ac), alternating.NOTE)
        yield PageSection("ac", "Capacitance and impedance by frequency", tuple(alternating.figures(ac)), parts)
    if comparison.direct:
        grouped = (
            yields.table(comparison) if len(comparison.last) > 1 else None,
            yields.direction_table(comparison),
        )
        notes = () if alone else yields.notes(comparison)
        parts = (*filter(None, grouped), electrodes.reasons(comparison), *notes)
        yield PageSection("verdicts", "Verdicts and yield", yields.figures(comparison), parts)
    if changes:
        notes = () if alone else (history.NOTE,)
        yield PageSection("changes", "Bake, shrinkage and defects", (), (history.table(changes), *notes))
    if explanations:
        parts = (explained.table(explanations), explained.NOTE)
        yield PageSection("explained-by", "Which parameter explains the residuals", (), parts)
    if calibrated:
        parts = (history.calibration_table(calibrated), history.CALIBRATION_NOTE)
        yield PageSection("calibrated", "Calibrated specimens", (), parts)
    if recorded:
        yield PageSection("recorded", "Recordings", tuple(recordings.figures(recorded)), (recordings.facts(recorded),))
    figures = () if alone else tuple(variants.figures(comparison))
    yield PageSection(
        "variants", "The variants", figures, variants.identifiability(comparison), variants.drawings(comparison)
    )
    if left_out:
        caption = "What was left out, or taken with care, and why"
        parts = (Table.of("left_out", caption, tuple(LeftOut(*row) for row in left_out)),)
        yield PageSection("left-out", "What was left out, and why", parts=parts)
    yield PageSection("provenance", "Provenance", parts=(origins(log, comparison, brief=alone),))


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
        for number, row in enumerate(table.cells, 1):
            target = io.StringIO(newline="")
            csv.writer(target, lineterminator="\n").writerows(
                (table.key, number, column.name, column.unit, spreadsheet(cell))
                for column, cell in zip(table.columns, row, strict=True)
            )
            yield target.getvalue()


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


def written(content: Report, how: str) -> str:
    """A report as text; parameters as :func:`pieces`."""
    return "".join(pieces(content, how))


_WRITERS = {"html": html, "md": markdown, "csv": comma_separated, "json": as_json}
FORMATS = tuple(_WRITERS)
