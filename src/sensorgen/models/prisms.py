"""Finite elements on prisms of polygons: bounds for layers of any shape, with conductors that float.

The part of a scene between its mirrors, or one period of it, is solved by
:mod:`sensorgen.solvers.electrostatics.prisms` on finer and finer meshes. Needs NGSolve. See docs/cells.md.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.util import find_spec
from itertools import chain, pairwise, product

import numpy as np
import shapely
from shapely.affinity import translate

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.bounds import Interval
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.scene.connections import groups
from sensorgen.scene.layers import Region, parts
from sensorgen.scene.repetition import Repeat, halved, raster, repeat, widened
from sensorgen.scene.scene import FLOATING, SLIVER_MM, Body, Scene, dielectrics
from sensorgen.scene.slabs import Slab, is_open, slabs
from sensorgen.solvers.electrostatics import bounds as fem
from sensorgen.solvers.electrostatics.prisms import BOTTOM, TOP, LayerCell, PrismMesh, plan, solved

SOURCE = "Dirichlet's and Thomson's principles; prisms of triangles, H1 and hybrid H(div) by NGSolve"
COST = 3

WIDTH = 1e-2  # of the interval unless given

_ENDS = {"bottom": BOTTOM, "top": TOP}
_RUNGS = (  # distances of lines from outlines, in electrode gaps; order of the potential; width that it often reaches
    ((2.0, 0.5), 2, 2.5e-2),
    ((0.8, 0.25, 0.08), 2, 1e-2),
    ((0.5, 0.1), 3, 5e-3),
    ((2.0, 0.4, 0.08), 3, 2.5e-3),
    ((2.0, 0.5, 0.12), 4, 1e-3),
)
_SLANTED = ((2.0,), 2, 0.2)  # for slanted bodies first, as all slabs have such lines
_GRID_MM = 1e-6  # to which corners are rounded
_COARSER_MM = (1e-4, 3e-4, 1e-3, 3e-3)  # where outlines nearly coincide
_SLENDER_MM = 2e-5  # height of a triangle below which a coarser grid is better
_STRETCHED = (1.0, 1.13, 0.89)  # distances of lines from outlines, where they come too near others
_COVERS = 0.99  # of the plan, by an electrode's layers together: between round beads there may be holes
_OVERLAP_MM2 = 1e-6
_MOST_MB = 4000.0  # memory of a mesh: more would take too long as well
_FAR = 1.25  # in electrode gaps: from other conductors, where outlines are drawn together
_LOOSE = 0.03  # in electrode gaps: by how much
_AIR = 40.0  # in electrode gaps: air around electrodes that do not cover the sensor
_AROUND = (6.0, 20.0)  # distances of lines from outlines there, in electrode gaps
_SHELL = 0.1  # of that air: thickness of the floating conductor around it
_OPEN_MB = 1500.0  # memory of a mesh with that air: a minute


def why_not_applicable(scene: Scene) -> str | None:
    """Why the model does not apply to a scene, or None."""
    if {body.terminal for body in scene.bodies} - {"", "top", "bottom", FLOATING}:
        return "more than two electrodes: use sensorgen stack"
    if find_spec("ngsolve") is None:
        return "NGSolve is not installed: pip install 'sensorgen[fem]'"
    try:
        cell = _cell(scene)
    except ValueError as error:
        return str(error)
    return "the electrodes touch: the capacitance grows without bound" if cell.gap_mm <= SLIVER_MM else None


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:
    """Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    Parameters, result and errors as of :class:`sensorgen.models.CapacitanceModel`.

    Raises
    ------
    Unsolved
        Outlines too near each other for doubles, or too many of them.

    Notes
    -----
    Corners are rounded to a grid of 1e-6 mm; the bounds are moved outwards by what this does to the conductors'
    outlines, to first order. Where outlines nearly coincide, as those of beads do, the grid is 1e-4 to 3e-3 mm, and the
    bounds are those of two cells that enclose the true one.
    """
    fem.check(permittivity, width)
    return fem.narrowest(steps(scene, permittivity, width))


def steps(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Iterator[fem.FieldStep]:
    """The meshes that :func:`capacitance` goes through, until the interval is narrow enough."""
    cell = _cell(scene)
    layers = cell.layers([permittivity[name] for name in cell.dielectrics])
    first = sum(reach > 2 * width for *_, reach in _RUNGS[:-1])
    failed, reached = None, False
    for factors, order, _ in (*((_SLANTED,) if cell.outer else ()), *_RUNGS[first:]):
        try:
            step = _step(cell, layers, factors, order)
        except (fem.Unsolved, shapely.errors.GEOSException) as error:  # or outlines that rounding makes invalid
            failed = fem.Unsolved(str(error))
            continue
        reached = True
        yield step
        if step.interval.width() <= width:
            return
    if failed and not reached:
        raise failed


def _step(cell: "_Cell", layers: LayerCell, factors: Sequence[float], order: int) -> fem.FieldStep:
    """One mesh, with lines at some distances from outlines, in electrode gaps."""
    beside_mm = [factor * cell.gap_mm for factor in (*(_AROUND if cell.air_mm else ()), *factors)]
    most, (inner, outer) = _OPEN_MB if cell.air_mm else _MOST_MB, _meshes(cell, layers, beside_mm)
    if outer.memory_mb(order) > most:
        raise fem.Unsolved(f"{outer.memory_mb(order):.0f} MB; meshes of up to {most:g} MB are solved")
    energies = solved(inner, outer, order, cell.shares(outer))
    interval = fem.whole(energies, np.outer(cell.x.shares, cell.y.shares).ravel().tolist())
    return fem.FieldStep(order, int(outer.free.sum()), energies.unknowns, interval.times(EPS0_F_PER_M * M_PER_MM))


def _meshes(cell: "_Cell", layers: LayerCell, beside_mm: Sequence[float]) -> tuple[PrismMesh, PrismMesh]:
    """Meshes for the flux and for the potential, with the outlines of a cell, or with such that enclose them.

    The latter where outlines nearly coincide. With air around it, the flux stays in that air, and the potential is
    constant beyond: a conductor that floats.
    """
    if not cell.outer:  # with it, no layer has outlines of its own
        with suppress(fem.Unsolved):  # the grid is too fine, as coarser ones may not be
            if plan(layers, (), _GRID_MM).slenderness_mm() > _SLENDER_MM:
                for times in _STRETCHED:
                    if exact := _exact(cell, layers, [times * far for far in beside_mm]):
                        return exact
    flux = _enclosing(cell, layers, beside_mm, outwards=False)
    return flux, _enclosing(cell, layers, beside_mm, outwards=True)


def _exact(cell: "_Cell", layers: LayerCell, beside_mm: Sequence[float]) -> tuple[PrismMesh, PrismMesh] | None:
    """Meshes with the outlines of a cell; None where their triangles are too slender or cannot be made."""
    far_mm = cell.far_mm()
    with suppress(fem.Unsolved):
        exact = PrismMesh.of(layers, beside_mm, _GRID_MM, far_mm)
        if exact.plan.slenderness_mm() > _SLENDER_MM:
            return exact, PrismMesh.of(cell.inside_shell(layers), beside_mm, _GRID_MM, far_mm) if cell.air_mm else exact
    return None


def _enclosing(cell: "_Cell", layers: LayerCell, beside_mm: Sequence[float], *, outwards: bool) -> PrismMesh:
    """Mesh on the finest coarse grid whose triangles are not too slender, else on the last."""
    from sensorgen.solvers.electrostatics.enclosed import enclosing

    least_mm = _SLENDER_MM / 10 if outwards else _SLENDER_MM  # a potential bears more than a flux
    some = replace(layers, regions=cell.outer) if outwards and cell.outer else layers
    for grid_mm in _COARSER_MM:
        near = enclosing(some, grid_mm, cell.far_mm(), _LOOSE * cell.gap_mm, outwards=outwards)
        if outwards and cell.air_mm:
            near = cell.inside_shell(near)
        mesh = PrismMesh.of(near, beside_mm, grid_mm, cell.far_mm())
        if mesh.plan.slenderness_mm() > least_mm:
            break
    return mesh


@dataclass(frozen=True)
class _Cell:
    """The repeating cell of a scene, as layers of regions.

    Attributes
    ----------
    x, y : Repeat
        Its sides.
    heights_mm : tuple of float
        Planes between layers [mm].
    regions : list of dict of int to Region
        What fills each layer: conductors from 0, then dielectrics; air is left out.
    conductors : int
        How many there are.
    dielectrics : tuple of str
        Their materials, air last.
    gap_mm : float
        Smallest distance of two conductors [mm].
    air_mm : float
        Air around the sensor, where an electrode does not cover it; else 0 [mm].
    open_sides : tuple of (bool, bool)
        Whether that air is beyond the low and the high end, along x and along y.
    outer : list of dict of int to Region
        What fills each layer at any of its heights, where bodies are slanted: ``regions`` is what fills it at all.
    """

    x: Repeat
    y: Repeat
    heights_mm: tuple[float, ...]
    regions: list[dict[int, Region]]
    conductors: int
    dielectrics: tuple[str, ...]
    gap_mm: float
    air_mm: float = 0.0
    open_sides: tuple[tuple[bool, bool], tuple[bool, bool]] = ((False, False), (False, False))
    outer: list[dict[int, Region]] | None = None

    def far_mm(self) -> float:
        """Distance from other conductors beyond which outlines are drawn together; infinite with air around [mm]."""
        return np.inf if self.air_mm else _FAR * self.gap_mm

    def inside_shell(self, layers: LayerCell) -> LayerCell:
        """Layers of it in a shell that conducts and floats: any potential in there goes on as a constant outside."""
        (x0, x1), (y0, y1) = self.open_sides
        thick, (x, y) = _SHELL * self.air_mm, layers.size_mm
        inner = shapely.box(thick * x0, thick * y0, x - thick * x1, y - thick * y1)
        whole, own = shapely.box(0.0, 0.0, x, y), layers.conductors
        ring = whole.difference(inner)
        regions = [
            {kind + (kind >= own): region for kind, region in layer.items()}
            | ({own: ring} if not ring.is_empty else {})
            for layer in layers.regions
        ]
        regions[0] = regions[-1] = {own: whole}
        return replace(layers, regions=regions, conductors=own + 1, in_shell=True)

    def layers(self, permittivity: Sequence[float]) -> LayerCell:
        """For the solver."""
        size = (self.x.high_mm - self.x.low_mm, self.y.high_mm - self.y.low_mm)
        cuts = tuple((side.places_mm[1:-1] - side.low_mm).tolist() for side in (self.x, self.y))
        shifts = self.x.shifts, self.y.shifts
        return LayerCell(
            size, np.array(self.heights_mm), self.regions, self.conductors, permittivity, shifts, (cuts[0], cuts[1])
        )

    def shares(self, mesh: PrismMesh) -> np.ndarray:
        """Number of times that each triangle of a mesh occurs in the sensor, beyond the least (t,)."""
        middle = mesh.plan.points_mm[mesh.plan.triangles].mean(1)
        shares = np.ones(len(middle))
        for at, side in zip(middle.T, (self.x, self.y), strict=True):
            shares *= side.shares[np.searchsorted(side.places_mm[1:-1] - side.low_mm, at)]
        return np.asarray(shares - self.x.shares.min() * self.y.shares.min())


@lru_cache(maxsize=8)
def _cell(scene: Scene) -> _Cell:
    """The cell of a scene; raises ValueError where it is none of upright prisms between two electrodes."""
    slanted = next((b for b, p in scene.pieces if not p.is_constant("z")), None)
    if slanted and is_open(scene) and not any(scene.repeats):
        return _enclosed(scene)
    if slanted:
        raise ValueError(f"{slanted.name} is slanted or curved in elevation: its layers are no prisms")
    layers = slabs(scene)
    patterned = _regions(layers)
    x, y = _sides(scene, patterned)
    whole = shapely.box(x.low_mm, y.low_mm, x.high_mm, y.high_mm)
    half = halved((x, y), [shapely.intersection(r, whole) for r in dict.fromkeys(patterned)])
    try:
        return _numbered(_levels(layers), _within(layers, *half), *half)
    except _Uncovered as error:
        return _surrounded(scene, layers, x, y, error.gap_mm)


def _regions(layers: Sequence[Slab]) -> list[Region]:
    """Regions of all slabs."""
    return [region for slab in layers for region in slab.inner.values()]


def _levels(layers: Sequence[Slab]) -> list[float]:
    """Planes between slabs [mm]."""
    return [layers[0].low_mm, *(slab.high_mm for slab in layers)]


def _sides(scene: Scene, patterned: Sequence[Region]) -> tuple[Repeat, Repeat]:
    """The repeating part along x and y, by what its regions show, or of boxes by their planes."""
    if any(scene.repeats) or not all(p.is_box() for _, p in scene.pieces):
        x, y = (
            Repeat.of(0.0, scene.size_mm[axis], True, scene.size_mm[axis])
            if scene.repeats[axis]
            else repeat(patterned, scene.size_mm, axis)
            for axis in (0, 1)
        )
        return x, y
    bodies = list(scene.bodies)  # the mirrors of :mod:`sensorgen.models.fem3d`
    boxes = raster(scene, bodies.index, len(bodies), [(0.0, size) for size in scene.size_mm])
    y_shares = boxes.shares[0] / boxes.shares[0, 0]
    return _mirrored(boxes.planes_mm[0], boxes.shares[:, 0]), _mirrored(boxes.planes_mm[1], y_shares)


class _Uncovered(ValueError):
    """An electrode that does not cover the sensor, and the electrode gap [mm]."""

    def __init__(self, end: str, gap_mm: float) -> None:
        super().__init__(f"the {end} electrode does not cover the whole sensor")
        self.gap_mm = gap_mm


def _within(layers: Sequence[Slab], x: Repeat, y: Repeat) -> list[dict[Body, Region]]:
    """Regions of slabs inside a cell, from its corner; raises ValueError where they overlap."""
    window = (x.low_mm, y.low_mm, x.high_mm, y.high_mm)
    inside = [
        {body: translate(shapely.clip_by_rect(r, *window), -x.low_mm, -y.low_mm) for body, r in slab.inner.items()}
        for slab in layers
    ]
    if any(
        sum(r.area for r in own.values()) > shapely.union_all(list(own.values())).area + _OVERLAP_MM2 for own in inside
    ):
        raise ValueError("outlines overlap in plan")
    return inside


def _surrounded(scene: Scene, layers: Sequence[Slab], x: Repeat, y: Repeat, gap_mm: float) -> _Cell:
    """A scene whose electrodes do not cover it, whole or by half, with air around, as its ends are not those of a cell.

    Above and below, that air ends in a layer more, which the flux may use and the potential may not.
    """
    if gap_mm <= SLIVER_MM:
        raise ValueError("the electrodes touch: the capacitance grows without bound")
    air, regions, open_ends = _AIR * gap_mm, _regions(layers), []
    sides = [x, y]
    for axis, repeats in enumerate(scene.repeats):
        if not repeats:
            sides[axis] = widened(regions, scene.size_mm, axis, air)
        open_ends.append((not repeats and sides[axis].low_mm < 0, not repeats))
    inside = _within(layers, *sides)
    cell = _numbered(_in_air(_levels(layers), air), [{}, {}, *inside, {}, {}], sides[0], sides[1], air)
    return replace(cell, open_sides=(open_ends[0], open_ends[1]))


def _in_air(levels_mm: Sequence[float], air_mm: float) -> list[float]:
    """Planes with those of the air around, which ends in a layer more [mm]."""
    low, high, thick = levels_mm[0] - air_mm, levels_mm[-1] + air_mm, _SHELL * air_mm
    return [low - thick, low, *levels_mm, high, high + thick]


def _enclosed(scene: Scene) -> _Cell:
    """A scene with slanted bodies whose electrodes do not cover it: what each slab has at all heights, and at any."""
    layers, names = slabs(scene), dielectrics(scene.bodies)
    number, conductors = _numbers(scene.bodies, names)
    heights = _levels(layers)
    gap_mm = _gap_mm([_merged(slab.outer, number) for slab in layers], heights, conductors)
    if not SLIVER_MM < gap_mm < np.inf:
        raise ValueError("slanted electrodes are nearer than the slabs that they are cut into")
    air = _AIR * gap_mm
    every = [r for slab in layers for own in (slab.inner, slab.outer) for r in own.values() if not r.is_empty]
    x, y = (widened(every, scene.size_mm, axis, air) for axis in (0, 1))
    window = shapely.box(0.0, 0.0, x.high_mm - x.low_mm, y.high_mm - y.low_mm)
    corner = x.low_mm, y.low_mm
    inner = [_clipped(_merged(slab.inner, number, corner), window) for slab in layers]
    outer = [_clipped(_merged(slab.outer, number, corner), window) for slab in layers]
    sides = ((x.low_mm < 0, True), (y.low_mm < 0, True))
    around = tuple(_in_air(heights, air))
    return _Cell(
        x, y, around, [{}, {}, *inner, {}, {}], conductors, names, gap_mm, air, sides, [{}, {}, *outer, {}, {}]
    )


def _clipped(own: Mapping[int, Region], window: Region) -> dict[int, Region]:
    return {k: shapely.multipolygons(parts(shapely.intersection(r, window, grid_size=1e-9))) for k, r in own.items()}


def _numbers(bodies: Sequence[Body], names: Sequence[str]) -> tuple[dict[Body, int], int]:
    """Number of each body, of an electrode, of a conductor that floats, or of its dielectric; and of conductors."""
    floating = [body for body in bodies if body.terminal == FLOATING]
    number, conductors = {body: 2 + k for k, body in enumerate(floating)}, 2 + len(floating)
    number |= {body: _ENDS[body.terminal] for body in bodies if body.terminal in _ENDS}
    return number | _dielectrics(bodies, conductors, names), conductors


def _merged(
    own: Mapping[Body, Region], number: Mapping[Body, int], corner_mm: tuple[float, float] = (0.0, 0.0)
) -> dict[int, Region]:
    """Regions of a slab by number, from a corner; bodies without a number are left out."""
    by_number: dict[int, list[Region]] = defaultdict(list)
    for body, region in own.items():
        if body in number and not region.is_empty:
            by_number[number[body]].append(translate(region, -corner_mm[0], -corner_mm[1]))
    return {k: shapely.union_all(regions) for k, regions in by_number.items()}


def _mirrored(planes: Real, shares: Real) -> Repeat:
    """The sides of a cell between mirrors, by the planes of its boxes and how often what lies between them occurs."""
    change = np.flatnonzero(np.diff(shares)) + 1
    places = planes[[0, *change, len(shares)]]
    return Repeat(float(places[0]), float(places[-1]), False, places, shares[[0, *change]])


def _numbered(
    levels_mm: list[float], inside: list[dict[Body, Region]], x: Repeat, y: Repeat, air_mm: float = 0.0
) -> _Cell:
    """A cell with a number for each conductor, those that touch one, and each dielectric."""
    slab, terminals, plans = _pieces(inside)
    sizes = (x.high_mm - x.low_mm, y.high_mm - y.low_mm)
    one, other = _touching(plans, sizes, (x.shifts, y.shifts))
    near = abs(slab[one] - slab[other]) < 2
    kinds = _conductors(groups(len(slab), one[near], other[near]).tolist(), terminals)
    conductors = len({BOTTOM, TOP, *kinds.tolist()})
    uncovered = _uncovered(plans, kinds, sizes)
    low, high = int(slab[kinds == BOTTOM].min()), int(slab[kinds == TOP].max())
    if uncovered:  # the field leaves the electrodes
        low, high = 0, len(inside) - 1
    names, regions = dielectrics(chain.from_iterable(inside[low : high + 1])), []
    for k in range(low, high + 1):
        here = kinds[slab == k]
        metal = {kind: shapely.union_all(plans[slab == k][here == kind]) for kind in np.unique(here).tolist()}
        regions.append(metal | _merged(inside[k], _dielectrics(inside[k], conductors, names)))
    heights = tuple(levels_mm[low : high + 2])
    gap_mm = _gap_mm(regions, heights, conductors)
    if uncovered and not air_mm:
        raise _Uncovered(uncovered, gap_mm)
    return _Cell(x, y, heights, regions, conductors, names, gap_mm, air_mm)


def _pieces(inside: Sequence[Mapping[Body, Region]]) -> tuple[Whole, list[str], np.ndarray]:
    """Number of the slab, terminal and outline of every piece of a conductor."""
    pieces = [(k, body.terminal, part) for k, own in enumerate(inside) for body, region in own.items() if body.terminal
              for part in parts(region)]  # fmt: skip
    return np.array([k for k, *_ in pieces]), [end for _, end, _ in pieces], np.array([part for *_, part in pieces])


def _touching(plans: np.ndarray, sizes_mm: tuple[float, float], shifts: tuple[bool, bool]) -> Whole:
    """Pairs of plans (2, n) that touch, also across sides beyond which the pattern goes on by shifts."""
    ways = product(*((0.0, size) if shifted else (0.0,) for size, shifted in zip(sizes_mm, shifts, strict=True)))
    every = np.concatenate([shapely.transform(plans, lambda p, to=to: p + to) for to in ways])
    pairs = shapely.STRtree(every).query(every, predicate="dwithin", distance=SLIVER_MM)
    return np.asarray(pairs % max(len(plans), 1))


def _dielectrics(bodies: Iterable[Body], first: int, names: Sequence[str]) -> dict[Body, int]:
    """Number of each body's dielectric, by its material; air is left out."""
    return {b: first + names.index(b.material) for b in bodies if not b.terminal and b.material != "air"}


def _conductors(connected: Sequence[int], terminals: Sequence[str]) -> Whole:
    """Number of the conductor that each piece is a part of; raises ValueError where bottom and top are connected."""
    numbers: dict[int, int] = {}
    for piece, terminal in zip(connected, terminals, strict=True):
        if terminal in _ENDS and numbers.setdefault(piece, _ENDS[terminal]) != _ENDS[terminal]:
            raise ValueError("the electrodes touch: the capacitance grows without bound")
    for piece in connected:
        numbers.setdefault(piece, len({*numbers.values(), BOTTOM, TOP}))
    return np.array([numbers[piece] for piece in connected], int)


def _uncovered(plans: np.ndarray, kinds: np.ndarray, sizes_mm: tuple[float, float]) -> str:
    """The electrode that does not cover the whole cell, or ""; raises ValueError where there is none."""
    own = {name: plans[kinds == end] for name, end in _ENDS.items()}
    if missing := [name for name, region in own.items() if not len(region)]:
        raise ValueError(f"the scene has no {missing[0]} electrode")
    whole = _COVERS * sizes_mm[0] * sizes_mm[1]
    return next((name for name, region in own.items() if shapely.union_all(region).area < whole), "")


def _gap_mm(regions: Sequence[dict[int, Region]], heights_mm: Sequence[float], conductors: int) -> float:
    """Smallest distance of an electrode from another conductor [mm]."""
    spans = list(pairwise(heights_mm))
    least = np.inf
    for (i, one), (j, other) in product(enumerate(regions), repeat=2):
        apart = max(spans[i][0] - spans[j][1], spans[j][0] - spans[i][1], 0.0)
        for end in {BOTTOM, TOP} & one.keys() if apart < least else ():
            for kind in (k for k in other if k < conductors and k != end):
                least = min(least, float(np.hypot(shapely.distance(one[end], other[kind]), apart)))
    return least
