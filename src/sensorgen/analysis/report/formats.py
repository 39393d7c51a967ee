"""A report as HTML, Markdown, CSV and JSON: the same numbers for people, spreadsheets and programs."""

import base64
import csv
import io
import json
from typing import Any

from sensorgen.analysis.plots.pages import render
from sensorgen.analysis.report.contents import Report
from sensorgen.core.document import Table, exact, plain, safe, shown, spreadsheet
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
    lines = [f"# {safe(report.title)}", "", *(f"**{safe(text)}**  " for text in report.headline), ""]
    lines += [f"- {safe(text)}" for text in report.findings]
    for section in report.sections:
        lines += ["", f"## {safe(section.title)}", ""]
        lines += [f"- {safe(v.design)} (design {v.design_id}): {safe(v.words)}" for v in section.variants]
        lines += [*document(section.tables), *(line for note in section.notes for line in ("", safe(note)))]
    return "\n".join([*lines, "", f"Made {report.made_at}."]) + "\n"


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

    def of_table(t: Table) -> dict[str, Any]:
        columns = [{"name": c.name, "unit": c.unit, "about": c.about} for c in t.columns]
        return {"key": t.key, "caption": t.caption, "columns": columns, "rows": [[*map(plain, row)] for row in t.cells]}

    sections = [
        {
            "key": s.key, "title": s.title, "notes": s.notes, "tables": [*map(of_table, s.tables)],
            "variants": [{"design": v.design, "design_id": v.design_id, "words": v.words} for v in s.variants],
        }
        for s in report.sections
    ]  # fmt: skip
    told = {
        "title": report.title, "iteration": report.iteration, "made_at": report.made_at, "headline": report.headline,
        "findings": report.findings, "sections": sections,
    }  # fmt: skip
    return json.dumps(told, ensure_ascii=False, indent=1, allow_nan=False) + "\n"


WRITERS = {"html": html, "md": markdown, "csv": comma_separated, "json": as_json}
