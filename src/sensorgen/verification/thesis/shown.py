"""Computed values as text: one line for the thesis, one for this package."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.verification.thesis.verdicts import ItemPart

_FEW = 3  # parts, or complex values in a part, that are all shown
_FEW_REAL = 8
_NONE = "no number"
_NOISE = 1e-9  # below this share of what is large, a number is what rounding left

MINUS, ELLIPSIS = "\u2212", "\u2026"

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_PREFIXED = ("A", "C", "F", "Hz", "N", "Pa", "S", "V", "m", "ohm")  # units that take one, alone or over something


def thesis(parts: Sequence[ItemPart], tolerance: float) -> list[str]:
    """The thesis's values: those that differ, or all where they are few."""
    texts = []
    for part in _chosen(parts, tolerance):
        if part.printed is not None:
            corrected = "" if part.corrected is None else f"; corrected {_number(part, part.corrected)}"
            limit = "at most " if part.limit else ""
            texts.append(f"{part.name}: {limit}{_number(part, part.printed)}{corrected}")
    return texts


def ours(parts: Sequence[ItemPart], tolerance: float) -> list[str]:
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
    large = max((abs(v) for v in flat.tolist() if not np.isnan(v)), default=0.0)
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
