"""A report as one HTML file that needs nothing else: styles, scripts, figures and drawings are inside."""

import base64
import json
from collections.abc import Iterator
from functools import cache
from html import escape
from importlib import resources
from typing import Any

from sensorgen import __version__
from sensorgen.analysis.report.charts import Chart
from sensorgen.analysis.report.contents import Report, Section
from sensorgen.analysis.report.interactive import figure, height_px
from sensorgen.analysis.report.tables import Cell, Column, Table, exact, said
from sensorgen.analysis.report.variants import Variant

# Nothing may be fetched, whatever a name or a remark holds.
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
MOST_ROWS = 2000  # of a table


def html(report: Report) -> str:
    """The page."""
    title = escape(report.title)
    drawn = bool(report.charts)
    return "\n".join(
        [
            "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">', '<link rel="icon" href="data:,">',
            f"<title>{title}</title>", f"<style>{_own('page.css')}</style>", "</head>", "<body>",
            '<a class="skip" href="#main">Skip to the report</a>', *_header(report), '<main id="main" tabindex="-1">',
            *(line for section in report.sections for line in _section(section)), "</main>",
            f"<footer>sensorgen {escape(__version__)}, {escape(report.made_at)}</footer>",
            f'<script type="application/json" id="figures">{_json([figure(c) for c in report.charts])}</script>',
            *([f"<script>{_plotly()}</script>"] if drawn else []), f"<script>{_own('page.js')}</script>",
            "</body>", "</html>", "",
        ]
    )  # fmt: skip


def _own(name: str) -> str:
    return (resources.files("sensorgen.analysis.report") / name).read_text("utf-8")


@cache
def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs())


def _json(data: Any) -> str:
    """JSON that no text in it can leave."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c").replace("\u2028", "\\u2028")


def _header(report: Report) -> Iterator[str]:
    yield f"<header><h1>{escape(report.title)}</h1>"
    yield "<ul class=findings>" + "".join(f"<li>{escape(text)}</li>" for text in report.findings) + "</ul>"
    yield '<nav aria-label="Sections"><ul>'
    yield from (f'<li><a href="#{s.key}">{escape(s.title)}</a></li>' for s in report.sections)
    yield "</ul></nav></header>"


def _section(section: Section) -> Iterator[str]:
    yield f'<section aria-labelledby="{section.key}"><h2 id="{section.key}">{escape(section.title)}</h2>'
    yield from (f"<p>{escape(words)}</p>" for words in section.words)
    for chart in section.charts:
        yield from _chart(chart)
    for table in section.tables:
        yield from _table(table)
    for variant in section.variants:
        yield from _variant(variant)
    yield "</section>"


def _chart(chart: Chart) -> Iterator[str]:
    key = chart.key
    yield f'<figure id="figure-{key}"><h3 id="{key}-title">{escape(chart.title)}</h3>'
    if chart.chooser:
        options = "".join(f"<option>{escape(name)}</option>" for name in chart.choices)
        choose = f'{escape(chart.chooser)} <select data-for="{chart.key}">{options}</select>'
        yield f"<p class=choose><label>{choose}</label></p>"
    yield (
        f'<div class="plot" role="img" aria-labelledby="{chart.key}-title {chart.key}-alt" data-key="{chart.key}" '
        f'style="min-height:{height_px(chart)}px"></div>'
    )
    yield f'<figcaption id="{chart.key}-alt">{escape(chart.alt)}</figcaption></figure>'


def _table(table: Table) -> Iterator[str]:
    """A table; of a long one the first rows, because a browser has to lay out all that it is given."""
    count = len(table.rows)
    rest = f" (the first {MOST_ROWS} of {count} rows; all are in --format csv)" if count > MOST_ROWS else ""
    yield f'<div class="scroll" tabindex="0" role="region" aria-labelledby="{table.key}-caption">'
    yield f'<table id="table-{table.key}"><caption id="{table.key}-caption">{escape(table.caption + rest)}</caption>'
    yield "<thead><tr>"
    yield from (_head(column) for column in table.columns)
    yield "</tr></thead><tbody>"
    named = next((k for k, c in enumerate(table.columns) if c.name in ("specimen", "what", "name")), 0)
    for row in table.rows[:MOST_ROWS]:
        cells = (_cell(value, header=k == named) for k, value in enumerate(row))
        yield f"<tr>{''.join(cells)}</tr>"
    yield "</tbody></table></div>"


def _head(column: Column) -> str:
    about = f' title="{escape(column.about)}"' if column.about else ""
    return f'<th scope="col" aria-sort="none"{about}><button type="button">{escape(column.head)}</button></th>'


def _cell(value: Cell, *, header: bool) -> str:
    start, end = ('th scope="row"', "th") if header else ("td", "td")
    if isinstance(value, str):
        return f"<{start}>{escape(value)}</{end}>"
    return f'<{start} class="n" data-value="{exact(value)}">{said(value)}</{end}>'


def _variant(variant: Variant) -> Iterator[str]:
    """A drawing as a picture of its own, so that no style of one reaches another."""
    data = base64.b64encode(variant.svg.encode()).decode()
    name = escape(variant.design)
    yield f'<figure class="drawing" id="drawing-{name}"><h3>{name}</h3>'
    alt = f"Cross-section of {name}, with its layers and what the checks find"
    yield f'<img loading="lazy" alt="{alt}" src="data:image/svg+xml;base64,{data}">'
    yield f"<figcaption>{escape(variant.words)} (design {escape(variant.design_id)})</figcaption></figure>"
