r"""Both bounds of a capacitance: potentials from above, fluxes from below; on triangles by NGSolve.

Dirichlet: any continuous u, 0 and 1 V on the electrodes, has :math:`C \le \int \varepsilon |\nabla u|^2`.
Thomson: any D of continuous normal component, without sources, tangential at the mirrors, has
:math:`C \ge 2 Q(D) - \int |D|^2 / \varepsilon`, Q its flux into the electrode at 1 V.
Both are stationary at their best field: what a solver leaves unsolved enters squared, and to the safe side.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import OutOfRange, SensorgenError
from sensorgen.interval import Interval
from sensorgen.scene import Scene


class CrossedBounds(SensorgenError):
    """A lower bound above its upper one: a fault of the solver, and no result."""


class Unsolved(SensorgenError):
    """A mesh so slender, or an order so high, that doubles do not solve it."""


@dataclass(frozen=True)
class Mesh:
    """Triangles that NGSolve is to fill with polynomials.

    Attributes
    ----------
    points : (n, 2) array
        Corners [mm].
    elements : (m, 3) array
        Corners of each triangle.
    regions : (m,) array
        Number of each element's region, from 0.
    terminals : dict of str to (k, 2) array
        Edges that lie on "top" and on "bottom".
    """

    points: NDArray[np.float64]
    elements: NDArray[np.int32]
    regions: NDArray[np.int32]
    terminals: dict[str, NDArray[np.int32]]


@dataclass(frozen=True)
class Energies:
    """What one mesh and order give, each over eps0: [mm], or per depth in two dimensions [-].

    Attributes
    ----------
    lower, upper : float
        By Thomson's and by Dirichlet's principle.
    part : float
        Of ``upper``: the energy weighted with how often each region occurs beyond the least.
    unknowns : int
        That the larger of the two systems couples.
    """

    lower: float
    upper: float
    part: float
    unknowns: int


def energies(
    mesh: Mesh, permittivity: Sequence[float], weights: Sequence[float], order: int, flux_order: int
) -> Energies:
    """Solve both problems on triangles with polynomials of one order.

    Parameters
    ----------
    mesh : Mesh
        Of a cell.
    permittivity : list of float
        Relative, of each region [-].
    weights : list of float
        Of each region in ``part`` [-].
    order, flux_order : int
        Of the potential's polynomials, and of the flux's; 1 or more.

    Raises
    ------
    Unsolved
        The flux does not balance its energy.
    """
    solved = Solved.of(mesh, permittivity, order, flux_order)
    slope = solved.slope()
    upper, part = solved.integrals(solved.eps * slope * slope, weights)
    return Energies(solved.lower(), upper, part, solved.unknowns)


@dataclass(frozen=True)
class Solved:
    """Both fields on one mesh, in NGSolve's own form.

    Attributes
    ----------
    space : ngsolve.Mesh
        That they live on.
    eps : ngsolve.CoefficientFunction
        Relative permittivity [-].
    potential, flux : ngsolve.GridFunction
        The best of their orders; the flux runs down the potential.
    into_top, flux_energy : float or complex
        What flows into the electrode at 1 V, and the flux's energy, over eps0.
    order, unknowns : int
        Of the potential; that the larger of the two systems couples.
    """

    space: Any
    eps: Any
    potential: Any
    flux: Any
    into_top: Any
    flux_energy: Any
    order: int
    unknowns: int

    @classmethod
    def of(cls, mesh: Mesh, permittivity: Sequence[complex], order: int, flux_order: int) -> "Solved":
        """Solve for both; complex where a permittivity is."""
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # elements are small: threads would only wait for each other
        import ngsolve as ng

        lossy = any(isinstance(e, complex) for e in permittivity)
        space = _ngsolve(mesh)
        eps = ng.CoefficientFunction([complex(e) if lossy else float(np.real(e)) for e in permittivity])
        potential = _potential(space, eps, order, lossy)
        flux, into_top, energy, unknowns = _flux(space, eps, flux_order, lossy)
        return cls(space, eps, potential, flux, into_top, energy, order, unknowns)

    def lower(self) -> Any:
        """Thomson's functional of the flux."""
        return 2 * self.into_top - self.flux_energy

    def slope(self) -> Any:
        """Gradient of the potential."""
        import ngsolve as ng

        return ng.grad(self.potential)

    def integrals(self, density: Any, weights: Sequence[float]) -> tuple[Any, Any]:
        """Integral of a product of two fields, and with the weight of each region."""
        import ngsolve as ng

        order = 2 * self.order + _MORE
        whole = ng.Integrate(density, self.space, order=order)
        if not any(weights):
            return whole, 0.0
        return whole, ng.Integrate(ng.CoefficientFunction(list(weights)) * density, self.space, order=order)


def third_electrode(scene: Scene) -> str | None:
    """Why bounds between two terminals cannot speak of a scene of more, or None."""
    if {body.terminal for body in scene.bodies} - {"", "top", "bottom"}:
        return "more than two electrodes: sensorgen stack speaks of them"
    return None


def check(permittivity: Mapping[str, complex], width: float) -> None:
    """Refuse permittivities and accuracies that mean nothing."""
    for material, value in permittivity.items():
        if not (np.isfinite(value) and np.real(value) > 0):
            raise OutOfRange(f"relative permittivity of {material} is {value:g}; expected a number above 0")
    if not width > 0:
        raise OutOfRange(f"accuracy is {width:g}; expected a number above 0, as 1e-4")


def whole(found: Energies, shares: Sequence[float]) -> Interval:
    r"""All cells of the sensor from one, and the cut ones at its ends from the energy in their part of it.

    With weights w up to W on parts of the cell, the energy norm of the exact field differs from the computed one by at
    most :math:`\sqrt{W (C_{upper} - C_{lower})}`, since its error over the whole cell is
    :math:`\|u_h - u\|^2 = C_{upper} - C`.

    Raises
    ------
    CrossedBounds
        The lower bound lies above the upper one by more than rounding.
    """
    below, above = found.lower, found.upper
    if not 0 < below <= above * (1 + ROUNDING):
        raise CrossedBounds(
            f"lower bound {below:.12g} above upper bound {above:.12g}: the solver failed on this scene; report it, "
            "and use --model columns meanwhile"
        )
    least, most = min(shares), max(shares)
    part, off = np.sqrt(found.part), np.sqrt((most - least) * max(above - below, 0.0))
    lower = least * below + max(part - off, 0.0) ** 2
    upper = least * above + (part + off) ** 2
    return Interval(float(min(lower, upper) * (1 - ROUNDING)), float(upper * (1 + ROUNDING)))


ROUNDING = 1e-9  # relative: what doubles may lose in a solve, by which both bounds are moved outwards


def _ngsolve(mesh: Mesh) -> Any:
    """The mesh in NGSolve's own form."""
    import netgen.meshing as netgen
    import ngsolve as ng

    size = np.ptp(mesh.points, axis=0).max()
    points = np.zeros((len(mesh.points), 3))
    points[:, :2] = (mesh.points - mesh.points.min(axis=0)) / size
    made = netgen.Mesh(2)
    made.AddPoints(points)
    for number in range(int(mesh.regions.max()) + 1):
        made.Add(netgen.FaceDescriptor(surfnr=number + 1, domin=number + 1, domout=0, bc=number + 1))
        here = np.ascontiguousarray(mesh.elements[mesh.regions == number])
        made.AddElements(dim=2, index=number + 1, data=here, base=0)
        made.SetMaterial(number + 1, str(number))
    for number, (name, edges) in enumerate(mesh.terminals.items()):
        made.AddElements(dim=1, index=number + 1, data=np.ascontiguousarray(edges), base=0)
        made.SetBCName(number, name)
    return ng.Mesh(made)


def _potential(space: Any, eps: Any, order: int, lossy: bool) -> Any:
    """The potential of least energy, or where it is stationary."""
    import ngsolve as ng

    fes = ng.H1(space, order=order, dirichlet="top|bottom", complex=lossy)
    u, v = fes.TnT()
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True, condense=True)
    found = ng.GridFunction(fes)
    found.Set(ng.CF(1), definedon=space.Boundaries("top"))
    _solve(form, found)
    return found


def _flux(space: Any, eps: Any, order: int, lossy: bool) -> tuple[Any, Any, Any, int]:
    """The flux at which Thomson's functional is most, what flows into the top, its energy, and the shared unknowns.

    Facets' potentials keep it continuous.

    The sign makes what is left after the elements' own unknowns positive definite.
    """
    import ngsolve as ng

    flux = ng.HDiv(space, order=order, discontinuous=True, hodivfree=True, complex=lossy)
    level = ng.L2(space, order=0, complex=lossy)
    facet = ng.FacetFESpace(space, order=order, dirichlet="top|bottom", complex=lossy)
    fes = flux * level * facet
    (d, q, w), (e, r, z) = fes.TnT()
    normal = ng.specialcf.normal(space.dim)
    form = ng.BilinearForm(fes, symmetric=True, condense=True)
    form += -(d * e / eps - q * ng.div(e) - r * ng.div(d)) * ng.dx
    form += -(w * (e * normal) + z * (d * normal)) * ng.dx(element_boundary=True)
    found = ng.GridFunction(fes)
    found.components[2].Set(ng.CF(1), definedon=space.Boundaries("top"))
    _solve(form, found)
    field = found.components[0]
    outwards = found.components[2] * (field * normal) * ng.dx(element_boundary=True, bonus_intorder=order)
    into_top = -ng.Integrate(outwards, space)  # facets inside cancel: the normal component is continuous there
    energy = ng.Integrate(field * field / eps, space, order=2 * order + _MORE)
    if not abs(into_top - energy) <= _BALANCE * abs(energy):
        raise Unsolved(
            f"flux {into_top:.9g} and its energy {energy:.9g} differ (order {order}): the solver failed on this scene; "
            "use --model columns"
        )
    return field, into_top, energy, facet.ndof


_MORE = 2  # orders of quadrature beyond twice the polynomials'
_BALANCE = 1e-8  # relative: at the best flux, what flows into the electrode at 1 V is its energy


def _solve(form: Any, found: Any) -> None:
    """Solve for the unknowns that elements share, then for their own."""
    try:
        form.Assemble()
    except Exception as error:  # NGSolve's own, of a type that it does not export
        raise Unsolved(f"the solver failed on this scene ({str(error).strip()}); use --model columns") from error
    residual = found.vec.CreateVector()
    inverse = form.mat.Inverse(found.space.FreeDofs(True), "sparsecholesky")
    for _ in range(3):  # each time takes back what slender triangles lose: 8e-5, 4e-9, nothing at an aspect of 1e4
        residual.data = form.mat * found.vec
        found.vec.data -= inverse * residual
    found.vec.data += form.harmonic_extension * found.vec
