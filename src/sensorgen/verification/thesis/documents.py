"""The reproduction as Markdown, as one HTML page that needs no network, and as plain data; its values as text."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import ArrayLike

from sensorgen.analysis.plots.pages import render
from sensorgen.verification.thesis.items import (
    CHAPTERS,
    JUDGED,
    KINDS,
    LOST,
    NOT_COVERED,
    TRANSCRIBED,
    UNEXPLAINED,
    WORDS,
    ItemPart,
    ReproducedItem,
    chapter,
)

ABOUT = (
    "Every numbered equation, table and figure of the thesis, and claims of its text, by the section where they stand. "
    "Values of models are computed as `sensorgen thesis` runs; what stands under “thesis” is a printed value, "
    "or a printed equation put into numbers. Lines are those of Table 3.1 with the mean resistivity of Table C.1, "
    "0.135 ohm m, at 99.7 kHz where nothing else is said; cells are the default ones with a film of 0.1 mm."
)
VERDICTS = {
    "agrees": "the thesis's value and ours have these leading digits in common",
    "misprint confirmed": "as printed it differs from ours, corrected it agrees",
    "differs": "it differs by as much as is known, for the reason that is given",
    "transcribed": "ours was typed from the thesis, too: both copies are the same, and nothing confirms the value",
    "not covered": "nothing here covers it, or nothing in it can be compared",
    "cannot be reproduced": "numbers did not survive or were never published; ours are shown where we have some",
    "unexplained": "it differs for an unknown reason: report it",
}

_FEW = 3  # parts, or complex values in a part, that are all shown
_FEW_REAL = 8
_NONE = "no number"
_NOISE = 1e-9  # below this share of what is large, a number is what rounding left

MINUS, ELLIPSIS = "\u2212", "\u2026"

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_PREFIXED = ("A", "C", "F", "Hz", "N", "Pa", "S", "V", "m", "ohm")  # units that take one, alone or over something


def markdown(rows: Sequence[ReproducedItem]) -> str:
    """The whole page."""
    return "\n".join(_lines(rows)) + "\n"


def lead(rows: Sequence[ReproducedItem]) -> str:
    """Sum of the counts, in words."""
    total = Counter(row.verdict.word for row in rows)
    copies = [sum(part.copied for part in row.parts) for row in rows if row.verdict.word in JUDGED]
    counts = [f"{total[word]} {text}" for word, text in zip(JUDGED, ("agree", "are misprints", "differ"), strict=True)]
    return (
        f"Of {len(rows)} items {sum(total[word] for word in JUDGED)} are compared with something that does not come "
        "from the item itself (a model, a solved field, a reading, another table of the thesis): "
        f"{', '.join(counts)}; {sum(map(bool, copies))} of these also have transcribed values, {sum(copies)} in all. "
        f"Transcribed only: {total[TRANSCRIBED]}; not covered: {total[NOT_COVERED]}; cannot be reproduced: "
        f"{total[LOST]}."
    )


def words(rows: Sequence[ReproducedItem]) -> list[str]:
    """Verdicts in use, in their order; the one that should not occur only where it does."""
    used = {row.verdict.word for row in rows}
    return [word for word in WORDS if word != UNEXPLAINED or word in used]


def _lines(rows: Sequence[ReproducedItem]) -> Iterator[str]:
    yield from ("# The thesis, reproduced", "", "Written by `sensorgen thesis`; a test holds the two together.", "")
    yield from (lead(rows), "")
    yield f"| | {' | '.join(f'{kind}s' for kind in KINDS)} | all |"
    yield f"|---|{'---|' * (len(KINDS) + 1)}"
    for word, counts in counted(rows):
        yield f"| {word or 'all'} | {' | '.join(map(str, counts))} |"
    yield ""
    yield from (f"- **{word}**: {VERDICTS[word]}" for word in words(rows))
    yield from ("", ABOUT)
    for name in CHAPTERS:
        yield from ("", f"## {heading(name)}", "")
        yield "| number | what it says | thesis | ours | verdict | erratum |"
        yield "|---|---|---|---|---|---|"
        for row in rows:
            if row.chapter == name:
                yield f"| {' | '.join(_cells(row))} |"


def heading(name: str) -> str:
    """A chapter's name and title."""
    return f"{'Chapter' if name.isdigit() else 'Appendix'} {name}: {chapter(name).title}"


def counted(rows: Sequence[ReproducedItem]) -> Iterator[tuple[str, list[int]]]:
    """Each verdict, and how many equations, figures and tables, and of all, have it; last the sums."""
    for word in (*words(rows), ""):
        counts = Counter(row.kind for row in rows if row.verdict.word == word or not word)
        yield word, [*(counts[kind] for kind in KINDS), sum(counts.values())]


def _cells(row: ReproducedItem) -> Iterator[str]:
    """Without what Markdown would take for a new cell, or for HTML."""
    parts, item = row.parts, row.item
    values = "; ".join(thesis_values(parts, item.tolerance)), "; ".join(our_values(parts, item.tolerance))
    for text in (row.name(), item.says, *values, verdict(row), item.erratum):
        yield text.replace("|", "&#124;").replace("<", "&lt;")


def verdict(row: ReproducedItem) -> str:
    """The verdict, and why its tolerance is what it is."""
    why = row.item.why_tolerance
    return row.verdict.text() + (f"; tolerance {row.item.tolerance:.2g}, since {why}" if why else "")


def html(rows: Sequence[ReproducedItem]) -> str:
    """The whole page."""
    used = words(rows)
    return render(
        "sensorgen.verification.thesis", "thesis.html", title="The thesis, reproduced", lead=lead(rows), about=ABOUT,
        kinds=KINDS, headings=[(name, heading(name)) for name in CHAPTERS],
        plurals=[(kind, f"{kind}s") for kind in KINDS], used={word: VERDICTS[word] for word in used},
        counts=list(counted(rows)), code=_code, thesis_values=thesis_values, our_values=our_values,
        chapters={name: (heading(name), [row for row in rows if row.chapter == name]) for name in CHAPTERS},
        why=lambda row: verdict(row).removeprefix(row.verdict.word),
    )  # fmt: skip


def _code(text: str) -> Markup:
    """Escaped, with text between back ticks as code."""
    parts = (
        Markup("<code>{}</code>").format(part) if k % 2 else escape(part) for k, part in enumerate(text.split("`"))
    )
    return Markup("").join(parts)


def plain(rows: Sequence[ReproducedItem]) -> list[dict[str, Any]]:
    """One mapping per item, with every value at full length."""
    return [
        {
            "chapter": row.chapter, "kind": row.kind, "number": row.item.number, "says": row.item.says,
            "model": row.item.check, "verdict": row.verdict.word, "why": row.verdict.why, "erratum": row.item.erratum,
            "tolerance": row.item.tolerance,
            "parts": [
                {"name": part.name, "unit": part.unit, "printed": _values(part.printed), "ours": _values(part.ours),
                 "corrected": _values(part.corrected)} for part in row.parts
            ],
        }
        for row in rows
    ]  # fmt: skip


def _values(values: ArrayLike | None) -> Any:
    """Numbers as JSON has them: complex ones as pairs, none for what is no number."""
    if values is None:
        return None
    array = np.asarray(values)
    if np.iscomplexobj(array):
        array = np.stack([array.real, array.imag], -1)
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return plain.tolist()


def thesis_values(parts: Sequence[ItemPart], tolerance: float) -> list[str]:
    """The thesis's values: those that differ, or all where they are few."""
    texts = []
    for part in _chosen(parts, tolerance):
        if part.printed is not None:
            corrected = "" if part.corrected is None else f"; corrected {_number(part, part.corrected)}"
            limit = "at most " if part.limit else ""
            texts.append(f"{part.name}: {limit}{_number(part, part.printed)}{corrected}")
    return texts


def our_values(parts: Sequence[ItemPart], tolerance: float) -> list[str]:
    """Ours of the same, and how many more there are."""
    chosen = _chosen(parts, tolerance)
    more = sum(not part.copied for part in parts) - sum(not part.copied for part in chosen)
    rest = [f"{more} more values that agree"] if more else []
    return [f"{part.name}: {_number(part, part.ours)}" for part in chosen] + rest


def _chosen(parts: Sequence[ItemPart], tolerance: float) -> Sequence[ItemPart]:
    """Those that differ, or the first few; transcribed ones only where there are no others."""
    parts = [part for part in parts if not part.copied] or parts
    if len(parts) <= _FEW:
        return parts
    return [part for part in parts if not abs(part.off()) <= tolerance] or parts[:_FEW]


def _number(part: ItemPart, values: ArrayLike) -> str:
    """In the light of ours: what is nothing beside it is what rounding left."""
    return number(values, part.unit, max(part.scale, float(np.max(abs(np.asarray(part.ours))))), part.shown)


def number(values: ArrayLike, unit: str = "", scale: float = 0.0, digits: int = 5) -> str:
    """One number or several with their unit.

    >>> number(2997.116648 - 23192.109j, "ohm"), number([1.0, 2e-3], "V"), number(float("nan"))
    ('2.9971 − 23.192j kohm', '1, 0.002 V', 'no number')
    """
    flat = np.atleast_1d(np.asarray(values)).ravel()
    if np.isnan(flat).all():
        return _NONE
    large = float(np.nanmax(abs(flat)))
    power = 0  # of ten, by which a unit is prefixed so that the largest value has one to three digits before its point
    if unit.partition("/")[0] in _PREFIXED and large > _NOISE * scale:
        power = max((p for p in _PREFIXES if large >= 10.0**p * (1 - _NOISE)), default=0)
    texts = [_one(value / 10.0**power, _NOISE * max(large, scale) / 10.0**power, digits) for value in flat.tolist()]
    end = f" {_PREFIXES[power]}{unit}" if unit else ""
    if len(texts) <= (_FEW if np.iscomplexobj(flat) else _FEW_REAL):
        return f"{', '.join(texts)}{end}"
    return f"{texts[0]} {ELLIPSIS} {texts[-1]}{end} ({len(texts)} values)"


def _one(value: complex, noise: float, digits: int) -> str:
    if np.isnan(value):
        return _NONE
    real, imaginary = (0.0 if abs(v) <= noise else v for v in (value.real, value.imag))
    shown = [f"{v:.{digits}g}".replace("-", MINUS) for v in (real, imaginary, abs(imaginary))]
    if not isinstance(value, complex) or not imaginary:
        return shown[0]
    return f"{shown[0]} {MINUS if imaginary < 0 else '+'} {shown[2]}j" if real else f"{shown[1]}j"
