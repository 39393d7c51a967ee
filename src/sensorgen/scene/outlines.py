"""Outlines in a plane: corners in turn, and what is true of them."""

from collections.abc import Iterable, Sequence
from math import isfinite

Point = tuple[float, float]
Outline = tuple[Point, ...]
Place = tuple[float, float, float]

SLIVER_MM = 1e-6  # a nanometre: narrower pieces are rounding, not geometry, and the CAD kernel refuses them from 1e-7
_SHOWN = 5  # corners of an outline that an error shows


def rectangle(a0: float, a1: float, b0: float, b1: float) -> Outline:
    """Rectangle from (a0, b0) to (a1, b1), counter-clockwise [mm]."""
    return ((a0, b0), (a1, b0), (a1, b1), (a0, b1))


def is_rectangle(outline: Outline) -> bool:
    """Whether it is a rectangle along the axes."""
    low, high = (tuple(map(end, zip(*outline, strict=True))) for end in (min, max))
    corners = {low, high, (low[0], high[1]), (high[0], low[1])}
    return len(outline) == 4 == len(corners) and set(outline) == corners and area_mm2(outline) != 0


def rounded(value_mm: float) -> float:
    """Round away what sums leave behind, so that faces that meet have equal coordinates [mm]."""
    return round(value_mm, 12)


def area_mm2(outline: Iterable[Point]) -> float:
    """Signed area of an outline, positive when counter-clockwise [mm2]."""
    points = tuple(outline)
    u0, v0 = points[0]
    turn = zip(points, points[1:] + points[:1], strict=True)
    return sum((a[0] - u0) * (b[1] - v0) - (b[0] - u0) * (a[1] - v0) for a, b in turn) / 2.0


def fault(outline: Outline, area: float | None = None) -> str:
    """Why corners are no outline, of an area that their edges may curve [mm2], or ""."""
    if len(outline) < (3 if area is None else 2):
        return f"of {len(outline)} corners is open"
    if any(a == b for a, b in zip(outline, outline[1:] + outline[:1], strict=True)):
        return "has the same corner twice in a row"
    area = area_mm2(outline) if area is None else area
    if not isfinite(area):
        return "has a corner that is nowhere"
    return "encloses nothing" if abs(area) < SLIVER_MM**2 else ""


def described(outline: Outline) -> str:
    """The first corners of an outline, for an error."""
    some = ", ".join(f"({u:.6g}, {v:.6g})" for u, v in outline[:_SHOWN])
    return some + (", ..." if len(outline) > _SHOWN else "") or "none"


def clipped(outline: Iterable[Point], end_mm: float) -> Outline:
    """The part of an outline with first coordinate between 0 and ``end_mm`` [mm], exactly.

    For outlines that every vertical line meets in one piece; empty where less than a sliver is left.
    Coordinates are rounded, so that neighbours reached by different sums stay neighbours.

    >>> clipped([(0, 0), (2, 0), (2, 1), (0, 1)], 1.5)
    ((0, 0), (1.5, 0.0), (1.5, 1.0), (0, 1))
    """
    points = [(rounded(u), rounded(v)) for u, v in outline]
    for sign, limit in ((-1.0, 0.0), (1.0, end_mm)):
        kept: list[Point] = []  # on the near side of a vertical line (Sutherland and Hodgman, 1974)
        for a, b in zip(points[-1:] + points[:-1], points, strict=True):
            a_in, b_in = sign * (a[0] - limit) <= 0, sign * (b[0] - limit) <= 0
            if a_in != b_in:
                share = (limit - a[0]) / (b[0] - a[0])
                kept.append((limit, round(a[1] + share * (b[1] - a[1]), 12)))
            kept += [b] if b_in else []
        points = kept
    distinct = tuple(p for k, p in enumerate(points) if p != points[k - 1])
    width = max((p[0] for p in distinct), default=0.0) - min((p[0] for p in distinct), default=0.0)
    return distinct if len(distinct) > 2 and width > SLIVER_MM else ()


def without_straight(loop: Sequence[Point]) -> Outline:
    """An outline without the corners at which it goes straight on."""
    kept: list[Point] = []
    for k, b in enumerate(loop):
        a, c = kept[-1] if kept else loop[k - 1], loop[(k + 1) % len(loop)]
        if b != a and (b == c or abs((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])) > SLIVER_MM**2):
            kept.append(b)
    return tuple(kept)
