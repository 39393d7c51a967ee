"""Finite elements in three dimensions for scenes of boxes: a potential from above, a flux from below.

Bricks in layers that shrink towards edges where the field is infinite fill the part of a cell between its mirrors. On
boxes all matrices are known in closed form, and elimination from the inside out needs no solver: NumPy is enough. See
docs/cells.md.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.interval import Disc, Interval
from sensorgen.models import _fem_bounds as fem
from sensorgen.models._fem_boxes import Element, flux, potential, traces
from sensorgen.models._fem_bricks import Grid, grid, layered
from sensorgen.models._fem_dissection import Elements, energies_of, least, unknowns_of
from sensorgen.models._fem_lossy import Fields, Turned, disc, turned
from sensorgen.scene import Scene
from sensorgen.units import EPS0_F_PER_M, M_PER_MM

SOURCE = "Dirichlet's and Thomson's principles; graded boxes, H1 and hybrid H(div), nested dissection"
COST = 3

WIDTH = 1e-3  # of the interval, where the caller does not say

_RUNGS = ((1, 3, 2), (1, 5, 4), (2, 6, 5), (3, 7, 6))  # layers, order of the potential, order of the flux
_MOST_BRICKS = 2500  # of one rung: more would take hours


def unfit(scene: Scene) -> str | None:
    """Why this model cannot speak of this scene, or None."""
    if reason := fem.third_electrode(scene):
        return reason
    try:
        coarse = grid(scene)
    except ValueError as error:
        return str(error)
    boxes = int((coarse.fill > 1).sum())
    if boxes > _MOST_BRICKS:
        return f"its cell has {boxes} bricks on the coarsest mesh; at most {_MOST_BRICKS} fit in the memory"
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
    values = [0.0, 0.0, *(permittivity[name] for name in coarse.names[2:])]
    for layers, order, flux_order in _RUNGS:
        fine = layered(coarse, values, layers)
        upper, part, shared = _least(fine, values, potential(order))
        lower, _, faces = _least(fine, values, flux(flux_order))
        found = fem.Energies(lower, upper, part, max(shared, faces))
        interval = fem.whole(found, fine.shares.ravel().tolist()).times(EPS0_F_PER_M * M_PER_MM)
        yield Step(layers, order, flux_order, int((fine.fill > 1).sum()), found.unknowns, interval)
        if interval.width() <= width:
            return


def lossy(scene: Scene, permittivity: Mapping[str, complex], width: float = WIDTH) -> Disc:
    """Complex capacitance where materials lose or leak, between the terminals.

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`unfit` is None.
    permittivity : mapping of str to complex
        As of :func:`sensorgen.models.fem2d.lossy` [-].
    width : float
        How wide the disc may be, relative to its centre's modulus; it is wider where the finest mesh is reached [-].

    Returns
    -------
    Disc
        Capacitance of the whole sensor [F]; see :mod:`sensorgen.models._fem_lossy`.

    Raises
    ------
    OutOfRange, KeyError, ValueError
        As :func:`capacitance`.
    """
    fem.check(permittivity, width)
    coarse = grid(scene)
    values = [0j, 0j, *(complex(permittivity[name]) for name in coarse.names[2:])]
    turn = turned(values[2:])
    found = []
    for layers, order, flux_order in _RUNGS:
        fine = layered(coarse, [abs(v) for v in values], layers)
        found.append(disc(_fields(fine, values, turn, order, flux_order), turn, fine.shares.ravel().tolist()))
        if found[-1].width() <= width:
            break
    return min(found, key=Disc.width).times(EPS0_F_PER_M * M_PER_MM)


def _least(fine: Grid, values: Sequence[float], kind: Element) -> tuple[float, float, int]:
    """Energy at 1 V over eps0, its part in columns that occur more often than others, and the unknowns."""
    boxes = _boxes(fine, values, kind)
    solved = least(boxes.elements, keep=bool(boxes.more.any()))
    part = (
        boxes.more @ energies_of(boxes.elements, unknowns_of(boxes.elements, solved.values())) if solved.steps else 0.0
    )
    return float(solved.energy), float(part), boxes.unknowns()


def _fields(fine: Grid, values: Sequence[complex], turn: Turned, order: int, flux_order: int) -> Fields:
    r"""Potential and flux, and how far they are apart, :math:`\int |\varepsilon \nabla u - D|^2 / \rho`."""
    upper, lower = (_boxes(fine, values, kind) for kind in (potential(order), flux(flux_order)))
    solved = [least(boxes.elements, keep=True) for boxes in (upper, lower)]
    u, level = (unknowns_of(b.elements, s.values()) for b, s in zip((upper, lower), solved, strict=True))
    seen = traces(order, flux_order)
    squares, apart = np.empty(len(u)), np.empty(len(u))
    for box, (here, there) in enumerate(zip(u, level, strict=True)):
        into, out = upper.shape(box) @ here, lower.shape(box) @ there
        squares[box] = (here.conj() @ into).real
        apart[box] = squares[box] - 2 * ((seen @ here) @ out.conj()).real + (there.conj() @ out).real
    rho = np.array([turn.weight[eps] for eps in upper.eps.tolist()])
    energies = energies_of(upper.elements, u)
    return Fields(
        solved[1].energy, energies.sum(), upper.more @ energies, float(upper.more @ (rho * squares)),
        max(float((abs(upper.eps) ** 2 / rho) @ apart), 0.0), max(upper.unknowns(), lower.unknowns()),
    )  # fmt: skip


@dataclass(frozen=True)
class _Boxes:
    """All boxes between the electrodes as elements of one kind.

    ``eps`` (n,), relative permittivity; ``more`` (n,), how often each occurs beyond the least; ``shape`` gives the
    matrix of a box for a permittivity of 1.
    """

    elements: Elements
    eps: NDArray[np.float64 | np.complex128]
    more: NDArray[np.float64]
    shape: Callable[[int], NDArray[np.float64]]

    def unknowns(self) -> int:
        """How many the boxes share."""
        return len(np.unique(self.elements.keys[np.isnan(self.elements.held)]))


def _boxes(fine: Grid, values: Sequence[complex], kind: Element) -> _Boxes:
    boxes = np.argwhere(fine.fill > 1)
    count = np.array(fine.fill.shape)
    keys = kind.keys(boxes, count)
    held = np.full(keys.shape, np.nan)
    for code, value in ((0, 0.0), (1, 1.0)):
        held[np.isin(keys, kind.keys(np.argwhere(fine.fill == code), count))] = value
    eps = np.array(values)[fine.fill[tuple(boxes.T)]]
    edges = np.column_stack([np.diff(p)[boxes[:, axis]] for axis, p in enumerate(fine.planes_mm)])
    scales = edges.prod(1)[:, None] / (2 * edges**2)

    def shape(box: int) -> NDArray[np.float64]:
        return kind.condensed(scales[box])

    elements = Elements(boxes, keys, held, kind.one, lambda box: eps[box] * shape(box))
    more = fine.shares[boxes[:, 0], boxes[:, 1]] - fine.shares.min()
    return _Boxes(elements, eps, more, shape)
