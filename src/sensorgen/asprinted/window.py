"""The unit cell of a print: one period of the drawing, from the middle of the sensor.

G-code is rounded to a micrometre, so that no printed period repeats another exactly: a model that looks for mirrors
would have to solve the whole sensor. The drawing's mirrors say where a period starts and ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import shapely
from shapely.affinity import translate

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput
from sensorgen.scene.layers import LayerRegions, Region, cleaned, drawn, parts
from sensorgen.scene.repetition import repeat
from sensorgen.scene.scene import SLIVER_MM, Point, Scene, rounded
from sensorgen.scene.sections import square_to
from sensorgen.scene.unit_cell import Band, Slice, affordable

ROUNDED_MM = 2e-3  # edges nearer than this are one: G-code has three decimals


@dataclass(frozen=True)
class Window:
    """A rectangle in plan [mm].

    Attributes
    ----------
    x_mm, y_mm : (float, float)
        Its sides [mm].
    repeats : (bool, bool)
        Whether the pattern goes on by shifts along x and y; else by mirrors.
    """

    x_mm: Point
    y_mm: Point
    repeats: tuple[bool, bool] = (False, False)

    def sides_mm(self) -> Point:
        """Lengths along x and y [mm]."""
        return rounded(self.x_mm[1] - self.x_mm[0]), rounded(self.y_mm[1] - self.y_mm[0])

    def area_mm2(self) -> float:
        """Area [mm2]."""
        x, y = self.sides_mm()
        return x * y


@lru_cache(maxsize=64)  # by whatever walls a drawing is printed, its period is the same
def window(scene: Scene, boundaries_mm: tuple[float, ...]) -> Window:
    """One period of a drawing near its middle, along x and y.

    It starts and ends where least conducts in the patterned layers, so that a cog that is printed lopsided is whole.
    Along an axis without mirrors that repeat it is the whole sensor.

    Parameters
    ----------
    scene : Scene
        The drawing.
    boundaries_mm : tuple of float
        Of its layers, from the bed up [mm].
    """
    conducting = {body.name for body in scene.bodies if body.terminal}
    (x, one), (y, other) = (_period(drawn(scene, boundaries_mm), conducting, scene.size_mm, axis) for axis in (0, 1))
    return Window(x, y, (one, other))


def inside(plan: Window, whole: Scene, layers: Sequence[LayerRegions]) -> Window:
    """The period of a rectangle inside a border that cuts it: as wide as a fifth of it where nothing changes across.

    Parameters
    ----------
    plan : Window
        Of the rectangle.
    whole : Scene
        The rectangle.
    layers : sequence of LayerRegions
        Inside the border.

    Raises
    ------
    BadInput
        The border cuts this period.
    """
    sides = []
    for axis, (low, high) in zip("xy", (plan.x_mm, plan.y_mm), strict=True):
        uniform = len(square_to(whole, axis)) == 1
        sides.append((0.4 * high + 0.6 * low, 0.6 * high + 0.4 * low) if uniform else (low, high))
    period_window = Window(sides[0], sides[1], plan.repeats)
    box = shapely.box(sides[0][0], sides[1][0], sides[0][1], sides[1][1])
    if not any(
        shapely.covers(shapely.union_all(list(layer.regions.values())).buffer(SLIVER_MM), box) for layer in layers
    ):
        raise BadInput("the border cuts the period in the middle of the sensor; expected one that leaves it whole")
    return period_window


def _period(
    layers: Sequence[LayerRegions], conducting: set[str], size_mm: Sequence[float], axis: int
) -> tuple[Point, bool]:
    """A period along an axis, and whether it repeats by shifts."""
    end, wide = size_mm[axis], size_mm[1 - axis]
    patterned = [layer for layer in layers if layer.along != "xy"[axis]]
    if all(layer.along for layer in patterned):
        low, high = _of_strips(
            list({region for layer in patterned for region in layer.regions.values()}), size_mm, axis
        )
        width, shifts = high - low, False
    else:
        repeated = repeat([region for layer in patterned for region in layer.regions.values()], size_mm, axis)
        low, shifts = repeated.low_mm, repeated.shifts
        width = (repeated.high_mm - low) / (2 if shifts else 1)
    middle = int((end / 2 - low) // width)
    starts = [low + k * width for k in range(middle - 3, middle + 3)]
    inside = [s for s in starts if s > -SLIVER_MM and s + 2 * width < end + SLIVER_MM]
    if not inside:
        return (0.0, end), False
    conductors = [layer.region(name) for layer in patterned for name in conducting]

    def crossed(at: float) -> int:
        strip = [at - SLIVER_MM, 0.0, at + SLIVER_MM, wide]
        return int(shapely.intersects(conductors, shapely.box(*(strip if axis == 0 else np.roll(strip, 1)))).sum())

    start = min(inside, key=lambda s: (crossed(s), abs(s + width - end / 2)))
    return (start, start + 2 * width), shifts


def _of_strips(regions: Sequence[Region], size_mm: Sequence[float], axis: int) -> Point:
    """Ends of the cell of strips square to an axis, between mirrors [mm]."""
    end, wide = size_mm[axis], size_mm[1 - axis]
    places = np.unique(np.append(shapely.get_coordinates(regions)[:, axis], [0.0, end]))
    # A face sampled just below leaves slivers: their middle is where the drawing's mirrors see the edge. An edge so
    # near to the sensor's end is where the other periods have it, and the end is there too.
    groups = np.split(places, np.flatnonzero(np.diff(places) > SLIVER_MM) + 1)
    places = np.array([groups[0][-1], *(group.mean() for group in groups[1:-1]), groups[-1][0]])
    middles = (places[:-1] + places[1:]) / 2
    x, y = (middles, wide / 2) if axis == 0 else (wide / 2, middles)
    looks = np.array([shapely.contains_xy(region, x, y) for region in regions], dtype=bool)
    # Slices of one level band each, named by all that stands there
    bands = [(Band(look.tobytes().hex(), "", (0.0, 0.0), (1.0, 1.0)),) for look in looks.T.reshape(len(middles), -1)]
    strips = [Slice(a, b, band) for (a, b), band in zip(pairwise(places.tolist()), bands, strict=True)]
    piece = affordable(tuple(strips)).slices
    return piece[0].left_mm, piece[-1].right_mm


def cut(layers: Sequence[LayerRegions], to: Window) -> list[LayerRegions]:
    """The part of some layers within a window, moved to the origin, with edges that rounding parted made one [mm]."""
    (x0, x1), (y0, y1) = to.x_mm, to.y_mm
    moved = []
    for layer in layers:
        inside = {n: translate(shapely.clip_by_rect(r, x0, y0, x1, y1), -x0, -y0) for n, r in layer.regions.items()}
        moved.append(layer.mapped(inside))
    drawn = shapely.get_coordinates([region for layer in moved if layer.along for region in layer.regions.values()])
    places = []  # edges, rising, and where each goes: to the middle of those that rounding parted, or to the side
    for axis, side in enumerate(to.sides_mm()):
        edges = np.unique(np.append(drawn[:, axis], [0.0, side]))
        groups = np.split(edges, np.flatnonzero(np.diff(edges) >= ROUNDED_MM) + 1)
        middles = [np.full(len(g), round(float(g.mean()), 6)) for g in groups[1:-1]]
        places.append((edges, np.concatenate([0.0 * groups[0], *middles, 0.0 * groups[-1] + side])))
    return [layer.mapped({n: _moved(r, places, layer.along) for n, r in layer.regions.items()}) for layer in moved]


def _moved(region: Region, places: list[tuple[Real, Real]], along: str) -> Region:
    """A region with its edges where they belong; slanted ones on a grid of the file's decimals."""
    if along:
        sides = zip(places * 2, shapely.bounds(parts(region)).T, strict=True)
        x0, y0, x1, y1 = (to[np.searchsorted(of, at)] for (of, to), at in sides)
        wide = (x1 > x0) & (y1 > y0)
        return shapely.union_all(shapely.box(x0, y0, x1, y1)[wide])
    high = np.array([to[-1] for _, to in places])

    def to_sides(at: Real) -> Real:
        return np.where(at < ROUNDED_MM, 0.0, np.where(at > high - ROUNDED_MM, high, at))

    return cleaned(shapely.transform(shapely.set_precision(region, ROUNDED_MM / 2), to_sides))


def evened(layers: Sequence[LayerRegions], to: Window, within_mm: float = np.inf) -> list[LayerRegions]:
    """Layers of a window with each strip as far to one side as its mirror image is to the other [mm].

    For crossed strips, whose lopsided cell would take sixteen times the bricks, and for cells that rounding alone made
    lopsided: as they are where a strip would move by ``within_mm`` or more. Widths stay; a strip that is printed a
    little aside moves to its place, which changes the field in second order.
    """
    sides, even = np.array([*to.sides_mm(), *to.sides_mm()]), []
    for layer in layers:
        regions = dict(layer.regions)
        for name, region in regions.items() if layer.along else ():
            bounds = shapely.bounds(parts(region))
            mirrored = (sides - bounds)[::-1][:, [2, 3, 0, 1]]
            if np.abs(mirrored - bounds).max(initial=0.0) >= 2 * within_mm:
                return list(layers)
            middle = ((bounds + mirrored - sides) / 2).round(9).round(6) + sides / 2  # alike to both sides
            middle = np.where((bounds <= 0) | (bounds >= sides), bounds, middle)  # sides have more decimals
            regions[name] = shapely.union_all(shapely.box(*middle.round(9).T))
        even.append(layer.mapped(regions))
    return even
