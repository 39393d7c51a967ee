"""Curved and slanted bodies pressed as columns, against finite elements on their true form, and Hertz's contact."""

import importlib.util
from math import tan

import numpy as np
import pytest

from sensorgen.design.design import make
from sensorgen.models import curved, press_stairs
from sensorgen.models.press_stairs import Columns, Elastic
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Scene, box

SOLIDS = {"etpu": Elastic(12e6, 0.45), "x60": Elastic(26e6, 0.45)}


def slope_m_per_pa(scene, solids):
    """Displacement over small pressure, by linear elasticity on tetrahedra that follow the bodies."""
    import netgen.occ as occ
    import ngsolve as ng

    from sensorgen.solvers.electrostatics.round_mesh import solid

    cell, _, _ = curved.cell(scene)
    shapes = []
    owner = {id(p): b.material for b in scene.bodies for p in b.pieces}
    for piece, _ in cell.pieces:
        one = solid(piece) * occ.Box(cell.low_mm, cell.high_mm)
        one.mat(owner[id(piece)])
        shapes.append(one)
    whole = occ.Glue(shapes)
    for face in whole.faces:
        for k, axis in enumerate("xyz"):
            for end, at in (("low", cell.low_mm[k]), ("high", cell.high_mm[k])):
                low, high = (tuple(corner)[k] for corner in face.bounding_box)
                if max(abs(low - at), abs(high - at)) < 1e-6:
                    face.name = axis + end
    mesh = ng.Mesh(occ.OCCGeometry(whole).GenerateMesh(maxh=0.2, grading=0.4))
    mesh.Curve(3)
    sides = {axis: f"{axis}low|{axis}high|zlow" for axis in "xy"}
    space = ng.VectorH1(mesh, order=3, dirichletx=sides["x"], dirichlety=sides["y"], dirichletz="zlow")
    u, v = space.TnT()

    def strain(w):
        return (ng.Grad(w) + ng.Grad(w).trans) / 2

    mu = mesh.MaterialCF({n: s.youngs_modulus_pa / (2 + 2 * s.poisson_ratio) for n, s in solids.items()})
    ratio = mesh.MaterialCF({n: 2 * s.poisson_ratio / (1 - 2 * s.poisson_ratio) for n, s in solids.items()})
    energy = 2 * mu * ng.InnerProduct(strain(u), strain(v)) + mu * ratio * ng.div(u) * ng.div(v)
    form = ng.BilinearForm(energy * ng.dx, symmetric=True).Assemble()
    top = mesh.Boundaries("zhigh")
    load = ng.LinearForm(-v[2] * ng.ds(definedon=top)).Assemble()
    moved = ng.GridFunction(space)
    moved.vec.data = form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * load.vec
    area = ng.Integrate(1, mesh, definedon=top)
    return -ng.Integrate(moved[2], mesh, definedon=top) / area * 1e-3


@pytest.mark.skipif(importlib.util.find_spec("ngsolve") is None, reason="NGSolve is not installed")
@pytest.mark.parametrize(("shape", "within"), [("pyramid", 0.12), ("cone", 0.12)])
def test_blunt_tips_deform_as_finite_elements_on_their_form(shape, within):
    scene = make({"shape": shape}).in_use
    exact = slope_m_per_pa(scene, SOLIDS)
    found = press_stairs.press(scene, SOLIDS, [0.0, 2e3], fineness=Columns(6))
    assert found.displacement_m[1] / 2e3 == pytest.approx(exact, rel=within)
    assert not found.faults


def bump(radius, period, high):
    """A quarter of a sphere's cap of soft rubber, that hangs over a hard plate."""
    at, angle = period / 2, np.arccos(1 - high / radius)
    cap = Revolved(at, at, ((0, 0.1), (radius * np.sin(angle), 0.1 + high), (0, 0.1 + high)), (tan(angle / 4), 0, 0))
    bodies = (
        Body("low", "hard", (box(0, period, 0, period, 0, 0.1),), "bottom"),
        Body("pattern", "soft", (cap, box(0, period, 0, period, 0.1 + high, 0.5 + high)), "top"),
    )
    return Scene(bodies, (period, period, 0.5 + high))


def test_a_bump_is_hertz_within_the_error_that_two_numbers_of_columns_state():
    """A sphere of 1 mm on a hard plate: (3 F / 4 E*)^(2/3) / R^(1/3), which takes the rubber for a half space."""
    radius, period, e, nu, stress = 1.0, 1.4, 10e6, 0.45, 1e5
    scene, solids = bump(radius, period, 0.25), {"soft": Elastic(e, nu), "hard": Elastic(1e10, 0.3)}
    coarse, fine = (press_stairs.press(scene, solids, [0.0, 3e4, stress], fineness=Columns(n)) for n in (7, 8))
    force = np.array([3e4, stress]) * (period * 1e-3) ** 2
    hertz = (3 * force * (1 - nu**2) / (4 * e)) ** (2 / 3) / (radius * 1e-3) ** (1 / 3)
    down, other = fine.displacement_m[1:], coarse.displacement_m[1:]
    error = np.maximum(0.24 * down, 1.25 / ((8 / 7) ** 2 - 1) * abs(down - other))
    assert (abs(down - hertz) <= error).all()
    assert abs(fine.imbalance).max() < 0.02  # a spline through two loads
