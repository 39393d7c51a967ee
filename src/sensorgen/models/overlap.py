"""Electrodes that do not cover the sensor: closed-form bounds with the fringe at their edges, in free air.

Flux that runs straight up where the electrodes overlap bounds the capacitance from below. From above, a potential that
depends on the height alone over the electrodes, and goes to its mean within some distance beside, above and below them.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import chain, pairwise, product
from math import cos, inf, log, pi

import numpy as np
import shapely

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.bounds import Interval
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.scene.layers import Region
from sensorgen.scene.scene import FLOATING, SLIVER_MM, Body, Scene
from sensorgen.scene.slabs import Slab, is_open, slabs

SOURCE = "Dirichlet's and Thomson's principles"
COST = 1
WIDTH = inf  # the bounds have the width that they have

_BESIDE = (0.5, 1.0, 2.0, 4.0)  # distances within which the potential goes to its mean, in electrode gaps
_ABOVE = (2.0, 4.0, 8.0, 16.0, 32.0)
_RINGS = 6  # of such a distance
_QUARTER = 8  # chords of a quarter of a circle
_GRID_MM = 1e-6


def why_not_applicable(scene: Scene) -> str | None:
    """Why the model does not apply to a scene, or None."""
    if {body.terminal for body in scene.bodies} - {"", "top", "bottom", FLOATING}:
        return "more than two electrodes: use sensorgen stack"
    if any(scene.repeats):
        return "a cell of a pattern that repeats by shifts"
    if missing := {"top", "bottom"} - {body.terminal for body in scene.bodies}:
        return f"the scene has no {min(missing)} electrode"
    if not is_open(scene):
        return "both electrodes cover the sensor: the other models apply"
    if _gap_mm(scene) <= SLIVER_MM:
        return "the electrodes reach into each other"
    return None


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:  # noqa: ARG001
    r"""Bounds of the capacitance between the terminals, fringes at the electrodes' edges included.

    .. math:: C_{lower} = \varepsilon_0 \int \frac{dA}{\sum_k t_k / \varepsilon_k}

    over the places where one electrode lies above the other, conductors that float left out of the sum; and

    .. math:: C_{upper} = \varepsilon_0 \int \varepsilon_r |\nabla u|^2 dV, \quad u = 1/2 + w(x, y) (v(z) - 1/2),

    w falling from 1 to 0 within a distance of the conductors' plan, v from 0 to 1 between the electrodes' heights and
    back to 1/2 within a distance above and below: the least over some distances.

    Parameters
    ----------
    scene : Scene
        Whole, as drawn or printed, for which :func:`why_not_applicable` is None.
    permittivity : mapping of str to float
        Relative permittivity of each material that does not conduct, and of "air" [-].
    width : float
        Not used: the bounds have one width.

    Returns
    -------
    Interval
        Capacitance of the whole sensor [F].

    Raises
    ------
    KeyError
        A material has no permittivity.
    """
    eps = {body: permittivity[body.material] for body in scene.bodies if not body.terminal}
    least = sum(_upright(look, area, eps, permittivity["air"]) for look, area in _columns(scene))
    most = min(
        _energy(scene, eps, permittivity["air"], beside * _gap_mm(scene), above * _gap_mm(scene))
        for beside, above in product(_BESIDE, _ABOVE)
    )
    return Interval(least, most).times(EPS0_F_PER_M * M_PER_MM)


def _heights(scene: Scene, which: str) -> tuple[float, float]:
    own = [p.span("z") for body, p in scene.pieces if body.terminal == which]
    return min(low for low, _ in own), max(high for _, high in own)


def _gap_mm(scene: Scene) -> float:
    """Height between the electrodes; 0 or less where they reach into each other [mm]."""
    (b0, b1), (t0, t1) = _heights(scene, "bottom"), _heights(scene, "top")
    return max(t0 - b1, b0 - t1)


@lru_cache(maxsize=4)
def _columns(scene: Scene) -> tuple[tuple[tuple[tuple[float, Body | None], ...], float], ...]:
    """Stacks of thickness and body, None for air, from below, each with the area of the columns that have it [mm2]."""
    layers = slabs(scene)
    regions = {id(r): r for slab in layers for r in slab.inner.values() if not r.is_empty}
    lines = shapely.union_all(shapely.boundary(list(regions.values())), grid_size=_GRID_MM)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines).tolist()))
    inside, area = shapely.point_on_surface(faces), shapely.area(faces)
    bodies: list[Body | None] = [None, *scene.bodies]
    fill = np.zeros((len(layers), len(faces)), int)
    for row, slab in zip(fill, layers, strict=True):
        for body, region in slab.inner.items():
            row[_within(region, inside)] = bodies.index(body)
    looks, which = np.unique(fill.T, axis=0, return_inverse=True)
    areas = np.bincount(which.ravel(), area, len(looks))
    thick = [slab.high_mm - slab.low_mm for slab in layers]
    return tuple(
        (tuple((t, bodies[k]) for t, k in zip(thick, look, strict=True)), float(a))
        for look, a in zip(looks.tolist(), areas.tolist(), strict=True)
    )


def _within(region: Region, points: Real) -> Whole:
    return np.asarray(shapely.STRtree(shapely.get_parts(region)).query(points, predicate="within")[0])


def _upright(
    look: Sequence[tuple[float, Body | None]], area_mm2: float, eps: Mapping[Body, float], air: float
) -> float:
    """Capacitance of straight flux in columns, over eps0 [mm]."""
    total, last, reduced = 0.0, "", 0.0
    for thick, body in look:
        end = body.terminal if body else ""
        if end in ("bottom", "top"):
            total += area_mm2 / reduced if last not in ("", end) and reduced > 0 else 0.0
            last, reduced = end, 0.0
        elif end != FLOATING:
            reduced += thick / (eps[body] if body else air)
    return total


def _energy(scene: Scene, eps: Mapping[Body, float], air: float, beside_mm: float, above_mm: float) -> float:
    """Energy of the potential within some distances, over eps0 at 1 V [mm]."""
    rings = _rings(scene, beside_mm)
    weight = np.array([1.0, *(((_RINGS - k) / _RINGS) ** 2 for k in range(_RINGS))])  # of w squared: most in each ring
    areas = np.array([ring.area for ring in rings])
    bottom, top = _heights(scene, "bottom"), _heights(scene, "top")
    floats = [p.span("z") for body, p in scene.pieces if body.terminal == FLOATING]
    floor, roof = sorted((min(bottom[1], top[1]), max(bottom[0], top[0])))
    heights = [*chain(bottom, top, *floats)]
    low, high = min(heights), max(heights)
    most = max((air, *eps.values()))
    compliance, seen = 0.0, 0.0  # of the slabs between the electrodes in series, and their height
    for slab in slabs(scene):
        thick = min(slab.high_mm, roof) - max(slab.low_mm, floor)
        seen += max(thick, 0.0)
        if thick > SLIVER_MM and not any(body.terminal == FLOATING for body in slab.outer):
            compliance += thick / float(weight @ _permittivity_areas(slab, rings, areas, eps, air))
    compliance += max(roof - floor - seen, 0.0) / float(air * (weight @ areas))  # heights at which there is air alone
    between = 1 / compliance if compliance else inf
    outer = most * float(weight @ areas) / (2 * above_mm)
    # Of the way down to the mean beside the conductors: (v - 1/2)^2 over all heights
    tall = (high - low) / 4 + above_mm / 6
    fall = most * tall * float(areas[1:].sum()) / beside_mm**2
    return between + outer + fall


def _permittivity_areas(
    slab: Slab, rings: Sequence[Region], areas: Real, eps: Mapping[Body, float], air: float
) -> Real:
    """Integral of the permittivity over each ring [mm2]."""
    total = air * areas
    for body, region in slab.outer.items():
        if body in eps and eps[body] > air:
            total = total + (eps[body] - air) * shapely.area(shapely.intersection(rings, region))
    return np.asarray(total)


@lru_cache(maxsize=16)
def _rings(scene: Scene, beside_mm: float) -> tuple[Region, ...]:
    """The conductors' plan, and rings around it out to a distance, none too small."""
    own = [region for slab in slabs(scene) for body, region in slab.outer.items() if body.terminal]
    wide = beside_mm / cos(pi / 4 / _QUARTER)  # chords of arcs lie inside them
    plan = shapely.union_all(own)
    grown = [plan, *(shapely.buffer(plan, wide * k / _RINGS, quad_segs=_QUARTER) for k in range(1, _RINGS + 1))]
    return (plan, *(shapely.difference(b, a) for a, b in pairwise(grown)))


def edge_fringe_f(
    perimeter_m: float, gap_m: float, across_m: float, electrode_m: float = 0.0, permittivity: float = 1.0
) -> float:
    r"""Capacitance that the edge adds to that between the faces of two equal plates [F].

    .. math:: \Delta C = \frac{\varepsilon_0 \varepsilon P}{2 \pi}
              \left[1 + \ln\frac{2 \pi b}{d} + (1 + x) \ln(1 + x) - x \ln x\right], \quad x = e / d

    Parameters
    ----------
    perimeter_m, gap_m, across_m, electrode_m : float
        P, distance d of the plates, their width b and thickness e [m]; b above d.
    permittivity : float
        Of all space, relative: 1 is the least and the film's the most of a film that ends with the plates [-].

    Notes
    -----
    Palmer, AIEE Trans. 46 (1937) 363, of a strip; thickness by Kirchhoff, as in Maxwell, Treatise, art. 202.

    Examples
    --------
    >>> round(edge_fringe_f(0.22, 0.3e-3, 10e-3) * 1e12, 2)  # of 89 pF with a permittivity of 3, in pF
    1.97
    """
    x = electrode_m / gap_m
    thick = (1 + x) * log(1 + x) - x * log(x) if x else 0.0
    return EPS0_F_PER_M * permittivity * perimeter_m / (2 * pi) * (1 + log(2 * pi * across_m / gap_m) + thick)
