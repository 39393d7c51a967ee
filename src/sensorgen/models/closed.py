"""Largest capacitance that a cell with gaps can have under a pressure: closed, its film thinned as if it were free."""

from collections.abc import Mapping

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.scene.layers import overlay_parts
from sensorgen.scene.scene import Scene

SOURCE = "Dirichlet's principle on a cell without air; neo-Hookean compression of one free column"
COST = 0

_PLACES = (np.arange(256) + 0.5) / 256  # in each column


def thinned(stress_over_shear: float) -> float:
    r"""Capacitance over that at rest of a free neo-Hookean column between its electrodes [-].

    .. math:: p / \mu = \lambda^{-2} - \lambda, \quad C / C_0 = \lambda^{-2}

    >>> round(thinned(0.0), 9), round(thinned(0.5**-2 - 0.5), 9)
    (1.0, 4.0)
    """
    roots = np.roots([1.0, stress_over_shear, 0.0, -1.0])
    stretch = float(roots[np.isreal(roots) & (roots.real > 0)].real[0])
    return stretch**-2


def most_f_per_m2(
    scene: Scene, permittivity: Mapping[str, float], softest_pa: float, stress_pa: float
) -> float:  # fmt: skip
    r"""Capacitance per area that a cell does not exceed under a pressure [F/m2].

    .. math:: C \le \varepsilon \min\left(\overline{1 / (h - \bar g)}, \bar t / t_{min}^2\right) / \lambda^2

    with distance h of the electrodes, air g and film t in each column, and means over the plan. The first is the
    cell whose stiff electrodes came together until its air is gone, the second one with the thinnest film everywhere.

    Parameters
    ----------
    scene : Scene
        Of columns, without support.
    permittivity : mapping of str to float
        By material [-].
    softest_pa : float
        Least Young's modulus of what is between the electrodes [Pa].
    stress_pa : float
        On the top [Pa].

    Raises
    ------
    ValueError
        The scene has no columns.
    """
    distance, film, width = _columns(scene)
    mean = film @ width / width.sum()
    left = distance - (distance - film) @ width / width.sum()
    came = float((1 / left) @ width / width.sum()) if (left > 0).all() else np.inf
    most = max(permittivity[b.material] for b in scene.bodies if not b.terminal)
    per_m = min(came, mean / film.min() ** 2 if film.min() > 0 else np.inf)
    return float(EPS0_F_PER_M * most * per_m * thinned(3 * stress_pa / softest_pa))


def _columns(scene: Scene) -> tuple[Real, Real, Real]:
    """Distance of the electrodes and film between them [m], and width, at places in all columns with both."""
    rows = []
    for part in overlay_parts(scene):
        for column in part.columns:
            ends = [layer.body.terminal for layer in column.layers]
            if not {"top", "bottom"} <= {*ends}:
                continue
            low, high = len(ends) - 1 - ends[::-1].index("bottom"), ends.index("top")
            low_mm, high_mm = (
                np.array([getattr(layer, key) for layer in column.layers]) @ np.array([1 - _PLACES, _PLACES])
                for key in ("bottom_mm", "top_mm")
            )
            film = (high_mm - low_mm)[low + 1 : high].sum(axis=0)
            width = np.full(len(_PLACES), (column.right_mm - column.left_mm) * part.depth_mm)
            rows.append(np.array([(low_mm[high] - high_mm[low]) * M_PER_MM, film * M_PER_MM, width]))
    if not rows:
        raise ValueError("no column with both electrodes")
    distance, film, width = np.concatenate(rows, axis=1)
    return distance, film, width
