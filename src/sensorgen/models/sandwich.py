r"""Plate of rubber bonded between two electrodes that it stretches: its modulus under a stiff tip, at small strain.

Thin film in plane strain: pressure p and the top electrode's sideways displacement u over the half width. In each layer
the sideways displacement is a parabola over the height (shear modulus G, of electrodes :math:`G_e`), so that

.. math:: q = d \frac{u + u_b}{2} - \frac{d^3}{12 G} p', \qquad
          4 (G_e - G) t u'' - t p' = \frac{G}{d} (u - u_b) + \frac{d}{2} p', \qquad
          (q + q_b + t u)' + \frac{d}{K} p = w

with what flows sideways in the film, q, and in the lower electrode, :math:`q_b`; w is the displacement of the tip. At
the sides p = 0 and the electrode is free. A base that holds the lower electrode leaves it its shear alone; on one that
slides both electrodes are alike. Between stiff faces it is :func:`sensorgen.models.compression.bonded`.
"""

import numpy as np

from sensorgen.core.errors import OutOfRange

SOURCE = "thin films in plane strain, as Gent and Meinecke (1970), with faces that shear stretches"
COST = 0

_ELEMENTS = 150  # over half the width, denser to its side: modulus known to 1e-3
_LEAST = 0.05  # of an electrode's stiffness: softer than the film it would not count


def modulus_pa(
    youngs_modulus_pa: float, width_m: float, thickness_m: float, bulk_pa: float, *, electrode_pa: tuple[float, float],
    electrode_m: tuple[float, float], base: str = "bonded",
) -> float:  # fmt: skip
    """Mean pressure on the film over its mean strain [Pa].

    Parameters
    ----------
    youngs_modulus_pa, width_m, thickness_m, bulk_pa : float
        Of the film: E [Pa], W and d [m], K, infinite if incompressible [Pa].
    electrode_pa, electrode_m : (float, float)
        Young's moduli [Pa] and thicknesses [m] of the lower and of the upper electrode, both incompressible.
    base : str
        "bonded" or "sliding"; on one that slides, each electrode is their mean.

    Raises
    ------
    OutOfRange
        A size or a modulus is not above 0.

    Examples
    --------
    >>> round(modulus_pa(6e6, 10e-3, 0.6e-3, 1e10, electrode_pa=(22e6, 22e6), electrode_m=(3e-4, 3e-4)) / 6e6, 1)
    12.1
    """
    if min(youngs_modulus_pa, width_m, thickness_m, bulk_pa, *electrode_pa, *electrode_m) <= 0:
        raise OutOfRange("a size or a modulus of a bonded plate is 0 or less; expected numbers above 0")
    g, d, is_bonded = youngs_modulus_pa / 3, thickness_m, base == "bonded"
    (g_low, g_top), (t_low, t) = [e / 3 for e in electrode_pa], electrode_m
    if not is_bonded:
        g_top, t = (g_low * t_low + g_top * t) / (t_low + t), (t_low + t) / 2
    x = width_m / 2 * np.sin(np.linspace(0, np.pi / 2, _ELEMENTS + 1))
    length, one = np.diff(x)[:, None], np.ones((_ELEMENTS, 1))
    dp, du = (np.array(of) / length for of in ([-1, 1, 0, 0], [0, 0, -1, 1]))  # of p, p, u, u at both ends
    p, u = (one * np.array(of) / 2 for of in ([1, 1, 0, 0], [0, 0, 1, 1]))
    slip = t_low * g / (g_low * d)
    below = (slip * u - t_low * (d + t_low) / (2 * g_low) * dp) / (1 + slip) if is_bonded else u
    film = d * (u + below) / 2 - d**3 / (12 * g) * dp
    up, down = (g * (u - below) / d + sign * d / 2 * dp for sign in (1, -1))  # shear on the upper and lower face
    lower = t_low**2 / (2 * g_low) * down - t_low**3 / (3 * g_low) * dp if is_bonded else t * u
    tension = 4 * max(g_top - g, _LEAST * g_top) * t * du - t * p
    turn, half = np.array([-1.0, 1.0]), length / 2
    rows = [
        *(-sign * (film + lower + t * u) + half * d / bulk_pa * p for sign in turn),
        *(-sign * tension - half * up for sign in turn),
    ]
    n = _ELEMENTS + 1
    matrix, load = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    at = np.arange(_ELEMENTS)[:, None] + np.array([0, 1, n, n + 1])
    for k, row in enumerate(rows):
        np.add.at(matrix, (at[:, k : k + 1], at), row)
    np.add.at(load, at[:, :2], half)
    for fixed in (n - 1, n):  # p at the side, u in the middle
        matrix[fixed] = np.eye(2 * n)[fixed]
        load[fixed] = 0
    solution = np.linalg.solve(matrix, load)
    pressure = float(np.trapezoid(solution[:n], x))
    squeezed = float(film[-1] @ solution[at[-1]]) + d / bulk_pa * pressure
    return pressure / (squeezed / d) + 4 * g
