"""Elimination of a network's unknowns in a narrow band, a stretch at a time: memory for one stretch, not for a factor.

An electrode is long and thin, so from one end to the other few of its nodes are neighbours of those before them. Only
a current is wanted, no potential: forward elimination of two right-hand sides tells it, and what is done is let go.
A wide electrode, of which the band is too, is left to multigrid: PyAMG's smoothed aggregation (Vanek, Mandel, Brezina,
Computing 1996, 56, 179).
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_HARDLY = "these lines are hardly connected: expected contacts that conduct as lines do, or not at all"
_MOST = 1e10  # multiplications of an elimination; beyond, multigrid is quicker
_STRONG = 0.02  # links of this share of both nodes' own conductance join them
_COARSEST = 2000  # unknowns that a sparse factor solves at once
_RESIDUAL = 1e-11  # of the right-hand side at which iterations end
_ITERATIONS = 300
_STRETCH = 4096  # unknowns that are eliminated at once, or four times the band


class _Rest(NamedTuple):
    """Remainder of elimination after a stretch: of the matrix, as a band, and of both right sides."""

    band: Real
    sides: Real


def product(matrix: "csr_array[np.float64]", one: Real, other: Real) -> float:
    """``one . matrix^-1 . other``.

    Parameters
    ----------
    matrix : (n, n) sparse array
        Symmetric, positive definite.
    one, other : (n,) array
        Both sides.

    Raises
    ------
    OutOfRange
        The matrix is not positive definite in doubles: parts are hardly connected.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> product(csr_array([[2.0, -1.0], [-1.0, 2.0]]), np.array([1.0, 0.0]), np.array([0.0, 3.0]))
    1.0
    """
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    order = reverse_cuthill_mckee(matrix, symmetric_mode=True)
    sides = np.stack([one, other], axis=1)[order]
    # Lower half of a symmetric matrix in another order: column, how far below the diagonal, and value
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    row, column = np.repeat(rank, np.diff(matrix.indptr)), rank[matrix.indices]
    half = column <= row
    column = column[half]
    column, below, value = column, row[half] - column, matrix.data[half]
    wide = max(int(below.max()), 1)
    if len(order) * wide**2 > _MOST:
        return _wide(matrix, one, other)
    step = max(4 * wide, _STRETCH)
    stretch = np.append(0, np.cumsum(np.bincount(column // step)))
    by_stretch = np.argsort((column // step).astype(np.int32), kind="stable")
    total, rest = 0.0, _Rest(np.zeros((wide + 1, wide)), np.zeros((wide, 2)))
    for start, first, last in zip(range(0, len(order), step), stretch[:-1], stretch[1:], strict=True):
        here = by_stretch[first:last]
        band = np.zeros((wide + 1, min(step, len(order) - start)), order="F")
        band[below[here], column[here] - start] = value[here]
        part, rest = _eliminated(band, sides[start : start + step], rest)
        total += part
    return total


def _wide(matrix: "csr_array[np.float64]", one: Real, other: Real) -> float:
    """The product by multigrid; by a sparse factor of the whole matrix where that does not converge."""
    import pyamg
    from scipy.sparse.linalg import splu

    try:
        # Weights of the interpolation by rows: an estimate of the largest eigenvalue would begin with random numbers
        levels = pyamg.smoothed_aggregation_solver(
            matrix,
            strength=("symmetric", {"theta": _STRONG}),
            smooth=("jacobi", {"omega": 4 / 3, "weighting": "local"}),
            max_coarse=_COARSEST,
            coarse_solver="splu",
        )
        found, failed = levels.solve(other, tol=_RESIDUAL, maxiter=_ITERATIONS, accel="cg", return_info=True)
        if failed:
            solver = splu(  # columns one by one: so sparse a factor has no panels worth their room
                matrix.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                panel_size=1,
                options={"SymmetricMode": True},
            )
            found = solver.solve(other)
    except RuntimeError as error:  # exactly singular
        raise OutOfRange(_HARDLY) from error
    return float(one @ found)


def _eliminated(band: Real, sides: Real, rest: _Rest) -> tuple[float, _Rest]:
    """One stretch: its part of the product, and what it leaves."""
    from scipy.linalg import solve_triangular
    from scipy.linalg.lapack import dpbtrf, dtbtrs

    wide, count = rest.band.shape[1], band.shape[1]
    band[:, :wide] += rest.band[:, :count]
    sides[:wide] += rest.sides[:count]
    factor, failed = dpbtrf(band, lower=1, overwrite_ab=1)
    if failed:
        raise OutOfRange(_HARDLY)
    solved, _ = dtbtrs(factor, sides, uplo="L")
    part = float(solved[:, 0] @ solved[:, 1])
    if count < wide:  # the last
        return part, rest
    row, col = np.arange(wide + 1)[:, None] + np.arange(wide), np.arange(wide)
    square = np.zeros((2 * wide + 1, wide))
    square[row, col] = factor[:, -wide:]
    linked = solve_triangular(square[:wide], square[wide : 2 * wide].T, lower=True, check_finite=False)
    square[:wide], square[wide:] = -linked.T @ linked, 0.0
    return part, _Rest(square[row, col], -linked.T @ solved[-wide:])
