"""Layers of a print as closed surfaces and as voxels, and voxels as VTU for ParaView and finite-element programs."""

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
import shapely

from sensorgen.core.arrays import Real, Whole, parts_of
from sensorgen.core.errors import OutOfRange, library
from sensorgen.scene.geometry.meshes import Mesh
from sensorgen.scene.layers import LayerRegions, inside, is_rectilinear
from sensorgen.scene.scene import Body

GRID_MM = 1e-3  # of corners in plan, as in G-code; edges nearer than this are one
MOST_VOXELS = 4_000_000  # 1 GB of memory while they are written


def closed(layers: Sequence[LayerRegions], bodies: Iterable[str]) -> Mesh:
    """Closed surface around some bodies together: each edge has two triangles, seen counter-clockwise from outside.

    Parameters
    ----------
    layers : sequence of LayerRegions
        From the bed up.
    bodies : iterable of str
        Names of the bodies; empty where none of them is printed.
    """
    import manifold3d

    names, slabs = tuple(bodies), []
    plans = [shapely.set_precision(shapely.union_all([k.region(n) for n in names]), GRID_MM) for k in layers]
    for _, alike in groupby(zip(plans, layers, strict=True), key=lambda pair: pair[0].wkb):
        (plan, first), *_, (_, last) = [*alike] * 2
        rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(plan))]
        if rings:
            section = manifold3d.CrossSection(rings, manifold3d.FillRule.EvenOdd)
            slab = manifold3d.Manifold.extrude(section, last.top_mm - first.bottom_mm)
            slabs.append(slab.translate((0.0, 0.0, first.bottom_mm)))
    joined = manifold3d.Manifold.batch_boolean(slabs, manifold3d.OpType.Add).simplify(GRID_MM).to_mesh64()
    return Mesh(np.array(joined.vert_properties)[:, :3], np.array(joined.tri_verts).astype(np.int32))


@dataclass(frozen=True, eq=False)
class Voxels:
    """Boxes between lines along x, y and z [mm], and the number of the body in each (x, y, z), from 0; -1 is air."""

    lines_mm: tuple[Real, Real, Real]
    body: Whole


def voxels(layers: Sequence[LayerRegions], bodies: Sequence[str], size_mm: Sequence[float], pitch_mm: float) -> Voxels:
    """Layers as boxes: exact where all edges run along the axes, else squares of a pitch by what is at their middle.

    Parameters
    ----------
    layers : sequence of LayerRegions
        From the bed up.
    bodies : sequence of str
        Names, in the order of their numbers.
    size_mm : sequence of float
        Of the sensor [mm].
    pitch_mm : float
        Longest side of a box along an axis that the pattern varies along, above 0 [mm].

    Raises
    ------
    OutOfRange
        A pitch that is not above 0, or so many boxes that they do not fit the memory.
    """
    regions = [region for layer in layers for region in layer.regions.values()]
    corners = shapely.get_coordinates(regions if all(map(is_rectilinear, regions)) else [])
    faces = np.array([layers[0].bottom_mm, *(layer.top_mm for layer in layers)])
    x, y = (_lines(at, end, pitch_mm) for at, end in zip(corners.T, size_mm, strict=False))
    z = _split(faces, pitch_mm)
    count = np.prod([len(line) - 1.0 for line in (x, y, z)])
    if count > MOST_VOXELS:
        raise OutOfRange(
            f"voxels of {pitch_mm:g} mm: {count / 1e6:.3g} million; expected at most {MOST_VOXELS / 1e6:g} million: "
            f"take --voxel {pitch_mm * (count / MOST_VOXELS) ** (1 / 3) * 1.1:.2g} or more, or a smaller sensor"
        )
    places = (x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2
    plans = np.full((len(layers), *map(len, places)), -1)
    for plan, layer in zip(plans, layers, strict=True):
        for name, region in layer.regions.items():
            plan[inside(region, *places)] = bodies.index(name)
    number = np.searchsorted(faces, (z[1:] + z[:-1]) / 2) - 1
    return Voxels((x, y, z), np.moveaxis(plans[number], 0, -1))


def _lines(corners_mm: Real, end_mm: float, pitch_mm: float) -> Real:
    """Edges of boxes along an axis: at all corners and both ends, those that rounding parted as one."""
    at = np.unique(np.append(corners_mm, [0.0, end_mm]).clip(0.0, end_mm))
    groups = np.split(at, np.flatnonzero(np.diff(at) > 2 * GRID_MM) + 1)
    middles = [float(group.mean()) for group in groups]
    middles[0], middles[-1] = 0.0, end_mm
    uniform = len(middles) == 2 and len(corners_mm) > 0
    return np.array(middles) if uniform else _split(np.array(middles), pitch_mm)


def _split(at_mm: Real, pitch_mm: float) -> Real:
    """Places, and more between them, so that no step is longer than a pitch; raises OutOfRange."""
    if not pitch_mm > 0:
        raise OutOfRange(f"voxels of {pitch_mm:g} mm: expected a length above 0")
    more = np.ceil(np.diff(at_mm) / pitch_mm - 1e-9).astype(int)
    which, within = parts_of(more)
    return np.append(at_mm[which] + within * (np.diff(at_mm) / more)[which], at_mm[-1])


TERMINALS = {"bottom": 1, "top": 2}


def content(voxels: Voxels, bodies: Sequence[Body], permittivity: Mapping[str, float]) -> bytes:
    """The file: hexahedra in mm, air among them, with five numbers each.

    ``body``: from 1 in the order of the bodies, 0 for air. ``material``: from 1 in the order of the materials' names,
    0 for air. ``terminal``: 1 bottom, 2 top electrode, else 0. ``relative_permittivity``: not a number in conductors.

    Parameters
    ----------
    voxels : Voxels
        Of the print.
    bodies : sequence of Body
        Whose numbers they have.
    permittivity : mapping of str to float
        Relative, of every dielectric and of "air" [-].

    Raises
    ------
    MissingValue
        meshio is not installed.
    """
    meshio = library("meshio", "VTU needs meshio: pip install 'sensorgen[mesh]', or write .3mf, .stl or .step")
    shape = np.array([len(line) for line in voxels.lines_mm])
    nodes = np.arange(shape.prod()).reshape(shape)
    low, high = slice(None, -1), slice(1, None)
    ring = ((low, low), (high, low), (high, high), (low, high))
    corners = [nodes[x, y, z].ravel() for z in (low, high) for x, y in ring]
    points = np.stack(np.meshgrid(*voxels.lines_mm, indexing="ij"), axis=-1).reshape(-1, 3)
    names = ["air", *sorted({body.material for body in bodies})]
    table = [(0, 0, 0, permittivity["air"])] + [
        (n, names.index(body.material), TERMINALS.get(body.terminal, 0), permittivity.get(body.material, np.nan))
        for n, body in enumerate(bodies, 1)
    ]
    columns = zip(("body", "material", "terminal", "relative_permittivity"), zip(*table, strict=True), strict=True)
    data = {name: [np.array(column)[voxels.body.ravel() + 1]] for name, column in columns}
    mesh = meshio.Mesh(points, [("hexahedron", np.stack(corners, axis=1))], cell_data=data)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "voxels.vtu"
        meshio.vtu.write(path, mesh)
        return path.read_bytes()
