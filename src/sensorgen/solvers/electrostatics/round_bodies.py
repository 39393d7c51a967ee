r"""Both bounds of a capacitance between curved and slanted bodies: curved tetrahedra, H1 above and hybrid H(div) below.

Piola's transformation keeps fluxes free of sources on curved elements too, and both functionals are integrated so
finely that quadrature does not count: what is left is the distance of the curved elements from the round faces, by
which the bounds are moved outwards.
"""

from collections.abc import Iterator
from math import inf
from typing import Any, NamedTuple

import numpy as np

from sensorgen.scene.revolved import Revolved
from sensorgen.solvers.electrostatics.bounds import Energies
from sensorgen.solvers.electrostatics.prisms import TOP, balanced, fluxes
from sensorgen.solvers.electrostatics.round_cell import RoundCell, profile
from sensorgen.solvers.electrostatics.round_mesh import BETWEEN, MORE, RoundMesh, mesh_of

__all__ = ["LEVELS", "RoundCell", "RoundLevel", "bounds", "solved"]


class RoundLevel(NamedTuple):
    """A mesh, as of :func:`mesh_of`, and the width that it often reaches [-]."""

    order: int
    layers: int
    closed: float
    width: float


LEVELS = (
    RoundLevel(2, 2, 1e-2, 1.5e-2),
    RoundLevel(3, 2, 4e-3, 1.5e-3),
    RoundLevel(4, 2, 2e-3, 4.5e-4),
    RoundLevel(5, 3, 1e-3, 6e-5),
    RoundLevel(6, 4, 5e-4, 1e-5),
)


def bounds(cell: RoundCell, width: float) -> Iterator[tuple[RoundLevel, int, Energies]]:
    """Both bounds over eps0 [mm] on finer and finer meshes, each with its number of elements, until within tolerance.

    Parameters
    ----------
    cell : RoundCell
        Between mirrors.
    width : float
        Relative width of the bounds that is wanted: the first mesh often reaches it [-].

    Raises
    ------
    Unsolved
        As :func:`mesh_of`.
    """
    first = sum(level.width > width for level in LEVELS[:-1])
    for level in LEVELS[first:]:
        mesh = mesh_of(cell, level.order, level.layers, level.closed)
        found = solved(mesh, level.order)
        yield level, mesh.ngsolve.ne, found
        if found.upper * (1 + found.rounding) - found.lower * (1 - found.rounding) <= width * found.lower:
            return


def solved(mesh: RoundMesh, order: int) -> Energies:
    """Both bounds over eps0 [mm] on one mesh, of a potential of an order and of a flux of one less."""
    import ngsolve as ng

    cell, space, fine = mesh.cell, mesh.ngsolve, 2 * order + MORE
    least = {f"d{k}p.*": value for k, value in enumerate(cell.permittivity)}
    most, metal = dict(least), [f"c{k}" for k in range(cell.conductors)]
    grown, filled = list(metal), "d.*"  # for the upper bound: conductors and what they leave
    for k, touch in enumerate(mesh.touches):
        own = cell.permittivity[max(touch.kind - cell.conductors, -1)]  # of a conductor's cusp, that of the rest
        both = sorted((own, cell.permittivity[-1]))
        least[f"t{k}"], most[f"t{k}"] = both
        if touch.kind < cell.conductors:
            grown[touch.kind] += f"|t{k}"
        else:
            filled += f"|t{k}"
    eps, inside = space.MaterialCF(most), space.Materials(filled)
    above = ng.H1(space, order=order, dirichlet="|".join(grown), definedon=inside)
    u, v = above.TnT()
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx(definedon=inside), symmetric=True, condense=True)
    _, potential = balanced(form, lambda f: f, grown)
    density = eps * ng.grad(potential) * ng.grad(potential)
    upper = ng.Integrate(density, space, order=fine, definedon=inside)
    part = sum(
        weight * ng.Integrate(density, space, order=fine, definedon=space.Materials(f"d.*p{n}"))
        for n, weight in enumerate(cell.weights().tolist())
        if weight
    )
    flux, _, charges, unknowns = fluxes(space, space.MaterialCF(least), metal, order - 1)
    lower = 2 * charges[TOP] - ng.Integrate(flux * flux / space.MaterialCF(least), space, order=fine)
    return Energies(lower, upper, part, unknowns, _moved(mesh, density) / upper, bool(mesh.touches))


def _moved(mesh: RoundMesh, density: Any) -> float:
    """Change by the distance of curved elements from round faces, to first order [mm].

    A conductor whose face moves changes the energy by that of the layer that it passes; a dielectric by at most that,
    on the side where it is greater: fields along the face and fluxes across it are continuous.
    """
    import ngsolve as ng

    space = mesh.ngsolve
    far = ng.CF(inf)
    for piece in (piece for _, piece, _ in mesh.cell.boxes() if isinstance(piece, Revolved)):
        radius = ng.sqrt((ng.x - piece.x_mm) ** 2 + (ng.y - piece.y_mm) ** 2)
        for edge in profile(piece):
            off = edge.distance(radius, ng.z, ng.sqrt)
            square = off * off
            far = ng.IfPos(far - square, square, far)
    between = np.array(space.GetBoundaries()) == BETWEEN
    ratio, far = max(mesh.cell.permittivity) / min(mesh.cell.permittivity), ng.sqrt(far).Compile()
    layer = far * ng.BoundaryFromVolumeCF(density)
    found = 0.0
    for faces, factor in ((mesh.round & ~between, 1.0), (mesh.round & between, ratio)):
        if faces.any():
            region = ng.Region(space, ng.BND, ng.BitArray(faces.tolist()))
            found += factor * ng.Integrate(layer, space, definedon=region, order=2 * MORE)
    return float(found)
