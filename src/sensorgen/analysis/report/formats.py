"""A report as HTML, Markdown, CSV and JSON: the same numbers for people, spreadsheets and programs."""

import base64
import csv
import io
import json
from collections.abc import Iterator

from sensorgen.analysis.plots.pages import render
from sensorgen.analysis.report.contents import Report
from sensorgen.core.document import exact, plain, safe, shown, spreadsheet
from sensorgen.core.document import markdown as document

MOST_ROWS = 2000  # of a table on the page: a browser has to lay out all of them


def html(report: Report) -> str:
    """One page that needs nothing else."""
    encoded = {v.design: base64.b64encode(v.svg.encode()).decode() for s in report.sections for v in s.variants}
    return render(
        "sensorgen.analysis.report", "report.html", report.figures, title=report.title, report=report,
        drawings=encoded, shown=shown, exact=exact, most_rows=MOST_ROWS,
    )  # fmt: skip


def markdown(report: Report) -> str:
    """Headings, sentences and tables."""
    return "\n".join(_lines(report)) + "\n"


def _lines(report: Report) -> Iterator[str]:
    yield from (f"# {safe(report.title)}", "")
    yield from (f"**{safe(text)}**  " for text in report.headline)
    yield ""
    yield from (f"- {safe(text)}" for text in report.findings)
    for section in report.sections:
        yield from ("", f"## {safe(section.title)}", "")
        yield from (f"- {safe(v.design)} (design {v.design_id}): {safe(v.words)}" for v in section.variants)
        for table in section.tables:
            yield from document([table])
        for note in section.notes:
            yield from ("", safe(note))
    yield from ("", f"Made {report.made_at}.")


def comma_separated(report: Report) -> str:
    """Every cell of every table in a row of its own: table, row, column, unit, value."""
    target = io.StringIO(newline="")
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(["table", "row", "column", "unit", "value"])
    for table in report.tables:
        for number, row in enumerate(table.cells, 1):
            for column, cell in zip(table.columns, row, strict=True):
                writer.writerow([table.key, number, column.name, column.unit, spreadsheet(cell)])
    return target.getvalue()


def as_json(report: Report) -> str:
    """Everything but the figures."""
    sections = [
        {
            "key": s.key, "title": s.title, "notes": list(s.notes),
            "tables": [
                {
                    "key": t.key, "caption": t.caption,
                    "columns": [{"name": c.name, "unit": c.unit, "about": c.about} for c in t.columns],
                    "rows": [[plain(v) for v in row] for row in t.cells],
                }
                for t in s.tables
            ],
            "variants": [{"design": v.design, "design_id": v.design_id, "words": v.words} for v in s.variants],
        }
        for s in report.sections
    ]  # fmt: skip
    told = {
        "title": report.title, "iteration": report.iteration, "made_at": report.made_at,
        "headline": list(report.headline), "findings": list(report.findings), "sections": sections,
    }  # fmt: skip
    return json.dumps(told, ensure_ascii=False, indent=1, allow_nan=False) + "\n"


WRITERS = {"html": html, "md": markdown, "csv": comma_separated, "json": as_json}
