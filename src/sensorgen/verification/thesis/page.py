"""The reproduction as one HTML page that needs no network, filtered by chapter, kind and verdict; and as plain data."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import ArrayLike

from sensorgen.analysis.plots.pages import render
from sensorgen.verification.thesis import shown
from sensorgen.verification.thesis.items import CHAPTERS, KINDS
from sensorgen.verification.thesis.markdown import ABOUT, VERDICTS, counted, heading, lead, verdict, words
from sensorgen.verification.thesis.reproduced import ReproducedItem


def html(rows: Sequence[ReproducedItem]) -> str:
    """The whole page."""
    used = words(rows)
    return render(
        "sensorgen.verification.thesis", "thesis.html", title="The thesis, reproduced", lead=lead(rows), about=ABOUT,
        kinds=KINDS,
        headings=[(name, heading(name)) for name in CHAPTERS], plurals=[(kind, f"{kind}s") for kind in KINDS],
        used={word: VERDICTS[word] for word in used}, counts=list(counted(rows)), code=_code, shown=shown,
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
