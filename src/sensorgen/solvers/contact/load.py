"""Equilibrium of a solid with contact under pressure: Newton's method in load steps that are halved where it fails."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, vstack
from scipy.sparse.csgraph import connected_components

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.solvers.contact.contact import FacePairs, Faces, carrying
from sensorgen.solvers.contact.element import Elements, Inner, Tangent, Unbalanced
from sensorgen.solvers.contact.factors import Lu

_ENOUGH = 1e-6  # residual over load
_LEAST = 1e-7  # of the penalty: pressures below it are lost in the rounding of incompressible rubber [-]
_NEARLY = 1e-3  # residual over load before the contact partners are updated
_STILL = 1e-10  # a step so much shorter than the displacement is rounding: nu near 1/2 turns it into forces
_MOST_STEPS = 15
_MOST_SETS = 3  # of gaps that close, tried for one step
_SLOW = 0.2  # an earlier stiffness serves as long as each step with it leaves less than this share of the residual [-]
_LEAST_J = 0.05  # a step may not compress an element below this share of its volume at once [-]
_SHARES = (1.0, 0.5, 0.25, 0.125, 0.0625)  # of Newton's step
_MOST_CUTS, _MORE_CUTS = 4, 4  # failed load steps in all before partners may stay; then before a cell is given up
_FLAT = 1e-3  # gaps that differ by less than this share of their side close at once [-]
_DEEPEST = 0.1  # initial penetration of a part that is lowered, over the length of a side [-]
_ROUNDING = 1e-9
_SWINGING = 0.5  # of a change of partners over the one before, above which they swing between two places [-]
_CLOSE = 0.5  # gap over a face's side, below which contact begins with the first loads [-]
_LONGER = 2.5  # longest load step while no faces touch, over that in contact [-]


@dataclass(frozen=True)
class State:
    """An equilibrium: pressure [Pa], displacements (d n,) [m], the elements' inner unknowns, and contact pairs."""

    pressure_pa: float
    u_m: Real
    inner: Inner
    pairs: FacePairs


@dataclass(frozen=True)
class Stiffness:
    """Derivative of the elements' forces at a state: of each, and of all on the free displacements."""

    elements: Tangent
    whole: csr_matrix


@dataclass
class Springs:
    """Contact of frozen pairs as springs: gaps act where they are closed, slips where faces stick.

    Attributes
    ----------
    rows : sparse (k, d n)
        Lengths from the places of all nodes, times the root of the stiffness.
    slid : (k,) array
        Lengths without force, times this root.
    always : (k,) array
        Which act whatever their length.
    across, push : sparse (k, n), (n, k)
        Lengths from the free displacements, and the transpose.
    """

    rows: csr_matrix
    slid: Real
    always: Mask
    across: csr_matrix
    push: csr_matrix
    _last: tuple[csr_matrix, Mask, csr_matrix] | None = field(default=None, repr=False)

    def lengths(self, places: Real) -> tuple[Real, Mask]:
        """Lengths at places of the nodes (n, d), times the root of the stiffness, and which springs act."""
        length = self.rows @ places.ravel() - self.slid
        return length, self.acting(length)

    def acting(self, length: Real) -> Mask:
        """Springs that act at some lengths."""
        return (length < 0) | self.always

    def added(self, whole: csr_matrix, acts: Mask) -> csr_matrix:
        """A stiffness with that of some springs; the very one before where both are the same, for its factors."""
        if not (self._last and self._last[0] is whole and np.array_equal(self._last[1], acts)):
            part = self.across[acts]
            self._last = whole, acts, whole + part.T @ part if acts.any() else whole
        return self._last[2]


@dataclass(frozen=True)
class Problem:
    """A solid under pressure.

    Attributes
    ----------
    elements : Elements
        Triangles or bricks.
    faces : Faces
        That may touch.
    free : sparse
        Displacements from the free ones: rows with a one, or empty.
    load : (d n,) array
        Forces of a unit pressure [m^(d - 1)].
    penalty_pa : float
        Contact pressure per penetration, times the length of the side [Pa].
    stick : bool
        Faces stick from first contact on.
    solver : callable
        Of the linear systems; None where a matrix is singular or not positive.
    sound : callable, optional
        Whether places of the nodes are admissible; a step that ends elsewhere is cut.
    settled : float
        Change of penetration over a side's length, below which the contact partners are kept [-].
    updates : int
        Of contact partners within one load step, at most.
    """

    elements: Elements
    faces: Faces
    free: csr_matrix
    load: Real
    penalty_pa: float
    stick: bool = False
    solver: Callable[[csr_matrix, Real], Real | None] = field(default_factory=Lu)
    sound: Callable[[Real], bool] | None = None
    settled: float = 0.05
    updates: int = 4
    _last: list["Stiffness"] = field(default_factory=list, repr=False, compare=False)
    _springs: list[tuple[FacePairs, Springs]] = field(default_factory=list, repr=False, compare=False)

    @property
    def dimension(self) -> int:
        """2 or 3; the last coordinate is the height."""
        return int(self.elements.mesh.points_m.shape[1])

    def start(self) -> State:
        """Unloaded."""
        u = np.zeros(len(self.load))
        return State(0.0, u, self.elements.start(), self.project(u))

    def lowered(self, state: State, pressure_pa: float) -> State:
        """Initial state with unsupported parts lowered to first contact.

        They penetrate as far as the penalty needs to carry a pressure, because contact without penetration has no
        stiffness.
        """
        pairs, drop = self._drops_m(state)
        if not pairs.point.size:
            return state
        first = drop < drop.min() + _FLAT * pairs.length_m
        sunk = pressure_pa * np.abs(self.load).sum() / pairs.stiffness_pa[first].sum()
        u = state.u_m.copy()
        fall = drop.min() + min(sunk, _DEEPEST * pairs.length_m[first].min())
        u[self.dimension - 1 :: self.dimension] -= self.loose * fall
        return replace(state, u_m=u, pairs=self.project(u))

    def fall_m(self, state: State) -> float:
        """Displacement of the top before anything carries it; none for domes that touch at a point [m]."""
        pairs, drop = self._drops_m(state)
        return float(drop.min()) if (drop > _FLAT * pairs.length_m).all() and drop.size else 0.0

    def _drops_m(self, state: State) -> tuple[FacePairs, Real]:
        """Pairs of unsupported parts with what is below them, and the fall until each touches [m]."""
        pairs, share = carrying(state.pairs, self.loose)
        return pairs, self.gaps(pairs, state.u_m) / share

    @cached_property
    def loose(self) -> Mask:
        """Nodes of unsupported parts."""
        d, outer = self.dimension, self.elements.mesh.outer
        nodes = len(self.elements.mesh.points_m)
        starts, ends = np.repeat(outer[:, 0], outer.shape[1] - 1), outer[:, 1:].ravel()
        _, part = connected_components(coo_matrix((np.ones(len(starts)), (starts, ends)), (nodes, nodes)))
        used = np.zeros(nodes, bool)
        used[outer] = True
        moves = np.diff(self.free.indptr)[d - 1 :: d] > 0
        return used & ~np.isin(part, part[used & ~moves])

    def places(self, u: Real) -> Real:
        """Places of the nodes (n, d) [m]."""
        return self.elements.mesh.points_m + u.reshape(-1, self.dimension)

    def project(self, u: Real, stuck: FacePairs | None = None) -> FacePairs:
        """Contact pairs at given displacements."""
        return self.faces.project(self.places(u), self.penalty_pa, stuck)

    def gaps(self, pairs: FacePairs, u: Real) -> Real:
        """Gap of each pair [m]."""
        return np.asarray(pairs.gap @ self.places(u).ravel())

    def slips(self, pairs: FacePairs, u: Real) -> Real:
        """Displacement of each pair's partner along the tangents since they stick (k, d - 1) [m]."""
        places = self.places(u).ravel()
        return np.column_stack([slip @ places for slip in pairs.slips]) - pairs.slid_m

    @cached_property
    def pattern(self) -> tuple[csr_matrix, Whole]:
        """The elements' stiffness on the free displacements, empty; place of each of their entries in it, from 1 on.

        Entries of fixed displacements have no place: 0.
        """
        n = self.free.shape[1]
        number = np.full(self.free.shape[0], n, np.int32)
        number[np.diff(self.free.indptr) > 0] = self.free.indices
        here = number[self.elements.freedoms]
        size, moves = here.shape[1], here < n
        starts = np.append(0, np.cumsum(moves.sum(axis=1)))
        shared = csr_matrix((np.ones(starts[-1], np.int32), here[moves], starts), (len(here), n))
        pattern = (shared.T @ shared).tocsr()
        pattern.sort_indices()
        # Sooner than sorting all entries: each is looked up by its number; fixed ones are in an empty row or column
        starts = np.append(pattern.indptr, pattern.nnz)
        numbered = csr_matrix((np.arange(1, pattern.nnz + 1), pattern.indices, starts), (n + 1, n + 1))
        at = np.repeat(here, size, axis=1).ravel(), np.tile(here, (1, size)).ravel()
        return pattern, np.asarray(numbered[at]).ravel()

    @cached_property
    def _freed(self) -> csr_matrix:
        """Forces on the free displacements from those on all."""
        return self.free.T.tocsr()

    def springs(self, pairs: FacePairs) -> Springs:
        """Contact pairs as springs; those of the last pairs are kept."""
        if not (self._springs and self._springs[0][0] is pairs):
            self._springs[:] = [(pairs, self._sprung(pairs))]
        return self._springs[0][1]

    def _sprung(self, pairs: FacePairs) -> Springs:
        rows, root, slid = pairs.gap, np.sqrt(pairs.stiffness_pa), np.zeros(len(pairs.point))
        always = np.zeros(len(slid), bool)
        if self.stick:
            stuck = pairs.some(pairs.sticks)
            rows = vstack([rows, *stuck.slips]).tocsr()
            root = np.concatenate([root, np.tile(np.sqrt(stuck.stiffness_pa), len(stuck.slips))])
            slid = np.concatenate([slid, stuck.slid_m.T.ravel()])
            always = np.arange(len(slid)) >= len(pairs.point)
        weighted = csr_matrix(
            (rows.data * np.repeat(root, np.diff(rows.indptr)), rows.indices, rows.indptr), rows.shape
        )
        across = weighted @ self.free
        return Springs(weighted, slid * root, always, across, across.T.tocsr())

    def contact_energy(self, state: State) -> float:
        """Energy in the penalty [J], per depth in two dimensions [J/m]."""
        length, acts = self.springs(state.pairs).lengths(self.places(state.u_m))
        return float(0.5 * (length[acts] ** 2).sum())

    def _linearised(self, state: State) -> Stiffness:
        """Derivative of the elements' forces at a state."""
        tangent, (pattern, place) = self.elements.tangent(state.u_m, state.inner), self.pattern
        data = np.bincount(place, tangent.stiffness.ravel(), pattern.nnz + 1)[1:]
        return Stiffness(tangent, csr_matrix((data, pattern.indices, pattern.indptr), pattern.shape))

    def _residual(self, state: State, tangent: Tangent) -> tuple[Real, Unbalanced]:
        """Unbalanced forces on the free displacements, and what the elements leave."""
        residual, springs = self.elements.residual(state.u_m, state.inner), self.springs(state.pairs)
        own = tangent.condensed(residual, self.elements.law.mu_pa)
        inside = np.bincount(self.elements.freedoms.ravel(), own.force.ravel(), len(self.load)).astype(float)
        length, acts = springs.lengths(self.places(state.u_m))
        return self._freed @ (inside - state.pressure_pa * self.load) + springs.push @ (acts * length), own

    def newton(self, state: State, pressure_pa: float, pairs: FacePairs, enough: float) -> State | None:
        """Equilibrium at a pressure with frozen contact pairs, or None where Newton's method does not converge.

        The last stiffness, of an earlier state, serves first. ``enough`` is the residual to reach, over the load [-].
        """
        here = replace(state, pressure_pa=pressure_pa, pairs=pairs)
        for _ in range(_MOST_STEPS):
            is_new = not self._last
            if is_new:
                self._last.append(self._linearised(here))
            reached, balanced = self._descended(here, self._last[0], enough, once=is_new or not self.stick)
            if reached and balanced:
                return reached
            self._last.clear()
            if reached is None and is_new:
                return None
            here = reached or here
        return None

    def _descended(self, state: State, by: Stiffness, enough: float, *, once: bool) -> tuple[State | None, bool]:
        """State as far as one stiffness serves, and whether it is balanced; None where no step is possible.

        It serves while each step leaves less, and at least ``once``: the first step at another load leaves more,
        whichever stiffness it is by. Not so where faces stick and an earlier stiffness lets them slide.
        """
        scale = max(state.pressure_pa, _LEAST * self.penalty_pa) * np.abs(self.free.T @ self.load).max()
        rest, unbalanced = self._residual(state, by.elements)
        worst, fast = np.abs(rest).max(), True
        while not (worst < enough * scale and unbalanced.imbalance < enough):
            after = self._moved(state, by, rest, unbalanced) if fast else None
            if after is None:
                return None if once else state, False
            (rest, unbalanced), before = self._residual(after, by.elements), worst
            worst = np.abs(rest).max()
            if not (once or worst < before):
                return state, False
            moved, once, fast = np.abs(after.u_m - state.u_m).max(), False, worst < _SLOW * before
            state = after
            if moved <= _STILL * np.abs(state.u_m).max() and unbalanced.imbalance < _NEARLY:
                break
        return state, True

    def _moved(self, state: State, by: Stiffness, rest: Real, unbalanced: Unbalanced) -> State | None:
        """State after a step of Newton's method, or so much of it that no element is squeezed too far; None if none."""
        step = self._step(state, by, rest) if np.isfinite(rest).all() else None
        if step is None:
            return None
        du = self.free @ step
        inside = by.elements.inner_step(unbalanced, du[self.elements.freedoms])
        for share in _SHARES:
            u, inner = state.u_m + share * du, state.inner.moved(inside, share)
            if self.elements.volume_ratio(u, inner).min() > _LEAST_J:
                return replace(state, u_m=u, inner=inner)
        return None

    def _step(self, state: State, by: Stiffness, rest: Real) -> Real | None:
        """Step of the free displacements to balance, where gaps close and open within it; None where singular.

        Which ones does is tried on the linear problem: by those that are closed before, the first steps at a new load
        leave a hundred times the forces.
        """
        springs = self.springs(state.pairs)
        length, before = springs.lengths(self.places(state.u_m))
        acts, step = before, None
        for _ in range(_MOST_SETS):
            more = springs.push @ ((acts * 1.0 - before) * length)
            step = self.solver(springs.added(by.whole, acts), -rest - more)
            after = acts if step is None else springs.acting(length + springs.across @ step)
            if np.array_equal(after, acts):
                break
            acts = after
        return step

    def touches(self, state: State, share: float = 0.0) -> bool:
        """Test whether faces touch, or are nearer than a share of their sides."""
        return bool((self.gaps(state.pairs, state.u_m) < share * state.pairs.length_m).any())

    def begins_in_contact(self) -> bool:
        """Test whether faces may touch at small loads, or stick, where the load at first touch counts."""
        return self.stick or bool(self.loose.any()) or self.touches(self.start(), _CLOSE)

    def extrapolated(self, state: State, before: State, pressure_pa: float) -> State:
        """Start of Newton's method by the last load step's direction, where there is no contact."""
        gone = state.pressure_pa - before.pressure_pa
        if not (before.pressure_pa and gone):
            return state
        share = (pressure_pa - state.pressure_pa) / gone
        u = state.u_m + share * (state.u_m - before.u_m)
        inner = state.inner.extrapolated(before.inner, share)
        inside_out = self.elements.volume_ratio(u, inner).min() <= _LEAST_J
        return state if inside_out else replace(state, u_m=u, inner=inner)

    def stepped(
        self, state: State, pressure_pa: float, before: State, *, is_long: bool = False, keeps: bool = False
    ) -> State | None:  # fmt: skip
        """One load step: solve, update the contact pairs and solve again, until they are settled or often enough.

        Where nothing touches, before or after, it is solved once, without contact: old partners may seem to touch. A
        long step is one without contact.
        With ``keeps`` the pairs of a problem with a test of its places stay where new ones have no equilibrium, as
        where a face slides off an edge.
        """
        reached = None
        if not self.touches(state):
            reached = self._alone(self.extrapolated(state, before, pressure_pa), pressure_pa)
        if reached is None and not is_long:
            reached = self._in_contact(state, pressure_pa, keeps=keeps and self.sound is not None)
        return reached if reached and (self.sound is None or self.sound(self.places(reached.u_m))) else None

    def _alone(self, start: State, pressure_pa: float) -> State | None:
        """Equilibrium without contact, or None where there is none or faces touch there."""
        nothing = start.pairs.some(np.zeros(len(start.pairs.point), bool))
        reached = self.newton(start, pressure_pa, nothing, _ENOUGH)
        reached = reached and replace(reached, pairs=self.project(reached.u_m))
        return None if reached is None or self.touches(reached) else reached

    def _in_contact(self, state: State, pressure_pa: float, *, keeps: bool) -> State | None:
        """Equilibrium with pairs that are updated and settled; None where some have none, unless the last ones stay."""
        reached = self.newton(state, pressure_pa, state.pairs, _NEARLY)
        if reached is None:
            return None
        stuck = self._stuck(state.u_m, reached) if self.stick else None
        pairs, last = self.project(reached.u_m, stuck), np.inf
        for _ in range(self.updates):
            again = self.newton(reached, pressure_pa, pairs, _ENOUGH)
            if again is None:
                return self.newton(reached, pressure_pa, reached.pairs, _ENOUGH) if keeps else None
            before, reached, pairs = reached, again, self.project(again.u_m, stuck)
            change = self._change(reached, pairs)
            if change < self.settled:
                break
            if change > _SWINGING * last:
                pairs = self.project((before.u_m + reached.u_m) / 2, stuck)
            last = change
        return reached

    def _change(self, state: State, pairs: FacePairs) -> float:
        """Largest change of penetration over a side's length by other pairs [-]."""
        depths = np.zeros((2, 1 + max(p.point.max(initial=0) for p in (state.pairs, pairs))))
        for depth, seen in zip(depths, (state.pairs, pairs), strict=True):
            depth[seen.point] = np.maximum(-self.gaps(seen, state.u_m), 0.0) / seen.length_m
        return float(np.ptp(depths, axis=0).max())

    def _stuck(self, before: Real, state: State) -> FacePairs:
        """Pairs that touch now and stick from where they first did, between the displacements before and those now."""
        pairs, free = state.pairs, replace(state.pairs, slid_m=np.zeros_like(state.pairs.slid_m))
        gaps, slips = ([of(free, u) for u in (before, state.u_m)] for of in (self.gaps, self.slips))
        touched = gaps[1] < 0
        share = np.clip(gaps[0] / np.where(touched, gaps[0] - gaps[1], np.inf), 0.0, 1.0)
        since = slips[0] + np.where(gaps[0] > 0, share, 0.0)[:, None] * (slips[1] - slips[0])
        slid = np.where(pairs.sticks[:, None], pairs.slid_m, since)
        return replace(pairs, slid_m=slid, sticks=touched).some(touched)


def curve(problem: Problem, pressures_pa: Sequence[float], longest_pa: float) -> Iterator[State]:
    """Equilibria at increasing pressures, and at each step between; ends where steps fail.

    Steps are of at most ``longest_pa``, or more while no faces touch.
    """
    state = problem.start()
    yield state
    state = before = problem.lowered(state, min(pressures_pa[1], longest_pa))
    step, cuts = _LONGER * longest_pa, 0
    for target in pressures_pa[1:]:
        while state.pressure_pa < target:
            step = min(step, longest_pa if problem.touches(state) else _LONGER * longest_pa)
            left = target - state.pressure_pa
            aim = target if left < step * (1 + _ROUNDING) else state.pressure_pa + step
            is_long = aim - state.pressure_pa > longest_pa * (1 + _ROUNDING)
            reached = problem.stepped(state, aim, before, is_long=is_long, keeps=cuts >= _MOST_CUTS)
            if reached is not None:
                before, state, step = state, reached, 2 * step
                yield state
                continue
            cuts, step = cuts + (not is_long), longest_pa if is_long else min(step, left) / 2
            if cuts > _MOST_CUTS + _MORE_CUTS:
                return
