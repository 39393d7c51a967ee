"""Bounds of the capacitance against finite elements, closed forms and quadrature.

Unless noted: default sizes, X60 4.68, air 1.00059; see models-cells.md.
"""

from itertools import product

import numpy as np
import pytest
from cell_scenes import CELLS, EPS, MM, close, rect_cell, stairs, tri_cell
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.shapes import rect, tri
from sensorgen.models import fem2d
from sensorgen.models.columns import capacitance, why_not_applicable
from sensorgen.scene.repetition import cell
from sensorgen.scene.scene import Body, Fill, Prism, Scene, box
from sensorgen.scene.sections import sections
from sensorgen.solvers.electrostatics.triangles import energy as straight
from sensorgen.solvers.electrostatics.triangles import triangles


def tri_bounds(film_mm: float, eps=EPS, **options) -> tuple[float, float]:
    """Per metre of depth [F/m]."""
    found = capacitance(tri_cell(film_mm, **options), eps)
    return found.lower / MM, found.upper / MM


@pytest.mark.parametrize("case", CELLS["tri"], ids=lambda c: f"d={c['d']}")
def test_tri_lies_between_its_bounds(case):
    lower, upper = tri_bounds(case["d"])
    off = case["rel_error_halfwidth"]
    assert lower < case["C_F_per_m"] * (1 - off)
    assert case["C_F_per_m"] * (1 + off) < upper


@pytest.mark.parametrize("case", CELLS["rect"], ids=lambda c: f"d={c['d']}")
def test_rect_lies_between_its_bounds(case):
    found = capacitance(rect_cell(case["d"]), EPS)
    off = case["rel_error_halfwidth"]
    assert found.lower < case["C_F"] * (1 - off)
    assert case["C_F"] * (1 + off) < found.upper


@pytest.mark.parametrize(("length", "width", "along"), [(100.0, 10.0, "xy"), (6.0, 2.0, "yx")])
def test_many_cells_are_that_many_times_one(length, width, along):
    """100 x 10 mm once came out at -22.5 % instead of -14.3: sections that repeat were cut at the wrong prisms."""
    scene = rect.scene(rect.Params(length_mm=length, width_mm=width, dielectric_mm=0.1, along=along), Fill())
    found, one = capacitance(scene, EPS), capacitance(rect_cell(0.1), EPS)
    cells = length * width / 4
    assert found.lower == close(cells * one.lower, 1e-12)
    assert found.upper == close(cells * one.upper, 1e-12)
    exact = cells * CELLS["rect"][0]["C_F"]  # the thesis's sum of columns, and the film alone: docs/cells.md
    assert 100 * (found.lower / exact - 1) == pytest.approx(-14.3, abs=0.05)
    assert 100 * (found.upper / exact - 1) == pytest.approx(104, abs=0.5)


@pytest.mark.parametrize("along", ["x", "y"])
def test_the_bounds_of_tri_are_those_of_its_periods(along):
    size = {"length_mm": 14.0, "width_mm": 3.0} if along == "x" else {"length_mm": 3.0, "width_mm": 14.0}
    found = capacitance(tri.scene(tri.Params(**size, dielectric_mm=0.1, along=along), Fill()), EPS)
    one = tri_bounds(0.1)
    assert (found.lower, found.upper) == close(tuple(7 * 3 * MM * bound for bound in one), 1e-12)


def test_plates_in_series_are_exact():
    """Layers of 0.1, 0.2, 0.4 mm with permittivities 2, 3, 5: s = 0.05 + 0.0667 + 0.08 mm."""
    names, heights, eps = ("a", "b", "c"), (0.3, 0.4, 0.6, 1.0), {"a": 2.0, "b": 3.0, "c": 5.0, "air": 1.0}
    layers = [Body(n, n, (box(0, 4, 0, 2, *heights[k : k + 2]),)) for k, n in enumerate(names)]
    found = capacitance(plates(*layers, gap_mm=0.7), eps)
    exact = EPS0_F_PER_M * 4 * 2 / (0.1 / 2 + 0.2 / 3 + 0.4 / 5) * MM
    assert (found.lower, found.upper) == close((exact, exact), 1e-12)


def plates(*bodies: Body, gap_mm: float = 0.7, size: tuple[float, float] = (4.0, 2.0)) -> Scene:
    low = Body("low", "etpu", (box(0, size[0], 0, size[1], 0, 0.3),), "bottom")
    high = Body("high", "etpu", (box(0, size[0], 0, size[1], 0.3 + gap_mm, 0.6 + gap_mm),), "top")
    return Scene((low, *bodies, high), (*size, 0.6 + gap_mm))


def test_columns_side_by_side_each_count_as_wide_and_of_what_they_are():
    """Posts from plate to plate, some alike: C = eps0 sum of w eps / h, whatever stands beside what."""
    posts = [("x60", 0.0, 0.5), ("pva", 0.5, 1.0), ("x60", 1.0, 1.75), ("x60", 2.25, 2.75), ("pva", 3.0, 3.5)]
    bodies = [Body(name, name, (box(a, b, 0, 2, 0.3, 1.0),)) for name, a, b in posts]
    found = capacitance(plates(*bodies), EPS | {"pva": 3.0})
    exact = EPS0_F_PER_M * 2 * (1.75 * 4.68 + 1.0 * 3.0 + 1.25 * EPS["air"]) / 0.7 * MM
    assert (found.lower, found.upper) == close((exact, exact), 1e-12)


def test_one_jump_anywhere_forbids_the_columns_own_potential():
    """A ridge whose columns' potentials meet, then a post whose own do not meet the air's: finite elements tell."""
    ridge = Prism("y", ((0.0, 0.3), (1.5, 0.3), (0.75, 0.4)), 0.0, 2.0)
    scene = plates(Body("x", "x60", (ridge, box(2.0, 3.0, 0, 2, 0.3, 0.9))))
    assert capacitance(scene, EPS | {"x60": 50.0}).upper > fem2d.capacitance(scene, EPS | {"x60": 50.0}, 1e-4).lower


def test_stairs_in_a_row_hold_as_much_as_one_each():
    """Where columns' own potentials jump, that of straight triangles repeats as the stairs do, up to a cut end."""
    found, one, cut = (capacitance(stair_row(end_mm), EPS) for end_mm in (14.0, 2.0, 5.3))
    assert (found.lower, found.upper) == close((7 * one.lower, 7 * one.upper), 1e-11)
    assert cut.upper == close(2.65 * one.upper, 0.05)


def stair_row(end_mm: float) -> Scene:
    """Two steps of dielectric that hang from the upper plate, in periods of 2 mm."""
    starts = np.arange(0.0, end_mm - 0.5, 2.0)
    wide = [box(x + 0.2, min(x + 1.8, end_mm), 0, 1, 0.7, 1.0) for x in starts]
    narrow = [box(x + 0.5, min(x + 1.5, end_mm), 0, 1, 0.4, 0.7) for x in starts]
    return plates(Body("stairs", "x60", (*wide, *narrow)), size=(end_mm, 1.0))


RIDGE = Body("ridge", "x60", (Prism("y", ((0, 0.3), (4, 0.3), (1, 0.9)), 0.0, 2.0),))


def test_a_ridge_of_the_same_permittivity_as_the_air_leaves_a_plate():
    found = capacitance(plates(RIDGE), {"x60": 4.68, "air": 4.68})
    exact = EPS0_F_PER_M * 4.68 * 4 * 2 / 0.7 * MM
    assert (found.lower, found.upper) == close((exact, exact), 1e-12)


def reduced_mm(u: float, film: float, hang: float, lower: float, cog: bool, eps=EPS, quarter: float = 0.5) -> float:
    """Thickness over permittivity at a distance u from a hanging apex, written from geometry.md, not from the scene."""
    gap = (hang - lower) * u / quarter
    hanging = 0.0 if cog else hang * (1 - u / quarter)
    return film / eps["x60"] + lower * u / quarter / eps["x60"] + gap / eps["air"] + hanging / eps["x60"]


@pytest.mark.parametrize(("film", "hang", "lower"), [(0.1, 0.5, 0.24), (1e-4, 1.3, 0.01), (1.0, 0.5, 0.499)])
def test_the_lower_bound_is_the_integral_of_its_columns(film, hang, lower):
    """Thesis 3.24: C' = eps0 int dx / s, by adaptive quadrature over the four flanks of a period."""
    sides = [
        quad(lambda u, c=cog: 1 / reduced_mm(u, film, hang, lower, c), 0, 0.5, epsabs=0, epsrel=1e-13, limit=200)[0]
        for cog in (True, False)
    ]
    expected = 2 * EPS0_F_PER_M * sum(sides)
    got, _ = tri_bounds(film, hang_height_mm=hang, lower_height_mm=lower)
    assert got == close(expected, 1e-12)


def test_the_lower_bound_of_rect_is_the_corrected_sum_of_sixteen_columns():
    """Models-cells.md: lower l and upper u in (eTPU, air, X60, air)."""
    strips = [("etpu", 0.7), ("air", 0.3), ("x60", 0.7), ("air", 0.3)]
    total = 0.0
    for (low, a), (high, b) in product(strips, strips):
        s = 0.1 / EPS["x60"]
        if low != "etpu":
            s += 0.3 / EPS[low]
            if high != "etpu":
                s += 0.3 / EPS[high]
        total += a * b / s
    assert capacitance(rect_cell(0.1), EPS).lower == close(EPS0_F_PER_M * MM * total, 1e-12)


def trial_energy(film: float, hang: float = 0.5, lower: float = 0.24, n: int = 1500) -> float:
    """Energy of the columns' potential on a fine grid by finite differences: int eps |grad u|^2 [-], per period.

    u = q / s with q the thickness over permittivity up to z. Points crowd at the apex (x = 0.5 t^3).
    """

    def state(x, share, cog):
        """Permittivity and potential at a place; ``share`` of the height of the gap."""
        slope, rise = lower / 0.5, hang / 0.5
        roof = film + (rise * x if cog else hang)
        z = share * roof
        tops = film + slope * x, film + rise * x, roof
        parts = np.clip(z, 0, tops[0]), np.clip(z - tops[0], 0, tops[1] - tops[0]), np.clip(z - tops[1], 0, None)
        q = parts[0] / EPS["x60"] + parts[1] / EPS["air"] + parts[2] / EPS["x60"]
        s = tops[0] / EPS["x60"] + (tops[1] - tops[0]) / EPS["air"] + (roof - tops[1]) / EPS["x60"]
        eps = np.where((z > tops[0]) & (z < tops[1]), EPS["air"], EPS["x60"])
        return eps, q / s, roof

    middle = (np.arange(n) + 0.5) / n
    x, weight = 0.5 * middle**3, 1.5 * middle**2 / n
    x, weight, share = x[:, None], weight[:, None], middle[None, :]
    total = 0.0
    for cog in (True, False):
        eps, _, roof = state(x, share, cog)
        step = 1e-6
        up = (state(x, share + step, cog)[1] - state(x, share - step, cog)[1]) / (2 * step * roof)
        h = 1e-6 * x
        here, there = state(x + h, share, cog), state(x - h, share, cog)
        along = (here[1] - there[1]) / (2 * h)  # at equal share of the height
        tilt = share * (here[2] - there[2]) / (2 * h)
        sideways = along - tilt * up
        total += 2 * float((eps * (up**2 + sideways**2) * roof * weight).sum()) / n
    return total


@pytest.mark.parametrize("film", [0.1, 0.2])
def test_the_upper_bound_is_the_energy_of_its_trial_potential(film):
    """By finite differences, good to some 1e-5 here; Dirichlet's principle does the rest."""
    assert tri_bounds(film)[1] == close(EPS0_F_PER_M * trial_energy(film), 1e-4)


def test_the_straight_potential_is_that_of_scikit_fem():
    """First-order triangles on the same corners; stairs have no continuous potential of columns."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import dot, grad

    scene = stairs()
    mesh = triangles(cell(sections(scene)[0], scene.size_mm[2]))
    used, corners = np.unique(np.array(mesh.triangles), return_inverse=True)
    drawn = skfem.MeshTri(mesh.points[used].T.copy(), corners.reshape(-1, 3).T.copy())
    basis = skfem.Basis(drawn, skfem.ElementTriP1())
    eps = basis.with_element(skfem.ElementTriP0()).interpolate(np.array([EPS[m] * share for m, share in mesh.regions]))
    matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=eps)
    ends = {
        name: np.searchsorted(used, [e for e, n in mesh.terminals.items() if n == name]) for name in ("top", "bottom")
    }
    x = np.zeros(len(used))
    x[ends["top"]] = 1.0
    x = skfem.solve(*skfem.condense(matrix, x=x, D=np.unique(np.concatenate([e.ravel() for e in ends.values()]))))
    exact = float(x @ matrix @ x)
    assert straight(sections(scene)[0], scene.size_mm[2], EPS) == close(exact, 1e-9)
    assert capacitance(scene, EPS).upper == close(exact * EPS0_F_PER_M * MM, 1e-9)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 12), st.floats(0.05, 0.65), st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.floats(1.5, 50),
    st.booleans(),
)  # fmt: skip
def test_smooth_rows_hold_at_most_what_a_potential_of_the_height_alone_gives(count, height, top, lean, eps, hanging):
    """Trapezia side by side, from flat to steep: two plates in series, one of the mean permittivity of its slab.

    Their columns' own potentials meet, and hold much more where the flanks are steep.
    """
    pitch, steps = 4 / count, np.array([0, 1, lean * (1 - top) + top, lean * (1 - top)])
    heights = np.array([0, 0, height, height])
    z = (1.0 - heights if hanging else 0.3 + heights).round(9).tolist()
    ridges = [Prism("y", tuple(zip(((k + steps) * pitch).round(9).tolist(), z, strict=True)), 0.0, 2.0)
              for k in range(count)]  # fmt: skip
    found = capacitance(plates(Body("ridges", "x60", tuple(ridges))), {"x60": eps, "air": 1.0})
    mean = 1 + (eps - 1) * (1 + top) / 2
    assert found.upper <= EPS0_F_PER_M * 4 * 2 * MM / (height / mean + 0.7 - height) * (1 + 1e-6)


@pytest.mark.parametrize(("period", "film"), [(0.1, 0.1), (0.25, 1.0), (2.0, 0.1)])
def test_triangles_of_any_pitch_hold_at_most_a_plate_on_their_film(period, film):
    """The upper electrode's cogs reach down to the film: no height above it is free of them."""
    plate = EPS0_F_PER_M * EPS["x60"] * 2 / film
    assert tri_bounds(film, period_mm=period)[1] <= plate * (1 + 1e-12)


def half_covered() -> Scene:
    low = Body("low", "etpu", (box(0, 4, 0, 2, 0, 0.3),), "bottom")
    high = Body("high", "etpu", (box(0, 2, 0, 2, 1.0, 1.3),), "top")
    return Scene((low, high), (4, 2, 1.3))


def interlocked() -> Scene:
    """Posts of both electrodes beside each other, higher than the gap between their tips."""
    posts = [Body("post", "etpu", (box(0, 1, 0, 1, 0.3, 0.8),), "bottom"),
             Body("tooth", "etpu", (box(2, 3, 1, 2, 0.5, 1.0),), "top")]  # fmt: skip
    return plates(*posts)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (tri_cell(0.0), "touch"),
        (rect_cell(0.0), "touch"),
        (half_covered(), "does not cover"),
        (tri_cell(0.1).turned_over(), "does not cover"),  # the bottom terminal is above
        (interlocked(), "reach into each other"),
        (
            plates(RIDGE, Body("wedge", "x60", (Prism("z", ((0, 0), (1, 0), (0, 1)), 0.9, 1.0),))),
            "slanted or curved in elevation",
        ),
    ],
)
def test_it_says_what_it_cannot_speak_of(scene, reason):
    assert reason in (why_not_applicable(scene) or "")


@pytest.mark.parametrize("scene", [tri_cell(0.1), rect_cell(0.1), tri_cell(1e-6), plates(RIDGE), plates()])
def test_it_speaks_of_the_rest(scene):
    assert why_not_applicable(scene) is None
