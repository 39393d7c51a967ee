"""From a cell's two energies to the sensor's interval: cells that its end cuts, bounds that cross, none at all."""

import numpy as np
import pytest
from cell_scenes import CELLS, EPS, MM, close, cut_slabs, tri_cell

from sensorgen.core.bounds import Interval
from sensorgen.design.shapes import tri
from sensorgen.models import fem2d
from sensorgen.scene.scene import Fill
from sensorgen.solvers.electrostatics import bounds as _fem_bounds


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
    found = [_fem_bounds.FieldStep(p, 1, 1, Interval(low, 2.0)) for p, low in ((4, 1.0), (6, 1.9), (8, 1.5))]
    monkeypatch.setattr(fem2d, "steps", lambda *_: iter(found))
    assert fem2d.capacitance(tri_cell(0.1), EPS, 1e-6) == found[1].interval


def test_exact_bounds_are_moved_outwards():
    found = _fem_bounds.whole(_fem_bounds.Energies(2.0, 2.0, 0.0, 1), [3.0, 3.0])
    assert 6 * (1 - 2e-9) < found.lower < 6 < found.upper < 6 * (1 + 2e-9)


@pytest.mark.parametrize("lower", [2.0, 1 + 1e-8])
def test_crossed_bounds_stop(lower):
    with pytest.raises(_fem_bounds.CrossedBounds, match="lower bound"):
        _fem_bounds.whole(_fem_bounds.Energies(lower, 1.0, 0.0, 1), [1.0])


@pytest.mark.parametrize(("lower", "upper"), [(0.0, 1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_bounds_that_tell_nothing_are_no_solution(lower, upper):
    with pytest.raises(_fem_bounds.Unsolved, match="doubles"):
        _fem_bounds.whole(_fem_bounds.Energies(lower, upper, 0.0, 1), [1.0])
