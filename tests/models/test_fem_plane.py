"""The plane's solver: against NGSolve on the same triangles, and bricks; islands, pieces that touch."""

import subprocess
import sys

import pytest
from cell_scenes import EPS, bars, bumps, close, few_rings, plates, prism, slab, stairs, tri_cell

from sensorgen.models import fem2d, fem3d
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.electrostatics import bounds

SLAB = slab()
ISLANDS = {
    "of both": plates(SLAB, bars("i", "bottom", (0.3, 0.8, 0.8, 1.0)), bars("j", "top", (1.2, 1.7, 0.5, 0.7))),
    "in a row": plates(
        SLAB, bars("i", "bottom", (0.3, 0.8, 0.8, 1.0)), bars("j", "top", (0.4, 0.9, 0.5, 0.7), (1.3, 1.5, 0.6, 0.7))
    ),
    "that touch at a corner": plates(SLAB, bars("i", "top", (0.4, 0.8, 0.5, 0.7), (0.8, 1.2, 0.7, 0.9))),
    "that touch at two": plates(
        SLAB, bars("i", "top", (0.4, 0.8, 0.5, 0.7), (0.8, 1.2, 0.7, 0.9), (1.2, 1.6, 0.5, 0.7))
    ),
    "amid corners of a solid": plates(
        SLAB,
        bars("i", "top", (0.6, 1.3, 0.6, 0.7)),
        Body(
            "solid",
            "x60",
            (box(0.7, 0.9, 0, 1, 0.8, 1.0), box(1.0, 1.1, 0, 1, 0.9, 1.1), box(0.8, 1.0, 0, 1, 0.5, 0.55)),
        ),
    ),
    "between mirrors": plates(SLAB, bars("i", "top", (0.6, 1.1, 0.5, 0.8))),
}


CLOSED = Scene(
    (
        Body(
            "lid",
            "etpu",
            (
                prism((0, 0), (0.5, 0), (0.7, 2), (0, 2)),
                prism((0.5, 0), (1.5, 0), (1.5, 0.5), (0.55, 0.5)),
                prism((0.65, 1.5), (1.5, 1.5), (1.5, 2), (0.7, 2)),
                prism((1.5, 0), (2, 0), (2, 2), (1.5, 2)),
            ),
            "top",
        ),
        bars("core", "bottom", (0.8, 1.2, 0.8, 1.2)),
    ),
    (2.0, 1.0, 2.0),
)  # all around no mirror, and no corner to the left whose field is smooth


@pytest.mark.parametrize(
    ("scene", "order", "doublings"),
    [
        (tri_cell(0.1), 5, 2),
        (tri_cell(1e-3), 4, 1),
        (stairs(), 4, 0),
        (bumps(6), 3, 1),
        (ISLANDS["in a row"], 3, 1),
        (ISLANDS["that touch at two"], 4, 1),
        (ISLANDS["amid corners of a solid"], 3, 1),
        (CLOSED, 4, 1),
    ],
    ids=["triangle", "thin film", "stairs", "bumps", "islands", "touching islands", "corners", "closed"],
)
def test_ngsolve_has_the_same_bounds_on_the_same_triangles(scene, order, doublings):
    """A hybrid H(div) flux there, a stream function here; every ring written out there, doubled here."""
    pytest.importorskip("ngsolve", reason="the independent program: pip install 'sensorgen[fem]'")
    import ngsolve_cells

    mesh = few_rings(scene, doublings)
    cells = mesh.triangles.regions[0][1]
    ours = bounds.whole(fem2d._solved(mesh, EPS, order), [1.0])
    assert {share for _, share in mesh.triangles.regions} == {cells}
    assert (ours.lower, ours.upper) == close(ngsolve_cells.bounds(mesh, EPS, order), 3e-9)


@pytest.mark.parametrize("name", ISLANDS)
def test_islands_of_electrode_as_bricks_have_them(name):
    """The flux around an island is its charge: a stream function needs a jump for each. Bricks know no such thing."""
    flat, bricks = fem2d.capacitance(ISLANDS[name], EPS, 1e-4), fem3d.capacitance(ISLANDS[name], EPS, 5e-3)
    assert flat.width() <= 1e-4
    assert bricks.lower < flat.lower < flat.upper < bricks.upper


@pytest.mark.parametrize("ratio", [1e2, 1e6])
def test_high_ratios_of_permittivity_at_a_sharp_wedge(ratio):
    """1e-4 at all of them; coarser bounds hold the finer, and C is homogeneous in the permittivities."""
    eps = {"x60": ratio, "air": 1.0}
    coarse, fine = (fem2d.capacitance(tri_cell(0.1), eps, w) for w in (1e-2, 1e-4))
    assert fine.width() <= 1e-4
    assert coarse.lower <= fine.lower
    assert fine.upper <= coarse.upper
    scaled = fem2d.capacitance(tri_cell(0.1), {"x60": 1.0, "air": 1 / ratio}, 1e-4)
    assert scaled.middle() * ratio == close(fine.middle(), 1e-8)


def test_it_needs_numpy_only_and_bricks_neither_ngsolve_nor_the_cad_kernel():
    code = (
        "import sys\nfrom sensorgen.models import fem2d\nfrom sensorgen.design.shapes import tri\n"
        "from sensorgen.scene.scene import Fill\n"
        "fem2d.capacitance(tri.scene(tri.Params(length_mm=2.0), Fill()), {'x60': 4.68, 'air': 1.0}, 1e-6)\n"
        "assert not {'ngsolve', 'netgen', 'scipy', 'build123d'} & set(sys.modules), sorted(sys.modules)\n"
        "from sensorgen.models import fem3d, columns\n"
        "assert not {'ngsolve', 'netgen', 'build123d', 'OCP'} & set(sys.modules), sorted(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
