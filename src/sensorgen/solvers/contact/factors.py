"""Solution of symmetric sparse systems: LU of planar meshes, multifrontal Cholesky factors of solid ones.

For the latter, blocks of unknowns are halved along planes; what lies on a plane is eliminated after both halves, by
dense algebra (nested dissection and fronts: George 1973; Duff and Reid 1983). The order serves as long as the pattern
stays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations_with_replacement, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import SuperLU, splu

from sensorgen.core.arrays import Mask, Real, Whole

_Short = NDArray[np.float32]
_PIVOT = 1e-3  # share of its column below which a pivot of an indefinite matrix is exchanged [-]
_LEAST = 100  # unknowns that are not halved any more
_MOST_TURNS = 30  # of conjugate gradients, before new factors are made
_FEW_TURNS = 10  # from which on they have to be as fast as the most turns need
_ENOUGH = 1e-4  # residual over right side: Newton's method takes the rest away [-]


# columns one by one (relax, panel_size): the factors are too sparse for panels to pay
_SPARSE = {"options": {"SymmetricMode": True}, "relax": 1, "panel_size": 1}
_MINIMUM_DEGREE = "MMD_AT_PLUS_A"


def solved_by_lu(matrix: csr_matrix, right: Real) -> Real:
    """Solution of a symmetric positive system.

    Raises
    ------
    RuntimeError
        The matrix is exactly singular.
    """
    solution: Real = splu(matrix.tocsc(), permc_spec=_MINIMUM_DEGREE, diag_pivot_thresh=0.0, **_SPARSE).solve(right)
    return solution


@dataclass
class Lu:
    """Systems that are symmetric but may be indefinite, by factors that are kept while the matrix stays the same.

    Unknowns are eliminated as they are numbered: :func:`elimination_order` numbers them so that factors stay sparse.
    """

    _last: tuple[csr_matrix, SuperLU] | None = field(default=None, repr=False)

    def __call__(self, matrix: csr_matrix, right: Real) -> Real | None:
        """Solution, or None where the matrix is singular."""
        if not (self._last and self._last[0] is matrix):
            try:
                factors = splu(matrix.T, permc_spec="NATURAL", diag_pivot_thresh=_PIVOT, **_SPARSE)
            except RuntimeError:
                return None
            self._last = matrix, factors
        solution: Real = self._last[1].solve(right)
        return solution


def elimination_order(pattern: csr_matrix) -> Whole:
    """Unknowns of a symmetric matrix (n,) in an order that keeps its factors sparse, by minimum degree.

    Only the pattern is used: to number them so once takes a third off each factorisation of matrices like it.
    """
    dominant = csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr), pattern.shape)
    dominant.setdiag(float(pattern.nnz))
    return np.argsort(splu(dominant.tocsc(), permc_spec=_MINIMUM_DEGREE, diag_pivot_thresh=0.0, **_SPARSE).perm_c)


@dataclass(frozen=True)
class FrontalMatrix:
    """Unknowns that are eliminated together.

    Attributes
    ----------
    start, stop : int
        Which, in the order of elimination.
    outer : (k,) array
        Those after them that they are coupled with, also through what went before.
    children : tuple of int
        Fronts whose rest is added to this one.
    """

    start: int
    stop: int
    outer: Whole
    children: tuple[int, ...]

    def local(self, numbers: Whole) -> Whole:
        """Where some unknowns, its own or outer ones, lie in it."""
        inside = self.stop - self.start
        return np.where(numbers < self.stop, numbers - self.start, inside + np.searchsorted(self.outer, numbers))


@dataclass(frozen=True)
class Order:
    """In what order unknowns are eliminated, and in which fronts."""

    turn: Whole
    fronts: list[FrontalMatrix]


def order_of(matrix: csr_matrix, places: Whole) -> Order:
    """Nested dissection of the unknowns of a matrix.

    Parameters
    ----------
    matrix : sparse (n, n)
        Symmetric, of which only the pattern is used.
    places : (n, 3) array
        Of each unknown; blocks are cut at even places.
    """
    pieces: list[tuple[Whole, tuple[int, ...]]] = []
    pattern = matrix.tocsr(copy=True)
    pattern.data = np.ones_like(pattern.data)  # values may cancel
    _dissected(pattern, places, np.arange(len(places)), pieces)
    turn = np.concatenate([own for own, _ in pieces])
    ends = np.cumsum([len(own) for own, _ in pieces])
    turned = matrix[turn][:, turn]
    fronts: list[FrontalMatrix] = []
    coupled = np.zeros(len(turn), bool)
    for (own, children), stop in zip(pieces, ends.tolist(), strict=True):
        start = stop - len(own)
        near = [turned.indices[turned.indptr[start] : turned.indptr[stop]], *(fronts[c].outer for c in children)]
        coupled[np.concatenate(near)] = True
        fronts.append(FrontalMatrix(start, stop, stop + np.flatnonzero(coupled[stop:]), children))
        coupled[:] = False
    return Order(turn, fronts)


def _dissected(pattern: csr_matrix, places: Whole, block: Whole, pieces: list[tuple[Whole, tuple[int, ...]]]) -> int:
    """Put a block's pieces into a list, what is eliminated first before the rest; the number of its last one."""
    cut = _cut(places[block]) if len(block) > _LEAST else None
    if cut is None:
        pieces.append((block, ()))
        return len(pieces) - 1
    beyond = np.zeros(len(places), bool)
    beyond[block[~cut]] = True
    left = block[cut]
    touches = pattern[left] @ beyond.astype(float) != 0
    children = tuple(_dissected(pattern, places, half, pieces) for half in (left[~touches], block[~cut]) if len(half))
    pieces.append((left[touches], children))
    return len(pieces) - 1


def _cut(places: Whole) -> Mask | None:
    """The lower part of a block cut across its longest side at the even place nearest to the middle; or None."""
    for axis in np.argsort(-np.ptp(places, axis=0), kind="stable"):
        here = places[:, axis]
        even = np.unique(here[here % 2 == 0])
        even = even[(even >= here.min()) & (even < here.max())]
        if even.size:
            below = np.array([(here <= e).mean() for e in even])
            return np.asarray(here <= even[np.abs(below - 0.5).argmin()])
    return None


@dataclass(frozen=True)
class Factors:
    """Of a positive matrix: of each front the inverse of its own triangle, and what couples it to the rest.

    Of seven digits: conjugate gradients take as many turns with them, and reading them is most of a turn's time.
    """

    order: Order
    parts: list[tuple[_Short, _Short]]

    def solve(self, right: Real) -> Real:
        """Solution of a right side, to some digits."""
        x = right[self.order.turn].astype(np.float32)
        for front, (inverse, coupling) in zip(self.order.fronts, self.parts, strict=True):
            own = x[front.start : front.stop] = inverse @ x[front.start : front.stop]
            x[front.outer] -= own @ coupling
        for front, (inverse, coupling) in zip(reversed(self.order.fronts), reversed(self.parts), strict=True):
            own = x[front.start : front.stop] - coupling @ x[front.outer]
            x[front.start : front.stop] = own @ inverse
        solution = np.empty(len(x))
        solution[self.order.turn] = x
        return solution


def factored(matrix: csr_matrix, order: Order) -> Factors | None:
    """Factors of a matrix, or None where it is not positive; of single precision where this shows that it is."""
    turned = matrix[order.turn][:, order.turn].tocsr()
    return _factored(turned, order, np.float32) or _factored(turned, order, np.float64)


def _factored(turned: csr_matrix, order: Order, kind: type[np.floating]) -> Factors | None:
    """Factors of a matrix in the order of elimination, worked out in numbers of some kind."""
    from scipy.linalg import lapack

    cholesky, inverted = lapack.get_lapack_funcs(("potrf", "trtri"), dtype=kind)
    rests: dict[int, Real] = {}
    parts: list[tuple[_Short, _Short]] = []
    for number, front in enumerate(order.fronts):
        n = front.stop - front.start
        whole = np.zeros((n + len(front.outer),) * 2, kind)  # its own entries, and what its children leave
        low, high = turned.indptr[front.start], turned.indptr[front.stop]
        rows = np.repeat(np.arange(n), np.diff(turned.indptr[front.start : front.stop + 1]))
        columns = turned.indices[low:high]
        later = columns >= front.start
        whole[rows[later], front.local(columns[later])] = turned.data[low:high][later]
        for child in front.children:
            at, rest = front.local(order.fronts[child].outer), rests.pop(child)
            ends = np.flatnonzero(np.diff(at, prepend=-2, append=-2) != 1).tolist()
            runs = [(slice(a, b), slice(place := int(at[a]), place + b - a)) for a, b in pairwise(ends)]
            for (i, here), (j, there) in combinations_with_replacement(runs, 2):  # the upper triangle: no other is used
                whole[here, there] += rest[i, j]
        upper, failed = cholesky(whole[:n, :n], clean=True)
        if failed:
            return None
        inverse = inverted(upper)[0].T if n else upper
        coupling = inverse @ whole[:n, n:]
        parts.append((inverse.astype(np.float32), coupling.astype(np.float32)))
        rests[number] = whole[n:, n:] - coupling.T @ coupling
    return Factors(order, parts)


@dataclass
class Solver:
    """Conjugate gradients, preconditioned by the factors of an earlier matrix while these serve.

    Attributes
    ----------
    places : (n, 3) array
        Of the unknowns, as for :func:`order_of`.
    enough : float
        Residual over right side that is small enough [-].
    """

    places: Whole
    enough: float = _ENOUGH
    _factors: Factors | None = field(default=None, repr=False)
    _last: tuple[Whole, Order] | None = field(default=None, repr=False)  # indices of a pattern, and its order

    def __call__(self, matrix: csr_matrix, right: Real) -> Real | None:
        """Solution of a positive system, or None where it is not."""
        solution = self._iterated(matrix, right)
        if solution is None:
            if not (self._last and np.may_share_memory(self._last[0], matrix.indices)):
                self._last = matrix.indices, order_of(matrix, self.places)
            self._factors = factored(matrix, self._last[1])
            solution = self._iterated(matrix, right)
        return solution

    def _iterated(self, matrix: csr_matrix, right: Real) -> Real | None:
        if self._factors is None:
            return None
        for turn, (solution, residual, _) in enumerate(iterations(matrix, right, self._factors), 1):
            left = np.abs(residual).max() / np.abs(right).max()
            if left < self.enough:
                return solution
            if turn >= _FEW_TURNS and left > self.enough ** (turn / _MOST_TURNS):
                break
        return None


def iterations(matrix: csr_matrix, right: Real, factors: Factors) -> Iterator[tuple[Real, Real, float]]:
    """Solution, residual and its energy in the factors' norm, turn by turn, while these serve."""
    solution, residual = np.zeros_like(right), right.copy()
    direction, power = np.zeros_like(right), 1.0
    for _ in range(_MOST_TURNS):
        way = factors.solve(residual)
        before, power = power, float(residual @ way)
        if not (np.isfinite(power) and power > 0):
            return
        direction = way + power / before * direction
        pushed = matrix @ direction
        bearing = float(direction @ pushed)
        if not bearing > 0:
            return
        share = power / bearing
        solution, residual = solution + share * direction, residual - share * pushed
        yield solution, residual, power
