"""Printed lines of one electrode, as arrays."""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole


@dataclass(frozen=True, eq=False)
class StraightLines:
    """Straight pieces of printed lines, in the order in which they are printed.

    Attributes
    ----------
    start_m, end_m : (n, 2) array
        Middle of the line where the piece starts and ends, in plan [m].
    width_m, height_m : (n,) array
        Of the line [m].
    layer : (n,) array of int
        Number of its layer, from below [-].
    joined : (n,) array of bool
        Whether it goes on where the piece before it ended.
    """

    start_m: Real
    end_m: Real
    width_m: Real
    height_m: Real
    layer: Whole
    joined: Mask

    def __len__(self) -> int:
        """Number of pieces [-]."""
        return len(self.layer)

    def length_m(self) -> Real:
        """Length of each piece [m]."""
        return np.asarray(np.hypot(*(self.end_m - self.start_m).T))

    def direction(self) -> Real:
        """Unit vector along each piece, (n, 2) [-]."""
        return np.asarray((self.end_m - self.start_m) / self.length_m()[:, None])

    def goes_on(self) -> Mask:
        """Mask: true where another piece goes on where this one ends."""
        return np.append(self.joined[1:], False)

    def at(self, piece: Whole, share: Real) -> Real:
        """Places in plan, at a share of a piece's length, (m, 2) [m]."""
        return np.asarray(self.start_m[piece] + share[:, None] * (self.end_m - self.start_m)[piece])


_SAME = 1e-6  # shares of a piece's length nearer than this are one node
_SAME_M = 1e-9  # places nearer than this are one, but for rounding


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes along all pieces, piece after piece and in order along each.

    Attributes
    ----------
    key : (m,) array
        Twice the piece's number, and the share of its length; rising [-].
    number : (m,) array of int
        The node; two pieces that join share one.
    place_m : (k, 2) array
        Where each node lies in plan [m].
    """

    key: Real
    number: Whole
    place_m: Real

    @classmethod
    def of(cls, lines: StraightLines, places: tuple[Whole, Real]) -> "Nodes":
        """Nodes at the ends of all pieces and at further places (piece, share of its length)."""
        every = np.arange(len(lines))
        key = np.sort(np.concatenate([2.0 * every, 2.0 * every + 1.0, 2.0 * places[0] + np.clip(places[1], 0.0, 1.0)]))
        apart = np.append(True, np.diff(key) > _SAME) | (key % 1 == 0)
        key = key[apart]
        key = key[np.append(True, np.diff(key) > 0)]
        piece = (key // 2).astype(np.int64)
        close = (np.diff(key, append=np.inf) < _SAME) & (key % 2 != 0)  # a crossing just before the end
        key, piece = key[~close], piece[~close]
        first = np.append(True, np.diff(piece) > 0) & lines.joined[piece]
        number = np.cumsum(~first) - 1  # a joined piece starts at the node where the last one ended
        place = np.zeros((number[-1] + 1, 2))
        place[number] = lines.at(piece, key - 2.0 * piece)
        return cls(key, number, place)

    def weights(self, piece: Whole, share: Real) -> tuple[Whole, Real]:
        """The two nodes that a place lies between, (m, 2), and its weight on each; beyond a piece's ends too."""
        inside = 2.0 * piece + np.clip(share, _SAME / 2, 1.0 - _SAME / 2)
        after = np.searchsorted(self.key, inside)
        low, high = self.key[after - 1], self.key[after]
        t = (2.0 * piece + share - low) / (high - low)
        return np.stack([self.number[after - 1], self.number[after]], axis=1), np.stack([1.0 - t, t], axis=1)

    def within(self, piece: Whole, low: Real, high: Real) -> tuple[Whole, Real]:
        """Nodes of pieces between two shares of their lengths: which query each answers, and its share."""
        first = np.searchsorted(self.key, 2.0 * piece + np.clip(low, 0.0, 1.0), side="right")
        last = np.searchsorted(self.key, 2.0 * piece + np.clip(high, 0.0, 1.0), side="left")
        count = np.maximum(last - first, 0)
        query = np.repeat(np.arange(len(piece)), count)
        index = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[query]
        return query, self.key[index] - 2.0 * piece[query]

    def steps(self) -> tuple[Whole, Whole, Whole]:
        """Neighbours along each piece: the piece, and the places of both in the list of nodes."""
        piece = (self.key // 2).astype(np.int64)
        here = np.flatnonzero(piece[1:] == piece[:-1])
        return piece[here], here, here + 1


def interleaved(query: Whole, at: Real) -> tuple[Whole, Real, Real]:
    """Sorted places of each query, each once, and the length that each stands for (trapezoid rule)."""
    order = np.lexsort((at, query))
    query, at = query[order], at[order]
    apart = np.append(True, (np.diff(query) != 0) | (np.diff(at) > _SAME_M))[: len(at)]
    query, at = query[apart], at[apart]
    step = np.where(np.diff(query) == 0, np.diff(at), 0.0)
    return query, at, (np.append(step, 0.0) + np.append(0.0, step))[: len(at)] / 2
