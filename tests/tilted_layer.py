"""Elastic layer on springs under a rigid tip that is held at an angle: plane strain, contact by an active set.

Shares no line with the package. Quadrilaterals with the volume's change taken at their middles.
"""

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

_GAUSS = 1 / np.sqrt(3)
_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
_RIGID = 1e4  # stiffness of the contact over that of the springs


def _slopes(a, b, dx, dz):
    x = _CORNERS[:, 0] * (1 + b * _CORNERS[:, 1]) / (2 * dx)
    return x, _CORNERS[:, 1] * (1 + a * _CORNERS[:, 0]) / (2 * dz)


def _stiffness(x, z, e, nu):
    lame, shear = e * nu / (1 + nu) / (1 - 2 * nu), e / 2 / (1 + nu)
    rows, columns, values = [], [], []
    for i in range(len(x) - 1):
        for k in range(len(z) - 1):
            dx, dz = x[i + 1] - x[i], z[k + 1] - z[k]
            matrix = np.zeros((8, 8))
            for a, b in _GAUSS * _CORNERS:
                by_x, by_z = _slopes(a, b, dx, dz)
                strain = np.zeros((3, 8))
                strain[0, ::2], strain[1, 1::2], strain[2, ::2], strain[2, 1::2] = by_x, by_z, by_z, by_x
                matrix += strain.T @ np.diag([2, 2, 1]) @ strain * shear * dx * dz / 4
            volume = np.column_stack(_slopes(0, 0, dx, dz)).ravel()
            matrix += lame * np.outer(volume, volume) * dx * dz
            corner = [i * len(z) + k, (i + 1) * len(z) + k, (i + 1) * len(z) + k + 1, i * len(z) + k + 1]
            here = np.array([[2 * m, 2 * m + 1] for m in corner]).ravel()
            rows.append(np.repeat(here, 8))
            columns.append(np.tile(here, 8))
            values.append(matrix.ravel())
    n = 2 * len(x) * len(z)
    return coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (n, n)).tocsr()


def pressure(width_m, thick_m, modulus_pa, springs_pa_per_m, slope, mean_pa, across=120, up=4, nu=0.45):
    """Share of the width of each place, and the pressure on the springs there [Pa]."""
    x = width_m * np.linspace(-0.5, 0.5, across + 1)
    z = np.linspace(0, thick_m, up + 1)
    size = np.gradient(x)
    size[[0, -1]] /= 2
    low = 2 * np.arange(across + 1) * (up + 1) + 1
    high = low + 2 * up
    stiffness = _stiffness(x, z, modulus_pa, nu)
    held = np.zeros(stiffness.shape[0])
    held[low], held[low - 1] = springs_pa_per_m * size, 1e-6 * springs_pa_per_m * size  # slides
    touches = x > width_m / 4
    for _ in range(100):
        contact = np.zeros(len(held))
        contact[high] = _RIGID * springs_pa_per_m * size * touches
        tip = np.zeros(len(held))
        tip[high] = slope * x
        u, by_depth = spsolve((stiffness + diags(held + contact)).tocsc(), -np.column_stack([contact * tip, contact])).T
        depth = (mean_pa * width_m - contact @ (u + tip)) / (contact @ (by_depth + 1))
        u = u + depth * by_depth
        again = (u + tip)[high] + depth > 0
        if (again == touches).all():
            break
        touches = again
    return size / width_m, -springs_pa_per_m * u[low]
