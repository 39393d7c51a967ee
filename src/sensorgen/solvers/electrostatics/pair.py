r"""A potential and a flux on the same boxes: how far they are apart, and the energy in a part of the field.

A sensor that ends amid a cell holds some boxes more often than others, by w. Let :math:`D = D_h + r` be the exact flux,
the computed one and what this misses, of at most :math:`\eta^2 = C_{upper} - C_{lower}`. In

.. math:: \int w \frac{D^2}{\varepsilon} = \int w \frac{D_h^2}{\varepsilon} + 2 \int w \frac{D_h r}{\varepsilon}
          + \int w \frac{r^2}{\varepsilon}

the middle term vanishes where :math:`w D_h` is a gradient :math:`\varepsilon \nabla z`, z zero at the electrodes, or a
flux of the same elements without sources, of which the computed one is the best. So it is :math:`2 \kappa \eta` at
most, :math:`\kappa` what both together cannot make of :math:`w D_h`: the distance of a second pair of fields, driven by
what crosses the planes where w jumps. Both factors fall with the mesh.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.bounds import Interval
from sensorgen.solvers.electrostatics.boxes import Element, flux, potential, traces
from sensorgen.solvers.electrostatics.bricks import Grid
from sensorgen.solvers.electrostatics.dissection import Elements, least, unknowns_of

Array = NDArray[Any]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class Boxes:
    """All boxes between the electrodes as elements of one kind.

    Attributes
    ----------
    elements : Elements
        Their energies over eps0 [mm].
    eps : (n,) array
        Relative permittivity, complex where it loses [-].
    shares : (n,) array
        How often each occurs in the sensor [-].
    shape : callable
        From a box's number to its matrix for a permittivity of 1.
    """

    elements: Elements
    eps: Array
    shares: Real
    shape: Callable[[int], Real]

    def unknowns(self) -> int:
        """How many the boxes share."""
        return len(np.unique(self.elements.keys[np.isnan(self.elements.held)]))

    def solved(self) -> Array:
        """The unknowns of each box (n, b) that have the least energy."""
        return unknowns_of(self.elements, least(self.elements, keep=True).values())

    def pushed(self, load: Array) -> "Boxes":
        """The same with both electrodes at 0 V and forces (n, b) on the unknowns."""
        held = np.where(np.isnan(self.elements.held), np.nan, 0.0)
        return replace(self, elements=replace(self.elements, held=held, load=load))

    def answers(self, unknowns: Array) -> Array:
        """What the unknowns (n, b) are met with (n, b): from a flux's, its moments on the six faces."""
        return np.array([e * (self.shape(box) @ x) for box, (e, x) in enumerate(zip(self.eps, unknowns, strict=True))])


def boxes_of(fine: Grid, values: Sequence[complex], kind: Element) -> Boxes:
    """The boxes of a grid whose materials have some relative permittivities."""
    boxes = np.argwhere(fine.fill > 1)
    count = np.array(fine.fill.shape)
    keys = kind.keys(boxes, count)
    held = np.full(keys.shape, np.nan)
    for code, value in ((0, 0.0), (1, 1.0)):
        held[np.isin(keys, kind.keys(np.argwhere(fine.fill == code), count))] = value
    eps = np.array(values)[fine.fill[tuple(boxes.T)]]
    edges = np.column_stack([np.diff(p)[boxes[:, axis]] for axis, p in enumerate(fine.planes_mm)])
    scales = edges.prod(1)[:, None] / (2 * edges**2)

    def shape(box: int) -> Real:
        return kind.condensed(scales[box])

    elements = Elements(boxes, keys, held, kind.one, lambda box: eps[box] * shape(box))
    return Boxes(elements, eps, fine.shares[boxes[:, 0], boxes[:, 1]], shape)


@dataclass(frozen=True)
class Pair:
    """Both kinds of elements on the same boxes; ``seen``, what fluxes feel of potentials."""

    potential: Boxes
    flux: Boxes
    seen: Real

    @classmethod
    def of(cls, fine: Grid, values: Sequence[complex], order: int, flux_order: int) -> "Pair":
        """Of a grid, by the orders of their polynomials."""
        one, other = (boxes_of(fine, values, kind) for kind in (potential(order), flux(flux_order)))
        return cls(one, other, traces(order, flux_order))

    def unknowns(self) -> int:
        """That the larger of the two systems couples."""
        return max(self.potential.unknowns(), self.flux.unknowns())

    def apart(self, u: Array, level: Array, rho: Real) -> float:
        r"""How far fields with these unknowns are apart, :math:`\int |\varepsilon \nabla u - D|^2 / \rho`."""
        found = np.empty(len(rho))
        for box, (here, there) in enumerate(zip(u, level, strict=True)):
            into, out = self.potential.shape(box) @ here, self.flux.shape(box) @ there
            found[box] = (here.conj() @ into - 2 * (self.seen @ here) @ out.conj() + there.conj() @ out).real
        return max(float((abs(self.flux.eps) ** 2 / rho) @ found), 0.0)

    def part(self, level: Array, rho: Real) -> tuple[Any, float]:
        """Energy of a flux, by its unknowns, weighted with how often boxes occur beyond the least; and kappa squared.

        The latter is weighted with 1 / ``rho``.
        """
        more = self.flux.shares - self.flux.shares.min()
        if not more.any():
            return 0.0, 0.0
        moments = self.flux.answers(level)
        load = more[:, None] * moments
        gradient, best = self.potential.pushed(load @ self.seen).solved(), self.flux.pushed(load).solved()
        return more @ (level * moments).sum(axis=1), self.apart(gradient, best, rho)


def whole(cell: Interval, part: float, unmet: float, shares: Real) -> Interval:
    """Bounds of all that a sensor holds, from those of its cell and :meth:`Pair.part`."""
    least, most = float(shares.min()), float(shares.max())
    off, kappa = np.sqrt(cell.upper - cell.lower), np.sqrt(unmet)
    found, worst = least * cell.lower + part, min(off, kappa / least) if least else off
    lower, upper = found + worst * (least * worst - 2 * kappa), found + off * (2 * kappa + most * off)
    return Interval(float(lower), float(upper))
