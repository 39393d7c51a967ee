"""A closed triangle mesh."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles over shared vertices, seen counter-clockwise from outside.

    Attributes
    ----------
    vertices_mm : (n, 3) float64 array
        Corners [mm].
    triangles : (m, 3) int32 array
        Indices into ``vertices_mm`` [-].
    """

    vertices_mm: NDArray[np.float64]
    triangles: NDArray[np.int32]

    def volume_mm3(self) -> float:
        """Enclosed volume, by the divergence theorem [mm3]."""
        if len(self.triangles) == 0:
            return 0.0
        origin = self.vertices_mm[0]  # near the body, so that little cancels
        a, b, c = ((self.vertices_mm - origin)[self.triangles[:, k]] for k in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
