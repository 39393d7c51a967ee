"""Result of a cell under pressure, in two or three dimensions, and the checks of its validity."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.solvers.contact.boundary import CHOICES, BoundaryConditions
from sensorgen.solvers.contact.mesh import TriangleMesh

if TYPE_CHECKING:
    from sensorgen.solvers.contact.bricks import BrickMesh
    from sensorgen.solvers.contact.load import Problem, State

_PENALTY = 60.0  # over the least Young's modulus of a solid [-]
_LEAST_VOLUME = 0.2  # J below which an element's answer is not to be trusted [-]
DEEPEST = 0.3  # penetration over the side it happens on [-]
_BALANCE = 0.01  # by which work and energy may differ [-]
_LEVELS = 0.01  # by which two meshes may differ [-]
_FIRST = 1 / np.array([16, 8, 4, 2, 1])  # of the longest load step: of a cross-section in which contact begins [-]
_SETTLED, _UPDATES = 0.005, 8  # of a cross-section: ``settled`` and ``updates`` of its problem
_NEAR = 0.2  # relative distance of two loads, of which only the one that was asked for is solved [-]

_BY_LOAD = (
    "stress_pa", "displacement_m", "capacitance_f_per_m2", "carried", "volume_ratio", "penetration", "imbalance",
    "apex_m",
)  # fmt: skip

AnyMesh = TypeVar("AnyMesh", TriangleMesh, "BrickMesh")


@dataclass(frozen=True)
class Elastic:
    """Young's modulus [Pa] and Poisson's ratio [-], up to 1/2, which is exactly incompressible."""

    youngs_modulus_pa: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        """Refuse what is no elastic solid."""
        if not (self.youngs_modulus_pa > 0 and 0 < self.poisson_ratio <= 0.5):
            raise OutOfRange(
                f"E {self.youngs_modulus_pa:g} Pa, nu {self.poisson_ratio:g}: "
                "expected E above 0 and nu above 0, up to 0.5"
            )


@dataclass(frozen=True)
class Pressed:
    """A cell under increasing pressure, as far as it converged.

    Attributes
    ----------
    stress_pa, displacement_m : (n,) array
        Pressure on the top, and the mean displacement of the top downwards [Pa], [m].
    capacitance_f_per_m2 : tuple of (Interval or None)
        Bounds for the deformed outlines; None where they could not be meshed [F/m2].
    carried : tuple of bool
        Of each pressure, whether the field's mesh is the undeformed cell's, whose errors its bounds share; empty in
        three dimensions, and without capacitance.
    volume_ratio, penetration, imbalance : (n,) array
        Least J, largest penetration over the side that it happens on, and work over energy less 1 [-].
    fall_m : float
        Displacement of the top before anything carries it: parts that are not supported as drawn [m].
    faults : tuple of str
        Why the answer is not to be trusted; empty when every check holds.
    doubts : tuple of str
        Other remarks.
    source : str
        Method.
    apex_m : tuple of float
        Size of the triangles at an apex, at each pressure [m]; empty where there is no apex.
    """

    stress_pa: Real
    displacement_m: Real
    capacitance_f_per_m2: tuple[Interval | None, ...]
    carried: tuple[bool, ...]
    volume_ratio: Real
    penetration: Real
    imbalance: Real
    fall_m: float
    faults: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    source: str = ""
    apex_m: tuple[float, ...] = ()

    @property
    def converged_pa(self) -> float:
        """Highest pressure that was reached [Pa]."""
        return float(self.stress_pa[-1])

    def sound(self) -> "Pressed":
        """The part before the first pressure at which a check fails, without faults; all where it has no two.

        Pressures of unknown capacitance, as of outlines that could not be meshed, are left out where a later one has
        it.
        """
        bounds = self.capacitance_f_per_m2
        last = max((k for k, c in enumerate(bounds) if c), default=-1)
        holds = self._holds()
        known = self.some([k for k in range(len(self.stress_pa)) if k > last or bounds[k] or not holds[k]])
        n = known.sound_loads()
        return replace(known.some(range(n)), faults=()) if n > 1 else self

    def sound_loads(self) -> int:
        """Number of pressures before the first at which a check fails."""
        known = [c.middle() if c else -np.inf for c in self.capacitance_f_per_m2]
        rises = [b >= a * (1 - _LEVELS) for a, b in pairwise(known)]
        holds = self._holds()
        holds[: len(known)] &= np.isfinite(known) & np.array([True, *rises])
        return len(holds) if holds.all() else int(holds.argmin())

    def _holds(self) -> Mask:
        """Pressures at which volume, penetration and balance of energy are sound."""
        volume = self.volume_ratio >= _LEAST_VOLUME
        return volume & (self.penetration <= DEEPEST) & (abs(self.imbalance) <= _BALANCE)

    def some(self, which: Sequence[int]) -> "Pressed":
        """Some pressures of the curve."""
        rows: dict[str, Any] = {
            name: v[list(which)] if isinstance(v, np.ndarray) else tuple(v[i] for i in which)
            for name in _BY_LOAD
            if len(v := getattr(self, name))
        }
        return replace(self, **rows)


@dataclass(frozen=True)
class LoadSteps(Generic[AnyMesh]):
    """A problem on a mesh and its equilibria, load by load."""

    problem: "Problem"
    mesh: AnyMesh
    states: "list[State]"


def check(stress_pa: Sequence[float], boundary: BoundaryConditions) -> None:
    """Refuse stresses that do not rise from 0, and unknown choices."""
    if len(stress_pa) < 2 or stress_pa[0] != 0 or any(b <= a for a, b in pairwise(stress_pa)):
        raise OutOfRange("stresses must begin with 0 and rise, as in 0:100:10")
    for key, choices in CHOICES.items():
        if getattr(boundary, key) not in choices:
            raise BadInput(f"{key} {getattr(boundary, key)!r}: expected {' or '.join(choices)}")


def penalty_pa(softest_pa: float) -> float:
    """Contact pressure per penetration, times the length of a side [Pa]; ``softest_pa`` is the least modulus."""
    return _PENALTY * softest_pa


def solve(
    mesh: AnyMesh,
    solids: Sequence[Elastic],
    stress_pa: Sequence[float],
    boundary: BoundaryConditions,
    longest: float,
    source: str,
    step: Callable[[float], None] | None,
) -> tuple[Pressed, LoadSteps[AnyMesh]]:
    """Press a mesh of triangles or bricks as far as it converges, and check the result.

    Parameters
    ----------
    mesh : TriangleMesh or BrickMesh
        Of the solid parts of a cell.
    solids : sequence of Elastic
        Of each element.
    stress_pa : sequence of float
        Increasing pressures, from 0 on [Pa].
    boundary : BoundaryConditions
        Base, period, top and contact.
    longest : float
        Load step over the least Young's modulus, at most [-].
    source : str
        Method.
    step : callable, optional
        Called with each pressure that is reached [Pa].
    """
    from sensorgen.solvers.contact.boundary import free_of, top_load
    from sensorgen.solvers.contact.contact import brick_faces_of, faces_of
    from sensorgen.solvers.contact.element import Elements, law
    from sensorgen.solvers.contact.factors import Solver, elimination_order
    from sensorgen.solvers.contact.load import Problem, curve

    ramp: list[float] = []
    moduli, ratios = np.array([[s.youngs_modulus_pa, s.poisson_ratio] for s in solids]).T
    softest, elements = float(moduli.min()), Elements(mesh, law(moduli, ratios))
    load, penalty, stick = top_load(mesh.points_m, *mesh.top()), penalty_pa(softest), boundary.contact == "stick"
    if isinstance(mesh, TriangleMesh):
        faces, outline = faces_of(mesh), mesh.outline

        def sound(places_m: Real) -> bool:
            return not faces.crossed(places_m, outline, DEEPEST)

        free = free_of(mesh.points_m, boundary)
        problem = Problem(elements, faces, free, load, penalty, stick, sound=sound, settled=_SETTLED, updates=_UPDATES)
        problem = replace(problem, free=free[:, elimination_order(problem.pattern[0])])
        ramp = (_FIRST * longest * softest).tolist() if problem.begins_in_contact() else []
    else:
        used = np.isin(np.arange(len(mesh.points_m)), mesh.outer)
        free = free_of(mesh.points_m, boundary, mesh.bricks.spans_m(), used)
        one = free.tocsc().indices[free.tocsc().indptr[:-1]]
        solver = Solver(mesh.lattice[one // 3])
        problem = Problem(elements, brick_faces_of(mesh), free, load, penalty, stick, solver)
    ramp = [p for p in ramp if p < stress_pa[-1] and np.abs(np.divide(stress_pa, p) - 1).min() > _NEAR]
    every, asked = [], []
    for state in curve(problem, sorted({*stress_pa, *ramp}), longest * softest):
        every.append(state)
        if state.pressure_pa in stress_pa:
            asked.append(state)
            if step:
                step(state.pressure_pa)
    return _checked(problem, every, stress_pa, source), LoadSteps(problem, mesh, asked)


def _checked(problem: "Problem", every: "Sequence[State]", stress_pa: Sequence[float], source: str) -> Pressed:
    """Displacements at each load, and the faults of the solution: load, volume, penetration, balance of energy.

    Work is summed over ``every`` load step, so that the balance does not depend on the loads asked for.
    """
    steps = np.array([s.pressure_pa for s in every])
    asked = np.flatnonzero(np.isin(steps, stress_pa)).tolist()
    states, last_pa = [every[k] for k in asked], stress_pa[-1]
    area, fall = np.abs(problem.load).sum(), problem.fall_m(states[0])
    moved = np.array([problem.load @ s.u_m / area for s in every])
    volume = np.array([problem.elements.volume_ratio(s.u_m, s.inner).min() for s in states])
    depth = np.array([-(problem.gaps(s.pairs, s.u_m) / s.pairs.length_m).min(initial=0.0) for s in states])
    energy = np.array([problem.elements.energy_j(s.u_m, s.inner) + problem.contact_energy(s) for s in every])
    imbalance = _imbalance(steps, (moved - fall) * area, energy)[asked]
    stress, down = steps[asked], moved[asked]
    reached, wanted = f"{stress[-1] / 1e3:.4g}", f"{last_pa / 1e3:.4g}"
    faults = {
        f"converged up to {reached} of {wanted} kPa": stress[-1] < last_pa * (1 - 1e-9),
        f"a triangle is squeezed to {volume.min():.2g} of its volume": volume.min() < _LEAST_VOLUME,
        f"faces run into each other by {depth.max():.2g} of a side": depth.max() > DEEPEST,
        f"work and energy differ by {imbalance[-1]:.1%}": abs(imbalance[-1]) > _BALANCE,
    }
    remarks = (f"feet hang free as drawn: the top falls {fall * 1e6:.4g} um before they carry",) if fall > 0 else ()
    wrong = tuple(words for words, holds in faults.items() if holds)
    return Pressed(stress, down, (), (), volume, depth, imbalance, fall, wrong, remarks, source)


def _imbalance(stress: Real, moved: Real, energy: Real) -> Real:
    """Work of the load less the energy stored, from the first load on, over the energy stored [-].

    As far as the sum over load steps tells: less by what it changes where every other step is left out. Where a gap
    closes within a step, the sum is off by a percent, whatever the mesh.
    """
    share, error = np.zeros(len(stress)), np.zeros(len(stress))
    if len(stress) < 3:
        return share
    share[2:] = (_work(stress[1:], moved[1:])[1:] - (energy[2:] - energy[1])) / energy[2:]
    if len(stress) > 3:
        fewer = np.unique([*range(1, len(stress), 2), len(stress) - 1])
        apart = _work(stress[1:], moved[1:])[fewer - 1] - _work(stress[fewer], moved[fewer])
        error = np.interp(np.arange(len(stress)), fewer, np.maximum.accumulate(abs(apart)) / energy[fewer])
    return np.sign(share) * np.maximum(abs(share) - error, 0.0)


def _work(stress: Real, moved: Real) -> Real:
    """Sums of stress by displacement up to each load, from the first on; log displacement is a spline of log stress."""
    (nodes, weights), logs = np.polynomial.legendre.leggauss(6), np.log(stress / stress[0])
    power, knots, half = np.arange(min(4, len(logs))), logs[2:-2], np.diff(logs)[:, None] / 2

    def spline(at: Real) -> Real:  # its functions (..., n), without scipy.interpolate, which takes 0.1 s to load
        return np.concatenate([at[..., None] ** power, np.maximum(at[..., None] - knots, 0.0) ** 3], axis=-1)

    at, law = logs[:-1, None] + half * (1 + nodes), np.linalg.solve(spline(logs), np.log(moved))
    turns = 3 * np.maximum(at[..., None] - knots, 0.0) ** 2
    slope = np.concatenate([power[1:] * at[..., None] ** power[:-1], turns], axis=-1) @ law[1:]
    return np.concatenate([[0.0], np.cumsum((half * stress[0] * np.exp(at + spline(at) @ law) * slope) @ weights)])


def with_capacitances(curve: Pressed, bounds: Sequence[Interval | None]) -> Pressed:
    """Add the capacitance of the deformed outlines, and its faults."""
    faults, known = list(curve.faults), [c.middle() for c in bounds if c]
    if len(known) < len(bounds):
        unknown = len(bounds) - len(known)
        faults.append(
            f"no capacitance at {unknown} of {len(bounds)} stresses: the deformed outlines could not be meshed"
        )
    if any(after < before * (1 - _LEVELS) for before, after in pairwise(known)):
        faults.append("the capacitance falls under pressure: some outlines were closed in the wrong place")
    return replace(curve, capacitance_f_per_m2=tuple(bounds), faults=tuple(faults))


def joined(parts: Sequence[Pressed], last_pa: float) -> Pressed:
    """Solutions that continue each other, as one; each begins with the unloaded cell.

    That one of them ended early is a fault only where none goes on.
    """
    used = [parts[0], *(part for part in parts[1:] if len(part.stress_pa) > 1)]
    whole = _columns(used)
    reached = whole["stress_pa"][-1]
    short = (
        [f"converged up to {reached / 1e3:.4g} of {last_pa / 1e3:.4g} kPa"] if reached < last_pa * (1 - 1e-9) else []
    )
    faults = dict.fromkeys(fault for part in used for fault in part.faults if not fault.startswith("converged up to"))
    doubts = dict.fromkeys(doubt for part in used for doubt in part.doubts)
    return replace(used[0], faults=(*short, *faults), doubts=tuple(doubts), **whole)


def _columns(parts: Sequence[Pressed]) -> dict[str, Any]:
    """Columns by load of solutions that continue each other, each of which begins with the unloaded cell."""
    whole: dict[str, Any] = {}
    for name in _BY_LOAD:
        runs = [getattr(parts[0], name), *(getattr(part, name)[1:] for part in parts[1:])]
        whole[name] = np.concatenate(runs) if isinstance(runs[0], np.ndarray) else tuple(chain.from_iterable(runs))
    return whole


def compared(coarser: Pressed, finer: Pressed) -> Pressed:
    """The finer of two solutions, and by how much they differ: a fault where displacements do by more than 1 %."""
    n = min(len(coarser.stress_pa), len(finer.stress_pa))
    apart = float(np.max(np.abs(coarser.displacement_m[1:n] / finer.displacement_m[1:n] - 1), initial=0.0))
    differ = f"two meshes differ by {apart:.2%} in displacement"
    if apart <= _LEVELS:
        return replace(finer, doubts=(*finer.doubts, differ))
    return replace(finer, faults=(*finer.faults, differ))
