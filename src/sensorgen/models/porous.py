"""Effective stiffness of a dielectric that is printed with sparse infill, as bounds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np
import shapely

from sensorgen.core.arrays import Real
from sensorgen.core.bounds import Interval
from sensorgen.scene.layers import overlay_parts
from sensorgen.scene.scene import Piece, Scene, shadow
from sensorgen.scene.sections import Layer, SectionColumn

SOURCE = "Wiener (1912), Gent & Lindley (1959), Hashin & Shtrikman (1962, 1963), Gibson & Ashby (1997)"
COST = 0
_POINTS = 4000  # along all edges of a plan


@dataclass(frozen=True)
class Filling:
    """Filling between two flat electrodes.

    Attributes
    ----------
    gap_mm : float
        Between the electrodes [mm].
    share : float
        Of the volume that is solid [-].
    modulus_pa : Interval
        Stress on the whole area over the relative change of the gap, at small strain [Pa].
    bend_per_pa : float
        At most, how much the upper electrode bends into the air below it, relative to that [1/Pa].
    """

    gap_mm: float
    share: float
    modulus_pa: Interval
    bend_per_pa: float = 0.0

    def rise_powers(self, permittivity: float) -> Interval:
        r"""Powers n of :math:`C \propto (1 - e)^{-n}` under a strain e [-].

        1 where the share of the solid stays; where its volume stays, the share rises, and with it the permittivity
        along Wiener's bounds, of which the steeper is taken.
        """
        eps, share = permittivity, self.share
        walls = share * (eps - 1) / (share * eps + 1 - share)
        layers = share * (1 - 1 / eps) / (share / eps + 1 - share)
        return Interval(1.0, 1 + max(walls, layers))


def filling(scene: Scene, modulus_pa: Mapping[str, float]) -> Filling | None:
    r"""Share and stiffness of what lies between flat electrodes; None where they are not flat, or nothing stands.

    At least the columns that are solid from electrode to electrode carry, each free to bulge; at most each level stays
    flat (Voigt in each level, Reuss over the levels), its solids held like plates bonded to both sides:

    .. math:: \sum_k a_k \left(\sum_j \frac{h_j}{E_{jk}}\right)^{-1} \le \frac{E}{d} \le
              \left(\sum_j \frac{h_j}{s_j \sum_k a_k E_{jk}}\right)^{-1},
              \quad s_j = \frac{4}{3} \left(1 + \frac{w_j^2}{4 d^2}\right)

    with the columns' shares a of the area, the levels' heights h, the gap d and the width w of a level's widest solid
    (Gent and Lindley, 1959, for s). The lower one is a bound for faces that slide or stick, the upper an estimate.
    Under a pressure p the upper electrode, E and h thick, bends by at most the mean deflection 2 p r^4 / 15 D,
    D = E h^3 / 12, of a strip on two edges that are free to turn, r from its middle: no place of it is farther from
    what stands under it.

    Parameters
    ----------
    scene : Scene
        A cell.
    modulus_pa : mapping of str to float
        Young's modulus by material [Pa].
    """
    try:
        columns = [(part.depth_mm * (c.right_mm - c.left_mm), c) for part in overlay_parts(scene) for c in part.columns]
    except ValueError:
        return None
    areas = [a for a, _ in columns]
    area = np.array(areas) / sum(areas)
    ends = {_gap(column) for _, column in columns}
    if len(ends) != 1 or (gap := ends.pop()) is None:
        return None
    levels, moduli = _moduli([column for _, column in columns], gap, modulus_pa)
    height = np.diff(levels)
    with np.errstate(divide="ignore"):
        standing = float(area @ (1 / (height / moduli).sum(axis=1)))
    if not standing:
        return None
    d = gap[1] - gap[0]
    flat = float(1 / (height / (_shape_factors(scene, levels, d) * (area @ moduli))).sum())
    share = float(area @ ((moduli > 0) @ height)) / d
    return Filling(d, share, Interval(d * standing, d * flat), _bend_per_pa(scene, levels, moduli, area, modulus_pa))


def _bend_per_pa(
    scene: Scene, levels: Sequence[float], moduli: Real, area: Real, modulus_pa: Mapping[str, float]
) -> float:
    """Bend of the upper electrode over the highest level that has air, as :class:`Filling` has it."""
    airy = np.flatnonzero((moduli == 0).any(axis=0))
    if not airy.size:
        return 0.0
    middle = (levels[airy[-1]] + levels[airy[-1] + 1]) / 2
    (material, *_), top = zip(*((body.material, p) for body, p in scene.pieces if body.terminal == "top"), strict=True)
    reach = _farthest_mm(top, [p for body, p in scene.pieces if not body.terminal and p.cut("z", middle)])
    stiffness = modulus_pa[material] * float(np.ptp([p.span("z") for p in top])) ** 3 / 12
    open_ = moduli[:, airy[-1]] == 0
    air = (moduli[open_] == 0) @ np.diff(levels)
    return float(area[open_] @ (1 / air) / area[open_].sum()) * 2 / 15 * reach**4 / stiffness


def _farthest_mm(whole: Sequence[Piece], standing: Sequence[Piece]) -> float:
    """Largest distance in plan from a place of some pieces to the nearest of others, which are drawn by points [mm]."""
    plate, *under = (shapely.union_all([shapely.Polygon(shadow(p, "z")) for p in ps]) for ps in (whole, standing))
    edges = [shapely.segmentize(shapely.boundary(one), shapely.length(one) / _POINTS) for one in (plate, *under)]
    places = shapely.get_coordinates([edges[0], shapely.voronoi_polygons(edges[1], only_edges=True)])
    places = places[shapely.intersects_xy(plate, *places.T)]
    tree = shapely.STRtree(shapely.get_parts(under[0]))
    return float(tree.query_nearest(shapely.points(places), all_matches=False, return_distance=True)[1].max())


def _moduli(
    columns: Sequence[SectionColumn], gap: tuple[float, float], modulus_pa: Mapping[str, float]
) -> tuple[list[float], Real]:
    """Heights [mm] at which anything between the electrodes begins or ends, and moduli of columns between them [Pa]."""
    between = [[one for one in column.layers if not one.body.terminal and _inside(one, gap)] for column in columns]
    faces = chain.from_iterable((one.bottom_mm[0], one.top_mm[0]) for one in chain.from_iterable(between))
    levels = sorted({*gap, *(round(z, 9) for z in faces)})
    return levels, np.array([[_modulus(of, (a + b) / 2, modulus_pa) for a, b in pairwise(levels)] for of in between])


def _gap(column: SectionColumn) -> tuple[float, float] | None:
    """Heights between the electrodes of a column [mm]; None where one is missing or slanted."""
    low = [one for one in column.layers if one.body.terminal == "bottom"]
    high = [one for one in column.layers if one.body.terminal == "top"]
    if not (low and high) or np.ptp([(one.bottom_mm, one.top_mm) for one in low + high], axis=2).any():
        return None
    return round(low[-1].top_mm[0], 9), round(high[0].bottom_mm[0], 9)


def _inside(layer: Layer, gap: tuple[float, float]) -> bool:
    return gap[0] - 1e-9 <= min(layer.bottom_mm) and max(layer.top_mm) <= gap[1] + 1e-9


def _modulus(layers: list[Layer], z: float, modulus_pa: Mapping[str, float]) -> float:
    """Of what is at a height, 0 of air [Pa]."""
    return next((modulus_pa[one.body.material] for one in layers if one.bottom_mm[0] < z < one.top_mm[0]), 0.0)


def _shape_factors(scene: Scene, levels: Sequence[float], gap_mm: float) -> Real:
    """Modulus of plates as wide as the widest solid of each level, bonded to both sides, over that of free ones [-]."""
    spans = [[p.span(axis) for axis in "xyz"] for body, p in scene.pieces if not body.terminal]
    widest = [
        max(min(x[1] - x[0], y[1] - y[0]) for x, y, (low, high) in spans if low < (a + b) / 2 < high)
        for a, b in pairwise(levels)
    ]
    return np.asarray(4 / 3 * (1 + (np.array(widest) / (2 * gap_mm)) ** 2))
