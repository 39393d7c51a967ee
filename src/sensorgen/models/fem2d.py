"""Finite elements on the cross-section: a potential from above, a flux from below, as near as asked.

Triangles shrink towards every corner where the field is singular, and polynomials of rising order fill them: the
distance of the bounds falls exponentially. See docs/cells.md.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TypeVar

import numpy as np

from sensorgen.cells import cell
from sensorgen.interval import Disc, Interval
from sensorgen.models import _fem_bounds as fem
from sensorgen.models._fem_corners import exponents
from sensorgen.models._fem_grading import graded
from sensorgen.models._fem_lossy import Fields, Turned, disc, turned
from sensorgen.models._fem_triangles import TERMINALS, Triangles, triangles
from sensorgen.scene import Scene
from sensorgen.sections import Section, sections
from sensorgen.units import EPS0_F_PER_M, M_PER_MM

SOURCE = "Dirichlet's and Thomson's principles; hp finite elements graded at corners (NGSolve)"
COST = 2

WIDTH = 1e-4  # of the interval, where the caller does not say
NEEDS = "NGSolve is not installed: pip install 'sensorgen[fem]'"

_ORDERS = (4, 20)  # of polynomials: the lowest and the highest
_CORNER_SHARE = 0.01  # of the wanted width: what may stay unresolved at a corner
_SMALLEST_SHARE = 1e-12
_GAIN = 1.2  # by which an order lowers the width, in e-folds, as measured
_STEP = 2  # of orders, where the field is complex
_STALLED = 0.7  # a step that leaves more of the width than this gains nothing


def unfit(scene: Scene) -> str | None:
    """Why this model cannot speak of this scene, or None."""
    if find_spec("ngsolve") is None:
        return NEEDS
    try:
        _triangles(scene)
    except ValueError as error:
        return str(error)
    return fem.third_electrode(scene)


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:
    r"""Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    .. math:: 2 Q(D) - \int \frac{|D|^2}{\varepsilon} \le C \le \int \varepsilon |\nabla u|^2

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`unfit` is None.
    permittivity : mapping of str to float
        Relative permittivity of each material that lies between the electrodes, and of "air", above 0 [-].
    width : float
        How wide the interval may be, relative to its middle; it is wider where doubles or orders end [-].

    Returns
    -------
    Interval
        Capacitance of the whole sensor [F].

    Raises
    ------
    OutOfRange
        A permittivity is not above 0, or the width is.
    KeyError
        A material between the electrodes has no permittivity.
    ValueError
        The scene is unfit.
    CrossedBounds
        The lower bound lies above the upper one: a fault of the solver.
    Unsolved
        The scene is too slender for doubles at any order.

    Notes
    -----
    Where a sensor ends amid a period, the pattern is thought to go on beyond its ends, and the sensor gets the energy
    that lies within its own length; see :func:`sensorgen.models._fem_bounds.whole`.
    """
    fem.check(permittivity, width)
    best = Interval(0.0, np.inf)
    for step in steps(scene, permittivity, width):
        if step.interval.upper - step.interval.lower < best.upper - best.lower:
            best = step.interval
    return best


@dataclass(frozen=True)
class Step:
    """One mesh and order on the way to an accuracy.

    Attributes
    ----------
    order : int
        Of the polynomials.
    elements, unknowns : int
        Triangles, and the unknowns that they couple.
    interval : Interval
        Capacitance of the whole sensor [F].
    """

    order: int
    elements: int
    unknowns: int
    interval: Interval


def steps(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Iterator[Step]:
    """The orders that :func:`capacitance` goes through, until the interval is narrow enough or gains no more."""
    section, coarse = _triangles(scene)
    values = {material: permittivity[material] for material, _ in coarse.regions}
    mesh = graded(coarse, exponents(coarse, values), max(_CORNER_SHARE * width, _SMALLEST_SHARE))
    last, order = np.inf, _first(width)
    while order <= _ORDERS[1]:
        try:
            interval, unknowns = _solved(mesh, values, order)
        except fem.Unsolved:
            if last < np.inf:
                return  # doubles end here: what was solved before stands
            if order - 3 < _ORDERS[0]:
                raise
            order -= 3
            continue
        here = interval.times(EPS0_F_PER_M * M_PER_MM * section.depth_mm)
        yield Step(order, len(mesh.triangles), unknowns, here)
        if here.width() <= width or here.width() > _STALLED * last:
            return
        order, last = order + _more(here.width(), width), here.width()


def _first(width: float) -> int:
    """The order to begin with, as measured."""
    return int(np.clip(round(2.3 - 1.25 * np.log10(width)), *_ORDERS))


def _more(now: float, width: float) -> int:
    """How many orders to add for a width, when the last had another; 4 at most."""
    return int(np.clip(np.ceil(np.log(now / width) / _GAIN), 1, 4))


def lossy(scene: Scene, permittivity: Mapping[str, complex], width: float = WIDTH) -> Disc:
    r"""Complex capacitance where materials lose or leak, between the terminals.

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`unfit` is None.
    permittivity : mapping of str to complex
        Relative permittivity of each material between the electrodes, and of "air"; real part above 0,
        :math:`\varepsilon' (1 - j\tan\delta) - j / (\omega\varepsilon_0\varrho)` [-].
    width : float
        How wide the disc may be, relative to its centre's modulus; wider where doubles or orders end [-].

    Returns
    -------
    Disc
        Capacitance of the whole sensor [F]; see :mod:`sensorgen.models._fem_lossy`.

    Raises
    ------
    OutOfRange, KeyError, ValueError, Unsolved
        As :func:`capacitance`.
    """
    fem.check(permittivity, width)
    section, coarse = _triangles(scene)
    values = {material: complex(permittivity[material]) for material, _ in coarse.regions}
    turn = turned(values.values())
    moduli = {material: abs(value) for material, value in values.items()}
    mesh = graded(coarse, exponents(coarse, moduli), max(_CORNER_SHARE * width, _SMALLEST_SHARE))
    best = _disc(mesh, values, turn, _first(width))
    for order in range(_first(width) + _STEP, _ORDERS[1] + 1, _STEP):
        if best.width() <= width:
            break
        try:
            found = _disc(mesh, values, turn, order)
        except fem.Unsolved:
            break  # doubles end here: what was solved before stands
        gain = found.width() / best.width()
        best = min(best, found, key=Disc.width)
        if gain > _STALLED:
            break
    return best.times(EPS0_F_PER_M * M_PER_MM * section.depth_mm)


def _disc(mesh: Triangles, permittivity: Mapping[str, complex], turn: Turned, order: int) -> Disc:
    import ngsolve as ng

    names, eps, weights = _by_region(mesh, permittivity)
    solved = fem.Solved.of(_for_ngsolve(mesh, names), eps, order, order - 1)
    rho = ng.CoefficientFunction([turn.weight[e] for e in eps])
    slope, missed = solved.slope(), solved.eps * solved.slope() + solved.flux
    energy, part = solved.integrals(solved.eps * slope * slope, weights)
    _, size = solved.integrals((rho * slope * ng.Conj(slope)).real, weights)
    apart, _ = solved.integrals((missed * ng.Conj(missed)).real / rho, ())
    found = Fields(solved.lower(), energy, part, size, apart, solved.unknowns)
    return disc(found, turn, [share for _, share in mesh.regions])


def _triangles(scene: Scene) -> tuple[Section, Triangles]:
    """The scene's only cross-section, and its repeating cell in few triangles."""
    found = sections(scene)
    if len(found) > 1:
        raise ValueError(f"{len(found)} different cross-sections: the field runs in all three directions")
    return found[0], triangles(cell(found[0], scene.size_mm[2]))


def _solved(mesh: Triangles, permittivity: Mapping[str, float], order: int) -> tuple[Interval, int]:
    found = _energies(mesh, permittivity, order)
    return fem.whole(found, [share for _, share in mesh.regions]), found.unknowns


def _energies(mesh: Triangles, permittivity: Mapping[str, float], order: int) -> fem.Energies:
    names, eps, weights = _by_region(mesh, permittivity)
    return fem.energies(_for_ngsolve(mesh, names), eps, weights, order, order - 1)


_Region = tuple[str, float]
_Number = TypeVar("_Number", float, complex)


def _by_region(mesh: Triangles, values: Mapping[str, _Number]) -> tuple[list[_Region], list[_Number], list[float]]:
    """All regions, and of each its permittivity, and how often it occurs beyond the least."""
    names = sorted(set(mesh.regions))
    least = min(share for _, share in names)
    return names, [values[m] for m, _ in names], [s - least for _, s in names]


def _for_ngsolve(mesh: Triangles, names: list[_Region]) -> fem.Mesh:
    edges = {name: [e for e, end in mesh.terminals.items() if end == name] for name in TERMINALS}
    return fem.Mesh(
        mesh.points,
        np.array(mesh.triangles, dtype=np.int32),
        np.array([names.index(r) for r in mesh.regions], dtype=np.int32),
        {name: np.array(found, dtype=np.int32) for name, found in edges.items()},
    )
