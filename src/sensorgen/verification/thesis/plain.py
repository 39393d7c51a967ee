"""The reproduction as plain data, for JSON."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.verification.thesis.reproduced import Row
from sensorgen.verification.thesis.verdicts import Part


def plain(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One mapping per item, with every value at full length."""
    return [
        {
            "chapter": row.chapter,
            "kind": row.kind,
            "number": row.item.number,
            "says": row.item.says,
            "model": row.item.check,
            "verdict": row.verdict.word,
            "why": row.verdict.why,
            "erratum": row.item.erratum,
            "tolerance": row.item.tolerance,
            "parts": [_part(part) for part in row.parts],
        }
        for row in rows
    ]


def _part(part: Part) -> dict[str, Any]:
    known = {"printed": part.printed, "ours": part.ours, "corrected": part.corrected}
    return {"name": part.name, "unit": part.unit} | {
        name: None if value is None else _values(value) for name, value in known.items()
    }


def _values(values: ArrayLike) -> Any:
    """Numbers as JSON has them: complex ones as pairs, none for what is no number."""
    found = np.asarray(values)
    if np.iscomplexobj(found):
        found = np.stack([found.real, found.imag], -1)
    return _without_nan(found.tolist())


def _without_nan(values: Any) -> Any:
    if isinstance(values, list):
        return [_without_nan(value) for value in values]
    return values if np.isfinite(values) else None
