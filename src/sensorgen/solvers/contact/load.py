"""Newton's method, and load steps that are cut when it fails."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import connected_components

from sensorgen.solvers.contact.contact import Faces, Pairs, carrying
from sensorgen.solvers.contact.element import Elements, Inner, Tangent
from sensorgen.solvers.contact.factors import solved_by_lu

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Solver = Callable[[csr_matrix, Real], Real | None]

_ENOUGH = 1e-6  # residual over load
_LEAST = 1e-7  # of the penalty: pressures below it are lost in the rounding of rubber that keeps its volume [-]
_NEARLY = 1e-3  # the same before the contact partners are looked for anew
_STILL = 1e-10  # a step so much shorter than the way is rounding: nu near 1/2 turns it into forces
_MOST_STEPS = 15
_MOST_TURNS = 4  # of looking for partners anew within one load step
_SETTLED = 0.05  # over the length of a side: depths that old and new partners see, where the partners stay [-]
_LEAST_J = 0.05  # a step may not squeeze a triangle below this share of its volume at once [-]
_SHARES = (1.0, 0.5, 0.25, 0.125, 0.0625)
_MOST_CUTS = 4  # failed load steps in all before a cell is given up
_FLAT = 1e-3  # gaps that differ by less than this share of their side close at once [-]
_DEEPEST = 0.1  # how far a foot may sink in to begin with, over the length of a side [-]
_ROUNDING = 1e-9
_PIVOT = 1e-3  # share of its column below which a pivot is exchanged [-]


def by_lu(stiffness: csr_matrix, right: Real) -> Real | None:
    """The step that a force makes, or None where a piece has nothing that holds it."""
    try:
        return solved_by_lu(stiffness, right, _PIVOT)
    except RuntimeError:
        return None


@dataclass(frozen=True)
class State:
    """An equilibrium: pressure [Pa], displacements (2n) [m], the triangles' own unknowns, and its contact."""

    pressure_pa: float
    u_m: Real
    inner: Inner
    pairs: Pairs
    cuts: int = 0


@dataclass(frozen=True)
class Problem:
    """A cell that is pressed.

    Attributes
    ----------
    elements : Elements
        Its triangles or bricks.
    faces : Faces
        What may touch.
    free : sparse
        Displacements from the free ones: rows with a one, or empty.
    load : (2n,) array
        Forces of a unit pressure [m].
    penalty_pa : float
        Contact pressure per penetration, times the length of the side [Pa].
    stick : bool
        What has touched sticks.
    solver : callable
        Of the linear systems.
    sound : callable, optional
        Whether places of the nodes may be: a step that ends elsewhere is cut.
    """

    elements: Elements
    faces: Faces
    free: csr_matrix
    load: Real
    penalty_pa: float
    stick: bool = False
    solver: Solver = by_lu
    sound: Callable[[Real], bool] | None = None

    @property
    def dimension(self) -> int:
        """2 or 3; the last coordinate is the height."""
        return int(self.elements.points_m.shape[1])

    def start(self) -> State:
        """Nothing presses."""
        u = np.zeros(len(self.load))
        return State(0.0, u, self.elements.start(), self.project(u))

    def rested(self, state: State, pressure_pa: float) -> State:
        """The start, with what hangs loose let down until it rests on what is below it.

        It sinks in as far as the penalty needs to carry a pressure, because a contact that only just touches has no
        stiffness to begin with.
        """
        pairs, drop = self._below(state)
        if not pairs.point.size:
            return state
        first = drop < drop.min() + _FLAT * pairs.length_m
        sunk = pressure_pa * np.abs(self.load).sum() / pairs.stiffness_pa[first].sum()
        u = state.u_m.copy()
        fall = drop.min() + min(sunk, _DEEPEST * pairs.length_m[first].min())
        u[self.dimension - 1 :: self.dimension] -= self.loose * fall
        return replace(state, u_m=u, pairs=self.project(u))

    def fall_m(self, state: State) -> float:
        """How far the top comes down before anything carries it [m]."""
        _, drop = self._below(state)
        return float(drop.min()) if drop.size else 0.0

    def _below(self, state: State) -> tuple[Pairs, Real]:
        """Pairs of loose pieces and what is below them, and how far those may fall until each touches [m]."""
        pairs, share = carrying(state.pairs, self.loose)
        return pairs, self.gaps(pairs, state.u_m) / share

    @cached_property
    def loose(self) -> NDArray[np.bool_]:
        """Nodes of pieces that nothing holds up."""
        d, nodes = self.dimension, len(self.elements.points_m)
        joined = self.elements.freedoms[:, ::d] // d
        starts, ends = np.repeat(joined[:, 0], joined.shape[1] - 1), joined[:, 1:].ravel()
        _, piece = connected_components(coo_matrix((np.ones(len(starts)), (starts, ends)), (nodes, nodes)))
        used = np.zeros(nodes, bool)
        used[joined] = True
        moves = np.diff(self.free.indptr)[d - 1 :: d] > 0
        return used & ~np.isin(piece, piece[used & ~moves])

    def places(self, u: Real) -> Real:
        """Where the nodes are [m]."""
        return self.elements.points_m + u.reshape(-1, self.dimension)

    def project(self, u: Real, stuck: Pairs | None = None) -> Pairs:
        """Contact partners at given displacements."""
        return self.faces.project(self.places(u), self.penalty_pa, stuck)

    def gaps(self, pairs: Pairs, u: Real) -> Real:
        """Gap of each pair [m]."""
        return np.asarray(pairs.gap @ self.places(u).ravel())

    def slips(self, pairs: Pairs, u: Real) -> Real:
        """Displacement of each pair's partner along the tangents since they stick (k, d - 1) [m]."""
        places = self.places(u).ravel()
        return np.column_stack([slip @ places for slip in pairs.slips]) - pairs.slid_m

    @cached_property
    def _pattern(self) -> tuple[csr_matrix, Whole, Whole]:
        """The elements' stiffness on the free displacements, empty; which entries of theirs it has, and where."""
        number = np.full(self.free.shape[0], -1)
        number[np.diff(self.free.indptr) > 0] = self.free.indices
        here = number[self.elements.freedoms]
        size, n = here.shape[1], self.free.shape[1]
        rows, columns = np.repeat(here, size, axis=1).ravel(), np.tile(here, (1, size)).ravel()
        kept = np.flatnonzero((rows >= 0) & (columns >= 0))
        entries, place = np.unique(rows[kept] * n + columns[kept], return_inverse=True)
        starts = np.searchsorted(entries, n * np.arange(n + 1))
        return csr_matrix((np.zeros(len(entries)), entries % n, starts), (n, n)), kept, place

    def _touching(self, pairs: Pairs, u: Real) -> tuple[Real, csr_matrix]:
        """Forces of the contact, and its stiffness on the free displacements."""
        gap = self.gaps(pairs, u)
        springs = [(pairs.gap, gap < 0, gap)]
        if self.stick:
            springs += [
                (slip, pairs.sticks, way) for slip, way in zip(pairs.slips, self.slips(pairs, u).T, strict=True)
            ]
        force, stiffness = np.zeros(len(u)), csr_matrix((self.free.shape[1],) * 2)
        for rows, which, length in springs:
            if which.any():
                row, k = rows[which], pairs.stiffness_pa[which]
                across = row @ self.free
                force += row.T @ (k * length[which])
                stiffness = stiffness + across.T @ diags(k) @ across
        return force, stiffness

    def contact_energy(self, state: State) -> float:
        """Energy in the penalty, per depth [J/m]."""
        k = state.pairs.stiffness_pa
        gap = self.gaps(state.pairs, state.u_m)
        slip = (self.slips(state.pairs, state.u_m) ** 2).sum(axis=1) * state.pairs.sticks
        return float(0.5 * (k * ((gap < 0) * gap**2 + slip)).sum())

    def residual(self, u: Real, inner: Inner, pairs: Pairs, pressure_pa: float) -> tuple[Real, csr_matrix, Tangent]:
        """Forces out of balance on the free displacements, their derivative, and the triangles' condensed part."""
        local, free = self.elements.tangent(u, inner), self.free
        force, stiffness = self._touching(pairs, u)
        force += np.bincount(self.elements.freedoms.ravel(), local.force.ravel(), len(force))
        empty, kept, place = self._pattern
        data = np.bincount(place, local.stiffness.ravel()[kept], empty.nnz)
        whole = csr_matrix((data, empty.indices, empty.indptr), empty.shape)
        stiffness = whole + stiffness if stiffness.nnz else whole  # a sum forgets zeros, and the pattern with them
        return free.T @ (force - pressure_pa * self.load), stiffness, local

    def newton(self, state: State, pressure_pa: float, pairs: Pairs, enough: float) -> State | None:
        """Equilibrium at a pressure with frozen contact partners, or None where it does not converge.

        ``enough`` is the residual to reach, over the load [-].
        """
        u, inner = state.u_m, state.inner
        scale = max(pressure_pa, _LEAST * self.penalty_pa) * np.abs(self.free.T @ self.load).max()
        for _ in range(_MOST_STEPS):
            residual, stiffness, local = self.residual(u, inner, pairs, pressure_pa)
            if not np.isfinite(residual).all():
                return None
            if np.abs(residual).max() < enough * scale and local.imbalance() < enough:
                return replace(state, pressure_pa=pressure_pa, u_m=u, inner=inner, pairs=pairs)
            step = self.solver(stiffness, -residual)
            if step is None:
                return None
            du = self.free @ step
            inside = local.inner_step(du[self.elements.freedoms])
            share = self._share(u, inner, du, inside)
            if share is None:
                return None
            u, inner = u + share * du, inner.moved(inside, share)
            if np.abs(du).max() <= _STILL * np.abs(u).max() and local.imbalance() < _NEARLY:
                return replace(state, pressure_pa=pressure_pa, u_m=u, inner=inner, pairs=pairs)
        return None

    def _share(self, u: Real, inner: Inner, du: Real, inside: Real) -> float | None:
        """The largest share of a step that turns no triangle inside out."""
        for share in _SHARES:
            if self.elements.volume_ratio(u + share * du, inner.moved(inside, share)).min() > _LEAST_J:
                return share
        return None

    def ahead(self, state: State, before: State, pressure_pa: float) -> State:
        """Where the last step leads if it is gone on with, as a start for Newton's method; or where it stands.

        With contact it stands: what touches changes from step to step.
        """
        gone = state.pressure_pa - before.pressure_pa
        if not (before.pressure_pa and gone) or (self.gaps(state.pairs, state.u_m) < 0).any():
            return state
        share = (pressure_pa - state.pressure_pa) / gone
        u = state.u_m + share * (state.u_m - before.u_m)
        inner = state.inner.extrapolated(before.inner, share)
        inside_out = self.elements.volume_ratio(u, inner).min() <= _LEAST_J
        return state if inside_out else replace(state, u_m=u, inner=inner)

    def stepped(self, state: State, pressure_pa: float, before: State | None = None) -> State | None:
        """Press on to a pressure: solve, look for partners anew and solve again, until they stay or often enough."""
        first = self.newton(self.ahead(state, before or state, pressure_pa), pressure_pa, state.pairs, _NEARLY)
        if first is None:
            first = self.newton(state, pressure_pa, state.pairs, _NEARLY) if before else None
        if first is None:
            return None
        held = self._held(state.u_m, first) if self.stick else None
        found, pairs = first, self.project(first.u_m, held)
        for _ in range(_MOST_TURNS):
            again = self.newton(found, pressure_pa, pairs, _ENOUGH)
            if again is None:
                return None
            found, pairs = again, self.project(again.u_m, held)
            if self._apart(found.pairs, pairs, found.u_m) < _SETTLED:
                break
        return found if self.sound is None or self.sound(self.places(found.u_m)) else None

    def _apart(self, one: Pairs, other: Pairs, u: Real) -> float:
        """By how much the depths differ that two choices of partners see, over the length of a side [-]."""
        depths = np.zeros((2, 1 + max(p.point.max(initial=0) for p in (one, other))))
        for depth, pairs in zip(depths, (one, other), strict=True):
            depth[pairs.point] = np.maximum(-self.gaps(pairs, u), 0.0) / pairs.length_m
        return float(np.ptp(depths, axis=0).max())

    def _held(self, before: Real, state: State) -> Pairs:
        """What touches now and holds fast from where it first did, between the places before and those now."""
        pairs, free = state.pairs, replace(state.pairs, slid_m=np.zeros_like(state.pairs.slid_m))
        gaps, slips = ([of(free, u) for u in (before, state.u_m)] for of in (self.gaps, self.slips))
        touched = gaps[1] < 0
        share = np.clip(gaps[0] / np.where(touched, gaps[0] - gaps[1], np.inf), 0.0, 1.0)
        since = slips[0] + np.where(gaps[0] > 0, share, 0.0)[:, None] * (slips[1] - slips[0])
        slid = np.where(pairs.sticks[:, None], pairs.slid_m, since)
        return replace(pairs, slid_m=slid, sticks=touched).some(touched)


def curve(problem: Problem, pressures_pa: Sequence[float], longest_pa: float) -> Iterator[State]:
    """Equilibria at rising pressures, in steps of at most ``longest_pa``; ends early where even small steps fail."""
    state = problem.start()
    yield state
    state = before = problem.rested(state, min(pressures_pa[1], longest_pa))
    step = longest_pa
    for target in pressures_pa[1:]:
        while state.pressure_pa < target:
            left = target - state.pressure_pa
            aim = target if left < step * (1 + _ROUNDING) else state.pressure_pa + step
            reached = problem.stepped(state, aim, before)
            if reached is not None:
                before, state, step = state, reached, min(2 * step, longest_pa)
                continue
            state, step = replace(state, cuts=state.cuts + 1), min(step, left) / 2
            if state.cuts > _MOST_CUTS:
                return
        yield state
