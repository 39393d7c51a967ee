"""The reproduction as one HTML page that needs no network: filtered by chapter, kind and verdict."""

from collections.abc import Iterator, Sequence
from html import escape
from importlib import resources

from sensorgen.verification.thesis import shown
from sensorgen.verification.thesis.items import CHAPTERS, KINDS
from sensorgen.verification.thesis.markdown import ABOUT, VERDICTS, counted, heading, verdict, words
from sensorgen.verification.thesis.reproduced import Row

TITLE = "The thesis, reproduced"
_HEADS = {
    "number": "number", "says": "what it says", "thesis": "thesis", "ours": "ours", "verdict": "verdict",
    "erratum": "erratum",
}  # fmt: skip
_VALUES = ("thesis", "ours")


def html(rows: Sequence[Row]) -> str:
    """The whole page."""
    return "\n".join(_lines(rows)) + "\n"


def _lines(rows: Sequence[Row]) -> Iterator[str]:
    used = words(rows)
    yield '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{TITLE}</title>\n<style>\n{_file('page.css')}</style>\n</head>\n<body>\n<main>"
    yield f"<h1>{TITLE}</h1>\n<p>{_code(ABOUT)}</p>"
    yield "<dl>"
    yield from (f"<dt {_colour(word)}>{word}</dt><dd>{escape(VERDICTS[word])}</dd>" for word in used)
    yield "</dl>"
    yield from _summary(rows)
    yield from _form(used)
    yield from _table(rows)
    yield f"</main>\n<script>\n{_file('page.js')}</script>\n</body>\n</html>"


def _file(name: str) -> str:
    return (resources.files("sensorgen.verification.thesis") / name).read_text("utf-8")


def _code(text: str) -> str:
    """Escaped, and what stands between back ticks as code."""
    parts = escape(text, quote=False).split("`")
    return "".join(f"<code>{part}</code>" if k % 2 else part for k, part in enumerate(parts))


def _colour(word: str) -> str:
    return f'style="color: var(--{word.replace(" ", "-")})"'


def _summary(rows: Sequence[Row]) -> Iterator[str]:
    yield '<table class="summary"><caption>How many of each</caption>'
    heads = "".join(f'<th scope="col">{head}</th>' for head in (*(f"{kind}s" for kind in KINDS), "all"))
    yield f"<thead><tr><td></td>{heads}</tr></thead><tbody>"
    for word, counts in counted(rows):
        cells = "".join(f"<td>{count}</td>" for count in counts)
        yield f'<tr><th scope="row"{f" {_colour(word)}" if word else ""}>{word or "all"}</th>{cells}</tr>'
    yield "</tbody></table>"


def _form(used: Sequence[str]) -> Iterator[str]:
    yield '<form hidden aria-label="Filter the items">'
    yield _select("chapter", {name: heading(name) for name in CHAPTERS})
    yield _select("kind", {kind: f"{kind}s" for kind in KINDS})
    yield _select("verdict", dict(zip(used, used, strict=True)))
    yield '<label>text<input type="search" name="text"></label><button type="reset">show all</button>'
    yield '<output name="count" aria-live="polite"></output>\n</form>'


def _select(name: str, choices: dict[str, str]) -> str:
    options = "".join(f'<option value="{value}">{escape(said)}</option>' for value, said in choices.items())
    return f'<label>{name}<select name="{name}"><option value="">all</option>{options}</select></label>'


def _table(rows: Sequence[Row]) -> Iterator[str]:
    # Narrow screens show rows as blocks, which would hide the table from screen readers: hence the roles.
    yield '<table id="items" role="table"><caption>Items</caption>\n<thead role="rowgroup"><tr role="row">'
    for key, head in _HEADS.items():
        names = f"{key} values" if key in _VALUES else key
        yield f'<th scope="col" role="columnheader" class="{names}">{head}</th>'
    yield '</tr></thead>\n<tbody role="rowgroup">'
    for name in CHAPTERS:
        yield (
            f'<tr class="chapter" role="row" data-chapter="{name}">'
            f'<th role="rowheader" colspan="{len(_HEADS)}">{escape(heading(name))}</th></tr>'
        )
        yield from (_row(row) for row in rows if row.chapter == name)
    yield "</tbody></table>"


def _row(row: Row) -> str:
    item = row.item
    word = row.verdict.word
    why = verdict(row).removeprefix(word)
    cells = {
        "says": _code(item.says),
        "thesis": _list(shown.thesis(row.parts, item.tolerance)),
        "ours": _list(shown.ours(row.parts, item.tolerance)),
        "verdict": f'<span class="word" {_colour(word)}>{word}</span>{_code(why)}',
        "erratum": _code(item.erratum),
    }
    place = f"{row.kind}-{item.number}"
    return (
        f'<tr role="row" id="{place}" data-chapter="{row.chapter}" data-kind="{row.kind}" data-verdict="{word}">'
        f'<th scope="row" role="rowheader">{row.name()}</th>{"".join(map(_cell, cells, cells.values()))}</tr>'
    )


def _cell(key: str, content: str) -> str:
    names = ' class="values"' if key in _VALUES else ""
    return f'<td role="cell" data-head="{_HEADS[key]}"{names}>{content}</td>'


def _list(lines: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>" if lines else ""
