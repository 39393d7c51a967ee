r"""Both bounds of a capacitance for layers of polygons: conforming prisms, H1 above and hybrid H(div) below.

The outlines of all layers, with lines beside those of conductors, are overlaid on a snap grid and triangulated without
further points; the triangles become prisms between planes that crowd where conductors end. A conductor at no terminal
floats: its potential is the one at which its net charge is zero, for each bound by a Schur complement.
"""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import NotInstalled
from sensorgen.solvers.electrostatics.bounds import Energies, Unsolved

BOTTOM, TOP = 0, 1  # numbers of the electrodes among conductors

_MB = 2.1e-3  # of a prism of order 1, measured at orders 2 and 3
_BALANCE = 1e-8  # relative: by which energy and the charges of both electrodes may differ
_SAME_MM = 1e-9
_FAR = 1e9  # beyond all lines
_SET = 0.01
_MANY = 100_000  # unknowns from which threads are used: on fewer they wait, at ten times the processor time
MITRE = 2.0  # of lines beside outlines, in their distance


@dataclass(frozen=True)
class LayerCell:
    """A cell of layers, each of polygons.

    Attributes
    ----------
    size_mm : (float, float)
        Sides of the cell, whose corner is the origin [mm].
    heights_mm : (n + 1,) array
        Planes between layers [mm].
    regions : sequence of n mappings of int to polygons
        What fills each layer, by the number of a conductor, from 0, or of a dielectric, after those; the rest is
        filled by the last dielectric.
    conductors : int
        How many there are: the bottom electrode, the top electrode, and those that float.
    permittivity : sequence of float
        Of each dielectric [-].
    periodic : (bool, bool)
        Whether the cell repeats along x and along y; else its sides are mirrors.
    cuts_mm : (sequence of float, sequence of float)
        Where else along x and y outlines are cut, as by the end of a sensor [mm].
    in_shell : bool
        Whether the last conductor is a shell around the others, far from them.
    encloses : bool
        Whether its outlines enclose those of another cell, as of :mod:`sensorgen.solvers.electrostatics.enclosed`, or
        are enclosed by them; else rounding may have moved them.
    """

    size_mm: tuple[float, float]
    heights_mm: Real
    regions: Sequence[dict[int, Any]]
    conductors: int
    permittivity: Sequence[float]
    periodic: tuple[bool, bool] = (False, False)
    cuts_mm: tuple[Sequence[float], Sequence[float]] = ((), ())
    in_shell: bool = False
    encloses: bool = False


@dataclass(frozen=True)
class PlanTriangles:
    """Triangles in plan, and what fills each in every layer.

    Attributes
    ----------
    points_mm : (p, 2) array
        Corners [mm].
    triangles : (t, 3) array of int
        Counter-clockwise.
    fill : (layers, t) array of int
        Number of the conductor or dielectric.
    """

    points_mm: Real
    triangles: Whole
    fill: Whole

    def slenderness_mm(self) -> float:
        """Smallest height of a triangle [mm]."""
        corners = self.points_mm[self.triangles]
        sides = np.roll(corners, -1, axis=1) - corners
        area = abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
        return float((area / np.hypot(*sides.T).max(0)).min())


def plan(cell: LayerCell, beside_mm: Sequence[float], grid_mm: float) -> PlanTriangles:
    """Overlay of a cell's outlines, triangulated.

    Parameters
    ----------
    cell : LayerCell
        Of polygons.
    beside_mm : sequence of float
        Distances of further lines from the outlines of conductors [mm].
    grid_mm : float
        All corners are rounded to its multiples [mm].

    Raises
    ------
    Unsolved
        The triangles do not fill the cell.
    """
    # In whole numbers of the grid's pitch, of which each side of the cell has some
    count = np.rint(np.array(cell.size_mm) / grid_mm).clip(1)
    pitch = np.array(cell.size_mm) / count
    layers = [
        {kind: shapely.transform(region, lambda p: p / pitch) for kind, region in layer.items()}
        for layer in cell.regions
    ]
    x, y = count.tolist()
    noded = shapely.union_all(_lines(cell, layers, np.array(beside_mm) / grid_mm, pitch, (x, y)), grid_size=1)
    if any(cell.periodic):
        noded = shapely.union_all([noded, _repeated(noded, (x, y), cell.periodic)], grid_size=1)
    faces = shapely.get_parts(shapely.polygonize([noded]))
    pieces, of_face = shapely.get_parts(shapely.constrained_delaunay_triangles(faces), return_index=True)
    corners = np.rint(shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3])
    points, triangles = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    whole = points.astype(np.int64)  # products of 1e8 and more are no whole numbers in doubles
    one, two = (whole[triangles[:, k]] - whole[triangles[:, 0]] for k in (1, 2))
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    triangles = np.where((area > 0)[:, None], triangles, triangles[:, ::-1])
    if int(np.abs(area).sum()) != 2 * int(x) * int(y) or not area.all():
        raise Unsolved(f"outlines nearer to each other than the grid of {grid_mm:g} mm: triangles do not fill the plan")
    return PlanTriangles(points * pitch, triangles, _filled(layers, faces, cell)[:, of_face])


def _lines(
    cell: LayerCell, layers: Sequence[Mapping[int, Any]], distances: Real, pitch_mm: Real, size: tuple[float, float]
) -> list[Any]:
    """Outlines of layers, lines at some distances beside those of conductors, and cuts, in pitches of the grid."""
    x, y = size
    sides = shapely.box(0.0, 0.0, x, y).exterior
    edges = shapely.boundary([region for layer in layers for region in layer.values()])
    metal = [
        shapely.union_all([r for kind, r in layer.items() if kind < cell.conductors - cell.in_shell], grid_size=1)
        for layer in layers
    ]
    lines = [sides, *edges]
    for far in distances.tolist():
        near = [beyond(_simpler(region, far / 5), (x, y), cell.periodic, np.ceil(2 * far)) for region in metal]
        lines.append(shapely.difference(shapely.clip_by_rect(_beside(near, far), 0.0, 0.0, x, y), sides))
    for axis, places in enumerate(cell.cuts_mm):
        lines += [
            shapely.LineString(((at, 0.0), (at, y)) if axis == 0 else ((0.0, at), (x, at)))
            for at in np.rint(np.array(places) / pitch_mm[axis]).tolist()
        ]
    return lines


def _beside(regions: Sequence[Any], far: float) -> Any:
    """Lines at a distance to both sides of the outlines of some regions, drawn together to a tenth of it."""
    wide, narrow = (
        shapely.buffer(regions, way * far, join_style="mitre", mitre_limit=MITRE, quad_segs=2) for way in (1, -1)
    )
    beside = shapely.union_all(shapely.difference(wide, narrow))
    return shapely.boundary(shapely.set_precision(shapely.simplify(beside, far / 10), max(far / 10, 1.0)))


def _simpler(region: Any, by: float) -> Any:
    """A region with fewer corners; itself where it is too narrow for that."""
    simple = shapely.simplify(region, by)
    return simple if shapely.area(simple) > region.area / 2 else region


def beyond(region: Any, size: Sequence[float], periodic: Sequence[bool], far: float) -> Any:
    """A region continued beyond the sides of a cell, by a distance."""
    for axis in (0, 1):
        turn, along = np.eye(2), np.eye(2)[axis]
        if not periodic[axis]:
            turn[axis, axis] = -1.0
        copies = [region]
        for way in (-1, 1):
            shift = along * size[axis] * (way if periodic[axis] else 1 + way)
            copies.append(shapely.transform(region, lambda p, shift=shift, turn=turn: p @ turn + shift))
        low, high = np.full(2, -_FAR), np.full(2, _FAR)
        low[axis], high[axis] = -far, size[axis] + far
        region = shapely.clip_by_rect(shapely.union_all(copies), *low, *high)
    return region


def _repeated(noded: Any, size: Sequence[float], periodic: Sequence[bool]) -> Any:
    """The sides of a cell with the corners of the opposite ones, and one in the middle."""
    points = shapely.get_coordinates(noded)
    lines = []
    for axis in (axis for axis in (0, 1) if periodic[axis]):
        side = points[(points[:, axis] == 0) | (points[:, axis] == size[axis])]
        other = size[1 - axis]
        along = np.unique(np.append(side[:, 1 - axis], [0.0, other // 2, other]))
        for at in (0.0, size[axis]):
            line = np.column_stack([np.full(len(along), at), along])
            lines.append(shapely.linestrings(line if axis == 0 else line[:, ::-1]))
    return shapely.multilinestrings(lines)


def _filled(layers: Sequence[dict[int, Any]], faces: Any, cell: LayerCell) -> Whole:
    """Filling of each face in every layer, by a place inside it."""
    inside = shapely.point_on_surface(faces)
    fill = np.full((len(layers), len(faces)), cell.conductors + len(cell.permittivity) - 1)
    for row, layer in zip(fill, layers, strict=True):
        for kind, region in layer.items():
            row[shapely.STRtree(shapely.get_parts(region)).query(inside, predicate="within")[0]] = kind
    return fill


@dataclass(frozen=True)
class PrismMesh:
    """Prisms between a cell's conductors.

    Attributes
    ----------
    cell : LayerCell
        That is meshed.
    plan : PlanTriangles
        Its triangles.
    heights_mm : (h,) array
        Planes [mm].
    fill : (h - 1, t) array
        Of each prism; conductors among them.
    grid_mm : float
        That corners are rounded to [mm].
    """

    cell: LayerCell
    plan: PlanTriangles
    heights_mm: Real
    fill: Whole
    grid_mm: float

    @classmethod
    def of(cls, cell: LayerCell, beside_mm: Sequence[float], grid_mm: float, reach_mm: float = np.inf) -> "PrismMesh":
        """The prisms of a cell; parameters and errors as of :func:`plan`.

        Planes as far from each level at which a conductor ends within the cell as the lines are from its outlines,
        where another conductor is within reach in height: elsewhere the field is weak.
        """
        flat = plan(cell, beside_mm, grid_mm)
        metal = np.where(flat.fill < cell.conductors, flat.fill, -1)
        padded = np.concatenate([metal[:1], metal, metal[-1:]])
        spans = {
            k: (cell.heights_mm[:-1][own].min(), cell.heights_mm[1:][own].max())
            for k in range(cell.conductors) if (own := (metal == k).any(1)).any()
        }  # fmt: skip
        ends = []
        for z, pair in zip(cell.heights_mm.tolist(), pairwise(padded), strict=True):
            here = set(np.array(pair)[:, pair[0] != pair[1]].ravel().tolist())
            near = any(max(low - z, z - high) <= reach_mm for k, (low, high) in spans.items() if here - {k, -1})
            ends.append(bool(len(np.unique(pair, axis=1).T) > 1 and near))
        heights, owner = [cell.heights_mm[:1]], []
        for k, (low, high) in enumerate(pairwise(cell.heights_mm.tolist())):
            far = np.array([d for d in beside_mm if d < 0.45 * (high - low)])
            inner = np.concatenate([low + far * ends[k], high - far * ends[k + 1], [high]])
            inner = np.unique(inner[inner > low].round(12))
            heights.append(inner)
            owner += [k] * len(inner)
        return cls(cell, flat, np.concatenate(heights), flat.fill[owner], grid_mm)

    @cached_property
    def free(self) -> Mask:
        """Prisms that are no conductor (h - 1, t)."""
        return np.asarray(self.fill >= self.cell.conductors)

    def memory_mb(self, order: int) -> float:
        """About how much memory a flux takes at an order of the potential: a matrix of each prism [MB]."""
        return float(self.free.sum()) * order**4 * _MB

    @cached_property
    def meshed(self) -> Mask:
        """Prisms of the mesh (h - 1, t): those, and conductors across a side that repeats from one of them.

        NGSolve wants both faces of a pair: where a cut through beads meets a conductor on one side only, the conductor
        is meshed too, with all its faces held.
        """
        filled, (near, far, _, _) = self.free.copy(), self._seams.T
        while (more := filled[:, near] & ~filled[:, far]).any():
            layer, which = np.nonzero(more)
            filled[layer, far[which]] = True
        return filled

    @cached_property
    def _kinds(self) -> Whole:
        """Materials of the prisms; conductors that are meshed, of the first dielectric."""
        return np.where(self.free, self.fill, self.cell.conductors)

    @cached_property
    def owner(self) -> Whole:
        """Triangle of each prism, in the order of the elements of NGSolve."""
        which, kinds = np.nonzero(self.meshed)[1], self._kinds[self.meshed]
        return np.asarray(which[np.argsort(kinds, kind="stable")])

    @cached_property
    def netgen(self) -> Any:
        """The mesh of NGSolve; materials are numbered as the dielectrics, boundaries as the conductors."""
        try:
            import netgen.meshing as netgen
            import ngsolve
        except ImportError:
            raise NotInstalled("layers of polygons need NGSolve: pip install 'sensorgen[fem]'") from None
        flat, count = self.plan, len(self.plan.points_mm)
        layer, which = np.nonzero(self.meshed)
        low = flat.triangles[which] + (layer * count)[:, None]
        prisms, kinds = np.concatenate([low, low + count], axis=1), self._kinds[self.meshed]
        # Corners of the cell come first: where sides repeat, NGSolve turns edges by the numbers of their ends, and maps
        # a corner to its images in an order of its own.
        used = np.unique(prisms)
        off = np.minimum(flat.points_mm, abs(flat.points_mm - self.cell.size_mm)).max(axis=1)
        used = used[np.argsort(off[used % count] > _SAME_MM, kind="stable")]
        number = np.full(count * len(self.heights_mm), -1)
        number[used] = np.arange(len(used))
        prisms = number[prisms]
        mesh = netgen.Mesh(3)
        mesh.AddPoints(np.column_stack([flat.points_mm[used % count], self.heights_mm[used // count]]))
        for k in range(self.cell.conductors):
            mesh.Add(netgen.FaceDescriptor(surfnr=k + 1, domin=1, domout=0, bc=k + 1))
            mesh.SetBCName(k, f"c{k}")
        for k in range(len(self.cell.permittivity)):
            own = prisms[kinds == self.cell.conductors + k]
            mesh.AddElements(dim=3, index=k + 1, data=np.ascontiguousarray(own, dtype=np.int32), base=0)
            mesh.SetMaterial(k + 1, f"d{k}")
        for k, faces in self._surfaces():
            mesh.AddElements(dim=2, index=k + 1, data=np.ascontiguousarray(number[faces], dtype=np.int32), base=0)
        for axis in (0, 1):
            if self.cell.periodic[axis]:
                for a, b in self._opposite(axis, used, count):
                    mesh.AddPointIdentification(
                        netgen.PointId(int(number[a]) + 1), netgen.PointId(int(number[b]) + 1),
                        identnr=axis + 1, type=2,
                    )  # fmt: skip
        return ngsolve.Mesh(mesh)

    def _surfaces(self) -> list[tuple[int, Whole]]:
        """Triangles and quadrilaterals at which prisms meet each conductor."""
        flat, count, first = self.plan, len(self.plan.points_mm), self.cell.conductors
        found = []
        for up, down in ((self.fill[1:], self.fill[:-1]), (self.fill[:-1], self.fill[1:])):
            metal = np.where((up >= first) & (down < first), down, first)
            for k in range(first):
                layer, which = np.nonzero(metal == k)
                found.append((k, flat.triangles[which] + ((layer + 1) * count)[:, None]))
        near, far, a, b = np.concatenate([self._neighbours, self._seams]).T
        metal = np.where(self.free[:, near], self.fill[:, far], first)
        metal_too = self.meshed & ~self.free
        metal = np.where(metal_too[:, near], self.fill[:, near], metal)
        for k in range(first):
            layer, which = np.nonzero(metal == k)
            ring = np.column_stack([a[which], b[which], b[which], a[which]]) + (layer * count)[:, None]
            found.append((k, ring + np.array([0, 0, count, count])))
            layer, which = np.nonzero(metal_too & (self.fill == k))
            found += [(k, flat.triangles[which] + ((layer + up) * count)[:, None]) for up in (0, 1)]
        alike = {(k, faces.shape[1]) for k, faces in found}
        return [
            (k, _distinct(np.concatenate([f for one, f in found if (one, f.shape[1]) == (k, corners)])))
            for k, corners in sorted(alike)
        ]

    @cached_property
    def _neighbours(self) -> Whole:
        """Triangles with a neighbour (n, 4): itself, the other, and the two points of their edge."""
        edges, owner = self._edges
        same = np.flatnonzero((edges[1:] == edges[:-1]).all(1))
        return np.concatenate([np.column_stack([owner[same + k], owner[same + 1 - k], edges[same]]) for k in (0, 1)])

    @cached_property
    def _seams(self) -> Whole:
        """Neighbours across sides that repeat, with the points of its own edge."""
        (edges, owner), at = self._edges, self.plan.points_mm
        seams = [np.zeros((0, 4), np.int64)]
        for axis in np.flatnonzero(self.cell.periodic):
            sides = [(abs(at[edges, axis] - end) < _SAME_MM).all(1) for end in (0.0, self.cell.size_mm[axis])]
            rising = [np.flatnonzero(s)[np.argsort(at[edges[s], 1 - axis].sum(1))] for s in sides]
            for here, there in (rising, rising[::-1]):
                seams.append(np.column_stack([owner[here], owner[there], edges[here]]))
        return np.concatenate(seams)

    @cached_property
    def _edges(self) -> tuple[Whole, Whole]:
        """Edges of all triangles (n, 2) in order, and the triangle of each."""
        t = self.plan.triangles
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        order = np.lexsort(edges.T)
        return edges[order], np.tile(np.arange(len(t)), 3)[order]

    def _opposite(self, axis: int, used: Whole, count: int) -> list[tuple[int, int]]:
        """Points on one side, and those on the other, where both are meshed."""
        at, size = self.plan.points_mm, self.cell.size_mm[axis]
        low, high = (np.flatnonzero(abs(at[:, axis] - end) < _SAME_MM) for end in (0.0, size))
        low, high = (side[np.argsort(at[side, 1 - axis])] for side in (low, high))
        if len(low) != len(high) or abs(at[low, 1 - axis] - at[high, 1 - axis]).max() > _SAME_MM:
            raise Unsolved("two sides of a repeating cell have different corners: report this scene")
        there = np.isin(np.arange(count * len(self.heights_mm)), used)
        pairs = [(low + k * count, high + k * count) for k in range(len(self.heights_mm))]
        every = np.concatenate([np.column_stack(pair) for pair in pairs])
        return [(int(a), int(b)) for a, b in every[there[every].all(1)]]


def _distinct(faces: Whole) -> Whole:
    """Faces, each once."""
    return faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]


def solved(inner: PrismMesh, outer: PrismMesh, order: int, weight: Real) -> Energies:
    """Both bounds over eps0 [mm], of a potential of an order and of a flux of one less.

    Parameters
    ----------
    inner, outer : PrismMesh
        Of a cell for the flux, and of the same or of one with more conductor for the potential.
    order : int
        Of the potential's polynomials.
    weight : (t,) array
        Of each triangle of the outer one in ``Energies.part``.

    Raises
    ------
    Unsolved
        Energy and charges of the flux differ: slivers spoil the system.
    """
    upper, part, moved = _upper(outer, order, weight)
    lower, unknowns = _lower(inner, order)
    return Energies(lower, upper, part, unknowns, 0.0 if outer.cell.encloses else moved / upper, outer is not inner)


def _upper(mesh: PrismMesh, order: int, weight: Real) -> tuple[float, float, float]:
    """Energy of the best potential, that of a part, and what the grid may have moved."""
    import ngsolve as ng

    space, cell = mesh.netgen, mesh.cell
    eps, names = _coefficients(mesh)
    plain = ng.H1(space, order=order, dirichlet="|".join(names))
    above = ng.Periodic(plain) if any(cell.periodic) else plain
    u, v = above.TnT()
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True, condense=True)
    upper, potential = balanced(form, lambda f: f, names)
    density = eps * ng.grad(potential) * ng.grad(potential)
    # What the grid may have moved the conductors' upright faces by, to first order
    normal = ng.specialcf.normal(3)
    upright = ng.BoundaryFromVolumeCF(density) * (1 - normal[2] * normal[2])
    moved = mesh.grid_mm / 2**0.5 * ng.Integrate(upright, space, ng.BND, order=2 * order)
    part = 0.0
    if weight.any():
        energies = ng.Integrate(density, space, order=2 * order, element_wise=True).NumPy()
        part = float(energies @ weight[mesh.owner])
    return upper, part, moved


def _lower(mesh: PrismMesh, order: int) -> tuple[float, int]:
    """Thomson's functional of the best flux, and its unknowns."""
    import ngsolve as ng

    eps, names = _coefficients(mesh)
    field, lower, charges, unknowns = fluxes(mesh.netgen, eps, names, order - 1, periodic=any(mesh.cell.periodic))
    energy = ng.Integrate(field * field / eps, mesh.netgen, order=2 * order)
    wrong = max(
        abs(energy - lower), abs(charges[TOP] - lower), abs(charges[BOTTOM] + lower), *map(abs, charges[2:]), 0.0
    )
    if not wrong < _BALANCE * lower:
        raise Unsolved(f"energy and charges differ by {wrong / lower:.1g}: triangles too slender for doubles")
    return lower, unknowns


def fluxes(
    space: Any, eps: Any, metal: Sequence[str], order: int, *, periodic: bool = False
) -> tuple[Any, float, list[float], int]:
    """The best flux of an order, its energy, the charge that it brings to each conductor, and the unknowns.

    Its normal component is continuous in every moment of that order, which is all that it has: reference elements hold
    the product of flux and face unchanged, however they are curved.
    """
    import ngsolve as ng

    normal = ng.specialcf.normal(3)
    plain = ng.FacetFESpace(space, order=order, dirichlet="|".join(metal))
    facet = ng.Periodic(plain) if periodic else plain
    below = ng.HDiv(space, order=order, discontinuous=True, hodivfree=True) * ng.L2(space, order=0) * facet
    (d, q, w), (e, r, z) = below.TnT()
    form = ng.BilinearForm(below, symmetric=True, condense=True)
    form += -(d * e / eps - q * ng.div(e) - r * ng.div(d)) * ng.dx
    form += -(w * (e * normal) + z * (d * normal)) * ng.dx(element_boundary=True)
    energy, best = balanced(form, lambda f: f.components[2], metal)
    field = best.components[0]
    charges = [
        -float(ng.Integrate(one.components[2] * (field * normal) * ng.dx(element_boundary=True), space))
        for one in indicators(below, lambda f: f.components[2], metal)
    ]
    return field, energy, charges, facet.ndof


def _coefficients(mesh: PrismMesh) -> tuple[Any, list[str]]:
    """Permittivity, and the boundaries of each conductor."""
    eps = mesh.netgen.MaterialCF({f"d{k}": value for k, value in enumerate(mesh.cell.permittivity)})
    return eps, [f"c{k}" for k in range(mesh.cell.conductors)]


def indicators(space: Any, part: Any, conductors: Sequence[str]) -> list[Any]:
    """Functions that are 1 on one conductor each."""
    import ngsolve as ng

    mesh, ones = space.mesh, [ng.GridFunction(space) for _ in conductors]
    for name, one in zip(conductors, ones, strict=True):
        part(one).Set(ng.CF(1), definedon=mesh.Boundaries(name))
        values = one.vec.FV().NumPy()
        values[:] = values > _SET  # a constant is 1 in lowest order; where sides repeat, Set averages over too many
    return ones


def balanced(form: Any, part: Any, conductors: Sequence[str]) -> tuple[float, Any]:
    """Energy and function with 1 V on the top electrode, 0 V on the bottom one and no net charge on the others.

    Parameters
    ----------
    form : BilinearForm
        Of the energy; condensed.
    part : callable
        From a function of its space to the part of it that is held on conductors.
    conductors : sequence of str
        Boundaries of each.
    """
    import ngsolve as ng

    space = form.space
    free = space.FreeDofs(True)
    with ng.TaskManager() if free.NumSet() > _MANY else nullcontext():
        form.Assemble()
        inverse = form.mat.Inverse(free, "sparsecholesky")  # slivers take CG with BDDC a thousand iterations
        lifts = indicators(space, part, conductors)[TOP:]
        rest = lifts[0].vec.CreateVector()
        for f in lifts:
            for _ in range(2):
                rest.data = form.mat * f.vec
                f.vec.data -= inverse * rest
        images = []
        for f in lifts:
            rest.data = form.mat * f.vec
            images.append(rest.Copy())
        energy = np.array([[ng.InnerProduct(f.vec, image) for image in images] for f in lifts])
        share = np.append(1.0, -np.linalg.solve(energy[1:, 1:], energy[1:, 0]))
        best = ng.GridFunction(space)
        for c, f in zip(share.tolist(), lifts, strict=True):
            best.vec.data += c * f.vec
        best.vec.data += form.harmonic_extension * best.vec
    return float(share @ energy @ share), best
