"""Least energy of many dense blocks: neighbours are joined, and unknowns that no other block shares are eliminated.

A direct solve from the inside out, in dense algebra only. Matrices are positive definite, or complex symmetric with a
real part that is after a turn: no pivots are looked for between blocks.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.int64]
Numbers = NDArray[Any]  # real or complex

HELD = 2  # unknowns 0 and 1 are none: their values are 0 and 1
_LEAF = 12  # blocks that are joined at once


@dataclass(frozen=True)
class Block:
    """An energy of some unknowns.

    Attributes
    ----------
    ids : (k,) array
        Numbers of the unknowns; one may occur twice.
    matrix : (k, k) array
        Symmetric.
    place : (2,) array
        Where it is, roughly.
    """

    ids: Whole
    matrix: Numbers
    place: NDArray[np.float64]


@dataclass(frozen=True)
class _Joined:
    """Blocks in one: each unknown once, and how many entries of it are in."""

    ids: Whole
    matrix: Numbers
    seen: Whole


def eliminated(matrix: Numbers, kept: int) -> tuple[Numbers, Numbers]:
    """Energy of the first ``kept`` unknowns at the best of the others, and the matrix that gives those."""
    mixed = matrix[kept:, :kept]
    others = -np.linalg.solve(matrix[kept:, kept:], mixed)
    return matrix[:kept, :kept] + mixed.T @ others, others


def added(size: int, parts: Iterable[tuple[Whole, Numbers]]) -> Numbers:
    """Sum (size, size) of matrices (..., k, k), each with the numbers (..., k) of its rows and columns."""
    places, values = zip(
        *(((at[..., :, None] * size + at[..., None, :]).ravel(), m.ravel()) for at, m in parts), strict=True
    )
    entries = np.concatenate(values)
    found = np.zeros(size * size, entries.dtype)
    np.add.at(found, np.concatenate(places), entries)
    return found.reshape(size, size)


def least(blocks: Sequence[Block], count: int) -> Numbers:
    """Values (count,) of all unknowns at which the sum of the energies is least, or stationary."""
    total = np.bincount(np.concatenate([b.ids for b in blocks]), minlength=count)
    total[:HELD] = np.iinfo(total.dtype).max
    steps: list[tuple[Whole, Whole, Numbers]] = []
    single = [_Joined(b.ids, b.matrix, np.ones_like(b.ids)) for b in blocks]
    _tree(single, np.array([b.place for b in blocks]), total, steps)
    values = np.zeros(count, dtype=np.result_type(*{b.matrix.dtype for b in blocks}))
    values[1] = 1.0
    for gone, kept, others in reversed(steps):
        values[gone] = others @ values[kept]
    return values


def _tree(
    blocks: list[_Joined], places: NDArray[np.float64], total: Whole, steps: list[tuple[Whole, Whole, Numbers]]
) -> _Joined:
    """Halves joined to one, each half's own unknowns gone before."""
    if len(blocks) > _LEAF:
        order = np.argsort(places[:, np.ptp(places, axis=0).argmax()], kind="stable")
        halves = order[: len(order) // 2], order[len(order) // 2 :]
        blocks = [_tree([blocks[k] for k in half], places[half], total, steps) for half in halves]
    joined = _sum(blocks)
    done = joined.seen == total[joined.ids]
    if not done.any():
        return joined
    turn = np.argsort(done, kind="stable")
    kept = len(done) - int(done.sum())
    matrix, others = eliminated(joined.matrix[turn[:, None], turn], kept)
    ids = joined.ids[turn]
    steps.append((ids[kept:], ids[:kept], others))
    return _Joined(ids[:kept], matrix, joined.seen[turn[:kept]])


def _sum(blocks: list[_Joined]) -> _Joined:
    ids, at = np.unique(np.concatenate([b.ids for b in blocks]), return_inverse=True)
    places = np.split(at, np.cumsum([len(b.ids) for b in blocks])[:-1])
    matrix = added(len(ids), zip(places, (b.matrix for b in blocks), strict=True))
    seen = np.bincount(at, np.concatenate([b.seen for b in blocks])).astype(np.int64)
    return _Joined(ids, matrix, seen)
