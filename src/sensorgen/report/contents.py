"""What a report holds, whatever it is written as."""

from dataclasses import dataclass
from datetime import UTC, datetime

from sensorgen.comparison import Comparison, of_iteration
from sensorgen.comparison.specimens import known_iterations
from sensorgen.log import Log
from sensorgen.report import figures, specimens, yields
from sensorgen.report.charts import Chart
from sensorgen.report.provenance import origins
from sensorgen.report.tables import Column, Table, table
from sensorgen.report.variants import Variant, variants


@dataclass(frozen=True, eq=False)
class Section:
    """A part of a report.

    Attributes
    ----------
    key, title : str
        Anchor and heading.
    words : tuple of str
        Paragraphs.
    tables, charts : tuple
        In the order in which they stand.
    variants : tuple of Variant
        Drawings.
    """

    key: str
    title: str
    words: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
    variants: tuple[Variant, ...] = ()


@dataclass(frozen=True, eq=False)
class Report:
    """A report.

    Attributes
    ----------
    iteration : int
        Of the design.
    made_at : str
        UTC.
    findings : tuple of str
        What comes out of it, in sentences.
    sections : tuple of Section
        Residuals first.
    """

    iteration: int
    made_at: str
    findings: tuple[str, ...]
    sections: tuple[Section, ...]

    @property
    def title(self) -> str:
        """Of the page."""
        return f"Iteration {self.iteration}: predicted and measured"

    @property
    def charts(self) -> tuple[Chart, ...]:
        """All figures."""
        return tuple(chart for section in self.sections for chart in section.charts)

    @property
    def tables(self) -> tuple[Table, ...]:
        """All tables."""
        return tuple(found for section in self.sections for found in section.tables)


def report(log: Log, iteration: int) -> Report:
    """The report of an iteration; one without readings says so, and which iterations there are.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int
        Of the design.
    """
    found = of_iteration(log, iteration)
    sections = (
        _residuals(found),
        _verdicts(found),
        _variants(found),
        _left_out(found),
        Section("provenance", "Provenance", tables=(origins(log, found),)),
    )
    return Report(
        iteration, datetime.now(UTC).isoformat(timespec="seconds"), tuple(_findings(log, iteration, found)),
        tuple(s for s in sections if s.words or s.tables or s.charts or s.variants),
    )  # fmt: skip


def _findings(log: Log, iteration: int, found: Comparison) -> list[str]:
    if not found.rows:
        known = ", ".join(map(str, known_iterations(log))) or "none"
        return [
            f"The log has no readings of iteration {iteration}. Iterations that it knows: {known}.",
            "Log some with: sensorgen log multimeter SPECIMEN --y 0.65k --z OL",
        ]
    return [*specimens.findings(found), *yields.findings(found)]


def _residuals(found: Comparison) -> Section:
    if not found.rows:
        return Section("residuals", "Residuals")
    return Section(
        "residuals", "Predicted against measured: residuals first", specimens.words(found),
        (specimens.table_of(found),), figures.residuals(found),
    )  # fmt: skip


def _verdicts(found: Comparison) -> Section:
    if not found.rows:
        return Section("verdicts", "Verdicts")
    return Section(
        "verdicts",
        "Verdicts and yield",
        yields.words(),
        (*yields.tables(found), specimens.reasons(found)),
        figures.verdicts(found),
    )


def _variants(found: Comparison) -> Section:
    made = variants(found)
    return Section("variants", "The variants", (), (), figures.bodies(found), made)


def _left_out(found: Comparison) -> Section:
    rows = found.left_out
    words = () if rows else ("Nothing was left out.",)
    made = (table("left_out", "What was left out, or taken with care, and why", (Column("what"), Column("why")), rows),)
    return Section("left-out", "What was left out, and why", words, made if rows else ())
