r"""Potential and stream function on one mesh: both bounds by the same matrices.

In the plane a flux without sources is the curl of a function psi, which has one value along each line that no flux
crosses, and :math:`\int |D|^2 / \varepsilon = \int |\nabla \psi|^2 / \varepsilon`. Hence both problems are one, with
the permittivity or its inverse for a weight, and values held at the electrodes or at the mirrors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sensorgen.solvers.electrostatics.cones import ring_corners
from sensorgen.solvers.electrostatics.fronts import HELD, Numbers, Whole
from sensorgen.solvers.electrostatics.mesh import Cones
from sensorgen.solvers.electrostatics.polynomials import Real, condensed, crossed
from sensorgen.solvers.electrostatics.problem import Field, Problem


@dataclass(frozen=True)
class Plane:
    """A mesh with polynomials of one order."""

    mesh: Cones
    order: int

    @property
    def unknowns(self) -> int:
        """That triangles and cones share, up to those held."""
        points = len(np.unique(self.mesh.corners[self.mesh.plain]))
        return points + len(self.mesh.sides[0]) * (self.order - 1)

    def potential(self, weight: Numbers) -> Field:
        """The best potential, 0 V at the bottom and 1 V at the top; ``weight`` (n,) of each triangle."""
        ends = self.mesh.triangles.terminals
        held = {point: int(name == "top") for edge, name in ends.items() for point in edge}
        return self._grounded(self._problem(weight, held, set(ends), {}, HELD).solved())

    def stream(self, weight: Numbers) -> Field:
        """The function whose curl is the flux at which twice what flows into the top, less its energy, is most."""
        flow = self.mesh.flow
        return self._grounded(self._problem(weight, flow.held, flow.walls, flow.lifts, flow.count).solved(flow))

    def energies(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . grad g over each triangle of the mesh."""
        return self._over(f, g, self._plain_energy, self._cone_energies)

    def crossings(self, f: Field, g: Field) -> Numbers:
        """Integral of grad f . curl g over each triangle of the mesh."""
        same = crossed(self.order)
        return self._over(f, g, same, [(same, same)] * len(f.cones))

    def energy_terms(self, f: Field) -> Numbers:
        """Moduli of all terms that :meth:`energies` of ``f`` and its conjugate adds, over each triangle."""
        size, cones = f.moduli(), [(abs(rings), abs(tips)) for rings, tips in self._cone_energies]
        return self._over(size, size, abs(self._plain_energy), cones)

    def crossing_terms(self, f: Field, g: Field) -> Numbers:
        """Moduli of all terms that :meth:`crossings` adds, over each triangle."""
        size = abs(crossed(self.order))
        return self._over(f.moduli(), g.moduli(), size, [(size, size)] * len(f.cones))

    def _problem(self, weight: Numbers, *held: Any) -> Problem:
        return Problem(self.mesh, self.order, self._plain_energy, self._cone_energies, weight, *held)

    def _grounded(self, f: Field) -> Field:
        """Less the value at one end of each triangle's shortest side.

        A constant has no energy, but rounding times 1e10 is some; both ends have about the same value.
        """
        plain, *others = (_at_shortest(shapes) for shapes in self._shapes)
        cones = [
            (_less(rings, ring.reshape(-1, 2)), _less(tips, tip))
            for (rings, tips), ring, tip in zip(f.cones, others[::2], others[1::2], strict=True)
        ]
        return Field(_less(f.plain, plain), cones)

    def _over(self, f: Field, g: Field, plain: Real, cones: Sequence[tuple[Real, Real]]) -> Numbers:
        found = np.zeros(len(self.mesh.corners), np.result_type(f.plain, g.plain))
        found[self.mesh.plain] = _product(f.plain, plain, g.plain)
        for fan, (rings, tips), mine, other in zip(self.mesh.fans.values(), cones, f.cones, g.cones, strict=True):
            found[fan.members] = _product(mine[0], rings, other[0]).sum(axis=(0, 2))
            found[fan.members] += _product(mine[1], tips, other[1])
        return found

    @property
    def _plain_energy(self) -> Real:
        """Of the plain triangles (n, k, k)."""
        return self._matrices[0]

    @property
    def _cone_energies(self) -> list[tuple[Real, Real]]:
        """Of one ring's triangles (s, 2, k, k) and of the innermost (s, k, k), at each singular corner."""
        rings = (m.reshape(-1, 2, *m.shape[1:]) for m in self._matrices[1::2])
        return list(zip(rings, self._matrices[2::2], strict=True))

    @cached_property
    def _matrices(self) -> list[Real]:
        found = condensed(np.concatenate(self._shapes), self.order)
        return np.split(found, np.cumsum([len(s) for s in self._shapes])[:-1])

    @cached_property
    def _shapes(self) -> list[Real]:
        """Corners (n, 3, 2) of the plain triangles, then of one ring and of the tips at each singular corner."""
        points = self.mesh.triangles.points
        shapes = [points[self.mesh.corners[self.mesh.plain]]]
        for corner, fan in self.mesh.fans.items():
            away = points[[*fan.spokes, fan.spokes[0]]] - points[corner]
            tips = np.stack([0 * away[:-1], away[:-1], away[1:]], axis=1)[: len(fan.members)]
            shapes += [ring_corners(tips), tips]
        return shapes


def _at_shortest(corners: Real) -> Whole:
    """Number of the corner at which each triangle's shortest side starts."""
    sides = np.roll(corners, -1, axis=1) - corners
    found: Whole = (sides**2).sum(axis=-1).argmin(axis=-1)
    return found


def _less(values: Numbers, corner: Whole) -> Numbers:
    """Values on triangles (..., k) less the one at a corner of each."""
    place = np.broadcast_to(corner, values.shape[:-1])[..., None]
    found: Numbers = values.copy()
    found[..., :3] -= np.take_along_axis(values, place, axis=-1)
    return found


def _product(f: Numbers, matrix: Numbers, g: Numbers) -> Numbers:
    found: Numbers = (f * (matrix @ g[..., None])[..., 0]).sum(axis=-1)
    return found
