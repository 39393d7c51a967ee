"""Networks of resistors, which several programs of the tests lead their fields back to."""

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import cg, spsolve

MOST = 20_000  # nodes that are solved without iterations


def potentials(one, other, siemens, held):
    """Potentials of the nodes, and the current that each takes from outside.

    Parameters
    ----------
    one, other, siemens : (k,) arrays
        Ends and conductances of the resistors.
    held : (n,) array
        Potentials, nan where a node is free.
    """
    off = coo_array((siemens, (one, other)), shape=(len(held),) * 2).tocsr()
    off = off + off.T
    matrix = (diags_array(off.sum(1)) - off).tocsr()
    u = np.where(np.isnan(held), 0, held).astype(off.dtype)
    free = np.isnan(held) & (matrix.diagonal() != 0)
    inner, right = matrix[free][:, free], -(matrix @ u)[free]
    if free.sum() < MOST:
        u[free] = spsolve(inner.tocsc(), right)
    else:
        u[free], info = cg(inner, right, rtol=1e-8, M=diags_array(1 / inner.diagonal()), maxiter=5000)
        assert info == 0
    return u, matrix @ u


def sides(of, axis):
    """Values of a grid before and behind each face across an axis."""
    return (np.delete(of, end, axis).ravel() for end in (-1, 0))


def ladder(r, y, length, cells):
    """Resistors (end, other end, conductance) of tracks with films between them; node n cell + k is of track k of n."""
    n, step = len(r), length / cells
    for cell in range(cells + 1):
        for k in range(n - 1):
            yield n * cell + k, n * cell + k + 1, y[k] * step * (0.5 if cell in (0, cells) else 1.0)
        for k in range(n if cell < cells else 0):
            yield n * cell + k, n * (cell + 1) + k, 1 / (r[k] * step)
