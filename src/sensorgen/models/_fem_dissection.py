"""Least energy of elements that share unknowns, by elimination from the inside out (nested dissection; George, 1973).

A block of boxes is halved until one box is left. Going back, two halves are added, and what no box outside shares is
eliminated at once, by dense algebra. What remains at the end is one number: the energy at 1 V.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

TOP = -1  # the unknown that stands for the electrode at 1 V

Ints = NDArray[np.int64]
Matrix = NDArray[Any]


@dataclass(frozen=True)
class Elements:
    """Boxes of a grid, and the unknowns of each.

    Attributes
    ----------
    boxes : (n, 3) array
        Which box of the grid each is, along x, y and z.
    keys : (n, b) array
        Unknowns, equal where boxes share them.
    held : (n, b) array
        1 and 0 for unknowns on the top and on the bottom electrode, NaN for free ones.
    one : (b,) array
        The unknowns of a potential of 1.
    energy : callable
        From a box's number to its (b, b) matrix.
    """

    boxes: Ints
    keys: Ints
    held: NDArray[np.float64]
    one: NDArray[np.float64]
    energy: Callable[[int], Matrix]


@dataclass
class Solution:
    """The least energy, and what it takes to find the unknowns.

    Attributes
    ----------
    energy : float or complex
        At 1 V.
    steps : list
        What was eliminated, in turn, if it was to be kept.
    """

    energy: Any = 0.0
    steps: list[tuple[Ints, Ints, Matrix]] = field(default_factory=list)

    def values(self) -> dict[int, Any]:
        """All free unknowns at 1 V, by their key."""
        found: dict[int, Any] = {TOP: 1.0}
        for gone, left, matrix in reversed(self.steps):
            here = -(matrix @ np.array([found[k] for k in left.tolist()]))
            found.update(zip(gone.tolist(), here.tolist(), strict=True))
        return found


_Front = tuple[Ints, Ints, Matrix]  # keys, how many boxes of the block share each, energy


def least(elements: Elements, keep: bool = False) -> Solution:
    """Eliminate all unknowns but the top electrode's; ``keep`` what finds them again."""
    free = np.isnan(elements.held)
    keys, counts = np.unique(elements.keys[free], return_counts=True)
    found = Solution()
    block = _Dissection(elements, free, keys, counts, found.steps if keep else None)
    left, _, energy = block.front(np.arange(len(elements.boxes)))
    if left.tolist() != [TOP]:
        raise ArithmeticError(f"{len(left)} unknowns are left: this is a fault of the solver")
    found.energy = energy[0, 0]
    return found


@dataclass(frozen=True)
class _Dissection:
    elements: Elements
    free: NDArray[np.bool_]
    all_keys: Ints
    all_counts: Ints
    steps: list[tuple[Ints, Ints, Matrix]] | None

    def front(self, block: Ints) -> _Front:
        """What a block of boxes looks like to those around it."""
        if len(block) == 1:
            return self._eliminated(self._leaf(int(block[0])))
        first, second = self._halves(block)
        return self._eliminated(_added(self.front(first), self.front(second)))

    def _leaf(self, box: int) -> _Front:
        energy, free = self.elements.energy(box), self.free[box]
        top = np.where(self.elements.held[box] == 1, self.elements.one, 0.0)
        keys = self.elements.keys[box][free]
        if not top.any():
            return keys, np.ones_like(keys), energy[np.ix_(free, free)]
        keep = np.column_stack([top, np.eye(len(top))[:, free]])
        return np.concatenate([[TOP], keys]), np.ones(len(keys) + 1, dtype=np.int64), keep.T @ energy @ keep

    def _halves(self, block: Ints) -> tuple[Ints, Ints]:
        """Two halves of a block, cut across its longest side."""
        places = self.elements.boxes[block]
        axis = int(np.ptp(places, axis=0).argmax())
        order = np.argsort(places[:, axis], kind="stable")
        along = places[order, axis]
        edges = np.flatnonzero(np.diff(along)) + 1
        cut = int(edges[np.abs(edges - len(block) / 2).argmin()])
        return block[order[:cut]], block[order[cut:]]

    def _eliminated(self, front: _Front) -> _Front:
        """A block without the unknowns that no box outside it shares."""
        keys, shared, energy = front
        total = self.all_counts[np.searchsorted(self.all_keys, keys).clip(max=len(self.all_keys) - 1)]
        gone = (shared == total) & (keys != TOP)
        if not gone.any():
            return front
        left = ~gone
        inner, coupling = energy[np.ix_(gone, gone)], energy[np.ix_(gone, left)]
        rest = energy[np.ix_(left, left)]
        if self.steps is not None:
            self.steps.append((keys[gone], keys[left], np.linalg.solve(inner, coupling)))
        return keys[left], shared[left], rest - _taken(inner, coupling)


def _taken(inner: Matrix, coupling: Matrix) -> Matrix:
    """B^T A^-1 B: what elimination takes from the energy of the rest."""
    from scipy.linalg import solve_triangular

    if np.iscomplexobj(inner):
        found: Matrix = coupling.T @ np.linalg.solve(inner, coupling)
        return found
    half = solve_triangular(np.linalg.cholesky(inner), coupling, lower=True, check_finite=False, overwrite_b=True)
    return half.T @ half


def _added(first: _Front, second: _Front) -> _Front:
    """Two blocks as one."""
    keys, at = np.unique(np.concatenate([first[0], second[0]]), return_inverse=True)
    energy = np.zeros((len(keys),) * 2, dtype=np.result_type(first[2], second[2]))
    shared = np.zeros(len(keys), dtype=np.int64)
    for (_, count, part), here in zip((first, second), np.split(at, [len(first[0])]), strict=True):
        shared[here] += count
        energy[np.ix_(here, here)] += part
    return keys, shared, energy


def energies_of(elements: Elements, values: dict[int, Any], weights: Sequence[float]) -> Any:
    """Energy of all boxes at given unknowns, each counted by its weight."""
    total: Any = 0.0
    for box, weight in enumerate(weights):
        if weight:
            here = np.where(elements.held[box] == 1, elements.one, 0.0).astype(object)
            free = np.isnan(elements.held[box])
            here[free] = [values[k] for k in elements.keys[box][free].tolist()]
            field_here = here.astype(complex if any(isinstance(v, complex) for v in here) else float)
            total += weight * (field_here @ elements.energy(box) @ field_here)
    return total
