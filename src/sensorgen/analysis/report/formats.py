"""A report as HTML, Markdown, CSV and JSON: the same numbers for people, spreadsheets and programs."""

import csv
import io
import json
from collections.abc import Iterator
from typing import Any

from sensorgen.analysis.plots import pages
from sensorgen.analysis.report.contents import Report
from sensorgen.core.document import Table, plain, safe, spreadsheet
from sensorgen.core.document import markdown as document


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


WRITERS = {"html": html, "md": markdown, "csv": comma_separated, "json": as_json}
