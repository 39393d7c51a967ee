"""Finite elements in three dimensions for scenes of boxes: a potential from above, a flux from below.

Bricks in layers that shrink towards every edge of the electrodes fill the part of a cell between its mirrors; see
docs/cells.md.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from sensorgen.interval import Interval
from sensorgen.models import _fem_bounds as fem
from sensorgen.models._fem_bricks import bricks, grid
from sensorgen.models.fem2d import NEEDS
from sensorgen.scene import Scene
from sensorgen.units import EPS0_F_PER_M, M_PER_MM

SOURCE = "Dirichlet's and Thomson's principles; graded hexahedra, H1 and H(div) (NGSolve)"
COST = 3

WIDTH = 1e-3  # of the interval, where the caller does not say

_RUNGS = ((1, 4, 3), (2, 5, 4), (3, 6, 5))  # layers, order of the potential, order of the flux
_MOST_BRICKS = 6000  # of one rung: more would not fit in 4 GB


def unfit(scene: Scene) -> str | None:
    """Why this model cannot speak of this scene, or None."""
    if find_spec("ngsolve") is None:
        return NEEDS
    try:
        mesh, _ = bricks(grid(scene), _RUNGS[0][0])
    except ValueError as error:
        return str(error)
    if len(mesh.elements) > _MOST_BRICKS:
        return f"its cell has {len(mesh.elements)} bricks on the coarsest mesh; at most {_MOST_BRICKS} fit in the memory"
    return None


@dataclass(frozen=True)
class Step:
    """One mesh on the way to an accuracy.

    Attributes
    ----------
    layers, order, flux_order : int
        That shrink towards edges; orders of the potential's and of the flux's polynomials.
    elements, unknowns : int
        Bricks, and the unknowns that they couple.
    interval : Interval
        Capacitance of the whole sensor [F].
    """

    layers: int
    order: int
    flux_order: int
    elements: int
    unknowns: int
    interval: Interval


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:
    """Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`unfit` is None.
    permittivity : mapping of str to float
        Relative permittivity of each material that lies between the electrodes, and of "air", above 0 [-].
    width : float
        How wide the interval may be, relative to its middle; it is wider where the finest mesh is reached [-].

    Returns
    -------
    Interval
        Capacitance of the whole sensor [F].

    Raises
    ------
    OutOfRange
        A permittivity is not above 0, or the width is.
    KeyError
        A material between the electrodes has no permittivity.
    ValueError
        The scene is unfit.
    CrossedBounds
        The lower bound lies above the upper one: a fault of the solver.
    """
    fem.check(permittivity, width)
    return min((step.interval for step in steps(scene, permittivity, width)), key=Interval.width)


def steps(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Iterator[Step]:
    """The meshes that :func:`capacitance` goes through, until the interval is narrow enough."""
    coarse = grid(scene)
    for layers, order, flux_order in _RUNGS:
        mesh, regions = bricks(coarse, layers)
        if len(mesh.elements) > _MOST_BRICKS:
            return
        least = min(share for _, share in regions)
        eps, weights = [permittivity[m] for m, _ in regions], [s - least for _, s in regions]
        found = fem.energies(mesh, eps, weights, order, flux_order)
        interval = fem.whole(found, [share for _, share in regions]).times(EPS0_F_PER_M * M_PER_MM)
        yield Step(layers, order, flux_order, len(mesh.elements), found.unknowns, interval)
        if interval.width() <= width or not np.isfinite(interval.width()):
            return
