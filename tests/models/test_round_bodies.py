"""Curved and slanted bodies against spheres in closed form, other solvers, and a cone in its plane."""

import importlib.util
from math import exp, pi, sinh, sqrt, tan

import numpy as np
import pytest

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.design import make
from sensorgen.models import fem2d
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.capacitance import capacitance, of_sensor
from sensorgen.scene.patterns import ArrayParams
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Prism, Scene, box
from sensorgen.solvers.electrostatics.bounds import whole

if importlib.util.find_spec("ngsolve") is None:
    pytest.skip("NGSolve is not installed", allow_module_level=True)

from sensorgen.solvers.electrostatics.round_bodies import RoundCell, bounds

QUARTER = tan(pi / 8)  # bulge of a quarter of a circle
EPS_MM = EPS0_F_PER_M * M_PER_MM


def cavity(radius, wide=2.0):
    """All around a ball."""
    outline = ((0, -wide), (3 * wide, -wide), (3 * wide, wide), (0, wide), (0, radius), (radius, 0), (0, -radius))
    return Revolved(0, 0, outline, (0, 0, 0, 0, -QUARTER, -QUARTER, 0))


def globe(radius, z=0.0):
    return Revolved(0, 0, ((0, z - radius), (radius, z), (0, z + radius)), (QUARTER, QUARTER, 0))


def shell(inner, outer):
    outline = ((0, -outer), (outer, 0), (0, outer), (0, inner), (inner, 0), (0, -inner))
    return Revolved(0, 0, outline, (QUARTER, QUARTER, 0, -QUARTER, -QUARTER, 0))


def spheres(*pieces, permittivity=(1.0,)):
    """A quarter of bodies in a ball of 1 mm."""
    return RoundCell((0, 0, -1.2), (1.2, 1.2, 1.2), ((cavity(1.0), 0), *pieces), 2, permittivity)


def narrowest(cell, width):
    """The bounds of a quarter cell or of one part, moved outwards by rounding."""
    *_, (_, _, found) = bounds(cell, width)
    interval = whole(found, [1.0])
    assert interval.width() <= width
    return interval


def held(found, exact):
    return found.lower <= exact <= found.upper


def test_concentric_spheres_with_a_round_interface():
    """eps 3 to 0.7 mm around a ball of 0.5 mm: 4 pi / (sum of (1/a - 1/b) / eps), a quarter of it."""
    exact = pi / ((1 / 0.5 - 1 / 0.7) / 3 + (1 / 0.7 - 1))
    cell = spheres((globe(0.5), 1), (shell(0.5, 0.7), 2), permittivity=(3.0, 1.0))
    for width in (5e-3, 1e-4):
        assert held(narrowest(cell, width), exact)


def test_eccentric_spheres():
    """Bispherical coordinates: a ball of 0.4 mm, 0.45 mm off the middle of one of 1 mm, 0.15 mm from it."""
    a, b, off = 0.4, 1.0, 0.45
    focal = sqrt((b**2 - a**2 - off**2) ** 2 - (2 * a * off) ** 2) / (2 * off)
    inner, outer = (np.arcsinh(focal / radius) for radius in (a, b))
    exact = pi * focal * sum(exp(-(n + 0.5) * (inner + outer)) / sinh((n + 0.5) * (inner - outer)) for n in range(60))
    assert held(narrowest(spheres((globe(a, -off), 1)), 1e-4), exact)


def pressed(pattern, film=0.1, gap=0.05, high=0.5, metal=True):
    """A quarter of a cell of 2 mm by 2 mm: a film, and a pattern that hangs from the top."""
    roof = film + gap + high
    plates = (
        (box(-2, 2, -2, 2, -0.1, 0), 0),
        (box(-2, 2, -2, 2, roof, roof + 0.1), 1),
        (box(-2, 2, -2, 2, 0, film), 2),
    )
    return RoundCell((0, 0, -0.1), (1, 1, roof + 0.1), (*plates, (pattern, 1 if metal else 3)), 2, (3.0, 2.5, 1.0))


def scene_of(cell):
    """The whole cell of which that is a quarter, as a scene."""
    names = [("low", "etpu", "bottom"), ("top", "etpu", "top"), ("film", "film", ""), ("pattern", "stuff", "")]
    bodies = []
    for k, (name, material, terminal) in enumerate(names):
        pieces = tuple(whole_piece(piece) for piece, kind in cell.pieces if kind == k)
        bodies.append(Body(name, material, pieces, terminal))
    return Scene(tuple(bodies), (2.0, 2.0, cell.high_mm[2] + 0.1))


def whole_piece(piece):
    """A piece in a cell of 2 mm that begins at 0."""
    if isinstance(piece, Prism) and not piece.is_box():
        return Prism(piece.axis, tuple((y + 1, z + 0.1) for y, z in piece.outline), 0.0, 2.0)
    (x0, x1), (y0, y1), (z0, z1) = ([min(max(v, -1), 1) + 1 for v in piece.span(a)] for a in "xyz")
    return box(x0, x1, y0, y1, z0 - 0.9, z1 - 0.9)


EPS = {"film": 3.0, "stuff": 2.5, "air": 1.0}


@pytest.mark.parametrize("metal", [True, False])
def test_a_slanted_strip_is_that_of_the_plane_solver(metal):
    strip = Prism("x", ((-0.1, 0.15), (0.1, 0.15), (0.5, 0.65), (-0.5, 0.65)), -1.0, 2.0)
    cell = pressed(strip, metal=metal)
    plane = fem2d.capacitance(scene_of(cell), EPS, 1e-7)
    assert held(narrowest(cell, 2e-3), plane.middle() / EPS_MM / 4)


def axial(profile, order):
    """From above, over eps0 [mm]: a cone of 1 V in a closed tin of 0.8 by 0.9 mm, in the plane of radius and height."""
    import netgen.occ as occ
    import ngsolve as ng

    tin = occ.MoveTo(0, 0).Rectangle(0.8, 0.9).Face()
    points = [occ.Vertex(occ.Pnt(r, z, 0)) for r, z in profile]
    cone = occ.Face(occ.MakePolygon([*points, points[0]]))
    for edge in tin.edges:
        edge.name = "axis" if edge.center.x < 1e-9 else "low"
    for edge in cone.edges:
        edge.name = "axis" if edge.center.x < 1e-9 else "high"
    rest = tin - cone
    for vertex in rest.vertices:
        if (vertex.p.x, vertex.p.y) in profile:
            vertex.maxh = 1e-4
    mesh = ng.Mesh(occ.OCCGeometry(rest, dim=2).GenerateMesh(maxh=0.05, grading=0.4))
    space = ng.H1(mesh, order=order, dirichlet="low|high")
    u, v = space.TnT()
    form = ng.BilinearForm(ng.x * ng.grad(u) * ng.grad(v) * ng.dx(bonus_intorder=2), symmetric=True).Assemble()
    field = ng.GridFunction(space)
    field.Set(1, definedon=mesh.Boundaries("high"))
    field.vec.data -= form.mat.Inverse(space.FreeDofs(), "sparsecholesky") @ form.mat * field.vec
    return 2 * pi * ng.Integrate(ng.x * ng.grad(field) * ng.grad(field), mesh, order=2 * order + 2)


@pytest.mark.parametrize("tip", [0.0, pytest.param(0.1, marks=pytest.mark.nightly)])
def test_a_cone_in_a_tin_is_that_of_its_plane(tip):
    """Finite elements in radius and height, two orders that agree to 1e-5, share neither mesh nor bounds with these."""
    tin = Revolved(0, 0, ((0, -0.3), (4, -0.3), (4, 1.3), (0, 1.3), (0, 0.9), (0.8, 0.9), (0.8, 0), (0, 0)))
    profile = ((0, 0.2), (tip, 0.2), (0.5, 0.7), (0, 0.7)) if tip else ((0, 0.2), (0.5, 0.7), (0, 0.7))
    cell = RoundCell((0, 0, -0.2), (1, 1, 1.1), ((tin, 0), (Revolved(0, 0, profile), 1)), 2, (1.0,))
    coarse, exact = (axial(profile, order) / 4 for order in (3, 4))
    assert exact == pytest.approx(coarse, rel=1e-5)
    found = narrowest(cell, 1e-3)
    assert held(found, exact)


@pytest.mark.parametrize(
    ("shape", "length_mm", "width_mm"),
    [
        pytest.param("cone", 12.0, 6.0, marks=pytest.mark.nightly),
        pytest.param("pyramid", 4.1, 4.5, marks=pytest.mark.nightly),
        pytest.param("bump", 5.0, 1.7, marks=pytest.mark.nightly),
        ("cone", 3.0, 2.0),
        ("cone", 5.0, 2.5),
    ],
)
def test_a_sensor_of_cells_and_rims_has_the_capacitance_of_its_whole_drawing(shape, length_mm, width_mm):
    """The rims counted as cells: +19 % of the cones on 12 x 6 mm, of which 36 fit, and not 46."""
    design = make({"shape": shape, "parameters": {"length_mm": length_mm, "width_mm": width_mm}})
    eps = {"air": 1.0, "x60": 4.68}
    cells = drawn(design).cells
    parts = of_sensor(cells, eps, 1e-2, keep=False).capacitance_f
    all_of_it = capacitance(design.in_use, eps, 1e-2, keep=False).capacitance_f
    assert parts.lower <= all_of_it.upper
    assert all_of_it.lower <= parts.upper
    assert parts.width() < 5e-3
    has_rims = design.params.fitting() != (length_mm / 1.25, width_mm / 1.25)
    assert (bool(cells.beside), bool(cells.remarks["drawn"])) == (has_rims, has_rims)
    areas = [
        count * scene.size_mm[0] * scene.size_mm[1] for scene, count in (*cells.beside, (cells.first(), cells.count))
    ]
    assert sum(areas) == pytest.approx(length_mm * width_mm)


@pytest.mark.parametrize(("cells", "rim_mm"), [(1, 0.4), (2, 0.4), (5, 0.4), (5, 0.0)])
def test_the_two_ends_of_a_row_keep_their_rims(cells, rim_mm):
    """Cells with a rim beside them are those at either end, by counting; all others lie between two of their kind."""
    row = ArrayParams(period_mm=1.0, length_mm=cells + 2 * rim_mm, width_mm=1.0)
    at_end = {0, cells - 1} if rim_mm else set()
    parts = {round(length, 9): count for length, _, count in row.parts() if count}
    ends = {round(len(at_end) + 2 * rim_mm, 9): 1.0} if at_end else {}
    inner = {1.0: float(cells - len(at_end))} if cells > len(at_end) else {}
    assert parts == inner | ends
