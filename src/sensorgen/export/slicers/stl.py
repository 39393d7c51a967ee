"""A body as binary STL, the one format that CuraEngine's command line reads."""

import numpy as np
from numpy.typing import NDArray

from sensorgen.scene.geometry.meshes import Mesh

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])


def content(mesh: Mesh, shift_mm: NDArray[np.float64]) -> bytes:
    """The file of a mesh.

    Parameters
    ----------
    mesh : Mesh
        The body [mm].
    shift_mm : (3,) float64 array
        Added to every corner [mm].
    """
    facets = np.zeros(len(mesh.triangles), dtype=_FACET)
    facets["corners"] = (mesh.vertices_mm + shift_mm)[mesh.triangles]
    return bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()
