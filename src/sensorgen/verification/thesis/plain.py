"""The reproduction as plain data, for JSON."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.verification.thesis.reproduced import ReproducedItem


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
    found = np.asarray(values)
    if np.iscomplexobj(found):
        found = np.stack([found.real, found.imag], -1)
    plain = found.astype(object)
    plain[~np.isfinite(found)] = None
    return plain.tolist()
