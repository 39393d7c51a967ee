"""Finite elements on the cross-section: bounds from a potential above and a flux below, to a given width.

Triangles shrink towards every corner where the field is singular, and polynomials of rising order fill them: the
distance of the bounds falls exponentially. See docs/cells.md.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.bounds import Disc, Interval
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.models import refusal
from sensorgen.scene.repetition import cell
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import Section, sections
from sensorgen.solvers.electrostatics import bounds as fem
from sensorgen.solvers.electrostatics.bounds import Fields, Turned, disc, turned
from sensorgen.solvers.electrostatics.elimination import Numbers
from sensorgen.solvers.electrostatics.mesh import Cones, exponents, graded
from sensorgen.solvers.electrostatics.plane import RATIO, Field, Plane
from sensorgen.solvers.electrostatics.triangles import Triangles, triangles

SOURCE = "Dirichlet's and Thomson's principles; hp finite elements, rings without end at corners"
COST = 2

WIDTH = 1e-4  # of the interval unless given

Bounded = TypeVar("Bounded", Interval, Disc)

_ORDERS = (3, 20)  # of polynomials: the lowest and the highest
_CORNER_SHARE = 0.01  # of the wanted width: what may stay unresolved at a corner
_LOST = 32 * 2.0**-53  # of the moduli of all terms of a sum: what doubles lose of it; up to 4 roundings, measured
_MOST_DOUBLINGS = 12  # of rings at a corner: 4096 of them
_GAIN = 1.6  # by which an order lowers the width, in e-folds, as measured
_STALLED = 0.7  # a step that leaves more of the width than this gains nothing


def why_not_applicable(scene: Scene) -> str | None:
    """Why the model does not apply to a scene, or None."""
    return fem.unmirrored(scene) or refusal(ValueError, _triangles, scene)


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:
    r"""Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    .. math:: 2 Q(D) - \int \frac{|D|^2}{\varepsilon} \le C \le \int \varepsilon |\nabla u|^2

    Parameters, result and errors as of :class:`sensorgen.models.CapacitanceModel`.

    Raises
    ------
    Unsolved
        The scene is too slender for doubles at any order.

    Notes
    -----
    Where a sensor ends amid a period, the pattern is continued periodically beyond its ends; only the energy
    within the sensor's length counts; see :func:`sensorgen.solvers.electrostatics.bounds.whole`.
    """
    fem.check(permittivity, width)
    return fem.narrowest(steps(scene, permittivity, width))


def steps(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Iterator[fem.FieldStep]:
    """The orders that :func:`capacitance` goes through, until the interval is narrow enough or gains no more."""
    section, coarse = _triangles(scene)
    shares = [share for _, share in coarse.regions]
    whole = EPS0_F_PER_M * M_PER_MM * section.depth_mm
    return narrowed(coarse, permittivity, lambda found: fem.whole(found, shares).times(whole), width)


def narrowed(
    coarse: Triangles, permittivity: Mapping[str, float], interval: Callable[[fem.Energies], Interval], width: float
) -> Iterator[fem.FieldStep]:
    """Meshes and orders on the way to an accuracy of a quantity that the energies of a field give.

    Parameters
    ----------
    coarse : Triangles
        Few, of the same field.
    permittivity : mapping of str to float
        Of each material, or whatever else the flux is proportional to.
    interval : callable
        From the energies of one mesh and order to bounds of the quantity.
    width : float
        How wide these may be, relative to their middle [-].
    """
    values = {material: permittivity[material] for material, _ in coarse.regions}
    mesh = _graded(coarse, values, width)

    def solved(order: int) -> tuple[int, Interval]:
        energies = _solved(mesh, values, order)
        return energies.unknowns, interval(energies)

    for order, (unknowns, here) in _orders(solved, width):
        yield fem.FieldStep(order, mesh.elements(), unknowns, here)


def _orders(solved: Callable[[int], tuple[int, Bounded]], width: float) -> Iterator[tuple[int, tuple[int, Bounded]]]:
    """Unknowns and bounds by rising orders, until these are narrow enough, gain no more, or doubles end."""
    last, order = np.inf, _first(width)
    while order <= _ORDERS[1]:
        try:
            step = solved(order)
        except fem.Unsolved:
            if last == np.inf:
                raise
            return  # what was solved before stands
        yield order, step
        now = step[1].width()
        if now <= width or now > _STALLED * last:
            return
        order, last = order + _more(now, width), now


def _first(width: float) -> int:
    """The order to begin with, as measured."""
    return int(np.clip(round(0.3 - 1.25 * np.log10(width)), *_ORDERS))


def _more(now: float, width: float) -> int:
    """Number of orders to add for a width, when the last had another; 4 at most."""
    return int(np.clip(np.ceil(np.log(now / width) / _GAIN), 1, 4))


def lossy(scene: Scene, permittivity: Mapping[str, complex], width: float = WIDTH) -> Disc:
    r"""Complex capacitance where materials lose or leak, between the terminals.

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`why_not_applicable` is None.
    permittivity : mapping of str to complex
        Relative permittivity of each material between the electrodes, and of "air"; real part above 0,
        :math:`\varepsilon' (1 - j\tan\delta) - j / (\omega\varepsilon_0\varrho)` [-].
    width : float
        Relative width of the disc; wider where double precision or the highest order limits it [-].

    Returns
    -------
    Disc
        Capacitance of the whole sensor [F]; see :mod:`sensorgen.solvers.electrostatics.bounds`.

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
    mesh = _graded(coarse, moduli, width)
    steps = _orders(lambda order: _disc(mesh, values, turn, order), width)
    best = min((here for _, (_, here) in steps), key=Disc.width)
    return best.times(EPS0_F_PER_M * M_PER_MM * section.depth_mm)


def _disc(mesh: Cones, permittivity: Mapping[str, complex], turn: Turned, order: int) -> tuple[int, Disc]:
    """Unknowns of one order, and where the capacitance lies."""
    plane = Plane(mesh, order)
    eps, weight = _by_triangle(mesh, permittivity)
    rho = np.array([turn.weight[e] for e in eps.tolist()])
    u, psi = _fields(plane, eps)
    energy, square = eps * plane.energies(u, u), plane.energies(u, u.conj()).real
    mixed = (eps * plane.crossings(u, psi.conj())).real
    apart = (abs(eps) ** 2 * square + plane.energies(psi, psi.conj()).real - 2 * mixed) / rho
    off = _rounding(plane, abs(eps), rho, u, psi)
    fields = Fields(
        lower=_thomson(plane, eps, u, psi),
        energy=energy.sum(),
        part=weight @ energy,
        size=float(weight @ (rho * square)),
        apart=max(float(apart.sum()), 0.0) + off,
        unknowns=plane.unknowns,
        rounding=off / abs(energy.sum()),
    )
    return plane.unknowns, disc(fields, turn, [share for _, share in mesh.triangles.regions])


def _triangles(scene: Scene) -> tuple[Section, Triangles]:
    """The scene's only cross-section, and its repeating cell in few triangles."""
    cross_sections = sections(scene)
    if len(cross_sections) > 1:
        raise ValueError(f"{len(cross_sections)} different cross-sections: the field runs in all three directions")
    return cross_sections[0], triangles(cell(cross_sections[0], scene.size_mm[2]))


def _graded(coarse: Triangles, permittivity: Mapping[str, float], width: float) -> Cones:
    """Finer at corners, with as many rings as leave a small share of a width unresolved there."""
    powers = exponents(coarse, permittivity)
    rings = {corner: np.log(_CORNER_SHARE * width) / (2 * value * np.log(RATIO)) for corner, value in powers.items()}
    doublings = {c: int(np.clip(np.ceil(np.log2(max(n, 1.0))), 0, _MOST_DOUBLINGS)) for c, n in rings.items()}
    mesh = Cones(graded(coarse, powers), doublings)
    if mesh.areas().min() <= 0:
        raise fem.Unsolved(
            "a piece of the scene is too thin for its length: double precision does not resolve such triangles"
        )
    return mesh


def _solved(mesh: Cones, permittivity: Mapping[str, float], order: int) -> fem.Energies:
    plane = Plane(mesh, order)
    eps, weight = _by_triangle(mesh, permittivity)
    u, psi = _fields(plane, eps)
    energy = eps * plane.energies(u, u)
    upper, lower = float(energy.sum()), _best_multiple(plane, eps, u, psi)
    off = _rounding(plane, abs(eps), eps, u, psi) / upper
    return fem.Energies(lower, upper, float(weight @ energy), plane.unknowns, off)


def _fields(plane: Plane, eps: NDArray[Any]) -> tuple[Field, Field]:
    """The best potential and the best stream function of one order."""
    try:
        return plane.potential(eps), plane.stream(1 / eps)
    except np.linalg.LinAlgError as error:
        raise fem.Unsolved(f"the solver failed on this scene ({error}); use --model columns") from None


def _thomson(plane: Plane, eps: NDArray[Any], u: Field, psi: Field) -> Any:
    """Twice the flux into the top, evaluated with any potential of 1 V there, less the flux's energy."""
    return 2 * plane.crossings(u, psi).sum() - (plane.energies(psi, psi) / eps).sum()


def _best_multiple(plane: Plane, eps: NDArray[Any], u: Field, psi: Field) -> float:
    """Thomson's bound at the flux that is a multiple of this one and best: slender scenes solve worst for its size."""
    return float(plane.crossings(u, psi).sum() ** 2 / (plane.energies(psi, psi) / eps).sum())


def _rounding(plane: Plane, eps: Numbers, rho: Numbers, u: Field, psi: Field) -> float:
    r"""Rounding error of :math:`\int |\varepsilon \nabla u - D|^2 / \rho`, and each of its three parts with it.

    However badly a system was solved, its potential and its flux bound the capacitance: all that doubles can spoil is
    what these two are worth, by the roundings of each term, and of the triangles' corners.
    """
    terms = eps**2 * plane.energy_terms(u) + plane.energy_terms(psi) + 2 * eps * plane.crossing_terms(u, psi)
    sizes = eps**2 * plane.energies(u, u.conj()).real + plane.energies(psi, psi.conj()).real
    return _LOST * float(((terms + plane.mesh.thinness() * sizes) / rho).sum())


def _by_triangle(mesh: Cones, values: Mapping[str, complex]) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Permittivity of each triangle, and how often it occurs beyond the least."""
    shares = np.array([share for _, share in mesh.triangles.regions])
    return np.array([values[material] for material, _ in mesh.triangles.regions]), shares - shares.min()
