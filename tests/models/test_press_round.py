"""Round and tapered bodies under pressure against Hertz, Sneddon, a bonded disc, boxes in 3D, and elasticity in 3D."""

import importlib.util
import json
from math import pi, tan
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.design.design import make
from sensorgen.design.tip import Tip
from sensorgen.models import curved, press2d, press_round, springs
from sensorgen.models.press_round import BoundaryConditions, Elastic, Fineness
from sensorgen.prediction.compression_law import case_of
from sensorgen.prediction.mesh_ladder import COARSEST, drawn, pressed
from sensorgen.scene.polyhedra import Loft
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Prism, Scene, box, rectangle

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")
SOLIDS = {"etpu": Elastic(12e6, 0.45), "x60": Elastic(26e6, 0.45)}
EPS = {"x60": 4.68, "air": 1.0}
BLUNT = json.loads((Path(__file__).parents[1] / "reference" / "blunt_tips.json").read_text("utf-8"))
E_PA, NU, PERIOD_MM = 10e6, 0.45, 3.0
STIFFNESS_PA = E_PA / (1 - NU**2)


def over_a_plate(piece, top_mm, period=PERIOD_MM):
    """A soft body under a soft block, over a hard plate that it touches."""
    end = piece.span("z")[1]
    bodies = (
        Body("low", "hard", (box(0, period, 0, period, 0, 0.1),), "bottom"),
        Body("soft", "soft", (piece, box(0, period, 0, period, end, end + top_mm)), "top"),
    )
    return Scene(bodies, (period, period, end + top_mm))


def solved(scene, fineness, forces_n, nu=NU, period=PERIOD_MM, top="even"):
    """Displacements [m] and second moments of the contact pressure [m2] at forces."""
    stress = [0.0, *(np.array(forces_n) / (period * 1e-3) ** 2).tolist()]
    solids = {"soft": Elastic(E_PA, nu), "hard": Elastic(1e4 * E_PA, 0.3)}
    cell = press_round.cell(scene, fineness)
    found, run = press2d._solved(cell, solids, stress, BoundaryConditions(top=top), fineness, lambda _: None)
    assert found.faults == ()
    moments = []
    for state in run.states[1:]:
        push = np.maximum(-run.problem.gaps(state.pairs, state.u_m), 0) * state.pairs.stiffness_pa
        here = run.problem.faces.rays(run.problem.places(state.u_m)).here_m
        moments.append((push * here[state.pairs.point % len(here), 0] ** 2).sum() / max(push.sum(), 1e-300))
    return found.displacement_m[1:], np.array(moments)


def test_a_sphere_on_a_flat_is_hertz():
    """Approach a²/R and force 4 E* a³ / 3R; the block below it is 60 radii of the contact high."""
    radius, high = 1.0, 0.5
    angle, at = np.arccos(1 - high / radius), PERIOD_MM / 2
    corners = ((0, 0.1), (float(radius * np.sin(angle)), 0.1 + high), (0, 0.1 + high))
    scene = over_a_plate(Revolved(at, at, corners, (tan(angle / 4), 0, 0)), 2.0)
    wide_m = np.array([2e-5, 4e-5])
    force, approach = 4 / 3 * STIFFNESS_PA * wide_m**3 / (radius * 1e-3), wide_m**2 / (radius * 1e-3)
    errors = []
    for factor in (1.0, 0.5):
        down, moment = solved(scene, Fineness(4e-3, 0.05, 0.3, 0.25).scaled(factor), force)
        errors.append([down / approach - 1, np.sqrt(2.5 * moment) / wide_m - 1])  # of a half ellipsoid
    assert abs(np.array(errors[0])).max() < 0.02
    assert abs(np.array(errors[1])).max() < 0.01
    assert abs(errors[1][1]).max() < abs(errors[0][1]).max() / 2


@pytest.mark.parametrize("slope", [0.05, 0.2])
def test_a_sharp_cone_is_sneddon(slope):
    """Force 2 E* d² / (pi slope) at an approach d, a half space for the cone."""
    at, high = PERIOD_MM / 2, 1.2 * slope
    scene = over_a_plate(Revolved(at, at, ((0, 0.1), (1.2, 0.1 + high), (0, 0.1 + high)), (0, 0, 0)), 2.0)
    approach = np.array([2e-5, 4e-5]) * pi / 2 * slope
    down, _ = solved(scene, Fineness(4e-3, 0.05, 0.3, 0.25), 2 / pi * STIFFNESS_PA * approach**2 / slope)
    assert down == pytest.approx(approach, rel=0.015)


@pytest.mark.parametrize(("shape", "within"), [(5.0, 0.03), (2.0, 0.03)])
def test_a_bonded_disc_has_the_modulus_of_gent_and_lindley(shape, within):
    """E (1 + 2 S²), S = radius / 2 height, of an incompressible disc between hard plates."""
    radius, high, period = 1.0, 0.5 / shape, 2.2
    disc = Revolved(period / 2, period / 2, ((0, 0.1), (radius, 0.1), (radius, 0.1 + high), (0, 0.1 + high)), (0,) * 4)
    plates = [(box(0, period, 0, period, low, low + 0.1),) for low in (0.0, 0.1 + high)]
    bodies = (
        Body("low", "hard", plates[0], "bottom"),
        Body("disc", "soft", (disc,)),
        Body("up", "hard", plates[1], "top"),
    )
    area = pi * (radius * 1e-3) ** 2
    down, _ = solved(
        Scene(bodies, (period, period, 0.2 + high)), Fineness(0.01, 0.02, 0.1, 0.3), [1.0], 0.5, period, "rigid"
    )
    assert 1.0 * high * 1e-3 / (area * down[0]) == pytest.approx(E_PA * (1 + 2 * shape**2), rel=within)


def slope_m_per_pa(scene, solids, fine_mm):
    """Displacement over small pressure, by linear elasticity on tetrahedra that are small along a tip's edge."""
    import netgen.occ as occ
    import ngsolve as ng
    from netgen.meshing import MeshingParameters

    from sensorgen.solvers.electrostatics.round_bodies import solid

    cell, _ = curved.cell(scene)
    shapes = []
    for piece, _ in cell.pieces:
        one = solid(piece) * occ.Box(cell.low_mm, cell.high_mm)
        one.mat(next(b.material for b in scene.bodies if piece in b.pieces))
        shapes.append(one)
    whole = occ.Glue(shapes)
    for face in whole.faces:
        for k, axis in enumerate("xyz"):
            for end, at in (("low", cell.low_mm[k]), ("high", cell.high_mm[k])):
                low, high = (tuple(corner)[k] for corner in face.bounding_box)
                if max(abs(low - at), abs(high - at)) < 1e-6:
                    face.name = axis + end
    sizes = MeshingParameters(maxh=0.3, grading=0.4)
    for edge in whole.edges:
        low, high = edge.parameter_interval
        if all(abs(edge.Value(t).z - 0.5) < 1e-6 for t in (low, high)):
            for t in np.linspace(low, high, 60):
                sizes.RestrictH(*edge.Value(t), fine_mm)
    mesh = ng.Mesh(occ.OCCGeometry(whole).GenerateMesh(sizes))
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


@pytest.mark.parametrize("shape", ["pyramid", "cone"])
def test_blunt_tips_deform_as_finite_elements_in_3d_within_the_stated_error(shape):
    coarse, fine = BLUNT["displacement_m_per_pa"][shape]
    found = press_round.press(make({"shape": shape, "parameters": {"tip_mm": 0.5}}).in_use, SOLIDS, [0.0, 2e3])
    assert found.displacement_m[1] / 2e3 == pytest.approx(2 * fine - coarse, rel=0.03)
    assert not found.faults


@pytest.mark.nightly
@pytest.mark.skipif(importlib.util.find_spec("ngsolve") is None, reason="NGSolve is not installed")
@pytest.mark.parametrize("shape", ["pyramid", "cone"])
def test_the_stored_finite_elements_in_3d_are_found_again(shape):
    scene = make({"shape": shape, "parameters": {"tip_mm": 0.5}}).in_use
    again = [slope_m_per_pa(scene, SOLIDS, size) for size in BLUNT["fine_mm"]]
    assert again == pytest.approx(BLUNT["displacement_m_per_pa"][shape], rel=2e-3, abs=0)
    scene = make({"shape": shape}).in_use
    coarse, fine = (slope_m_per_pa(scene, SOLIDS, size) for size in BLUNT["fine_mm"])
    pressed = press_round.press(scene, SOLIDS, [0.0, 1e3, 2e3])
    assert pressed.displacement_m[2] / 2e3 == pytest.approx(2 * fine - coarse, rel=press_round.AREA_ERROR)


@pytest.mark.parametrize(("shape", "within"), [
    pytest.param("bump", 0.005, marks=pytest.mark.nightly), ("cone", 0.005),
    pytest.param("pyramid", 0.03, marks=pytest.mark.nightly),
])  # fmt: skip
def test_bounds_at_rest_meet_and_are_near_those_in_3d(shape, within):
    scene = make({"shape": shape, "parameters": {"length_mm": 1.25, "width_mm": 1.25}}).in_use
    (at_rest, pressed_one) = press_round.press(scene, SOLIDS, [0.0, 1e4], EPS).capacitance_f_per_m2
    assert at_rest.width() < 3e-4
    assert at_rest.middle() < pressed_one.middle()
    in_3d = curved.capacitance(scene, EPS, 1e-2).middle() / (1.25e-3) ** 2
    assert at_rest.middle() == pytest.approx(in_3d, rel=within)


def test_a_block_holds_the_electrode_as_in_3d():
    """Posts far apart under a block: between an even pressure, 4.8, and a stiff plate, 2.1 nF/m2 (press3d: 2.36)."""
    sizes = {"cog": "dielectric", "period_mm": 3.0, "side_mm": 1.0, "length_mm": 30.0, "width_mm": 12.0}
    cell = make({"shape": "pillar", "parameters": sizes | {"electrode_mm": 0.4}})
    case = case_of(cell, drawn(cell), "press_round", Tip())
    rest, loaded = (c.middle() for c in pressed(case, [0.0, 5e4], COARSEST).capacitance_f_per_m2)
    assert loaded - rest == pytest.approx(2.364e-9, rel=0.05)


def test_what_has_no_common_axis_is_refused():
    at = Revolved(0.5, 0.6, ((0, 0.1), (0.3, 0.4), (0, 0.4)), (0, 0, 0))
    assert "axis" in press_round.why_not_applicable(over_a_plate(at, 0.2, 1.25))
    long = Loft(rectangle(0.1, 1.15, 0.5, 0.7), rectangle(0.1, 1.15, 0.5, 0.7), 0.1, 0.4)
    assert "square" in press_round.why_not_applicable(over_a_plate(long, 0.2, 1.25))
    turn = np.linspace(0, 2 * pi, 33)[:-1]
    outline = tuple(map(tuple, np.round(np.column_stack([10 + 10 * np.cos(turn), 10 + 10 * np.sin(turn)]), 6).tolist()))
    levels = {"bottom": (0.0, 0.4), "": (0.4, 0.9), "top": (0.9, 1.3)}
    disc = Scene(tuple(Body(n, "soft", (Prism("z", outline, *z),), n) for n, z in levels.items()), (20.0, 20.0, 1.3))
    assert "ends before the cell" in press_round.why_not_applicable(disc)
    assert springs.displacement_m(disc, {"soft": 1e6}, [1e4]) == pytest.approx([1.3e-5])
    with pytest.raises(BadInput, match="axisymmetric"):
        press_round.press(over_a_plate(long, 0.2, 1.25), SOLIDS, [0.0, 1e4])
