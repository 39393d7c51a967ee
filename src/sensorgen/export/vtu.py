"""Voxels as VTU, which ParaView, PyVista and finite-element programs read."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from sensorgen.core.errors import MissingValue
from sensorgen.scene.geometry.layered import Voxels
from sensorgen.scene.scene import Body

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
    try:
        import meshio
    except ImportError:
        raise MissingValue("VTU needs meshio: pip install 'sensorgen[mesh]', or write .3mf, .stl or .step") from None
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
