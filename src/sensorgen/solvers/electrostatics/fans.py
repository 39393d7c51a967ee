"""The triangles around each corner, in turn; points at which two pieces only touch, as two corners."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

Triangle = tuple[int, int, int]


@dataclass(frozen=True)
class Fan:
    """Triangles that meet at a corner, counter-clockwise.

    Attributes
    ----------
    members : list of int
        Their numbers.
    spokes : list of int
        Other ends of the edges that meet there; one more than members, unless the fan is closed.
    """

    members: list[int]
    spokes: list[int]

    @property
    def closed(self) -> bool:
        """Whether it goes all around the corner."""
        return len(self.members) == len(self.spokes)


def fans(triangles: Sequence[Triangle]) -> dict[int, list[Fan]]:
    """Of each corner, its fans; more than one where pieces touch at a point only."""
    around: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
    for number, (a, b, c) in enumerate(triangles):
        around[a][b], around[b][c], around[c][a] = (number, c), (number, a), (number, b)
    return {corner: _fans(by_first) for corner, by_first in around.items()}


def _fans(by_first: dict[int, tuple[int, int]]) -> list[Fan]:
    """From each triangle's first spoke, with its number and last spoke."""
    lasts = {last for _, last in by_first.values()}
    found = []
    for start in [first for first in by_first if first not in lasts] or [next(iter(by_first))]:
        fan, spoke = Fan([], []), start
        while spoke in by_first and not (fan.spokes and spoke == start):
            fan.spokes.append(spoke)
            number, spoke = by_first[spoke]
            fan.members.append(number)
        if spoke != start:
            fan.spokes.append(spoke)
        found.append(fan)
    return found
