"""Printed lines of one electrode, as arrays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Lines:
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

    start_m: Floats
    end_m: Floats
    width_m: Floats
    height_m: Floats
    layer: Ints
    joined: NDArray[np.bool_]

    def __len__(self) -> int:
        """Number of pieces [-]."""
        return len(self.layer)

    def length_m(self) -> Floats:
        """Length of each piece [m]."""
        return np.asarray(np.hypot(*(self.end_m - self.start_m).T))

    def direction(self) -> Floats:
        """Unit vector along each piece, (n, 2) [-]."""
        return np.asarray((self.end_m - self.start_m) / self.length_m()[:, None])

    def goes_on(self) -> NDArray[np.bool_]:
        """Whether another piece goes on where this one ends."""
        return np.append(self.joined[1:], False)

    def at(self, piece: Ints, share: Floats) -> Floats:
        """Places in plan, at a share of a piece's length, (m, 2) [m]."""
        return np.asarray(self.start_m[piece] + share[:, None] * (self.end_m - self.start_m)[piece])
