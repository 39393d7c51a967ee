"""Least energy of dense blocks that share unknowns, eliminated inside out (nested dissection: George 1973).

Blocks are halved by their places until few are left. Going back, two halves are added, and unknowns that no other block
shares are eliminated by dense algebra. Matrices are positive definite, or complex symmetric with a real part that is
after a turn: no pivoting between blocks.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Whole

Numbers = NDArray[Any]  # real or complex

HELD = 2  # unknowns 0 and 1 have the values 0 and 1
_LEAF = 30  # blocks that are joined together


@dataclass(frozen=True)
class Block:
    """An energy of some unknowns.

    Attributes
    ----------
    ids : (k,) array
        Numbers of the unknowns; one may occur twice.
    matrix : (k, k) array, or a function that makes it
        Symmetric. A function where not all blocks fit into memory together.
    place : (d,) array
        Where it is, roughly.
    """

    ids: Whole
    matrix: Numbers | Callable[[], Numbers]
    place: NDArray[Any]


@dataclass
class EnergySolution:
    """The least energy, or the stationary one.

    Attributes
    ----------
    count : int
        Number of unknowns.
    energy : float or complex
        Of all blocks.
    steps : list of (eliminated unknowns, the others, matrix from the others)
        In turn; empty where values were not wanted.
    """

    count: int
    energy: Any = 0.0
    steps: list[tuple[Whole, Whole, Numbers]] = field(default_factory=list)

    def values(self) -> Numbers:
        """Of all unknowns (count,)."""
        values = np.zeros(self.count, np.result_type(self.energy, *(m.dtype for _, _, m in self.steps[:1])))
        values[1] = 1.0
        for gone, rest, others in reversed(self.steps):
            values[gone] = others @ values[rest]
        return values


@dataclass(frozen=True)
class _Joined:
    """Blocks in one: each unknown once, and how many entries of it are in."""

    ids: Whole
    matrix: Numbers
    seen: Whole


def eliminated(matrix: Numbers, count: int) -> tuple[Numbers, Numbers]:
    """Energy of the first ``count`` unknowns at the best of the others, and the matrix that gives those."""
    mixed = matrix[count:, :count]
    others = -np.linalg.solve(matrix[count:, count:], mixed)
    return matrix[:count, :count] + mixed.T @ others, others


def _condensed(matrix: Numbers, count: int) -> Numbers:
    """The first result of :func:`eliminated` alone, in half the time where it is real."""
    from scipy.linalg import solve_triangular

    if np.iscomplexobj(matrix):
        return eliminated(matrix, count)[0]
    factor = np.linalg.cholesky(matrix[count:, count:])
    half = solve_triangular(factor, matrix[count:, :count], lower=True, check_finite=False)
    return np.asarray(matrix[:count, :count] - half.T @ half)


def added(size: int, parts: Sequence[tuple[Whole, Numbers]]) -> Numbers:
    """Sum (size, size) of matrices (..., k, k), each with the numbers (..., k) of its rows and columns."""
    total = np.zeros(size * size, np.result_type(*(matrix.dtype for _, matrix in parts)))
    for at, matrix in parts:
        places = (at[..., :, None] * size + at[..., None, :]).ravel()
        if at.ndim == 1 and np.bincount(at).max() == 1:  # no place twice: a plain sum takes a seventh of the time
            total[places] += matrix.ravel()
        else:
            np.add.at(total, places, matrix.ravel())
    return total.reshape(size, size)


def least(blocks: Sequence[Block], count: int, *, leaf: int = _LEAF, keep: bool = True) -> EnergySolution:
    """Least energy of the sum of the blocks over ``count`` unknowns.

    Parameters
    ----------
    blocks : sequence of Block
        Energies.
    count : int
        Number of unknowns, the two of known value among them.
    leaf : int
        Blocks that are joined without halving; 1 where blocks are large.
    keep : bool
        Keep what is needed for the values of the unknowns.
    """
    total = np.bincount(np.concatenate([b.ids for b in blocks]), minlength=count)
    total[:HELD] = np.iinfo(total.dtype).max
    places, solution = np.array([b.place for b in blocks]), EnergySolution(count)

    def joined(which: Whole) -> _Joined:
        """Some blocks without the unknowns that no other block shares."""
        if len(which) > leaf:
            parts = [joined(half) for half in _halves(which, places[which])]
        else:
            leaves = [(b.ids, b.matrix() if callable(b.matrix) else b.matrix) for b in map(blocks.__getitem__, which)]
            parts = [_Joined(ids, matrix, np.ones_like(ids)) for ids, matrix in leaves]
        both, shared = _sum(parts, total)
        if shared == len(both.ids):
            return both
        if keep:
            matrix, others = eliminated(both.matrix, shared)
            solution.steps.append((both.ids[shared:], both.ids[:shared], others))
        else:
            matrix = _condensed(both.matrix, shared)
        return _Joined(both.ids[:shared], matrix, both.seen[:shared])

    left = joined(np.arange(len(blocks)))
    if (left.ids >= HELD).any():
        raise ArithmeticError(f"{(left.ids >= HELD).sum()} unknowns are left: this is a fault of the solver")
    at = np.flatnonzero(left.ids == 1)
    solution.energy = left.matrix[at, at].sum()
    return solution


def _halves(which: Whole, places: NDArray[Any]) -> tuple[Whole, Whole]:
    """Two halves of some blocks, cut across their longest side, between two places where they differ."""
    along = places[:, np.ptp(places, axis=0).argmax()]
    order = np.argsort(along, kind="stable")
    edges = np.flatnonzero(np.diff(along[order])) + 1
    middle = len(which) // 2
    cut = int(edges[np.abs(edges - len(which) / 2).argmin()]) if len(edges) else middle
    return which[order[:cut]], which[order[cut:]]


def _sum(parts: list[_Joined], total: Whole) -> tuple[_Joined, int]:
    """Parts in one, and how many of its unknowns other blocks share; these come first."""
    ids, at = np.unique(np.concatenate([p.ids for p in parts]), return_inverse=True)
    seen = np.bincount(at, np.concatenate([p.seen for p in parts])).astype(np.int64)
    done = seen == total[ids]
    order = np.argsort(done, kind="stable")
    turned = np.empty_like(order)
    turned[order] = np.arange(len(order))
    places = np.split(turned[at], np.cumsum([len(p.ids) for p in parts])[:-1])
    ids, seen, shared = ids[order], seen[order], len(ids) - int(done.sum())
    matrix = added(len(ids), [(place, part.matrix) for place, part in zip(places, parts, strict=True)])
    return _Joined(ids, matrix, seen), shared
