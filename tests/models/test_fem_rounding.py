"""What doubles lose in the plane: elements against 40 digits, slivers of 100 mm against closed forms and columns."""

from functools import cache

import mpmath as mp
import numpy as np
import pytest
from cell_scenes import EPS, MM, cut_slabs, plates, prism

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import columns, fem2d
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.electrostatics import bounds as _fem_bounds
from sensorgen.solvers.electrostatics.mesh import Cones
from sensorgen.solvers.electrostatics.plane import SIDES, Field, Plane
from sensorgen.solvers.electrostatics.triangles import Triangles

AIR_AT_1E4 = {"x60": 1e4, "air": 1.0}
FORMS = {"needle": ((0, 0), (1, 0), (0, 1)), "flat": ((0, 0), (1, 0), (0.4, 1)), "wedge": ((0, 0), (1, 0), (1, 1))}


def gap(length_mm: float, thin_mm: float) -> Scene:
    """Air of even thickness over dielectric, 1 mm together."""
    return plates(Body("x", "x60", (box(0, length_mm, 0, 1, 0.2, 1.2 - thin_mm),)), length_mm=length_mm)


def sliver(length_mm: float, thin_mm: float) -> Scene:
    """Air that grows from nothing to its thickness over dielectric, 1 mm together."""
    block = prism((0, 0.2), (length_mm, 0.2), (length_mm, 1.2 - thin_mm), (0, 1.2))
    return plates(Body("x", "x60", (block,)), length_mm=length_mm)


def in_series(length_mm: float, thin_mm: float, eps) -> complex:
    return EPS0_F_PER_M * length_mm * MM / ((1 - thin_mm) / eps["x60"] + thin_mm / eps["air"])


@cache
def gauss(count: int) -> list[tuple[mp.mpf, mp.mpf]]:
    """Places and weights on -1..1."""
    found = []
    for start in np.polynomial.legendre.leggauss(count)[0]:
        x = mp.findroot(lambda t: mp.legendre(count, t), mp.mpf(float(start)))
        slope = count * (x * mp.legendre(count, x) - mp.legendre(count - 1, x)) / (x * x - 1)
        found.append((x, 2 / ((1 - x * x) * slope**2)))
    return found


def on_sides(corners, function, order: int) -> np.ndarray:
    """A function by its values at corners, less the first, and its integrated Legendre modes along the sides."""
    values = [function(c) for c in corners]
    found = [v - values[0] for v in values]
    for a, b in SIDES:
        at = [(w, t, function((corners[a] * (1 - t) + corners[b] * (1 + t)) / 2)) for t, w in gauss(order + 1)]
        for k in range(1, order):
            slope = [w * v * k * (t * mp.legendre(k, t) - mp.legendre(k - 1, t)) / (t * t - 1) for w, t, v in at]
            found.append((values[b] - values[a] * (-1) ** k - mp.fsum(slope)) * mp.sqrt(k + mp.mpf(1) / 2))
    return np.array([float(v) for v in found])


def energy(corners, power: int) -> mp.mpf:
    """Integral of |d z^power / dz|^2 over a triangle."""
    u, v = corners[1] - corners[0], corners[2] - corners[0]
    inside = mp.mpf(0)
    for t, w in gauss(power + 1):
        for s, x in gauss(power + 1):
            place = corners[0] + u * (1 + s) / 2 * (1 - t) / 2 + v * (1 + t) / 2
            inside += w * x * (1 - t) / 8 * abs(power * place ** (power - 1)) ** 2
    return inside * (mp.conj(u) * v).imag


@pytest.mark.parametrize(("form", "order"), [("needle", 2), ("flat", 13), ("wedge", 5)])
def test_a_triangle_loses_what_it_is_said_to_lose_at_most(form, order):
    """Re and Im of z^n have one energy, which is their crossing too; the more slender, the more digits are lost."""
    random, worst = np.random.default_rng(order), 0.0
    with mp.workdps(40):
        for thin, turn in ((1.0, 0.0), (1e-3, 0.7), (1e-6, 0.0), (1e-8, 2.0)):
            points = FORMS[form] * np.array([1, thin]) @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
            points = np.roll(points + random.uniform(-1, 1, 2) * (turn > 0), 1 if form == "wedge" else 0, axis=0)
            plane = Plane(Cones(Triangles(points, [(0, 1, 2)], [("air", 1.0)], {}), {}), order)
            corners = [mp.mpc(*map(float, p)) for p in points]
            phase = mp.expj(random.uniform(0, 6))
            f, g = (on_sides(corners, lambda z, p=p, turn=phase: p(turn * z**order), order) for p in (mp.re, mp.im))
            f, g = Field(f[None], []), Field(g[None], [])
            exact = energy(corners, order)
            found = plane.energies(f, f)[0], plane.energies(g, g)[0], plane.crossings(f, g)[0]
            terms = plane.energy_terms(f)[0], plane.energy_terms(g)[0], plane.crossing_terms(f, g)[0]
            drawn = float(plane.mesh.thinness()[0] * exact)
            for value, size in zip(found, terms, strict=True):
                off = float(abs(mp.mpf(float(value)) - exact))
                assert off < fem2d._LOST * (size + drawn) / 2
                worst = max(worst, off / (fem2d._LOST * size))
    assert worst > 1e-3  # it is no wider than that


@pytest.mark.parametrize(("length_mm", "thin_mm", "ratio"), [(20.0, 1e-3, 4.68), (100.0, 1e-6, 100.0)])
def test_even_air_over_a_long_sensor(length_mm, thin_mm, ratio):
    """Layers in series, in which nothing changes along 100 mm; bounds once stayed 5e-6 apart, for fear of doubles."""
    eps = {"x60": ratio, "air": 1.0}
    found = fem2d.capacitance(gap(length_mm, thin_mm), eps, 1e-8)
    assert found.lower <= in_series(length_mm, thin_mm, eps) <= found.upper
    assert found.width() < 1e-7


@pytest.mark.parametrize(("thin_mm", "ratio"), [(1e-4, 100.0), (1e-6, 4.68)])
def test_a_sliver_of_100_mm(thin_mm, ratio):
    """Columns are nearly exact where hardly anything changes along them: their two bounds are the closed form."""
    eps = {"x60": ratio, "air": 1.0}
    scene = sliver(100.0, thin_mm)
    found, form = fem2d.capacitance(scene, eps, 1e-8), columns.capacitance(scene, eps)
    assert found.width() < 1e-7
    assert form.lower <= found.upper
    assert found.lower <= form.upper
    assert form.width() < 1e-4


def test_even_air_at_1e4_times_its_permittivity():
    """There the stream function grows along slender triangles whose short sides tell it nothing: the solve is off by
    the roundings of its level times 1e8 and 1e4, and Thomson's bound says so.
    """
    found = fem2d.capacitance(gap(100.0, 1e-6), AIR_AT_1E4, 1e-8)
    assert found.lower <= in_series(100.0, 1e-6, AIR_AT_1E4) <= found.upper
    assert found.width() < 1e-3


@pytest.mark.parametrize(("length_mm", "thin_mm"), [(20.0, 1e-3), (100.0, 1e-6)])
def test_air_slivers_at_1e4_times_its_permittivity(length_mm, thin_mm):
    """The flux turns along the air, whose energy a triangle tells from large terms: the lower bound of the first
    scene came out 4e-9 above the upper one. Now all orders' intervals meet, however narrow each is.
    """
    found = [s.interval for s in fem2d.steps(sliver(length_mm, thin_mm), AIR_AT_1E4, 1e-9)]
    form = columns.capacitance(sliver(length_mm, thin_mm), AIR_AT_1E4)
    assert max(f.lower for f in [*found, form]) <= min(f.upper for f in [*found, form])
    assert min(f.width() for f in found) < 1e-4


def test_layers_that_lose_over_100_mm():
    eps = {"x60": 4.68 - 1j, "air": 1.0 + 0j}
    found = fem2d.lossy(gap(100.0, 1e-6), eps, 1e-8)
    assert found.holds(in_series(100.0, 1e-6, eps))
    assert found.width() < 1e-7


def test_a_cut_cell_allows_for_what_two_bounds_may_hide():
    """Bounds that doubles moved onto each other: the field may still be off by the root of what they moved."""
    random, shares, lost = np.random.default_rng(1), np.array([3.0, 3.0, 4.0, 5.0]), 1e-6
    for exact, error in random.normal(size=(200, 2, 4)):
        error -= exact * (error @ exact) / (exact @ exact)
        field = exact + error * np.sqrt(0.9 * lost * (exact @ exact)) / np.hypot.reduce(error)
        above, below = (field @ field) * (1 - 0.4 * lost), (exact @ exact) * (1 + 0.4 * lost)
        found = _fem_bounds.whole(_fem_bounds.Energies(below, above, (shares - 3) @ field**2, 1, lost), shares.tolist())
        assert found.lower < shares @ exact**2 < found.upper


def test_a_disc_of_a_cut_cell_is_as_wide_as_its_bounds():
    """Slabs from plate to plate are solved exactly: all that is left is the root of what doubles may hide."""
    scene, _ = cut_slabs()
    bounds, disc = (
        fem2d.capacitance(scene, EPS, 1e-6),
        fem2d.lossy(scene, {m: complex(e) for m, e in EPS.items()}, 1e-6),
    )
    assert bounds.width() < 1e-6
    assert 0.5 * bounds.width() < disc.width() < 2 * bounds.width()
