"""Cells of a cross-section between two bounds: references, closed forms, scikit-fem, symmetries, limits."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from cell_scenes import EPS, MM, between_curves, bumps, cut_slabs, plates, prism, rect_cell, stairs, tri_cell
from scipy.special import ellipk

from sensorgen.errors import OutOfRange
from sensorgen.interval import Interval
from sensorgen.models import _fem_bounds, columns, fem2d
from sensorgen.scene import Body, Fill, Scene, box
from sensorgen.shapes import reference, tri
from sensorgen.units import EPS0_F_PER_M

CELLS = json.loads((Path(__file__).parents[1] / "reference" / "cells.json").read_text("utf-8"))
VACUUM = {"air": 1.0, "x60": 1.0}


def close(expected: float, rel: float):
    return pytest.approx(expected, rel=rel, abs=0)


def holds(found, low: float, high: float | None = None) -> bool:
    """Whether an interval meets another one, that of a reference."""
    return found.lower <= (low if high is None else high) and low <= found.upper


@pytest.mark.parametrize("width", [1e-4, 1e-6])
@pytest.mark.parametrize("case", CELLS["tri"], ids=lambda c: f"d={c['d']}")
def test_tri_lies_between_its_bounds(case, width):
    found = fem2d.capacitance(tri_cell(case["d"]), EPS, width).times(1 / MM)
    off = case["rel_error_halfwidth"]
    assert found.width() <= width
    assert holds(found, case["C_F_per_m"] * (1 - off), case["C_F_per_m"] * (1 + off))


def test_widths_shrink_and_lie_within_each_other():
    found = [s.interval for s in fem2d.steps(tri_cell(0.05), EPS, 1e-7)]
    coarse = [fem2d.capacitance(tri_cell(0.05), EPS, w) for w in (1e-2, 1e-4, 1e-6)]
    best = found[-1]
    assert best.width() < 1e-7
    for wide, narrow in zip(coarse, [*coarse[1:], best], strict=True):
        assert wide.lower <= narrow.lower * (1 + 1e-9)
        assert wide.upper >= narrow.upper * (1 - 1e-9)
        assert wide.width() > narrow.width()


def test_the_width_falls_exponentially_with_the_order():
    section, coarse = fem2d._triangles(tri_cell(0.1))
    mesh = fem2d._graded(coarse, EPS, 1e-10)
    widths = [fem2d._solved(mesh, EPS, p)[0].width() for p in (3, 5, 7, 9)]
    assert section.depth_mm == 1.0
    assert all(b < a / 5 for a, b in pairwise(widths))  # a factor of 9 to 12, measured


def test_a_plate_is_exact():
    scene = reference.scene(reference.Params(length_mm=2.0, width_mm=2.0), Fill())
    found = fem2d.capacitance(scene, EPS, 1e-6)
    assert (found.lower, found.upper) == close((CELLS["plate"]["cell_2x2mm_F"],) * 2, 2e-9)


def coaxial_quarter(corners: int) -> Scene:
    """The upper quarter of a coaxial line of radii 1 and 2, between mirrors at 0 and 45 degrees turned to x:
    see test.
    """
    angle = np.linspace(np.pi / 2, 0, corners + 1)
    inner, outer = [(np.cos(a), np.sin(a)) for a in angle], [(2 * np.cos(a), 2 * np.sin(a)) for a in angle]
    low = prism((0, 0), (1, 0), *inner[::-1][1:-1], (0, 1))
    high = prism((2, 0), (2.2, 0), (2.2, 2.2), (0, 2.2), (0, 2), *outer[1:-1])
    return Scene((Body("low", "etpu", (low,), "bottom"), Body("high", "etpu", (high,), "top")), (2.2, 1.0, 2.2))


def test_a_coaxial_line_is_met_with_the_square_of_its_corners(monkeypatch):
    """C = 2 pi eps0 / ln 2; twice as many corners err by a quarter or less: what both circles lose partly cancels."""
    monkeypatch.setattr(fem2d.fem, "third_electrode", lambda scene: None)
    monkeypatch.setattr("sensorgen.models.fem2d.triangles", lambda cell: _closed_below(cell))
    exact = np.pi / 2 * EPS0_F_PER_M / np.log(2) * MM
    errors = []
    for corners in (3, 6, 12):
        found = fem2d.capacitance(coaxial_quarter(corners), VACUUM, 1e-6)
        assert found.width() < 1e-5
        errors.append(found.middle() / exact - 1)
    assert abs(errors[2]) < 4e-3
    rates = [a / b for a, b in pairwise(errors)]
    assert min(rates) > 4


def _closed_below(cell):
    """Triangles of a scene whose floor is a mirror: where no electrode lies on the floor, by intent here."""
    from sensorgen.models import _fem_triangles

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_fem_triangles, "_refuse_open", lambda *_: None)
        return _fem_triangles.triangles(cell)


def test_a_strip_between_plates():
    """Stripline of no thickness: C = 4 eps0 K(k)/K(k'), k = tanh(pi w / (2 b)); half of it, above the strip's plane.

    Strip of width 1 at one height with two plates 1 apart: upper half between a mirror plane (beside the strip) and the
    plate. The strip as floor's electrode, the mirror beside it as an open floor.
    """
    w, b, end = 1.0, 1.0, 4.0
    strip = Body("low", "etpu", (box(end - w / 2, end + w / 2, 0, 1, 0, 0.1),), "bottom")
    plate = Body("high", "etpu", (box(0, 2 * end, 0, 1, 0.1 + b / 2, 0.2 + b / 2),), "top")
    sides = box(0, end - w / 2, 0, 1, 0, 0.1), box(end + w / 2, 2 * end, 0, 1, 0, 0.1)
    gap = Body("wall", "wall", sides)  # hardly any permittivity: a mirror, up to 1e-9
    scene = Scene((strip, gap, plate), (2 * end, 1.0, 0.2 + b / 2))
    found = _open_floor(scene, {"air": 1.0, "wall": 1e-9}, 1e-6)
    k = np.tanh(np.pi * w / (2 * b))
    exact = 4 * EPS0_F_PER_M * ellipk(k**2) / ellipk(1 - k**2) / 2 * MM  # the upper half of the line
    assert found.width() < 1e-6
    assert found.middle() == close(exact, 1e-6)


def _open_floor(scene, permittivity, width):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sensorgen.models.fem2d.triangles", _closed_below)
        return fem2d.capacitance(scene, permittivity, width)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_interdigital_strips_on_a_half_space(share):
    """Fingers that fill a share of their plane: C = eps0 K(k)/K(k') from one finger to the plane half way to the next,
    k = sin(pi share / 2) (Igreja and Dias 2004), so half of it from finger to finger.

    Between two fingers' middles the upper half space; its lid, 4 pitches up, carries e^-25 of the field.
    """
    edge = 2.0 * share / 2
    low = Body("low", "etpu", (box(0, edge, 0, 1, 0, 0.1),), "bottom")
    high = Body("high", "etpu", (box(2 - edge, 2, 0, 1, 0, 0.1),), "top")
    gap = Body("wall", "wall", (box(edge, 2 - edge, 0, 1, 0, 0.1),))
    found = _open_floor(Scene((low, gap, high), (2.0, 1.0, 8.1)), {"air": 1.0, "wall": 1e-10}, 1e-6)
    k = np.sin(np.pi * share / 2)
    assert found.middle() == close(EPS0_F_PER_M * ellipk(k**2) / ellipk(1 - k**2) / 2 * MM, 2e-6)


def eccentric_half(corners: int, apart: float) -> Scene:
    """The upper half of a line of radii 1 and 2 whose axes are apart, on a mirror through both."""
    inner, outer = ([(r * np.cos(a), r * np.sin(a)) for a in np.linspace(np.pi, 0, corners + 1)] for r in (1, 2))
    low = prism(*((x + apart + 2.2, z if 0 < k < corners else 0.0) for k, (x, z) in enumerate(inner)))
    arc = [(x + 2.2, z if 0 < k < corners else 0.0) for k, (x, z) in enumerate(outer)]
    high = prism((0, 0), *arc, (4.4, 0), (4.4, 2.2), (0, 2.2))
    bodies = Body("low", "etpu", (_neat(low),), "bottom"), Body("high", "etpu", (_neat(high),), "top")
    return Scene(bodies, (4.4, 1.0, 2.2))


@pytest.mark.parametrize("apart", [0.3, 0.7])
def test_eccentric_cylinders_are_met_with_the_square_of_their_corners(apart):
    """C = 2 pi eps0 / acosh((a^2 + b^2 - e^2) / (2 a b)), a = 1, b = 2; half of it above the mirror."""
    exact = np.pi * EPS0_F_PER_M / np.arccosh((5 - apart**2) / 4) * MM
    errors = []
    for corners in (8, 16):
        found = _open_floor(eccentric_half(corners, apart), VACUUM, 1e-6)
        assert found.width() < 1e-5
        errors.append(found.middle() / exact - 1)
    assert abs(errors[1]) < 4e-3
    assert errors[0] / errors[1] > 3.9


def test_confocal_ellipses():
    """Between confocal ellipses C = 2 pi eps0 / (mu2 - mu1); drawn by curves over x it is a quarter of that."""
    hyper = lambda mu, nu: (np.cosh(mu) * np.cos(nu), np.sinh(mu) * np.sin(nu))  # noqa: E731
    errors = []
    for corners in (6, 12):
        nu = np.linspace(0, np.pi / 2, corners + 1)
        inner, outer = hyper(0.4, nu), hyper(1.0, nu)
        low = prism((0, 0), *zip(*inner, strict=True))
        high = prism((1.7, 0), (1.7, 1.4), (0, 1.4), *list(zip(*outer, strict=True))[::-1])
        scene = Scene((Body("l", "e", (_neat(low),), "bottom"), Body("h", "e", (_neat(high),), "top")), (1.7, 1.0, 1.4))
        found = _open_floor(scene, VACUUM, 1e-6)
        errors.append(found.middle() / (np.pi / 2 / 0.6 * EPS0_F_PER_M * MM) - 1)
    assert abs(errors[1]) < 8e-3
    assert errors[0] / errors[1] > 4


def _neat(p):
    return replace(p, outline=tuple((round(u, 12), round(v, 12)) for u, v in p.outline))


def test_mirrored_swapped_scaled_and_deeper():
    scene = tri_cell(0.1)
    one = fem2d.capacitance(scene, EPS, 1e-6)
    along_y = fem2d.capacitance(
        tri.scene(tri.Params(length_mm=1.0, width_mm=2.0, dielectric_mm=0.1, along="y"), Fill()), EPS, 1e-6
    )
    swapped = Scene(
        tuple(
            replace(b, terminal={"top": "bottom", "bottom": "top"}.get(b.terminal, ""))
            for b in scene.turned_over().bodies
        ),
        scene.size_mm,
    )
    twice = fem2d.capacitance(
        tri.scene(
            tri.Params(4.0, 1.0, dielectric_mm=0.2, hang_height_mm=1.0, lower_height_mm=0.48, period_mm=4.0), Fill()
        ),
        EPS,
        1e-6,
    )
    many = tri.scene(tri.Params(length_mm=14.0, width_mm=3.0, dielectric_mm=0.1), Fill())
    assert along_y.middle() == close(one.middle(), 1e-6)
    assert fem2d.capacitance(swapped, EPS, 1e-6).middle() == close(one.middle(), 1e-6)
    assert twice.middle() == close(one.middle(), 1e-6)  # C' of a cell does not know its size
    assert fem2d.capacitance(many, EPS, 1e-6).middle() == close(21 * one.middle(), 1e-6)


def test_all_permittivities_twice_is_twice_the_capacitance():
    one, two = (fem2d.capacitance(stairs(), {m: f * e for m, e in EPS.items()}, 1e-6) for f in (1, 2))
    assert two.middle() == close(2 * one.middle(), 1e-6)


@pytest.mark.parametrize("film_mm", [0.2, 1e-2, 1e-4, 1e-5])
def test_thin_films_down_to_a_nanometre(film_mm):
    """From film to film a tenth as thick C' grows by 4.087e-11 F/m per e-fold, once the film is thin against
    the cell.
    """
    found = fem2d.capacitance(tri_cell(film_mm), EPS, 1e-4).times(1 / MM)
    thinner = fem2d.capacitance(tri_cell(film_mm / 10), EPS, 1e-4).times(1 / MM)
    assert found.width() < 1e-4
    if film_mm <= 1e-2:
        assert (thinner.middle() - found.middle()) / np.log(10) == close(4.087e-11, 5e-3)
    assert thinner.lower > found.upper


def test_too_thin_for_its_length_is_told():
    """A tenth of a nanometre of air along 10 cm: triangles that doubles cannot tell from lines."""
    thin = plates(Body("x", "x60", (box(0, 100, 0, 1, 0.2, 1.2 - 1.1e-7),)), length_mm=100.0)
    with pytest.raises(_fem_bounds.Unsolved, match="too thin"):
        fem2d.capacitance(thin, EPS, 1e-4)


@pytest.mark.parametrize("film_mm", [1e-3, 3e-5])
def test_slanted_films_cost_no_digits(film_mm):
    """Films along slopes, whose columns are nearly exact: doubles once lost 4e-8 of the lower bound at 3e-5 mm.

    Between mirrors the thinner film's capacitance is the larger one's times their ratio, up to its bends.
    """
    heights = np.array([0.17, 0.29, 0.13, 0.23])
    low, high = (lambda u, t=t: float(np.interp(u, (0.0, 0.75, 1.05, 1.6), heights) + t) for t in (0.0, film_mm))
    scene = between_curves(low, high, np.array([0.0, 0.75, 1.05, 1.6]), 0.58)
    found = fem2d.capacitance(scene, VACUUM, 3e-9)
    slopes = np.diff(heights) / np.diff([0.0, 0.75, 1.05, 1.6])
    straight = (np.diff([0.0, 0.75, 1.05, 1.6]) * (1 + slopes**2)).sum() / film_mm * EPS0_F_PER_M * MM
    assert found.width() < 3e-9
    assert found.middle() == close(straight, 2 * film_mm)


def test_no_film_is_refused():
    assert "touch" in (fem2d.unfit(tri_cell(0.0)) or "")
    with pytest.raises(ValueError, match="touch"):
        fem2d.capacitance(tri_cell(0.0), EPS)


@pytest.mark.parametrize("ratio", [1.0, 10.0, 1e2, 1e3, 1e4])
def test_permittivity_ratios(ratio):
    """Where air wedges meet a film of high permittivity, energy sits in r^(2 lambda), lambda = 0.12 at 100,
    0.012 at 1e4.

    What lies within 1e-13 of the cell's size no double resolves: the interval says so by its width. Layers do not care.
    """
    eps = {"x60": ratio, "air": 1.0}
    found = fem2d.capacitance(tri_cell(0.1), eps, 1e-4)
    _, coarse = fem2d._triangles(tri_cell(0.1))
    exponent = min(fem2d.exponents(coarse, eps).values())
    assert found.width() < 1e-4 + 4 * 1e-13 ** (2 * exponent)
    assert fem2d.capacitance(stairs(), eps, 1e-4).width() < 1e-4
    bounds = columns.capacitance(tri_cell(0.1), {"x60": ratio, "air": 1.0})
    assert bounds.lower < found.lower < found.upper < bounds.upper


def test_equal_apex_angles_leave_no_air():
    """As high as the hanging ones, the lower triangles fill all: dielectric of one kind, whatever air would be."""
    scene = tri_cell(0.1, lower_height_mm=0.49)
    solid = [fem2d.capacitance(scene, {"x60": 4.68, "air": air}, 1e-5) for air in (1.0, 4.68)]
    assert solid[0].middle() == close(solid[1].middle(), 0.1)
    assert solid[0].upper <= solid[1].upper


def test_slivers_do_no_harm():
    """Air gaps of a micrometre and a tenth of one, over a millimetre of dielectric."""
    for thin in (1e-3, 1e-4):
        gap = plates(Body("x", "x60", (box(0, 2, 0, 1, 0.2, 1.2 - thin),)))
        exact = EPS0_F_PER_M * 2 * MM / ((1 - thin) / 4.68 + thin / 1.00059)
        assert fem2d.capacitance(gap, EPS, 1e-6).middle() == close(exact, 1e-6)


GENERAL = {
    "stairs": stairs(),
    "bumps": bumps(10),
    "flatter": tri_cell(0.1, hang_height_mm=0.2, lower_height_mm=0.1),
    "steeper": tri_cell(0.1, hang_height_mm=1.5, lower_height_mm=1.2),
    "isolated": tri_cell(0.1, isolation_mm=0.3),
    "supported": tri.scene(tri.Params(length_mm=2.0, width_mm=1.0), Fill(support="pva")),
    "bent alike": between_curves(
        lambda u: 0.6 - 0.4 * abs(u - 1), lambda u: 1.0 - 0.4 * abs(u - 1), np.arange(3.0), 1.2
    ),
    "curved": between_curves(
        lambda u: 0.3 + 0.1 * np.cos(np.pi * u), lambda u: 0.7 + 0.2 * np.sin(3 * u), np.linspace(0, 2, 17), 1.2
    ),
}


@pytest.mark.parametrize("name", GENERAL)
def test_scenes_that_nobody_foresaw(name):
    """Vertical columns lie below and their trial potentials above, whatever is drawn; a finer width lies within."""
    scene, eps = GENERAL[name], EPS | {"pva": 3.0}
    found, finer = (fem2d.capacitance(scene, eps, w) for w in (1e-3, 1e-5))
    bounds = columns.capacitance(scene, eps)
    assert finer.width() <= 1e-5
    assert bounds.lower < finer.lower < finer.upper < bounds.upper
    assert found.lower <= finer.lower * (1 + 1e-9)
    assert finer.upper <= found.upper * (1 + 1e-9)


def test_an_isolation_above_the_electrode_changes_nothing():
    plain, isolated = (fem2d.capacitance(tri_cell(0.1, isolation_mm=t), EPS, 1e-6) for t in (0.0, 0.3))
    assert plain.middle() == close(isolated.middle(), 1e-9)


def test_support_of_the_films_kind_fills_the_air():
    """Support of permittivity eps in the gaps is air of permittivity eps."""
    filled = tri.scene(tri.Params(length_mm=2.0, width_mm=1.0, dielectric_mm=0.1), Fill(support="pva"))
    with_support = fem2d.capacitance(filled, EPS | {"pva": 3.0}, 1e-6)
    with_air = fem2d.capacitance(tri_cell(0.1), {"x60": 4.68, "air": 3.0}, 1e-6)
    assert with_support.middle() == close(with_air.middle(), 1e-6)


def skfem_bounds(scene: Scene, eps: dict[str, float], refine: int) -> tuple[float, float]:
    """P2 elements of scikit-fem on the same few triangles, refined everywhere: from above, and the last gain."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import dot, grad

    section, coarse = fem2d._triangles(scene)
    used, corners = np.unique(np.array(coarse.triangles), return_inverse=True)
    mesh = skfem.MeshTri(coarse.points[used].T.copy(), corners.reshape(-1, 3).T.copy())
    values = np.array([eps[m] * share for m, share in coarse.regions])
    found = []
    for _ in range(refine):
        mesh = mesh.refined()
        middle = mesh.p[:, mesh.t].mean(1)
        owner = skfem.MeshTri(coarse.points[used].T.copy(), corners.reshape(-1, 3).T.copy()).element_finder()(*middle)
        basis = skfem.Basis(mesh, skfem.ElementTriP2(), intorder=4)
        weight = skfem.Basis(mesh, skfem.ElementTriP0(), intorder=4).interpolate(values[owner])
        matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=weight)
        x = np.zeros(basis.N)
        held = []
        for edge, end in coarse.terminals.items():
            a, b = (coarse.points[k] for k in edge)
            here = np.flatnonzero(_off(a, b, basis.doflocs) < 1e-12)
            x[here] = float(end == "top")
            held.append(here)
        x = skfem.solve(*skfem.condense(matrix, x=x, D=np.unique(np.concatenate(held))))
        found.append(float(x @ matrix @ x) * EPS0_F_PER_M * MM * section.depth_mm)
    return found[-1], found[-2] - found[-1]


def _off(a, b, points):
    """How far points lie off a straight piece."""
    along = (b - a) / np.hypot(*(b - a))
    share = np.clip((points.T - a) @ along, 0, np.hypot(*(b - a)))
    return np.hypot(*(points.T - a - share[:, None] * along).T)


@pytest.mark.parametrize("name", ["stairs", "bumps", "flatter", "curved"])
def test_scikit_fem_comes_from_above_and_near(name):
    scene = GENERAL[name]
    above, gain = skfem_bounds(scene, EPS, 4)
    found = fem2d.capacitance(scene, EPS, 1e-6)
    assert found.lower < above
    assert 0 < above - found.middle() < 3 * gain  # singular corners halve the error or better with each refinement
    assert above == close(found.middle(), 1e-2)


def test_a_sensor_that_ends_amid_a_period_has_the_energy_of_its_length():
    """7 mm hold one period more than 5 mm do."""
    short, long, one = (
        fem2d.capacitance(tri.scene(tri.Params(length_mm=x, width_mm=1.0), Fill()), EPS, 1e-3) for x in (5.0, 7.0, 2.0)
    )
    assert long.lower - short.upper <= one.middle() <= long.upper - short.lower
    assert one.middle() == close(CELLS["tri"][1]["C_F_per_m"] * MM, 1e-3)


def test_slabs_that_the_sensors_end_cuts():
    scene, exact = cut_slabs()
    found = fem2d.capacitance(scene, EPS)
    assert (found.lower, found.upper) == close((exact, exact), 1e-6)  # the root of what doubles lose


@pytest.mark.parametrize("off", [0.5, 1e-2, 1e-4])
def test_the_energy_of_cut_cells_lies_between_its_bounds(off):
    """Whatever a field's error is, as long as it is square to the exact one: vectors stand for fields."""
    random, shares = np.random.default_rng(1), np.array([3.0, 3.0, 4.0, 5.0])
    for exact, error in random.normal(size=(200, 2, 4)):
        error -= exact * (error @ exact) / (exact @ exact)
        field = exact + error * off / np.hypot.reduce(error)
        solved = _fem_bounds.Energies(exact @ exact, field @ field, (shares - 3) @ field**2, 1)
        found = _fem_bounds.whole(solved, shares.tolist())
        assert found.lower < shares @ exact**2 < found.upper
        assert found.upper - found.lower < 20 * off * (exact @ exact + 1)


def test_the_narrowest_step_is_the_answer(monkeypatch):
    """Doubles may end before orders do: the last step is then wider than one before."""
    found = [fem2d.Step(p, 1, 1, Interval(low, 2.0)) for p, low in ((4, 1.0), (6, 1.9), (8, 1.5))]
    monkeypatch.setattr(fem2d, "steps", lambda *_: iter(found))
    assert fem2d.capacitance(tri_cell(0.1), EPS, 1e-6) == found[1].interval


def test_exact_bounds_are_moved_outwards():
    found = _fem_bounds.whole(_fem_bounds.Energies(2.0, 2.0, 0.0, 1), [3.0, 3.0])
    assert 6 * (1 - 2e-9) < found.lower < 6 < found.upper < 6 * (1 + 2e-9)


@pytest.mark.parametrize("lower", [2.0, 1 + 1e-8])
def test_crossed_bounds_stop(lower):
    with pytest.raises(_fem_bounds.CrossedBounds, match="lower bound"):
        _fem_bounds.whole(_fem_bounds.Energies(lower, 1.0, 0.0, 1), [1.0])


@pytest.mark.parametrize(("lower", "upper"), [(0.0, 1.0), (-1.0, 1.0), (np.nan, 1.0), (1.0, np.nan), (1.0, np.inf)])
def test_bounds_that_tell_nothing_are_no_solution(lower, upper):
    with pytest.raises(_fem_bounds.Unsolved, match="doubles"):
        _fem_bounds.whole(_fem_bounds.Energies(lower, upper, 0.0, 1), [1.0])


@pytest.mark.parametrize(
    ("eps", "width", "words"),
    [
        (EPS | {"x60": 0.0}, 1e-4, "x60 is 0"),
        (EPS | {"x60": -1.0}, 1e-4, "above 0"),
        (EPS | {"air": float("nan")}, 1e-4, "air"),
        (EPS, 0.0, "accuracy"),
        (EPS, float("nan"), "accuracy"),
    ],
)
def test_nonsense_is_refused(eps, width, words):
    with pytest.raises(OutOfRange, match=words):
        fem2d.capacitance(tri_cell(0.1), eps, width)


def test_a_missing_permittivity_is_named():
    with pytest.raises(KeyError, match="x60"):
        fem2d.capacitance(tri_cell(0.1), {"air": 1.0})


def test_what_it_cannot_speak_of():
    overlap = plates(Body("a", "x60", (box(0, 2, 0, 1, 0.2, 0.6),)), Body("b", "pva", (box(0, 2, 0, 1, 0.5, 0.8),)))
    half = Scene((plates().bodies[0], Body("high", "etpu", (box(0, 1, 0, 1, 1.2, 1.4),), "top")), (2.0, 1.0, 1.4))
    middle = plates(Body("mid", "etpu", (box(0, 2, 0, 1, 0.5, 0.6),), "middle"))
    assert "overlap" in (fem2d.unfit(overlap) or "")
    assert "does not cover" in (fem2d.unfit(half) or "")
    assert "three directions" in (fem2d.unfit(rect_cell(0.1)) or "")
    assert "two electrodes" in (fem2d.unfit(middle) or "")
    assert fem2d.unfit(tri_cell(0.1)) is None
