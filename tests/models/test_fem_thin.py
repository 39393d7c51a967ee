"""Where a cross-section is thin, sharp or uneven: films to a nanometre, air to none, permittivities 1e4 apart."""

import numpy as np
import pytest
from cell_scenes import EPS, MM, between_curves, close, plates, tri_cell

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import fem2d
from sensorgen.scene.scene import Body, box
from sensorgen.solvers.electrostatics import bounds as _fem_bounds
from sensorgen.solvers.electrostatics.mesh import Cones


@pytest.mark.parametrize("film_mm", [1e-2, 1e-5])
def test_thin_films_down_to_a_nanometre(film_mm):
    """From film to film a tenth as thick C' grows by 4.087e-11 F/m per e-fold, once the film is thin against
    the cell.
    """
    found = fem2d.capacitance(tri_cell(film_mm), EPS, 1e-4).times(1 / MM)
    thinner = fem2d.capacitance(tri_cell(film_mm / 10), EPS, 1e-4).times(1 / MM)
    assert found.width() < 1e-4
    assert (thinner.middle() - found.middle()) / np.log(10) == close(4.087e-11, 5e-3)
    assert thinner.lower > found.upper


def test_too_thin_for_its_length_is_told(monkeypatch):
    """A tenth of a nanometre of air along 10 cm is solved; triangles that doubles cannot tell from lines are not."""
    thin = plates(Body("x", "x60", (box(0, 100, 0, 1, 0.2, 1.2 - 1.1e-7),)), length_mm=100.0)
    gap_mm, found = 1.2 - (1.2 - 1.1e-7), fem2d.capacitance(thin, EPS, 1e-4)
    exact = EPS0_F_PER_M * 100 * MM / ((1 - gap_mm) / EPS["x60"] + gap_mm / EPS["air"])
    assert found.lower <= exact <= found.upper < 1.02 * found.lower
    monkeypatch.setattr(Cones, "areas", lambda _: np.zeros(1))
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
