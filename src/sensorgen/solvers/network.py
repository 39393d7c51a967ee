"""Network of extruded lines: nodes on them, resistors along each line and across every contact, and its solution.

The solution is by a sparse factor; by multigrid where that is large, PyAMG's smoothed aggregation (Vanek, Mandel,
Brezina, Computing 1996, 56, 179).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import OutOfRange

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_PARALLEL = np.cos(np.radians(20.0))
_REACH = 1.3  # lines whose middles are further apart than this many mean widths do not touch
_BEVEL = _REACH * _PARALLEL / np.sqrt(1 - _PARALLEL**2)  # neighbours end no further apart, in widths, on one wall
_LONG = 5.0  # widths; shorter stretches are turns of infill
_STACKED = 0.25  # parallel lines lie on each other when their middles differ by less, in mean widths
_SAME = 1e-6  # shares of a piece's length nearer than this are one node
_SAME_M = 1e-9  # places nearer than this are one, but for rounding
_HARDLY = "these lines are hardly connected: expected contacts that conduct as lines do, or not at all"
_MOST = 300_000  # unknowns of a factor; beyond, multigrid is quicker
_STRONG = 0.02  # links of this share of both nodes' own conductance join them
_COARSEST = 2000  # unknowns that a sparse factor solves at once
_RESIDUAL = 1e-11  # of the right-hand side at which iterations end
_ITERATIONS = 300


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

    def at(self, piece: Whole, share: Real) -> Real:
        """Places in plan, at a share of a piece's length, (m, 2) [m]."""
        return np.asarray(self.start_m[piece] + share[:, None] * (self.end_m - self.start_m)[piece])


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


@dataclass(frozen=True, eq=False)
class Links:
    """Resistors, each over four nodes.

    Attributes
    ----------
    node : (m, 4) array of int
        Nodes.
    weight : (m, 4) array
        By which their potentials make the voltage across the resistor [-].
    area_m2, path_m : (m,) array
        Its cross-section, and how far the current goes through bulk [m2, m].
    contacts : (m,) array
        Contacts on the way: 0 along a line, else 1 [-].
    """

    node: Whole
    weight: Real
    area_m2: Real
    path_m: Real
    contacts: Real

    def conductance_s(self, resistivity_ohm_m: float, contact_ohm_m2: float) -> Real:
        """Conductance of each resistor [S]."""
        contact = np.where(self.contacts > 0, contact_ohm_m2, 0.0)
        return np.asarray(self.area_m2 / (resistivity_ohm_m * self.path_m + contact))

    def matrix(self, conductance_s: Real, nodes: int) -> "csr_array[np.float64]":
        """Currents that flow from all nodes at their potentials, (nodes, nodes) [S].

        Parameters
        ----------
        conductance_s : (m,) array
            Of each resistor [S].
        nodes : int
            How many there are [-].
        """
        from scipy.sparse import csr_array

        used = self.weight != 0
        ends = np.append(0, np.cumsum(used.sum(axis=1)))
        voltages = csr_array((self.weight[used], self.node[used], ends), shape=(len(self.node), nodes))
        currents = voltages.copy()
        currents.data *= np.repeat(conductance_s, np.diff(ends))
        matrix = csr_array(voltages.T.tocsr() @ currents)
        matrix.eliminate_zeros()
        return matrix

    @classmethod
    def between(
        cls, nodes: Nodes, one: tuple[Whole, Real], other: tuple[Whole, Real], area_m2: Real, path_m: Real
    ) -> "Links":
        """Contacts between places of two pieces each (piece, share of its length)."""
        (a, wa), (b, wb) = nodes.weights(*one), nodes.weights(*other)
        return cls(np.hstack([a, b]), np.hstack([wa, -wb]), area_m2, path_m, np.ones(len(area_m2)))


@dataclass(frozen=True, eq=False)
class LineCrossings:
    """Where lines of neighbouring layers cross: both pieces, the shares of their lengths, and the sine between them."""

    one: Whole
    other: Whole
    share_one: Real
    share_other: Real
    sine: Real

    def places(self) -> tuple[Whole, Real]:
        """All of them as (piece, share of its length)."""
        return np.concatenate([self.one, self.other]), np.concatenate([self.share_one, self.share_other])


def near(lines: StraightLines) -> tuple[Whole, Whole]:
    """Pairs of pieces, of one layer or of neighbouring ones, that may touch: within two widths; the lower number first.

    Layers are drawn beside each other, so that a search in the plane finds the pairs of one layer, and, each moved on
    by one, those with the layer above.
    """
    import shapely

    far, ends = 2.0 * float(lines.width_m.max()), np.stack([lines.start_m, lines.end_m], axis=1)
    aside = np.zeros((len(lines), 1, 2))
    aside[:, 0, 0] = (np.ptp(ends[..., 0]) + 2 * far) * (lines.layer - lines.layer.min())
    above = [np.ptp(ends[..., 0]) + 2 * far, 0.0]
    tree = shapely.STRtree(shapely.linestrings(ends + aside))
    both = [shapely.linestrings(ends + aside + shift) for shift in (0.0, above)]
    pairs = np.concatenate([tree.query(one, predicate="dwithin", distance=far) for one in both], axis=1)
    low, high = np.sort(pairs[:, pairs[0] != pairs[1]], axis=0)
    number = np.sort(low * len(lines) + high)
    number = number[np.append(True, np.diff(number) > 0)[: len(number)]]
    return number // len(lines), number % len(lines)


def crossings(lines: StraightLines, pairs: tuple[Whole, Whole]) -> LineCrossings:
    """Pairs in neighbouring layers that cross at an angle."""
    i, j = pairs
    apart = lines.layer[i] != lines.layer[j]
    i, j = i[apart], j[apart]
    d = lines.end_m - lines.start_m
    sine = _cross(lines.direction()[i], lines.direction()[j])
    steep = np.abs(sine) > np.sqrt(1 - _PARALLEL**2)
    i, j, sine = i[steep], j[steep], sine[steep]
    gap, turn = lines.start_m[j] - lines.start_m[i], _cross(d[i], d[j])
    s, t = _cross(gap, d[j]) / turn, _cross(gap, d[i]) / turn
    hit = (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    return LineCrossings(i[hit], j[hit], s[hit], t[hit], np.abs(sine[hit]))


def gathered(lines: StraightLines, nodes: Nodes, pairs: tuple[Whole, Whole], crossed: LineCrossings) -> Links:
    """All resistors."""
    ends = _Ends(lines, pairs)
    neighbours = _alongside(lines, pairs, same_layer=True)
    kinds = [
        _along(lines, nodes, neighbours), _over(lines, nodes, crossed), _beside(lines, nodes, neighbours, ends),
        _stacked(lines, nodes, _alongside(lines, pairs, same_layer=False)), ends.links(nodes),
    ]  # fmt: skip
    return Links(*(np.concatenate([getattr(k, name) for k in kinds]) for name in Links.__dataclass_fields__))


class _Alongside(NamedTuple):
    """Parallel pairs with a common stretch: both pieces, their distance, and the stretch along the first [m]."""

    one: Whole
    other: Whole
    away_m: Real
    low_m: Real
    high_m: Real


def _along(lines: StraightLines, nodes: Nodes, neighbours: _Alongside) -> Links:
    piece, a, b = nodes.steps()
    length = (nodes.key[b] - nodes.key[a]) * lines.length_m()[piece]
    node = np.stack([nodes.number[a], nodes.number[b]] * 2, axis=1)
    weight = np.tile([1.0, -1.0, 0.0, 0.0], (len(piece), 1))
    area = (_own_width_m(lines, neighbours) * lines.height_m)[piece]
    return Links(node, weight, area, length, np.zeros(len(piece)))


def _own_width_m(lines: StraightLines, neighbours: _Alongside) -> Real:
    """Width of each piece without half of what long neighbours overlap: one place conducts once [m]."""
    i, j, away, low, high = neighbours
    mean, stretch = (lines.width_m[i] + lines.width_m[j]) / 2, high - low
    over = np.where((stretch > _LONG * mean) & (away > _STACKED * mean), np.maximum(mean - away, 0.0), 0.0)
    lost = np.zeros(len(lines))
    for piece in (i, j):
        np.add.at(lost, piece, over / 2 * stretch / lines.length_m()[piece])
    return np.maximum(lines.width_m - lost, lines.width_m / 4)


def _over(lines: StraightLines, nodes: Nodes, c: LineCrossings) -> Links:
    area = lines.width_m[c.one] * lines.width_m[c.other] / c.sine
    path = (lines.height_m[c.one] + lines.height_m[c.other]) / 2
    return Links.between(nodes, (c.one, c.share_one), (c.other, c.share_other), area, path)


def _beside(lines: StraightLines, nodes: Nodes, neighbours: _Alongside, ends: "_Ends") -> Links:
    """Lines of one layer that run side by side."""
    i, j, away, _, _ = neighbours
    mean = (lines.width_m[i] + lines.width_m[j]) / 2
    fits = (away > _STACKED * mean) & (away < _REACH * mean)
    i, j, away = i[fits], j[fits], away[fits]
    low, high = ends.widened(i, j)
    fits = high > low
    i, j, away, low, high = i[fits], j[fits], away[fits], low[fits], high[fits]
    height = np.minimum(lines.height_m[i], lines.height_m[j])
    return _distributed(lines, nodes, (i, j), (low, high), height, away)


def _stacked(lines: StraightLines, nodes: Nodes, above: _Alongside) -> Links:
    """Lines of neighbouring layers that run on each other."""
    i, j, away, low, high = above
    fits = away < _STACKED * (lines.width_m[i] + lines.width_m[j]) / 2
    i, j, away, low, high = i[fits], j[fits], away[fits], low[fits], high[fits]
    wide = (lines.width_m[i] + lines.width_m[j]) / 2 - away
    return _distributed(lines, nodes, (i, j), (low, high), wide, (lines.height_m[i] + lines.height_m[j]) / 2)


def _alongside(lines: StraightLines, pairs: tuple[Whole, Whole], *, same_layer: bool) -> _Alongside:
    """Parallel pairs with a common stretch."""
    i, j = pairs
    way = lines.direction()
    fits = (lines.layer[i] == lines.layer[j]) == same_layer
    fits &= np.abs(_dot(way[i], way[j])) > _PARALLEL
    i, j = i[fits], j[fits]
    ends = np.stack([_dot(p[j] - lines.start_m[i], way[i]) for p in (lines.start_m, lines.end_m)])
    low, high = np.maximum(ends.min(0), 0.0), np.minimum(ends.max(0), lines.length_m()[i])
    middle = lines.start_m[i] + way[i] * ((low + high) / 2)[:, None] - lines.start_m[j]
    away = np.abs(_cross(way[j], middle))
    fits = high > low
    return _Alongside(i[fits], j[fits], away[fits], low[fits], high[fits])


def _distributed(
    lines: StraightLines, nodes: Nodes, pair: tuple[Whole, Whole], stretch: tuple[Real, Real], breadth: Real, path: Real
) -> Links:
    """A contact along a stretch, as resistors at every node that either line has there, and at its ends."""
    i, j = pair
    low, high = stretch
    length, way = lines.length_m(), lines.direction()
    towards = _dot(way[i], way[j])
    start = _dot(lines.start_m[j] - lines.start_m[i], way[i])  # of j, along i
    of_j = np.sort(np.stack([(low - start) / towards, (high - start) / towards]) / length[j], axis=0)
    qi, si = nodes.within(i, low / length[i], high / length[i])
    qj, sj = nodes.within(j, *of_j)
    every = np.arange(len(i))
    query = np.concatenate([every, every, qi, qj])
    at = np.concatenate([low, high, si * length[i][qi], start[qj] + sj * length[j][qj] * towards[qj]])
    query, at, share = interleaved(query, np.clip(at, low[query], high[query]))
    used = share > 0
    query, at, share = query[used], at[used], share[used]
    on_i = at / length[i][query]
    on_j = (at - start[query]) / towards[query] / length[j][query]
    return Links.between(nodes, (i[query], on_i), (j[query], on_j), share * breadth[query], path[query])


class _Ends:
    """Where pieces end on the side of another line of their layer, as infill does on a wall."""

    def __init__(self, lines: StraightLines, pairs: tuple[Whole, Whole]) -> None:
        self.lines = lines
        # For each end of a piece the nearest line across it: piece, end (0 or 1), wall, share, distance [m] and sine
        a, b = pairs
        way, length = lines.direction(), lines.length_m()
        jointed = (np.abs(a - b) == 1) & lines.joined[np.maximum(a, b)]
        fits = (lines.layer[a] == lines.layer[b]) & ~jointed
        a, b = a[fits], b[fits]
        steep = np.abs(_dot(way[a], way[b])) < _PARALLEL
        a, b = a[steep], b[steep]
        mean, sine = (lines.width_m[a] + lines.width_m[b]) / 2, np.abs(_cross(way[a], way[b]))
        sides_of = []
        for i, j in ((a, b), (b, a)):
            for side, at in ((0, lines.start_m), (1, lines.end_m)):
                gap = at[i] - lines.start_m[j]
                foot, away = _dot(gap, way[j]), np.abs(_cross(way[j], gap))
                touch = (foot >= 0) & (foot <= length[j]) & (away < 1.1 * mean) & (away > _STACKED * mean)
                columns = i, np.full(len(i), side), j, foot / length[j], away, sine
                sides_of.append(np.stack([column[touch] for column in columns]))
        every = np.concatenate(sides_of, axis=1)
        every = every[:, np.lexsort((every[4], every[1], every[0]))]
        first = np.append(True, (np.diff(every[0]) != 0) | (np.diff(every[1]) != 0))[: every.shape[1]]
        self.piece, self.side, self.wall = every[:3, first].astype(np.int64)
        self.share, self.away, self.sine = every[3:, first]
        self.room = np.zeros((2, len(lines)))  # from a piece's start and end to the wall, along the piece [m]
        room = (self.away - lines.width_m[self.wall] / 2) / self.sine
        self.room[self.side, self.piece] = room
        self.sines = np.ones((2, len(lines)))
        self.sines[self.side, self.piece] = self.sine
        self.turns = np.stack([lines.joined, np.append(lines.joined[1:], False)])  # at a piece's start and end

    def links(self, nodes: Nodes) -> Links:
        """Ends on walls; where a line turns, the piece after the turn lies along the wall itself."""
        free = ~self.turns[self.side, self.piece]
        lines, i = self.lines, self.piece[free]
        area = lines.width_m[i] * lines.height_m[i] / self.sine[free]
        at = (i, self.side[free].astype(float)), (self.wall[free], self.share[free])
        return Links.between(nodes, *at, area, self.away[free])

    def widened(self, i: Whole, j: Whole) -> tuple[Real, Real]:
        """Where neighbours i and j touch, along i: up to the wall, or to the piece that joins both there."""
        lines, length = self.lines, self.lines.length_m()
        way = lines.direction()
        start = _dot(lines.start_m[j] - lines.start_m[i], way[i])
        back = _dot(way[i], way[j]) < 0
        end = start + np.where(back, -length[j], length[j])
        apart = _BEVEL * (lines.width_m[i] + lines.width_m[j]) / 2
        low = _reach((0.0, self.room[0, i]), (-np.minimum(start, end), self.room[np.where(back, 1, 0), j]), apart)
        high = _reach((length[i], self.room[1, i]), (np.maximum(start, end), self.room[np.where(back, 0, 1), j]), apart)
        bridge = lines.width_m[np.minimum(i + 1, len(lines) - 1)] / self.sines[1, i]
        joined, last = self.lines.joined, len(lines) - 1
        is_bridged = (j == i + 2) & joined[np.minimum(i + 1, last)] & joined[np.minimum(i + 2, last)]
        return -low, high - np.where(is_bridged, bridge, 0.0)


def _reach(one: tuple[float | Real, Real], other: tuple[float | Real, Real], apart: Real) -> Real:
    """Length by which two neighbours touch, by the end of each and its room there.

    Where both end on one wall, thus not far apart, to where the line between them meets it; else to the end of the
    shorter one.
    """
    (a, room_a), (b, room_b) = one, other
    shorter = np.where(np.less(a, b), a + room_a, b + room_b)
    one_wall = (room_a > 0) & (room_b > 0) & (np.abs(a - b) < apart)
    return np.where(one_wall, (a + room_a + b + room_b) / 2, shorter)


def _dot(a: Real, b: Real) -> Real:
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])


def _cross(a: Real, b: Real) -> Real:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def product(matrix: "csr_array[np.float64]", one: Real, other: Real) -> float:
    """``one . matrix^-1 . other``.

    Parameters
    ----------
    matrix : (n, n) sparse array
        Symmetric, positive definite.
    one, other : (n,) array
        Both sides.

    Raises
    ------
    OutOfRange
        The matrix is not positive definite in doubles: parts are hardly connected.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> round(product(csr_array([[2.0, -1.0], [-1.0, 2.0]]), np.array([1.0, 0.0]), np.array([0.0, 3.0])), 12)
    1.0
    """
    try:
        solution = _by_multigrid(matrix, other) if len(one) > _MOST else None
        return float(one @ (_by_factor(matrix, other) if solution is None else solution))
    except RuntimeError as error:  # exactly singular
        raise OutOfRange(_HARDLY) from error


def _by_multigrid(matrix: "csr_array[np.float64]", right: Real) -> Real | None:
    """Solution, or None where iterations do not converge."""
    import pyamg

    # Weights of the interpolation by rows: an estimate of the largest eigenvalue would begin with random numbers
    levels = pyamg.smoothed_aggregation_solver(
        matrix,
        strength=("symmetric", {"theta": _STRONG}),
        smooth=("jacobi", {"omega": 4 / 3, "weighting": "local"}),
        max_coarse=_COARSEST,
        coarse_solver="splu",
    )
    solution, failed = levels.solve(right, tol=_RESIDUAL, maxiter=_ITERATIONS, accel="cg", return_info=True)
    return None if failed else solution


def _by_factor(matrix: "csr_array[np.float64]", right: Real) -> Real:
    from scipy.sparse.linalg import splu

    # Columns one by one: so sparse a factor has no panels worth their room
    how = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}, "diag_pivot_thresh": 0.0}
    factor = splu(matrix.tocsc(), panel_size=1, **how)
    if not factor.U.diagonal().min() > 0:
        raise OutOfRange(_HARDLY)
    solution: Real = factor.solve(right)
    return solution
