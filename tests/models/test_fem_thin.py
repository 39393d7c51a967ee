"""Where a cross-section is thin, sharp or uneven: films to a nanometre, air to none, permittivities 1e4 apart."""

import numpy as np
import pytest
from cell_scenes import EPS, MM, between_curves, plates, stairs, tri_cell

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import columns, fem2d
from sensorgen.scene.scene import Body, box
from sensorgen.solvers.electrostatics import bounds as _fem_bounds


def close(expected: float, rel: float):
    return pytest.approx(expected, rel=rel, abs=0)


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
    found = fem2d.capacitance(scene, {"air": 1.0}, 3e-9)
    slopes = np.diff(heights) / np.diff([0.0, 0.75, 1.05, 1.6])
    straight = (np.diff([0.0, 0.75, 1.05, 1.6]) * (1 + slopes**2)).sum() / film_mm * EPS0_F_PER_M * MM
    assert found.width() < 3e-9
    assert found.middle() == close(straight, 2 * film_mm)


def test_no_film_is_refused():
    assert "touch" in (fem2d.why_not_applicable(tri_cell(0.0)) or "")
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
