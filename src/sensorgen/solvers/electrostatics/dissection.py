"""Least energy of elements that share unknowns, by elimination from the inside out (nested dissection; George, 1973).

A block of boxes is halved until one box is left. Going back, two halves are added, and what no box outside shares is
eliminated by dense algebra. What remains at the end is one number: the energy at 1 V.
"""

from collections.abc import Callable
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
    load : (n, b) array, optional
        Forces on the unknowns, in place of a top at 1 V.
    """

    boxes: Ints
    keys: Ints
    held: NDArray[np.float64]
    one: NDArray[np.float64]
    energy: Callable[[int], Matrix]
    load: Matrix | None = None


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


@dataclass(frozen=True)
class _Front:
    """What a block of boxes looks like to those around it.

    ``keys`` (n,), those that no box outside shares first, of which there are ``inner``; ``shared`` (n,), by how many
    boxes of the block; ``energy`` (n, n).
    """

    keys: Ints
    shared: Ints
    inner: int
    energy: Matrix


def least(elements: Elements, keep: bool = False) -> Solution:
    """Eliminate all unknowns but the top electrode's; ``keep`` what finds them again."""
    free = np.isnan(elements.held)
    keys, counts = np.unique(elements.keys[free], return_counts=True)
    found = Solution()
    left = _Dissection(elements, free, keys, counts, found.steps if keep else None).outside(np.arange(len(free)))
    if left.keys.tolist() != [TOP]:
        raise ArithmeticError(f"{len(left.keys)} unknowns are left: this is a fault of the solver")
    found.energy = left.energy[0, 0]
    return found


@dataclass(frozen=True)
class _Dissection:
    elements: Elements
    free: NDArray[np.bool_]
    all_keys: Ints
    all_counts: Ints
    steps: list[tuple[Ints, Ints, Matrix]] | None

    def outside(self, block: Ints) -> _Front:
        """A block of boxes without the unknowns that no box outside it shares."""
        if len(block) == 1:
            return self._eliminated(self._sum([self._leaf(int(block[0]))]))
        return self._eliminated(self._sum([self.outside(half) for half in self._halves(block)]))

    def _leaf(self, box: int) -> _Front:
        energy, free = self.elements.energy(box), self.free[box]
        top = np.where(self.elements.held[box] == 1, self.elements.one, 0.0)
        keys, energy = self.elements.keys[box][free], (energy[free][:, free], energy)[int(top.any())]
        if top.any():
            keep = np.column_stack([np.eye(len(top))[:, free], top])
            keys, energy = np.append(keys, TOP), keep.T @ energy @ keep
        elif self.elements.load is not None:
            push = -self.elements.load[box][free, None]
            keys, energy = np.append(keys, TOP), np.block([[energy, push], [push.T, np.zeros((1, 1))]])
        return _Front(keys, np.ones_like(keys), 0, energy)

    def _halves(self, block: Ints) -> tuple[Ints, Ints]:
        """Two halves of a block, cut across its longest side."""
        places = self.elements.boxes[block]
        axis = int(np.ptp(places, axis=0).argmax())
        order = np.argsort(places[:, axis], kind="stable")
        edges = np.flatnonzero(np.diff(places[order, axis])) + 1
        cut = int(edges[np.abs(edges - len(block) / 2).argmin()])
        return block[order[:cut]], block[order[cut:]]

    def _sum(self, parts: list[_Front]) -> _Front:
        """Blocks as one, the unknowns that no box outside them shares first."""
        keys, at = np.unique(np.concatenate([p.keys for p in parts]), return_inverse=True)
        shared = np.bincount(at, np.concatenate([p.shared for p in parts])).astype(np.int64)
        total = self.all_counts[np.searchsorted(self.all_keys, keys).clip(max=len(self.all_keys) - 1)]
        outer = (shared < total) | (keys == TOP)
        order = np.argsort(outer, kind="stable")
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        energy = np.zeros((len(keys),) * 2, dtype=parts[0].energy.dtype)
        for part, here in zip(parts, np.split(place[at], [len(parts[0].keys)]), strict=False):
            energy[np.ix_(here, here)] += part.energy
        return _Front(keys[order], shared[order], int((~outer).sum()), energy)

    def _eliminated(self, front: _Front) -> _Front:
        n = front.inner
        if not n:
            return front
        inner, coupling, rest = front.energy[:n, :n], front.energy[:n, n:], front.energy[n:, n:]
        if self.steps is not None:
            self.steps.append((front.keys[:n], front.keys[n:], np.linalg.solve(inner, coupling)))
        return _Front(front.keys[n:], front.shared[n:], 0, rest - _taken(inner, coupling))


def _taken(inner: Matrix, coupling: Matrix) -> Matrix:
    """B^T A^-1 B: what elimination takes from the energy of the rest."""
    from scipy.linalg import solve_triangular

    if np.iscomplexobj(inner):
        found: Matrix = coupling.T @ np.linalg.solve(inner, coupling)
        return found
    half = solve_triangular(np.linalg.cholesky(inner), coupling, lower=True, check_finite=False)
    taken: Matrix = half.T @ half
    return taken


def unknowns_of(elements: Elements, values: dict[int, Any]) -> Matrix:
    """The unknowns of each box, (n, b), from all by their key."""
    found = np.where(elements.held == 1, elements.one, 0.0).astype(np.result_type(*values.values()))
    free = np.isnan(elements.held)
    found[free] = [values[k] for k in elements.keys[free].tolist()]
    return found
