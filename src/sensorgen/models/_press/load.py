"""Newton's method, and load steps that are cut when it fails."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from sensorgen.models._press import contact
from sensorgen.models._press.contact import Faces, Pairs
from sensorgen.models._press.element import Elements, Inner, Tangent

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_ENOUGH = 1e-6  # residual over load
_NEARLY = 1e-3  # the same before the contact partners are looked for anew
_STILL = 1e-10  # a step so much shorter than the way is rounding: nu near 1/2 turns it into forces
_MOST_STEPS = 25
_LEAST_J = 0.05  # a step may not squeeze a triangle below this share of its volume at once [-]
_SHARES = (1.0, 0.5, 0.25, 0.125, 0.0625)
_MOST_CUTS = 8  # failed load steps in all before a cell is given up
_FLAT = 1e-3  # gaps that differ by less than this share of their side close at once [-]
_DEEPEST = 0.1  # how far a foot may sink in to begin with, over the length of a side [-]
_ROUNDING = 1e-9


@dataclass(frozen=True)
class State:
    """An equilibrium: pressure [Pa], displacements (2n) [m], the triangles' own unknowns, and its contact."""

    pressure_pa: float
    u_m: Real
    inner: Inner
    pairs: Pairs
    stuck: Pairs | None = None
    cuts: int = 0
    stale: int = 0


@dataclass(frozen=True)
class Problem:
    """A cell that is pressed.

    Attributes
    ----------
    elements : Elements
        Its triangles.
    faces : Faces
        What may touch.
    free : sparse
        Displacements from the free ones.
    load : (2n,) array
        Forces of a unit pressure [m].
    penalty_pa : float
        Contact pressure per penetration, times the length of the side [Pa].
    stick : bool
        What has touched sticks.
    tied : (k, 2) array
        Nodes that move as one.
    """

    elements: Elements
    faces: Faces
    free: csr_matrix
    load: Real
    penalty_pa: float
    stick: bool = False
    tied: Whole = field(default_factory=lambda: np.empty((0, 2), np.int64))

    def start(self) -> State:
        """Nothing presses."""
        u = np.zeros(len(self.load))
        return State(0.0, u, self.elements.start(), self.project(u))

    def rested(self, state: State, pressure_pa: float) -> State:
        """The start, with what hangs loose let down until it rests on what is below it.

        It sinks in as far as the penalty needs to carry a pressure, because a contact that only just touches has no
        stiffness to begin with.
        """
        pairs = contact.carrying(state.pairs, self.loose)
        if not pairs.point.size:
            return state
        gap = self.gaps(pairs, state.u_m)
        first = gap < gap.min() + _FLAT * pairs.length_m
        sunk = pressure_pa * np.abs(self.load).sum() / pairs.stiffness_pa[first].sum()
        u = state.u_m.copy()
        u[1::2] -= self.loose * (gap.min() + min(sunk, _DEEPEST * pairs.length_m[first].min()))
        return replace(state, u_m=u, pairs=self.project(u))

    def fall_m(self, state: State) -> float:
        """How far the top comes down before anything carries it [m]."""
        pairs = contact.carrying(state.pairs, self.loose)
        return float(self.gaps(pairs, state.u_m).min()) if pairs.point.size else 0.0

    @cached_property
    def loose(self) -> NDArray[np.bool_]:
        """Nodes of pieces that nothing holds up."""
        triangles, tied = self.elements.mesh.triangles, self.tied
        starts = np.concatenate([np.repeat(triangles[:, 0], 5), tied[:, 0]])
        ends = np.concatenate([triangles[:, 1:].ravel(), tied[:, 1]])
        nodes = len(self.elements.mesh.points_m)
        _, piece = connected_components(coo_matrix((np.ones(len(starts)), (starts, ends)), (nodes, nodes)))
        moves = np.diff(self.free.indptr)[1::2] > 0
        return ~np.isin(piece, piece[~moves])

    def places(self, u: Real) -> Real:
        """Where the nodes are [m]."""
        return self.elements.mesh.points_m + u.reshape(-1, 2)

    def project(self, u: Real, stuck: Pairs | None = None) -> Pairs:
        """Contact partners at given displacements."""
        return contact.project(self.elements.mesh, self.faces, self.places(u), self.penalty_pa, stuck)

    def gaps(self, pairs: Pairs, u: Real) -> Real:
        """Gap of each pair [m]."""
        return np.asarray(pairs.gap @ self.places(u).ravel())

    @cached_property
    def _places_of_entries(self) -> tuple[Whole, Whole]:
        freedoms = self.elements.freedoms
        return np.repeat(freedoms, 12, axis=1).ravel(), np.tile(freedoms, (1, 12)).ravel()

    def _touching(self, pairs: Pairs, u: Real) -> tuple[Real, csr_matrix]:
        """Forces and stiffness of the contact."""
        gap = self.gaps(pairs, u)
        k = pairs.stiffness_pa * (gap < 0)
        force, stiffness = pairs.gap.T @ (k * gap), pairs.gap.T @ diags(k) @ pairs.gap
        if self.stick:
            k = pairs.stiffness_pa * pairs.sticks
            force = force + pairs.slip.T @ (k * (pairs.slip @ self.places(u).ravel()))
            stiffness = stiffness + pairs.slip.T @ diags(k) @ pairs.slip
        return force, stiffness

    def contact_energy(self, state: State) -> float:
        """Energy in the penalty, per depth [J/m]."""
        k = state.pairs.stiffness_pa
        gap = self.gaps(state.pairs, state.u_m)
        slip = state.pairs.slip @ self.places(state.u_m).ravel() * state.pairs.sticks
        return float(0.5 * (k * ((gap < 0) * gap**2 + slip**2)).sum())

    def residual(self, u: Real, inner: Inner, pairs: Pairs, pressure_pa: float) -> tuple[Real, csr_matrix, Tangent]:
        """Forces out of balance on the free displacements, their derivative, and the triangles' condensed part."""
        local = self.elements.tangent(u, inner)
        force, stiffness = self._touching(pairs, u)
        np.add.at(force, self.elements.freedoms.ravel(), local.force.ravel())
        whole = (
            coo_matrix((local.stiffness.ravel(), self._places_of_entries), shape=stiffness.shape).tocsr() + stiffness
        )
        return self.free.T @ (force - pressure_pa * self.load), self.free.T @ whole @ self.free, local

    def newton(self, state: State, pressure_pa: float, pairs: Pairs, enough: float) -> State | None:
        """Equilibrium at a pressure with frozen contact partners, or None where it does not converge.

        ``enough`` is the residual to reach, over the load [-].
        """
        u, inner = state.u_m, state.inner
        scale = max(pressure_pa, 1.0) * np.abs(self.free.T @ self.load).max()
        for _ in range(_MOST_STEPS):
            residual, stiffness, local = self.residual(u, inner, pairs, pressure_pa)
            if not np.isfinite(residual).all():
                return None
            if np.abs(residual).max() < enough * scale and local.imbalance() < enough:
                return replace(state, pressure_pa=pressure_pa, u_m=u, inner=inner, pairs=pairs)
            step = _solved(stiffness, -residual)
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

    def stepped(self, state: State, pressure_pa: float) -> State | None:
        """Press on to a pressure: solve, look for the partners anew, and solve again."""
        first = self.newton(state, pressure_pa, state.pairs, _NEARLY)
        if first is None:
            return None
        stuck = self._stuck(first) if self.stick else None
        fresh = self.project(first.u_m, stuck)
        second = self.newton(first, pressure_pa, fresh, _ENOUGH)
        if second is None:
            settled = self.newton(first, pressure_pa, first.pairs, _ENOUGH)
            return replace(settled, stale=first.stale + 1) if settled else None
        return replace(second, stuck=stuck, stale=0)

    def _stuck(self, state: State) -> Pairs:
        return contact.stuck(state.pairs, self.gaps(state.pairs, state.u_m) < 0)


def _solved(stiffness: csr_matrix, right: Real) -> Real | None:
    """The step that a force makes, or None where a piece has nothing that holds it."""
    try:
        found: Real = splu(stiffness.tocsc()).solve(right)
    except RuntimeError:  # exactly singular
        return None
    return found


def curve(problem: Problem, pressures_pa: Sequence[float], longest_pa: float) -> Iterator[State]:
    """Equilibria at rising pressures, in steps of at most ``longest_pa``; ends early where even small steps fail."""
    state = problem.start()
    yield state
    state = problem.rested(state, min(pressures_pa[1], longest_pa))
    step = longest_pa
    for target in pressures_pa[1:]:
        while state.pressure_pa < target:
            left = target - state.pressure_pa
            reached = problem.stepped(state, target if left < step * (1 + _ROUNDING) else state.pressure_pa + step)
            if reached is not None:
                state, step = reached, min(2 * step, longest_pa)
                continue
            state, step = replace(state, cuts=state.cuts + 1), min(step, left) / 2
            if state.cuts > _MOST_CUTS:
                return
        yield state
