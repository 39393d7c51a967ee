"""Complex capacitances in their discs: layers in closed form, slopes of the lossless, finer meshes, both solvers."""

import numpy as np
import pytest
from cell_scenes import EPS, MM, close, cut_slabs, plates, rect_cell, stairs, tri_cell

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import fem2d, fem3d
from sensorgen.scene.scene import Body, box
from sensorgen.solvers.electrostatics.bounds import Fields, disc, turned

BOTH = pytest.mark.parametrize("model", [fem2d, fem3d])
LOSSY = {"x60": 4.68 * (1 - 0.3j), "air": 1.00059}


@BOTH
@pytest.mark.parametrize(("first", "second"), [(1e4, 1 - 1e-9j), (3.0 - 0.5j, 2.0 - 1.5j), (1 - 50j, 9.0)])
def test_layers_in_series_and_side_by_side(model, first, second):
    """1/C = sum of t/eps, or C = sum of w eps: also where charge gathers between a leak and none (Maxwell, Wagner)."""
    eps = {"a": first, "b": second, "air": 1.0}
    series = plates(Body("a", "a", (box(0, 2, 0, 1, 0.2, 0.6),)), Body("b", "b", (box(0, 2, 0, 1, 0.6, 1.2),)))
    beside = plates(Body("a", "a", (box(0, 0.7, 0, 1, 0.2, 1.2),)), Body("b", "b", (box(0.7, 2, 0, 1, 0.2, 1.2),)))
    for scene, exact in ((series, 2 / (0.4 / first + 0.6 / second)), (beside, 0.7 * first + 1.3 * second)):
        found = model.lossy(scene, eps, 1e-7)
        assert found.holds(exact * EPS0_F_PER_M * MM)
        assert found.width() < 1e-7


@BOTH
@pytest.mark.parametrize("made", [stairs(), cut_slabs()[0]], ids=["whole cells", "a cut cell"])
def test_without_losses_it_overlaps_the_interval(model, made):
    found, bounds = model.lossy(made, EPS, 1e-3), model.capacitance(made, EPS, 1e-3)
    assert found.centre.imag == 0
    assert found.centre.real - found.radius <= bounds.upper
    assert bounds.lower <= found.centre.real + found.radius


@pytest.mark.parametrize(("model", "made", "width"), [(fem2d, tri_cell(0.1), 1e-4), (fem3d, rect_cell(0.1), 1e-2)])
def test_whole_cells_without_losses(model, made, width):
    """The middle of the bounds, and half their distance (Prager and Synge)."""
    found, bounds = model.lossy(made, EPS, width), model.capacitance(made, EPS, width)
    ends = found.centre.real - found.radius, found.centre.real + found.radius
    assert ends == close((bounds.lower, bounds.upper), 1e-8)


def test_a_small_loss_is_the_slope_of_the_lossless():
    """Im C = -tan delta eps dC/deps to first order, by differences of certified values."""
    delta, step = 1e-3, 1e-2
    found = fem2d.lossy(tri_cell(0.1), {"x60": 4.68 * (1 - 1j * delta), "air": 1.00059}, 1e-6)
    up, down = (
        fem2d.capacitance(tri_cell(0.1), {"x60": 4.68 * (1 + s), "air": 1.00059}, 1e-6).middle() for s in (step, -step)
    )
    assert found.centre.imag == close(-delta * (up - down) / (2 * step), 1e-4)


@pytest.mark.parametrize("tangent", [0.01, 1.0, 1e3])
def test_finer_meshes_lie_in_the_coarse_disc(tangent):
    scene, eps = tri_cell(0.1), {"x60": 4.68 * (1 - 1j * tangent), "air": 1.00059}
    coarse, fine = fem2d.lossy(scene, eps, 1e-2), fem2d.lossy(scene, eps, 1e-6)
    assert fine.width() < 1e-5
    assert fine.radius < coarse.radius / 100
    assert coarse.holds(fine.centre)


def test_both_solvers_agree_on_stairs():
    """Triangles and polynomials of NGSolve beside bricks and elimination of our own."""
    plane, bricks = fem2d.lossy(stairs(), LOSSY, 1e-6), fem3d.lossy(stairs(), LOSSY, 1e-3)
    assert bricks.width() < 1e-3
    assert bricks.holds(plane.centre)


def test_a_second_program():
    """Strips half as high as the gap, as wide as their distance: scikit-fem, even mesh, from mirror to mirror."""
    skfem = pytest.importorskip("skfem")
    mesh = skfem.MeshTri.init_tensor(np.linspace(0.25, 0.75, 41), np.linspace(0, 1, 81))
    basis = skfem.Basis(mesh, skfem.ElementTriP2())

    @skfem.BilinearForm(dtype=complex)
    def energy(u, v, w):
        inside = (w.x[0] < 0.5) & (w.x[1] < 0.5)
        return np.where(inside, 3 - 2j, 1.0) * (u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])

    matrix = energy.assemble(basis)
    low, top = (basis.get_dofs(lambda x, at=at: np.isclose(x[1], at)).flatten() for at in (0, 1))
    potential = np.zeros(basis.N, dtype=complex)
    potential[top] = 1.0
    free = np.setdiff1d(np.arange(basis.N), np.concatenate([low, top]))
    potential = skfem.solve(*skfem.condense(matrix, x=potential, I=free))
    theirs = 2 * potential @ (matrix @ potential) * EPS0_F_PER_M * MM
    strips = plates(Body("a", "a", (box(0, 0.5, 0, 1, 0.2, 0.7),)), length_mm=1.0)
    ours = fem2d.lossy(strips, {"a": 3 - 2j, "air": 1.0}, 1e-7)
    assert ours.centre == close(theirs, 3e-5)
    assert ours.centre.imag == close(theirs.imag, 2e-4)


def test_an_even_angle_is_the_smallest_tangent():
    found = turned([2.0, 1 - 1j, 3 - 0.5j])
    assert found.tangent == close(np.tan(np.pi / 8), 1e-12)
    assert found.kappa() == close(1 / np.cos(np.pi / 8), 1e-12)
    assert found.weight[2.0] == close(2 * np.cos(np.pi / 8), 1e-12)


def test_the_middle_is_nearer_the_less_permittivities_turn():
    """Half of eta squared times the root of (1 + t) / (1 - t), with a t of 1/2."""
    turn = turned([1.0, np.exp(-2j * np.arctan(0.5))])
    found = disc(Fields(1 - 1j, 1.1 - 1j, 0j, 0.0, 0.1, 7), turn, [2.0])
    assert found.centre == close(2.1 - 2j, 1e-12)
    assert found.radius == close(0.1 * 3**0.5, 1e-6)


def test_a_tangent_of_one_and_more_leaves_the_wide_disc():
    found = disc(Fields(1 - 1j, 1.1 - 1j, 0j, 0.0, 0.1, 7), turned([1.0, np.exp(-0.51j * np.pi)]), [2.0])
    assert found.centre == 2.2 - 2j
    assert found.radius == close(0.2 * np.hypot(1, np.tan(0.255 * np.pi)), 1e-6)


@BOTH
@pytest.mark.parametrize("bad", [complex(1, -np.inf), 0 - 1j])
def test_permittivities_that_mean_nothing_are_refused(model, bad):
    with pytest.raises(OutOfRange, match="relative permittivity of x60"):
        model.lossy(stairs(), {"x60": bad, "air": 1.0}, 1e-3)


def test_a_cut_cell_holds_the_truth():
    """2.25 periods of slabs from plate to plate: C = sum of w eps / h for any permittivity."""
    scene, _ = cut_slabs()
    exact = (0.2 + 2 * 0.4) * LOSSY["x60"] + (2.25 - 1.0) * LOSSY["air"]
    found = fem2d.lossy(scene, LOSSY, 1e-4)
    assert found.holds(exact * EPS0_F_PER_M * MM)
    assert found.width() < 1e-4
