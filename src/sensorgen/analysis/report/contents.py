"""What a report holds, whatever it is written as."""

from dataclasses import dataclass
from datetime import UTC, datetime

from sensorgen.analysis.comparison import Comparison, of_iteration
from sensorgen.analysis.comparison.runs import Run, runs
from sensorgen.analysis.comparison.specimens import known_iterations
from sensorgen.analysis.report import figures, identified, recordings, specimens, yields
from sensorgen.analysis.report.charts import Chart
from sensorgen.analysis.report.explained import Explanation, explanations, sentences, table_of
from sensorgen.analysis.report.provenance import origins
from sensorgen.analysis.report.tables import Column, Table, table
from sensorgen.analysis.report.variants import Variant, variants
from sensorgen.measure.log import Log


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
    left_out = list(found.left_out)
    recorded = list(runs(log, iteration, left_out))
    explained = explanations(found, recorded)
    sections = (
        _residuals(found, recorded),
        _explained(explained),
        _verdicts(found),
        _recordings(recorded),
        _variants(found),
        _left_out(left_out),
        Section("provenance", "Provenance", tables=(origins(log, found),)),
    )
    return Report(
        iteration, datetime.now(UTC).isoformat(timespec="seconds"),
        tuple(_findings(log, iteration, found, recorded, explained)),
        tuple(s for s in sections if s.words or s.tables or s.charts or s.variants),
    )  # fmt: skip


def _findings(
    log: Log, iteration: int, found: Comparison, recorded: list[Run], explained: list[Explanation]
) -> list[str]:
    if not found.rows and not recorded:
        known = ", ".join(map(str, known_iterations(log))) or "none"
        return [
            f"The log has no readings of iteration {iteration}. Iterations that it knows: {known}.",
            "Log some with: sensorgen log multimeter SPECIMEN --y 0.65k --z OL",
        ]
    of_readings = [*specimens.findings(found), *yields.findings(found)] if found.rows else []
    return [*of_readings, *sentences(explained), *recordings.findings(recorded, found)]


def _residuals(found: Comparison, recorded: list[Run]) -> Section:
    if not found.rows and not recorded:
        return Section("residuals", "Residuals")
    tables = [specimens.table_of(found)] if found.rows else []
    tables += [recordings.tones(recorded, found)] if recorded else []
    drawn = [*figures.residuals(found), *recordings.residuals(recorded, found)]
    return Section(
        "residuals", "Predicted against measured: residuals first", specimens.words(found), tuple(tables), tuple(drawn)
    )


def _explained(explained: list[Explanation]) -> Section:
    if not explained:
        return Section("explained", "Explained")
    words = (
        "Each parameter is moved alone, for all specimens at once, until the squared residuals are least. R_Z is "
        "compared up to the meter's highest range, which is also what a film without a leak is predicted to read; "
        "where the electrodes touch as drawn, it is not compared.",
    )  # fmt: skip
    return Section("explained-by", "Which parameter explains the residuals", words, (table_of(explained),))


def _recordings(recorded: list[Run]) -> Section:
    if not recorded:
        return Section("recorded", "Recordings")
    drawn = (*recordings.normalised_differences(recorded), *recordings.figures(recorded))
    return Section("recorded", "Recordings", (), (recordings.facts(recorded),), drawn)


def _verdicts(found: Comparison) -> Section:
    if not found.rows:
        return Section("verdicts", "Verdicts")
    return Section(
        "verdicts",
        "Verdicts and yield",
        yields.words(found),
        (*yields.tables(found), specimens.reasons(found)),
        figures.verdicts(found),
    )


def _variants(found: Comparison) -> Section:
    made = variants(found)
    card = identified.table_of(found)
    drawn = (*figures.bodies(found), *identified.figure(found))
    return Section("variants", "The variants", (), (card,) if card else (), drawn, made)


def _left_out(rows: list[tuple[str, str]]) -> Section:
    words = () if rows else ("Nothing was left out.",)
    made = (table("left_out", "What was left out, or taken with care, and why", (Column("what"), Column("why")), rows),)
    return Section("left-out", "What was left out, and why", words, made if rows else ())
