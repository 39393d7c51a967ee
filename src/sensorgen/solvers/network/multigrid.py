"""Conjugate gradients with a multigrid of aggregates: time and memory of a large network grow as its resistors.

Smoothed aggregation (Vanek, Mandel, Brezina, Computing 1996, 56, 179) in SciPy alone, for one near-kernel, equal
potentials. Aggregates are the neighbourhoods of a set of nodes that lie three strong links apart or more, found in
parallel as by Bell, Dalton and Olson, SIAM J. Sci. Comput. 2012, 34, C123.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.arrays import Real, Whole

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import SuperLU

_STRONG = 0.02  # links of this share of both nodes' own conductance join them; half of it on each coarser level
_COARSEST = 2000  # unknowns that a sparse factor solves at once
_LEVELS = 12
_SMOOTHED = 8.0  # ratio of the eigenvalues that Chebyshev polynomials damp
_RESIDUAL = 1e-11  # of the right-hand side at which iterations end
_MOST = 300  # iterations


@dataclass(frozen=True, eq=False)
class _Level:
    """A matrix, its diagonal, the largest eigenvalue of both, and interpolation from the next level and back."""

    matrix: "csr_array[np.float64]"
    diagonal: Real
    largest: float
    finer: "csr_array[np.float64]"
    coarser: "csr_array[np.float64]"


def solve(matrix: "csr_array[np.float64]", side: Real) -> Real | None:
    """``matrix^-1 . side``, or None where iterations do not converge.

    Parameters
    ----------
    matrix : (n, n) sparse array
        Symmetric, positive definite.
    side : (n,) array
        Right-hand side.
    """
    levels, factor = _levels(matrix)
    found, rest = np.zeros(len(side)), side.astype(float)
    wanted = _RESIDUAL * float(np.linalg.norm(side))
    way, before = np.zeros(len(side)), np.inf
    for _ in range(_MOST):
        if np.linalg.norm(rest) <= wanted:
            return found
        cycled = _cycle(levels, factor, rest)
        now = float(rest @ cycled)
        if not now > 0:
            return None
        way = cycled + now / before * way
        flow = matrix @ way
        step = now / float(way @ flow)
        found += step * way
        rest -= step * flow
        before = now
    return None


def _levels(matrix: "csr_array[np.float64]") -> tuple[list[_Level], "SuperLU"]:
    """All levels but the coarsest, and the factor of that."""
    from scipy.sparse import csr_array, diags_array
    from scipy.sparse.linalg import splu

    levels: list[_Level] = []
    potential = np.ones(matrix.shape[0])
    while (count := matrix.shape[0]) > _COARSEST and len(levels) < _LEVELS:
        group = _groups(matrix, _STRONG * 0.5 ** len(levels))
        coarse = int(group.max()) + 1
        if coarse > 0.8 * count:
            break
        norm = np.sqrt(np.bincount(group, potential**2, minlength=coarse))
        plain = csr_array((potential / norm[group], (np.arange(count), group)), shape=(count, coarse))
        potential, diagonal = norm, matrix.diagonal()
        scaled = csr_array(diags_array(1.0 / diagonal) @ matrix)
        vector, largest = np.random.default_rng(1).random(count), 1.0
        for _ in range(12):  # power iterations
            vector = scaled @ vector
            largest = float(np.linalg.norm(vector))
            vector /= largest
        largest *= 1.05
        finer = csr_array(plain - (4 / 3 / largest) * (scaled @ plain))
        coarser = csr_array(finer.T)
        levels.append(_Level(matrix, diagonal, largest, finer, coarser))
        matrix = csr_array(coarser @ matrix @ finer)
    return levels, splu(matrix.tocsc())


def _groups(matrix: "csr_array[np.float64]", strong: float) -> Whole:
    """The aggregate of each unknown, from 0."""
    from scipy.sparse import csr_array

    count, diagonal = matrix.shape[0], matrix.diagonal()
    row, column = np.repeat(np.arange(count), np.diff(matrix.indptr)), matrix.indices
    kept = np.abs(matrix.data) >= strong * np.sqrt(diagonal[row] * diagonal[column])
    links = csr_array((np.ones(kept.sum()), (row[kept], column[kept])), shape=matrix.shape)

    def highest(value: Real) -> Real:
        """Of each unknown and its strong neighbours."""
        return np.asarray(np.maximum.reduceat(value[links.indices], links.indptr[:-1]))

    weight = np.random.default_rng(0).permutation(count) + 1.0
    roots, open_ = np.zeros(count, bool), np.ones(count, bool)
    while open_.any():
        value = np.where(open_, weight, 0.0)
        roots |= open_ & (highest(highest(value)) == weight)
        open_ &= highest(highest(roots.astype(float))) == 0
    group = np.zeros(count)
    group[roots] = np.arange(1, roots.sum() + 1)
    for _ in range(2):
        group = np.where(group > 0, group, highest(group))
    return np.asarray(group.astype(np.int64) - 1)


def _cycle(levels: list[_Level], factor: "SuperLU", side: Real) -> Real:
    """One V-cycle from a potential of 0."""
    if not levels:
        return np.asarray(factor.solve(side))
    level = levels[0]
    found = _smoothed(level, side, np.zeros(len(side)))
    found = found + level.finer @ _cycle(levels[1:], factor, level.coarser @ (side - level.matrix @ found))
    return _smoothed(level, side, found)


def _smoothed(level: _Level, side: Real, found: Real) -> Real:
    """Two steps of a Chebyshev polynomial (Adams et al., J. Comput. Phys. 2003, 188, 593)."""
    high = 1.1 * level.largest
    low = high / _SMOOTHED
    middle, half = (high + low) / 2, (high - low) / 2
    way = (side - level.matrix @ found) / level.diagonal / middle
    found = found + way
    share = 1.0 / (2.0 * middle / half - half / middle)
    rest = (side - level.matrix @ found) / level.diagonal
    return np.asarray(found + share * half / middle * way + 2.0 * share / half * rest)
