"""A report as Markdown, as CSV and as JSON: the same numbers for people, spreadsheets and programs."""

import csv
import io
import json
import re
from collections.abc import Iterator

from sensorgen.analysis.report.contents import Report
from sensorgen.analysis.report.tables import Cell, Table, exact, plain, said

_SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|!~$&])")
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "'")


def markdown(report: Report) -> str:
    """Headings, sentences and tables."""
    return "\n".join(_lines(report)) + "\n"


def _lines(report: Report) -> Iterator[str]:
    yield f"# {_safe(report.title)}"
    yield ""
    yield from (f"- {_safe(text)}" for text in report.findings)
    for section in report.sections:
        yield from ("", f"## {_safe(section.title)}", "")
        for words in section.words:
            yield from (_safe(words), "")
        for variant in section.variants:
            yield f"- {_safe(variant.design)} (design {variant.design_id}): {_safe(variant.words)}"
        for table in section.tables:
            yield from _table(table)
    yield from ("", f"Made {report.made_at}.")


def _table(table: Table) -> Iterator[str]:
    yield from ("", f"**{_safe(table.caption)}**", "")
    yield f"| {' | '.join(_safe(c.head) for c in table.columns)} |"
    yield f"|{'|'.join('---' if _worded(table, k) else '---:' for k in range(len(table.columns)))}|"
    yield from (f"| {' | '.join(_safe(said(v)) for v in row)} |" for row in table.rows)


def _worded(table: Table, column: int) -> bool:
    return any(isinstance(row[column], str) for row in table.rows)


def _safe(text: str) -> str:
    """Text whose signs mean nothing to Markdown, on one line."""
    return _SPECIAL.sub(r"\\\1", " ".join(text.split()))


def comma_separated(report: Report) -> str:
    """Every cell of every table in a row of its own: table, row, column, unit, value."""
    target = io.StringIO(newline="")
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(["table", "row", "column", "unit", "value"])
    for table in report.tables:
        for number, row in enumerate(table.rows, 1):
            for column, cell in zip(table.columns, row, strict=True):
                writer.writerow([table.key, number, column.name, column.unit, _cell(cell)])
    return target.getvalue()


def _cell(cell: Cell) -> str:
    """Text that a spreadsheet would take for a formula gets an apostrophe, as in the log's own tables."""
    text = exact(cell)
    return f"'{text}" if isinstance(cell, str) and text.startswith(_FORMULA) else text


def as_json(report: Report) -> str:
    """Everything but the figures, as JSON."""
    data = {
        "title": report.title,
        "iteration": report.iteration,
        "made_at": report.made_at,
        "findings": list(report.findings),
        "sections": [
            {
                "key": s.key,
                "title": s.title,
                "words": list(s.words),
                "tables": [_plain(t) for t in s.tables],
                "variants": [{"design": v.design, "design_id": v.design_id, "words": v.words} for v in s.variants],
            }
            for s in report.sections
        ],
    }
    return json.dumps(data, ensure_ascii=False, indent=1, allow_nan=False) + "\n"


def _plain(table: Table) -> dict[str, object]:
    return {
        "key": table.key,
        "caption": table.caption,
        "columns": [{"name": c.name, "unit": c.unit, "about": c.about} for c in table.columns],
        "rows": [[plain(v) for v in row] for row in table.rows],
    }
