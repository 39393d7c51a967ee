"""Columns as springs in series, in parallel under a stiff plate: a closed-form estimate of the displacement.

Each column is free to bulge, independent of its neighbours, and carries load once its gap is closed.
"""

from collections.abc import Mapping, Sequence
from operator import attrgetter

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.scene.layers import overlay_parts
from sensorgen.scene.scene import Scene

SOURCE = "Hooke's law, column by column; plane strain, E / (1 - nu^2)"
COST = 0

_PLACES = (np.arange(256) + 0.5) / 256  # in each column; evenly, because gaps close from one side
_HALVINGS = 60  # of the interval that holds the displacement


def displacement_m(scene: Scene, modulus_pa: Mapping[str, float], stress_pa: Sequence[float]) -> Real:
    r"""Displacement of a stiff plate on a scene.

    .. math:: \sigma = \frac{1}{L} \int \frac{\max(\delta - g, 0)}{\sum_k t_k / M_k} dx

    with the air gap g and the layers' thickness t and modulus M in each column.

    Parameters
    ----------
    scene : Scene
        Of columns, without support.
    modulus_pa : mapping of str to float
        M of each material, as E / (1 - nu^2) [Pa].
    stress_pa : sequence of float
        Mean stresses, 0 or more [Pa].

    Returns
    -------
    (n,) array
        Displacement of the top [m].

    Raises
    ------
    BadInput
        No column of the scene has layers of one height.
    OutOfRange
        A stress is below 0, or would press a column flat.

    Notes
    -----
    It ignores that columns hold each other and that rubber keeps its volume: see ``docs/compression.md`` for its error.
    """
    # Gap [mm], compliance t / M [mm/Pa], width [mm] and thickness [mm] at places in all columns
    share, rows = _PLACES, []
    try:
        sections_of = overlay_parts(scene)
    except ValueError as error:
        raise BadInput(f"no springs of columns: {error}") from None
    for part in sections_of:
        for column in filter(attrgetter("layers"), part.columns):
            bottoms, tops = (
                np.array([getattr(layer, key) for layer in column.layers]) @ np.array([1 - share, share])
                for key in ("bottom_mm", "top_mm")
            )
            solid = tops - bottoms
            gap = np.maximum(bottoms[1:] - tops[:-1], 0.0).sum(axis=0)
            moduli = np.array([modulus_pa[layer.body.material] for layer in column.layers])
            width = np.full(len(share), (column.right_mm - column.left_mm) * part.depth_mm)
            rows.append(np.array([gap, (solid / moduli[:, None]).sum(axis=0), width, solid.sum(axis=0)]))
    gap, compliance, width, solid = np.concatenate(rows, axis=1)
    height = float((gap + solid).min() * M_PER_MM)
    gap, compliance = gap * M_PER_MM, compliance * M_PER_MM
    stress = np.asarray(stress_pa, float)
    if (stress < 0).any():
        raise OutOfRange(f"a stress of {stress.min():g} Pa pulls; expected 0 or more")
    low, high = np.zeros(len(stress)), np.full(len(stress), height)
    if (_stress(high[:1], gap, compliance, width) <= stress.max(initial=0.0)).any():
        raise OutOfRange(f"{stress.max():g} Pa presses the cell flat")
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        beyond = _stress(middle, gap, compliance, width) > stress
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.where(stress > 0, high, 0.0)


def _stress(displacement_m: Real, gap: Real, compliance: Real, width: Real) -> Real:
    share = np.maximum(displacement_m[:, None] - gap, 0.0) / compliance
    return np.asarray(share @ width / width.sum())
