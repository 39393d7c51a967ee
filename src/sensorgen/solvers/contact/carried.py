"""A field's mesh that a cell's deformation carries along, while no gap closes: one mesh serves for all loads.

Where a gap closes from its tip, faces slide along each other, and triangles of the air between them turn over by as
much as their own area. With their volumes held above 0, as a pulled-back permittivity needs them, the rise of tri with
a film of 0.1 mm was 8.5 % off at 100 kPa and half of it at 1.1 MPa: such cells are meshed anew at each load.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import coo_matrix, csr_matrix

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.solvers.contact.cell import ContactCell
from sensorgen.solvers.contact.element import determinant, triangle_values
from sensorgen.solvers.contact.factors import solved_by_lu
from sensorgen.solvers.contact.mesh import TriangleMesh

_THIN = 0.2  # of its area as drawn: a triangle that is pressed further is no good any more [-]
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Carried:
    """Mesh of a field, of which the solids move as their own mesh does, and the air between them by Laplace's equation.

    Attributes
    ----------
    field : TriangleMesh
        Of solids and air, as drawn.
    solids : TriangleMesh
        That is pressed.
    cell : ContactCell
        Whose regions both have.
    """

    field: TriangleMesh
    solids: TriangleMesh
    cell: ContactCell

    def at(self, u_m: Real) -> TriangleMesh | None:
        """The mesh at displacements of the solids' nodes (2n) [m]; None where a triangle folds or is flattened."""
        moved = np.zeros((len(self.field.points_m), 2))
        moved[self._inside] = self._values @ u_m.reshape(-1, 2)
        if self._air.any():
            for axis in range(2):
                free = self._free[axis]
                known = np.where(free, 0.0, moved[:, axis])
                if axis == 0:  # air at a wall moves as the wall does
                    for wall in self._walls:
                        known[wall & ~self._inside] = moved[wall & self._inside, 0].mean()
                known[free] = solved_by_lu(self._laplace[free][:, free], -(self._laplace @ known)[free])
                moved[:, axis] = known
        corners, sides = self.field.outer[:, :3], self.field.outer[:, 3:]
        places = self.field.points_m + moved
        places[sides] = (places[corners] + places[np.roll(corners, -1, axis=1)]) / 2
        found = replace(self.field, points_m=places)
        kept = determinant(found.jacobians_m) > _THIN * determinant(self.field.jacobians_m)
        return found if kept.all() else None

    @cached_property
    def _air(self) -> Mask:
        """Mask of the triangles of air."""
        return np.asarray(self.field.region == self.cell.air)

    @cached_property
    def _inside(self) -> Mask:
        """Mask of the nodes that move with a solid: its corners."""
        found = np.zeros(len(self.field.points_m), bool)
        found[self.field.outer[~self._air, :3]] = True
        return found

    @cached_property
    def _values(self) -> csr_matrix:
        """Displacements of those nodes from those of the solids' nodes."""
        places, corners = self.field.points_m[self._inside], self.solids.points_m[self.solids.outer[:, :3]]
        _, triangle = shapely.STRtree(shapely.polygons(corners)).query_nearest(
            shapely.points(places), all_matches=False
        )
        first, *ends = corners[triangle].swapaxes(0, 1)
        at = np.linalg.solve(np.stack([end - first for end in ends], axis=-1), (places - first)[..., None])[..., 0]
        shares = triangle_values(at)[:, :6]
        rows = np.repeat(np.arange(len(places)), 6)
        columns = self.solids.outer[triangle].ravel()
        return coo_matrix((shares.ravel(), (rows, columns)), (len(places), len(self.solids.points_m))).tocsr()

    @cached_property
    def _walls(self) -> list[Mask]:
        x = self.field.points_m[:, 0]
        return [np.asarray(abs(x - end) < _ROUNDING * np.ptp(x)) for end in (x.min(), x.max())]

    @cached_property
    def _free(self) -> list[Mask]:
        """Corners of the air that no solid moves along x, where walls hold them too, and along the height."""
        air = np.zeros(len(self.field.points_m), bool)
        air[self.field.outer[self._air, :3]] = True
        air &= ~self._inside
        return [air & ~np.any(self._walls, axis=0), air]

    @cached_property
    def _laplace(self) -> csr_matrix:
        """Of linear triangles of the air, each as stiff as it is small."""
        corners: Whole = self.field.outer[self._air, :3]
        places, n = self.field.points_m[corners], len(self.field.points_m)
        edges = places[:, [2, 0, 1]] - places[:, [1, 2, 0]]  # against each corner
        local = edges @ edges.transpose(0, 2, 1) / determinant(self.field.jacobians_m[self._air])[:, None, None] ** 2
        rows, columns = np.repeat(corners, 3, axis=1).ravel(), np.tile(corners, (1, 3)).ravel()
        return coo_matrix((local.ravel(), (rows, columns)), (n, n)).tocsr()
