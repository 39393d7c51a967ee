"""The triangles alone: closed forms, tangent and energy against differences, locking."""

import numpy as np
import pytest
from neo_hooke import check_derivatives, stretches

from sensorgen.solvers.contact import boundary, element, load
from sensorgen.solvers.contact.contact import Faces
from sensorgen.solvers.contact.mesh import of_triangles


def none(mesh):
    return Faces(mesh.points_m, np.empty((0, 3), int), ())


def grid(nx, ny, wide=1.0, high=1.0, bend=0.0, shape=None):
    """A block of triangles; ``bend`` moves the inner corners."""
    x, y = np.meshgrid(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1))
    x, y = x + bend * np.sin(np.pi * x) * np.sin(np.pi * y), y - bend * np.sin(np.pi * x) * np.sin(2 * np.pi * y)
    points = np.column_stack([x.ravel() * wide, y.ravel() * high])
    points = points if shape is None else shape(points)
    k = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    a, b, c, d = (v.ravel() for v in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    corners = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return of_triangles(points, corners, np.ones(len(corners), int))


def elements(mesh, e, nu):
    return element.Elements(mesh, element.law(np.full(len(mesh.outer), e), np.full(len(mesh.outer), nu)))


def pressed(mesh, e, nu, held, stress, steps=5):
    free = boundary.free_of(mesh.points_m, held)
    problem = load.Problem(elements(mesh, e, nu), none(mesh), free, boundary.top_load(mesh.points_m, *mesh.top()), 1.0)
    return problem, list(load.curve(problem, np.linspace(0, stress, steps + 1), stress))[-1]


@pytest.mark.parametrize(("nu", "period"), [(0.4999, "fixed"), (0.3, "free"), (0.5, "free")])
def test_a_block_follows_the_closed_form_on_any_mesh(nu, period):
    """Homogeneous neo-Hookean block: stretch a across, b along the load, nothing pulls sideways where free."""
    mesh = grid(3, 3, bend=0.08)
    problem, state = pressed(mesh, 6.0, nu, boundary.BoundaryConditions("sliding", period, "rigid"), 2.0)
    across, along = stretches(2.0, 6.0, nu, period, 1)
    assert problem.load @ state.u_m / np.abs(problem.load).sum() == pytest.approx(1 - along, rel=1e-6)
    j = problem.elements.volume_ratio(state.u_m, state.inner)
    assert j == pytest.approx(np.full_like(j, across * along), rel=1e-6)


def test_the_tangent_is_the_derivative_of_the_residual_and_that_of_the_energy():
    mesh = grid(2, 2, bend=0.1)
    e, rng = elements(mesh, 6.0, 0.49), np.random.default_rng(1)
    u = rng.normal(size=2 * len(mesh.points_m)) * 0.02
    inner = element.Inner(rng.normal(size=(8, 2)) * 0.01, rng.normal(size=(8, 3)))
    check_derivatives(e, u, inner, rng.normal(size=len(u)), rng.normal(size=(8, 5)))


@pytest.mark.parametrize(("thick", "stiffer"), [(0.2, 835)])
def test_a_bonded_strip_is_as_stiff_as_gent_and_lindley_say(thick, stiffer):
    """Half of a strip 10 mm wide, sides free, between stiff plates to which it is bonded; exactly incompressible."""
    mesh = grid(40, 3, wide=5.0, high=thick)
    x, y = mesh.points_m.T
    fixed = np.zeros(2 * len(x), bool)
    fixed[2 * np.flatnonzero((x == 0) | (y == 0) | (y == y.max()))] = True
    fixed[2 * np.flatnonzero(y == 0) + 1] = True
    top = np.flatnonzero(y == y.max())
    from scipy.sparse import csr_matrix

    free = np.flatnonzero(~fixed)
    leader = np.arange(2 * len(x))
    leader[2 * top + 1] = 2 * top[0] + 1
    kept, column = np.unique(leader[free], return_inverse=True)
    reduce = csr_matrix((np.ones(len(free)), (free, column)), (2 * len(x), len(kept)))
    problem = load.Problem(
        elements(mesh, 1.0, 0.5), none(mesh), reduce, boundary.top_load(mesh.points_m, *mesh.top()), 1.0
    )
    *_, state = load.curve(problem, [0.0, 1e-3], 1.0)
    strain = problem.load @ state.u_m / np.abs(problem.load).sum() / thick
    assert 1e-3 / strain == pytest.approx(stiffer, rel=0.06)
