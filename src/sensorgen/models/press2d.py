"""Prismatic cells under pressure: plane-strain finite elements with contact, and the capacitance when deformed.

Near-incompressible neo-Hookean solids at large strain; gaps close and open, without friction or sticking. Each answer
is checked: load reached, volume kept, faces not run into each other, work equal to the energy stored.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import BadInput, OutOfRange
from sensorgen.interval import Interval
from sensorgen.models import compression
from sensorgen.models._press.cell import AIR, Cell, cell_of
from sensorgen.models._press.mesh import Fineness, Unmeshed, mesh_of
from sensorgen.models._press.support import CHOICES, Held
from sensorgen.scene import Scene

if TYPE_CHECKING:
    from sensorgen.models._press.load import Problem, State

SOURCE = (
    "neo-Hookean plane strain, displacement with bubble and pressure (Crouzeix and Raviart 1973), penalty contact with "
    "frozen partners; bounds of the capacitance by Dirichlet's and Thomson's principles"
)
COST = 2

__all__ = ["Elastic", "Fineness", "Held", "Pressed", "cell", "compared", "curve_of", "press", "unfit"]

_PENALTY = 10.0  # over the least Young's modulus of a solid [-]
_LEAST_PENALTY_PA = 60e6
_STEP = 1 / 600  # longest load step over the least Young's modulus: 10 kPa for 6 MPa [-]
_LEAST_VOLUME = 0.2  # J below which a triangle says nothing any more [-]
_DEEPEST = 0.3  # penetration over the side it happens on [-]
_BALANCE = 0.01  # by which work and energy may differ [-]
_LEVELS = 0.01  # by which two meshes may differ [-]
_FIELD_GROWTH = 0.5  # of the triangles of the capacitance's mesh, per distance [-]
_NARROW = 2e-3  # a bracket of the capacitance wider than this is a poor mesh [-]
_COARSER = (4, 8, 16)  # times the size of the triangles at an apex, where the finer ones do not converge [-]

Real = NDArray[np.float64]


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
    """A cell under rising pressure, as far as it converged.

    Attributes
    ----------
    stress_pa, displacement_m : (n,) array
        Pressure on the top, and how far the top has come down on average [Pa], [m].
    capacitance_f_per_m2 : tuple of (Interval or None)
        Bounds for the deformed outlines; None where they could not be meshed [F/m2].
    outlines : tuple of Cell
        The deformed cell at each pressure; empty when no capacitance was asked for.
    volume_ratio, penetration, imbalance : (n,) array
        Least J, largest penetration over the side that it happens on, and work over energy less 1 [-].
    fall_m : float
        How far the top came down before anything carried it: feet that do not touch as drawn [m].
    faults : tuple of str
        Why the answer is not to be trusted; empty when every check holds.
    doubts : tuple of str
        What else to know of it.
    """

    stress_pa: Real
    displacement_m: Real
    capacitance_f_per_m2: tuple[Interval | None, ...]
    outlines: tuple[Cell, ...]
    volume_ratio: Real
    penetration: Real
    imbalance: Real
    fall_m: float
    faults: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    @property
    def converged_pa(self) -> float:
        """Highest pressure that was reached [Pa]."""
        return float(self.stress_pa[-1])


def press(
    cell: Cell,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    held: Held | None = None,
    fineness: Fineness | None = None,
    step: Callable[[float], None] | None = None,
) -> Pressed:
    """Press a cell from above.

    Parameters
    ----------
    cell : Cell
        From :func:`cell`.
    solids : mapping of str to Elastic
        By material.
    stress_pa : sequence of float
        Pressures, from 0 on and rising [Pa].
    permittivity : mapping of str to float, optional
        Relative permittivity by material, with "air"; without it no capacitance is computed [-].
    held : Held, optional
        Base, period, top and contact.
    fineness : Fineness, optional
        Of the mesh.
    step : callable, optional
        Told every pressure of ``stress_pa`` that is reached [Pa].

    Raises
    ------
    OutOfRange
        Pressures do not rise from 0, or a choice of ``held`` is unknown.
    MissingValue
        The mesher is not installed.
    """
    held, fineness = held or Held(), fineness or Fineness()
    _check(stress_pa, held)
    told = step or (lambda _: None)
    first, _ = best, run = _solved(cell, solids, stress_pa, held, fineness, told)
    for factor in _COARSER:
        if not best.faults:
            break
        coarser = replace(fineness, apex_mm=factor * fineness.apex_mm)
        again, other = _solved(cell, solids, stress_pa, held, coarser, told)
        if (again.converged_pa, -len(again.faults)) > (best.converged_pa, -len(best.faults)):
            best, run = replace(again, doubts=(*again.doubts, _coarsened(first, again, coarser))), other
    return _with_fields(best, cell, run, permittivity) if permittivity else best


def _coarsened(first: Pressed, again: Pressed, coarser: Fineness) -> str:
    """What coarser triangles at the apex cost, where the finer ones converged too."""
    both = len(first.stress_pa)
    apart = float(np.abs(again.displacement_m[1:both] / first.displacement_m[1:] - 1).max(initial=0.0))
    known = f"displacement {apart:.1%} off up to {first.converged_pa / 1e3:.4g} kPa" if both > 1 else "error not known"
    return f"triangles of {coarser.apex_mm * 1e3:.3g} um at the apex, because finer ones do not converge: {known}"


def compared(found: Pressed, finer: Pressed) -> Pressed:
    """The finer of two solutions, with a fault where they differ by more than 1 %."""
    n = min(len(found.stress_pa), len(finer.stress_pa))
    apart = float(np.max(np.abs(found.displacement_m[1:n] / finer.displacement_m[1:n] - 1), initial=0.0))
    if apart <= _LEVELS:
        return finer
    return replace(finer, faults=(*finer.faults, f"two meshes differ by {apart:.1%} in displacement"))


def curve_of(pressed: Pressed, name: str = "solved") -> compression.Curve:
    """The law of compression that a solved cell gives, for the sensor.

    Raises
    ------
    OutOfRange
        The solution has faults, or the capacitance is not known at two pressures at least.
    """
    if pressed.faults:
        raise OutOfRange(f"the solved cell is not to be trusted: {'; '.join(pressed.faults)}")
    known = [(p, c.middle()) for p, c in zip(pressed.stress_pa, pressed.capacitance_f_per_m2, strict=True) if c]
    ratio = [c / known[0][1] for _, c in known] if known else []
    return compression.curve(name, SOURCE, [float(p) for p, _ in known], ratio)


def _check(stress_pa: Sequence[float], held: Held) -> None:
    if len(stress_pa) < 2 or stress_pa[0] != 0 or any(b <= a for a, b in pairwise(stress_pa)):
        raise OutOfRange("stresses must begin with 0 and rise, as in 0:100:10")
    for key, choices in CHOICES.items():
        if getattr(held, key) not in choices:
            raise BadInput(f"{key} {getattr(held, key)!r}: expected {' or '.join(choices)}")


@dataclass(frozen=True)
class _Run:
    """What was solved, and the equilibria that were found."""

    problem: "Problem"
    states: "list[State]"


def _solved(
    cell: Cell,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    held: Held,
    fineness: Fineness,
    step: Callable[[float], None],
) -> tuple[Pressed, _Run]:
    from sensorgen.models._press import load

    problem = _problem(cell, solids, held, fineness)
    states = []
    for state in load.curve(problem, stress_pa, _STEP * _softest(cell, solids)):
        states.append(state)
        step(state.pressure_pa)
    width = np.abs(problem.load).sum()
    down = np.array([problem.load @ s.u_m / width for s in states])
    volume = np.array([problem.elements.volume_ratio(s.u_m, s.inner).min() for s in states])
    depth = np.array([_depth(problem.gaps(s.pairs, s.u_m) / s.pairs.length_m) for s in states])
    energy = np.array([problem.elements.energy_j_per_m(s.u_m, s.inner) + problem.contact_energy(s) for s in states])
    stress = np.array([s.pressure_pa for s in states])
    fall = problem.fall_m(states[0])
    imbalance = _imbalance(stress, (down - fall) * width, energy)
    faults = tuple(_faults(stress, stress_pa, volume, depth, imbalance, sum(s.stale > 0 for s in states)))
    found = Pressed(stress, down, (), (), volume, depth, imbalance, fall, faults, _doubts(cell, fall))
    return found, _Run(problem, states)


def _softest(cell: Cell, solids: Mapping[str, Elastic]) -> float:
    """Least Young's modulus [Pa]."""
    return min(solids[r.material].youngs_modulus_pa for r in cell.regions if r.material != AIR)


def _problem(cell: Cell, solids: Mapping[str, Elastic], held: Held, fineness: Fineness) -> "Problem":
    from sensorgen.models._press import contact, element, load, support

    mesh = mesh_of(cell, fineness)
    materials = [solids[r.material] if r.material != AIR else Elastic(1.0, 0.3) for r in cell.regions]
    moduli, ratios = (
        np.array([getattr(m, key) for m in materials])[mesh.region - 1]
        for key in ("youngs_modulus_pa", "poisson_ratio")
    )
    tied = support.tied_nodes(mesh)
    return load.Problem(
        element.Elements(mesh, element.law(moduli, ratios)),
        contact.faces_of(mesh),
        support.free_of(mesh, held, mirrored=True, tied=tied),
        support.top_load(mesh),
        max(_LEAST_PENALTY_PA, _PENALTY * _softest(cell, solids)),
        held.contact == "stick",
        tied,
    )


def _with_fields(found: Pressed, cell: Cell, run: _Run, permittivity: Mapping[str, float]) -> Pressed:
    """The same with the capacitance of the deformed outlines."""
    fields = [_field(cell, run.problem, s.u_m, permittivity) for s in run.states]
    unknown = sum(c is None for c, _ in fields)
    known = [c.middle() for c, _ in fields if c]
    said = {
        f"no capacitance at {unknown} of {len(fields)} stresses: the deformed outlines could not be meshed": unknown
        > 0,
        "the capacitance falls under pressure: some outlines were closed in the wrong place": any(
            after < before * (1 - _LEVELS) for before, after in pairwise(known)
        ),
    }
    return replace(
        found,
        capacitance_f_per_m2=tuple(c for c, _ in fields),
        outlines=tuple(outline for _, outline in fields),
        faults=(*found.faults, *(words for words, holds in said.items() if holds)),
    )


def _doubts(cell: Cell, fall_m: float) -> tuple[str, ...]:
    said = {
        "mirrors stand at both ends of the period, though it is not its own mirror image": not cell.mirrored,
        f"feet hang free as drawn: the top falls {fall_m * 1e6:.4g} um before they carry": fall_m > 0,
    }
    return tuple(words for words, holds in said.items() if holds)


def _depth(gaps: Real) -> float:
    return float(-gaps.min(initial=0.0))


def _field(
    cell: Cell, problem: "Problem", u_m: Real, permittivity: Mapping[str, float]
) -> tuple[Interval | None, Cell]:
    """Capacitance and outlines of a deformed cell; gaps are closed a little more or less where a mesh fails."""
    from sensorgen.models._press import deformed, field

    mesh = problem.elements.mesh
    best: tuple[Interval | None, Cell] = (None, cell)
    for closed in deformed.CLOSED:
        outline = deformed.deformed(cell, mesh, problem.faces, problem.tied, u_m, closed)
        try:
            found = field.capacitance(outline, permittivity, cell.width_mm() / 4, _FIELD_GROWTH)
        except Unmeshed:
            best = best if best[0] else (None, outline)
            continue
        if best[0] is None or found.width() < best[0].width():
            best = found, outline
        if found.width() < _NARROW:
            break
    return best


def _imbalance(stress: Real, moved: Real, energy: Real) -> Real:
    """Work of the load less the energy stored, from the first load on, over the energy stored [-].

    Between two loads stress and displacement follow a power law; before the first, feet may still be landing.
    """
    found = np.zeros(len(stress))
    if len(stress) < 3:
        return found
    powers = np.log(moved[2:] / moved[1:-1]) / np.log(stress[2:] / stress[1:-1])
    work = np.cumsum(powers / (1 + powers) * np.diff((stress * moved)[1:]))
    found[2:] = (work - (energy[2:] - energy[1])) / energy[2:]
    return found


def _faults(stress: Real, asked: Sequence[float], volume: Real, depth: Real, imbalance: Real, stale: int) -> list[str]:
    said = {
        f"converged up to {stress[-1] / 1e3:.4g} of {asked[-1] / 1e3:.4g} kPa": stress[-1] < asked[-1] * (1 - 1e-9),
        f"a triangle is squeezed to {volume.min():.2g} of its volume": volume.min() < _LEAST_VOLUME,
        f"faces run into each other by {depth.max():.2g} of a side": depth.max() > _DEEPEST,
        f"work and energy differ by {imbalance[-1]:.1%}": abs(imbalance[-1]) > _BALANCE,
        f"old contact partners at {stale} of {len(stress)} stresses": stale > 0,
    }
    return [words for words, holds in said.items() if holds]


def unfit(scene: Scene) -> str | None:
    """Why this model cannot speak of a scene, or None."""
    try:
        cell_of(scene, None)
    except BadInput as error:
        return str(error)
    return None


def cell(scene: Scene, period_mm: float | None) -> Cell:
    """The cell of a prismatic scene: half a period between two mirrors where there are such, else a whole one.

    Parameters
    ----------
    scene : Scene
        As drawn or as printed, its support gone.
    period_mm : float or None
        Period of the pattern; None for a scene without one, as a plate [mm].

    Raises
    ------
    BadInput
        The scene is no prism, or shorter than its period.
    """
    return cell_of(scene, period_mm)
