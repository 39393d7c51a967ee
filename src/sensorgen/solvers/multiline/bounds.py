"""How well force and position can be told at all from noisy readings (Cramer and Rao)."""

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]

_UNRELATED = 1e-12  # of the largest: singular values below it are rounding, and what they stand for is not told


def standard_errors(slopes: NDArray[np.complex128], noise: Real) -> Real:
    r"""Smallest standard errors of an unbiased estimate, none of the quantities being known beforehand.

    .. math:: \sigma_a^2 = (F^{-1})_{aa}, \quad
              F_{ab} = \sum_k \frac{\mathrm{Re}(\overline{s_{ak}}\, s_{bk})}{\sigma_k^2}

    Parameters
    ----------
    slopes : (quantities, readings) complex array
        Derivatives of each reading [ohm per the quantity's unit].
    noise : (readings,) array
        Standard deviation of the real and of the imaginary part of each reading, independent and normal [ohm].

    Returns
    -------
    (quantities,) array
        Standard errors, in the quantities' units; inf where the readings do not tell them apart.

    Examples
    --------
    One real reading that rises by 2 ohm/N, with 0.1 ohm of noise:

    >>> standard_errors(np.array([[2.0 + 0j]]), np.array([0.1])).tolist()
    [0.05]
    """
    weighted = slopes / noise
    jacobian = np.concatenate([weighted.real, weighted.imag], axis=1).T
    size = np.linalg.norm(jacobian, axis=0)
    _, values, rows = np.linalg.svd(jacobian / np.where(size > 0, size, 1.0), full_matrices=False)
    told = values > _UNRELATED * values.max(initial=0.0)
    spread = np.where(told[:, None], rows / np.where(told, values, 1.0)[:, None], 0.0)
    errors = np.linalg.norm(spread, axis=0) / np.where(size > 0, size, 1.0)
    untold = np.linalg.norm(rows[~told], axis=0) > np.sqrt(_UNRELATED)
    missing = len(rows) < len(size)
    return np.where(untold | (size == 0) | missing, np.inf, errors)
