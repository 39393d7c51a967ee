"""Rings of triangles around a corner, without end: in the plane energies have no scale, so that all rings are one.

One ring joined to itself makes two, these four, and so on (cyclic reduction): a thousand rings take ten steps, and no
radius is ever written down, be it 1e-300 of the cell's.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sensorgen.models._fem_fronts import Numbers, Whole, eliminated
from sensorgen.models._fem_polynomials import Real, numbered

RATIO = 0.25  # of one ring's radius to the last; more lowers the error no further


def ring_corners(tips: Real) -> Real:
    """The two triangles (2 s, 3, 2) of each tip (s, 3, 2; at the origin, first, last) in the outermost ring."""
    first, last = tips[:, 1], tips[:, 2]
    both = [last, RATIO * last, first], [RATIO * last, RATIO * first, first]
    return np.stack([np.stack(part, axis=1) for part in both], axis=1).reshape(-1, 3, 2)


@dataclass(frozen=True)
class Layout:
    """Unknowns of one ring around a corner, by what they touch.

    Attributes
    ----------
    ids, signs : (s, 2, 3 order) array
        Of both triangles in each sector: 1 to m outer, then as many inner, then the held value if any, then others;
        0 for none.
    tip_ids, tip_signs : (s, 3 order) array
        Of the triangle at the corner itself: 1 to m outer, the held value or the corner.
    free : array
        Spokes that are not held; their outer ends come first.
    rim : (s, 2) array
        Spokes at the ends of the outer sides, the lower first; their modes come next.
    outer : int
        m, how many that is.
    held : bool
        Whether the corner lies on a line of one value.
    """

    ids: Whole
    signs: Real
    tip_ids: Whole
    tip_signs: Real
    free: Whole
    rim: Whole
    outer: int
    held: bool

    @classmethod
    @cache
    def of(cls, spokes: int, closed: bool, ends: tuple[bool, bool], order: int) -> "Layout":
        """For so many spokes, of which the first and the last may be held."""
        sectors = np.arange(spokes if closed else spokes - 1)
        a, b = sectors, (sectors + 1) % spokes
        corners = np.stack([np.stack([b, b + spokes, a], 1), np.stack([b + spokes, a + spokes, a], 1)], 1).reshape(
            -1, 3
        )
        tips = np.stack([np.full_like(a, spokes), a, b], 1)
        fixed = np.zeros(spokes, bool)
        fixed[0], fixed[-1] = ends
        free = np.flatnonzero(~fixed)
        outer = len(free) + len(sectors) * (order - 1)
        held = 2 * outer + 1
        vertex = np.empty(2 * spokes, np.int64)
        vertex[np.flatnonzero(fixed)] = vertex[np.flatnonzero(fixed) + spokes] = held
        vertex[free], vertex[free + spokes] = np.arange(len(free)) + 1, np.arange(len(free)) + 1 + outer
        names, side = _sides(corners, 2 * spokes)
        low, high = names // (2 * spokes), names % (2 * spokes)
        first = np.zeros(len(names), np.int64)
        is_outer, is_inner = high < spokes, low >= spokes
        ends_of_rim = np.stack([low[is_outer], high[is_outer]], axis=1)
        rim = 1 + len(free) + (order - 1) * np.arange(len(sectors))
        first[is_outer], first[is_inner] = rim, rim + outer
        other = ~(is_outer | is_inner) & ~((high == low + spokes) & fixed[low % spokes])
        any_held = bool(fixed.any())
        first[other] = held + any_held + (order - 1) * np.arange(other.sum())
        ids, signs = numbered(corners, vertex, first[side], order)
        tip_vertex = np.append(vertex[:spokes], outer + 1)
        tip_vertex[:spokes][fixed] = outer + 1
        tip_names, tip_side = _sides(tips, 2 * spokes)
        low, high = tip_names // (2 * spokes), tip_names % (2 * spokes)
        first = np.zeros(len(tip_names), np.int64)
        first[high < spokes] = rim
        other = (high == spokes) & ~fixed[low]
        first[other] = outer + 2 + (order - 1) * np.arange(other.sum())
        tip_ids, tip_signs = numbered(tips, tip_vertex, first[tip_side], order)
        shape = (len(sectors), 2, 3 * order)
        return cls(ids.reshape(shape), signs.reshape(shape), tip_ids, tip_signs, free, ends_of_rim, outer, any_held)


def _sides(corners: Whole, base: int) -> tuple[Whole, Whole]:
    """Distinct sides as low * base + high in rising order, and which of them each side (n, 3) is."""
    after = np.roll(corners, -1, axis=1)
    names, at = np.unique(np.minimum(corners, after) * base + np.maximum(corners, after), return_inverse=True)
    return names, at.reshape(corners.shape)


@dataclass(frozen=True)
class Cone:
    """All rings around a corner: an energy of what is on the outermost, and the way back inside.

    Attributes
    ----------
    matrix : (m, m) or (m + 1, m + 1) array
        Of the outermost unknowns, and of the held value if there is one.
    """

    layout: Layout
    matrix: Numbers
    within_ring: Numbers
    between: list[Numbers]
    innermost: Numbers
    at_tip: Numbers

    @classmethod
    def of(cls, layout: Layout, rings: Numbers, tips: Numbers, doublings: int) -> "Cone":
        """Of energies (s, 2, k, k) of one ring's triangles, and (s, k, k) of the innermost, 2 ** doublings rings."""
        m, held = layout.outer, int(layout.held)
        ring, within = eliminated(_assembled(layout.ids, layout.signs, rings), 2 * m + held)
        tip, at_tip = eliminated(_assembled(layout.tip_ids, layout.tip_signs, tips), m + held)
        between = []
        for _ in range(doublings):
            ring, others = _doubled(ring, m)
            between.append(others)
        matrix, innermost = _closed(ring, tip, m)
        return cls(layout, matrix, within, between, innermost, at_tip)

    def inside(self, values: Numbers) -> tuple[Numbers, Numbers]:
        """From the values that ``matrix`` takes: those of all triangles (rings, s, 2, k), and of the innermost (s, k)."""
        m = self.layout.outer
        held = values[m:]
        levels = np.stack([values[:m], self.innermost @ values])
        for others in reversed(self.between):
            amid = _with(np.concatenate([levels[:-1], levels[1:]], axis=1), held) @ others.T
            both = np.empty((len(levels) + len(amid), m), levels.dtype)
            both[::2], both[1::2] = levels, amid
            levels = both
        own = _with(np.concatenate([levels[:-1], levels[1:]], axis=1), held)
        rings = np.concatenate([np.zeros((len(own), 1)), own, own @ self.within_ring.T], axis=1)
        own = np.concatenate([levels[-1], held])
        tip = np.concatenate([[0.0], own, self.at_tip @ own])
        return rings[:, self.layout.ids] * self.layout.signs, tip[self.layout.tip_ids] * self.layout.tip_signs


def _with(rows: Numbers, held: Numbers) -> Numbers:
    return np.concatenate([rows, np.broadcast_to(held, (len(rows), len(held)))], axis=1)


def _assembled(ids: Whole, signs: Real, matrices: Numbers) -> Numbers:
    """Sum of the triangles' energies; unknown 0 is none."""
    size = int(ids.max()) + 1
    found = np.zeros(size * size, matrices.dtype)
    at = ids[..., :, None] * size + ids[..., None, :]
    np.add.at(found, at.ravel(), (signs[..., :, None] * matrices * signs[..., None, :]).ravel())
    return found.reshape(size, size)[1:, 1:]


def _doubled(ring: Numbers, m: int) -> tuple[Numbers, Numbers]:
    """Two rings as one, without the unknowns amid them, and the matrix that gives those."""
    outer, inner, held = slice(m), slice(m, 2 * m), slice(2 * m, None)
    mixed = np.concatenate([ring[inner, outer], ring[outer, inner], ring[inner, held] + ring[outer, held]], axis=1)
    others = -np.linalg.solve(ring[inner, inner] + ring[outer, outer], mixed)
    apart = ring.copy()
    apart[outer, inner] = apart[inner, outer] = 0.0
    apart[held, held] *= 2
    return apart + mixed.T @ others, others


def _closed(ring: Numbers, tip: Numbers, m: int) -> tuple[Numbers, Numbers]:
    """A ring around the innermost triangles, without the unknowns amid them, and the matrix that gives those."""
    inner, kept = slice(m, 2 * m), np.r_[:m, 2 * m : len(ring)]
    mixed = ring[inner][:, kept]
    mixed[:, m:] += tip[:m, m:]
    others = -np.linalg.solve(ring[inner, inner] + tip[:m, :m], mixed)
    both = ring[kept[:, None], kept]
    both[m:, m:] += tip[m:, m:]
    return both + mixed.T @ others, others
