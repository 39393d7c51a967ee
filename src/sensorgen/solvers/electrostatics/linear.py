"""Linear potential on the few triangles of a section: an upper bound of the capacitance for any polygons."""

from collections.abc import Mapping

import numpy as np

from sensorgen.scene.sections import Section
from sensorgen.scene.unit_cell import cell
from sensorgen.solvers.electrostatics.triangles import triangles


def energy(section: Section, height_mm: float, permittivity: Mapping[str, float]) -> float:
    """Least energy of such potentials at 1 V, per depth and over eps0 [-], the same in each repeating cell.

    Raises
    ------
    ValueError
        The electrodes touch, none lies opposite the other, or the field between them would leave the sensor.
    """
    mesh = triangles(cell(section, height_mm))
    used, corners = np.unique(np.array(mesh.triangles), return_inverse=True)
    corners = corners.reshape(-1, 3)
    points = mesh.points[used][corners]
    sides = np.roll(points, -1, axis=1) - np.roll(points, -2, axis=1)
    twice = np.abs(np.linalg.det(sides[:, :2]))
    eps = np.array([permittivity[material] * share for material, share in mesh.regions])
    stiffness = np.zeros((len(used),) * 2)
    parts = (eps / (2 * twice))[:, None, None] * (sides @ sides.transpose(0, 2, 1))
    np.add.at(stiffness, (corners[:, :, None], corners[:, None, :]), parts)
    held = np.full(len(used), np.nan)
    for edge, name in mesh.terminals.items():
        held[np.searchsorted(used, edge)] = float(name == "top")
    free = np.isnan(held)
    held[free] = np.linalg.solve(stiffness[free][:, free], -stiffness[free][:, ~free] @ held[~free])
    return float(held @ stiffness @ held)
