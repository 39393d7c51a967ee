"""Finite elements in three dimensions for scenes of boxes: a potential from above, a flux from below.

Bricks in layers that shrink towards edges where the field is infinite fill the part of a cell between its mirrors. On
boxes all matrices are known in closed form, and elimination from the inside out needs no solver: NumPy is enough. See
docs/cells.md.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from sensorgen.core.bounds import Disc, Interval
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.scene.scene import Scene
from sensorgen.solvers.electrostatics import bounds as fem
from sensorgen.solvers.electrostatics.bounds import Fields, disc, turned
from sensorgen.solvers.electrostatics.boxes import Grid, Pair, grid, layered, whole

SOURCE = "Dirichlet's and Thomson's principles; graded boxes, H1 and hybrid H(div), nested dissection"
COST = 3

WIDTH = 1e-3  # of the interval unless given

_MOST_BRICKS = 2500  # on the coarsest mesh: more would take hours
_MOST_UNKNOWNS = 600_000  # of a finer mesh: 4 GB

Bounded = TypeVar("Bounded", Interval, Disc)


class BoxMeshLevel(NamedTuple):
    """Layers that shrink towards edges, orders of potential and flux, and width on rect with a film of 0.1 mm [-]."""

    layers: int
    order: int
    flux_order: int
    width: float


MESHES = (  # each takes at most 3.4 times as long as the one before, on rect
    BoxMeshLevel(1, 3, 2, 3.4e-3),
    BoxMeshLevel(1, 4, 3, 1.3e-3),
    BoxMeshLevel(1, 5, 4, 7.2e-4),
    BoxMeshLevel(1, 6, 5, 4.6e-4),
    BoxMeshLevel(1, 7, 6, 3.3e-4),
    BoxMeshLevel(2, 5, 4, 1.4e-4),
    BoxMeshLevel(2, 6, 5, 6.6e-5),
    BoxMeshLevel(3, 6, 5, 2.2e-5),
    BoxMeshLevel(3, 7, 6, 9e-6),
)
_MANY_BRICKS = 80  # of which the first of those takes seconds: without layers a tenth of that
_WITHOUT_LAYERS = (BoxMeshLevel(0, 3, 2, 2.9e-2), BoxMeshLevel(0, 5, 4, 1.1e-2))


def why_not_applicable(scene: Scene) -> str | None:
    """Why the model does not apply to a scene, or None."""
    if reason := fem.unmirrored(scene):
        return reason
    try:
        coarse = grid(scene)
    except ValueError as error:
        return str(error)
    boxes = int((coarse.fill > 1).sum())
    if boxes > _MOST_BRICKS:
        return f"its cell has {boxes} bricks on the coarsest mesh; at most {_MOST_BRICKS} fit in the memory"
    return None


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:
    """Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    Parameters, result and errors as of :class:`sensorgen.models.CapacitanceModel`.
    """
    fem.check(permittivity, width)
    return fem.narrowest(steps(scene, permittivity, width))


def steps(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Iterator[fem.FieldStep]:
    """The meshes that :func:`capacitance` goes through, until the interval is narrow enough."""
    coarse = grid(scene)
    values = [0.0, 0.0, *(permittivity[name] for name in coarse.names[2:])]
    for mesh, pair, cell in narrowed(total, coarse, values, width):
        interval = cell.times(EPS0_F_PER_M * M_PER_MM)
        yield fem.FieldStep(
            mesh.order, len(pair.flux.eps), pair.unknowns(), interval, layers=mesh.layers, flux_order=mesh.flux_order
        )


def narrowed(
    bounds: "Callable[[Pair], Bounded]", coarse: Grid, values: Sequence[complex], width: float
) -> "Iterator[tuple[BoxMeshLevel, Pair, Bounded]]":
    """Bounds on meshes of a grid from coarse to fine, until they are narrow enough.

    Parameters
    ----------
    bounds : callable
        From both kinds of elements on one mesh.
    coarse : Grid
        A cell.
    values : sequence of float or complex
        Permittivity of each of its names [-].
    width : float
        Relative width of the bounds that is wanted [-].

    Notes
    -----
    Meshes are left out that miss the width if they narrow the bounds as they do on rect, and those too large for the
    memory.
    """
    left = [*(_WITHOUT_LAYERS if (coarse.fill > 1).sum() > _MANY_BRICKS else ()), *MESHES]
    first = left[0]
    while left:
        mesh = left.pop(0)
        fine = layered(coarse, [abs(v) for v in values], mesh.layers)
        pair = Pair.of(fine, values, mesh.order, mesh.flux_order)
        if mesh != first and pair.unknowns() > _MOST_UNKNOWNS:
            return
        bound = bounds(pair)
        yield mesh, pair, bound
        if bound.width() <= width:
            return
        enough = [finer for finer in left if bound.width() * finer.width <= width * mesh.width]
        left = enough or left[-1:]


def total(pair: Pair) -> Interval:
    """Energy at 1 V over eps0 of all that the sensor holds, cut cells among it [mm]."""
    shares, rho = pair.flux.shares, np.real(pair.flux.eps)
    upper, cut = pair.potential.least().energy, bool(np.ptp(shares))
    flux = pair.flux.least(keep=cut)
    cell = fem.whole(fem.Energies(flux.energy, upper, 0.0, pair.unknowns()), [1.0])
    if not cut:
        return cell.times(float(shares.min()))
    part, unmet = pair.part(flux.values()[pair.flux.ids] * pair.flux.scale, rho)
    return whole(cell, float(part), unmet, shares)


def lossy(scene: Scene, permittivity: Mapping[str, complex], width: float = WIDTH) -> Disc:
    """Complex capacitance where materials lose or leak, between the terminals.

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`why_not_applicable` is None.
    permittivity : mapping of str to complex
        As of :func:`sensorgen.models.fem2d.lossy` [-].
    width : float
        Relative width of the disc; wider where the finest mesh is reached [-].

    Returns
    -------
    Disc
        Capacitance of the whole sensor [F]; see :mod:`sensorgen.solvers.electrostatics.bounds`.

    Raises
    ------
    OutOfRange, KeyError, ValueError
        As :func:`capacitance`.
    """
    fem.check(permittivity, width)
    coarse = grid(scene)
    values = [0j, 0j, *(complex(permittivity[name]) for name in coarse.names[2:])]
    turn = turned(values[2:])

    def bounds(pair: Pair) -> Disc:
        u, level = pair.potential.solved(), pair.flux.solved()
        rho = np.array([turn.weight[eps] for eps in pair.flux.eps.tolist()])
        upper, lower = ((x * boxes.answers(x)).sum() for x, boxes in ((u, pair.potential), (level, pair.flux)))
        part, unmet = pair.part(level, rho)  # by the flux
        most = float(np.ptp(pair.flux.shares))
        size = unmet / most if most else 0.0
        fields = Fields(lower, upper, part, size, pair.apart(u, level, rho), pair.unknowns())
        return disc(fields, turn, pair.flux.shares.tolist())

    best = min((cell for *_, cell in narrowed(bounds, coarse, values, width)), key=Disc.width)
    return best.times(EPS0_F_PER_M * M_PER_MM)
