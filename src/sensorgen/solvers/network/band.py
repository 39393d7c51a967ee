"""Product of two vectors with the inverse of a network's matrix, by a sparse factor; by multigrid where that is large.

Multigrid is PyAMG's smoothed aggregation (Vanek, Mandel, Brezina, Computing 1996, 56, 179).
"""

from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_HARDLY = "these lines are hardly connected: expected contacts that conduct as lines do, or not at all"
_MOST = 300_000  # unknowns of a factor; beyond, multigrid is quicker
_STRONG = 0.02  # links of this share of both nodes' own conductance join them
_COARSEST = 2000  # unknowns that a sparse factor solves at once
_RESIDUAL = 1e-11  # of the right-hand side at which iterations end
_ITERATIONS = 300


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
    >>> round(product(csr_array([[2.0, -1.0], [-1.0, 2.0]]), np.array([1.0, 0.0]), np.array([0.0, 3.0])), 12)
    1.0
    """
    try:
        found = _by_multigrid(matrix, other) if len(one) > _MOST else None
        return float(one @ (_by_factor(matrix, other) if found is None else found))
    except RuntimeError as error:  # exactly singular
        raise OutOfRange(_HARDLY) from error


def _by_multigrid(matrix: "csr_array[np.float64]", right: Real) -> Real | None:
    """Solution, or None where iterations do not converge."""
    import pyamg

    # Weights of the interpolation by rows: an estimate of the largest eigenvalue would begin with random numbers
    levels = pyamg.smoothed_aggregation_solver(
        matrix,
        strength=("symmetric", {"theta": _STRONG}),
        smooth=("jacobi", {"omega": 4 / 3, "weighting": "local"}),
        max_coarse=_COARSEST,
        coarse_solver="splu",
    )
    found, failed = levels.solve(right, tol=_RESIDUAL, maxiter=_ITERATIONS, accel="cg", return_info=True)
    return None if failed else found


def _by_factor(matrix: "csr_array[np.float64]", right: Real) -> Real:
    from scipy.sparse.linalg import splu

    # Columns one by one: so sparse a factor has no panels worth their room
    how = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}, "diag_pivot_thresh": 0.0}
    factor = splu(matrix.tocsc(), panel_size=1, **how)
    if not factor.U.diagonal().min() > 0:
        raise OutOfRange(_HARDLY)
    solution: Real = factor.solve(right)
    return solution
