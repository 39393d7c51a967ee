"""Content of a report, whatever it is written as."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated

from sensorgen.analysis.comparison import Comparison, of_iteration
from sensorgen.analysis.comparison.runs import Run, runs
from sensorgen.analysis.comparison.specimens import known_iterations
from sensorgen.analysis.plots.figure import Figure
from sensorgen.analysis.report import electrodes, explained, recordings, variants, yields
from sensorgen.analysis.report.provenance import origins
from sensorgen.analysis.report.variants import Variant
from sensorgen.core.document import Column, Table
from sensorgen.core.errors import BadInput
from sensorgen.measure.log import Log

STEPS = ("readings", "recordings", "residuals", "variants", "page")


@dataclass(frozen=True)
class LeftOut:
    """Something that could not be used, and the reason."""

    what: Annotated[str, Column("what")]
    why: Annotated[str, Column("why")]


@dataclass(frozen=True, eq=False)
class Section:
    """A part of a report.

    Attributes
    ----------
    key, title : str
        Anchor and heading.
    figures, tables : tuple
        In the order in which they stand.
    notes : tuple of str
        Paragraphs on how numbers come about.
    variants : tuple of Variant
        Drawings.
    """

    key: str
    title: str
    figures: tuple[Figure, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
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
    headline : tuple of str
        Measured against predicted, one sentence for each quantity.
    findings : tuple of str
        Further results, in sentences.
    sections : tuple of Section
        Residuals first.
    """

    iteration: int
    made_at: str
    headline: tuple[str, ...]
    findings: tuple[str, ...]
    sections: tuple[Section, ...]

    @property
    def title(self) -> str:
        """Of the page."""
        return f"Iteration {self.iteration}: predicted and measured"

    @property
    def figures(self) -> tuple[Figure, ...]:
        """All figures."""
        return tuple(figure for section in self.sections for figure in section.figures)

    @property
    def tables(self) -> tuple[Table, ...]:
        """All tables."""
        return tuple(table for section in self.sections for table in section.tables)


def report(log: Log, iteration: int, step: Callable[[str], None] = lambda _: None) -> Report:
    """The report of an iteration.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int
        Of the design.
    step : callable
        Called with each of ``STEPS``, and with the name of each design to predict, before it is done.

    Raises
    ------
    BadInput
        The log has no readings of the iteration.
    """
    step("readings")
    found = of_iteration(log, iteration, step)
    left_out = list(found.left_out)
    step("recordings")
    recorded = list(runs(log, iteration, left_out))
    if not found.rows and not recorded:
        raise BadInput(_no_readings(log, iteration, left_out))
    step("residuals")
    explanations = explained.explanations(found, recorded)
    impedances = recordings.impedances(recorded, found) if recorded else None
    verdicts = bool(found.rows)
    headline = [*electrodes.headline(found), *(yields.headline(found) if verdicts else ())]
    findings = [
        *(yields.findings(found) if verdicts else ()), *explained.sentences(explanations), *electrodes.findings(found)
    ]  # fmt: skip
    step("variants")
    sections = (
        _measured(found, impedances),
        _verdicts(found),
        _explained(explanations),
        _recordings(recorded),
        Section("variants", "The variants", tuple(variants.figures(found)), variants.identifiability(found),
                variants=variants.variants(found)),
        Section("left-out", "What was left out, and why", tables=_left_out(left_out)),
        Section("provenance", "Provenance", tables=(origins(log, found),)),
    )  # fmt: skip
    step("page")
    return Report(
        iteration, datetime.now(UTC).isoformat(timespec="seconds"), (*headline, *recordings.headline(impedances)),
        tuple(findings), tuple(s for s in sections if s.tables or s.figures or s.variants),
    )  # fmt: skip


def _no_readings(log: Log, iteration: int, left_out: Sequence[tuple[str, str]]) -> str:
    known = ", ".join(map(str, known_iterations(log))) or "none"
    lost = "; ".join(f"{what}: {why}" for what, why in left_out)
    return (
        f"the log has no readings of iteration {iteration}{f' ({lost})' if lost else ''}; iterations in it: {known}. "
        "Log some with: sensorgen log multimeter SPECIMEN --y 0.65k --z OL"
    )


def _measured(found: Comparison, impedances: Table | None) -> Section:
    tables = [electrodes.readings(found)] if found.rows else []
    drawn = [*electrodes.figures(found), *(recordings.residuals(impedances) if impedances else ())]
    notes = electrodes.NOTES if found.rows else ()
    return Section(
        "measured", "Measured and predicted", tuple(drawn), (*tables, *([impedances] if impedances else [])), notes
    )


def _verdicts(found: Comparison) -> Section:
    if not found.rows:
        return Section("verdicts", "Verdicts and yield")
    tables = (*([yields.table(found)] if len(found.last) > 1 else []), electrodes.reasons(found))
    return Section("verdicts", "Verdicts and yield", yields.figures(found), tables, yields.notes(found))


def _explained(found: Sequence[explained.Explanation]) -> Section:
    notes = (
        "Each parameter is moved alone, for all specimens together, until the squared residuals are least. Film "
        "resistance is compared up to the meter's highest range, the prediction for a film without leakage; it is not "
        "compared where the electrodes touch as drawn.",
    )
    tables = (explained.table(found),) if found else ()
    return Section("explained-by", "Which parameter explains the residuals", (), tables, notes)


def _recordings(recorded: Sequence[Run]) -> Section:
    tables = (recordings.facts(recorded),) if recorded else ()
    return Section("recorded", "Recordings", tuple(recordings.figures(recorded)), tables)


def _left_out(rows: Sequence[tuple[str, str]]) -> tuple[Table, ...]:
    caption = "What was left out, or taken with care, and why"
    return (Table.of("left_out", caption, tuple(LeftOut(*row) for row in rows)),) if rows else ()
