"""Cells that are solved on demand: what is asked, what is kept, and what is said where it does not work."""

import math
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import make
from sensorgen.design.tip import Tip
from sensorgen.models import compression
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.capacitance import Answer
from sensorgen.prediction.compression_law import law_of
from sensorgen.prediction.query import Load
from sensorgen.prediction.sensor_model import execute, plan

GAPS = Answer("columns", Interval(1e-10, 2e-10), ())
OTHER = {"shape": "tri", "parameters": {"period_mm": 2.5}}


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))


def test_rises_and_stiffness_of_a_curve():
    """Stress over modulus decides, so twice the modulus bears twice the stress; a rise is scaled as it is."""
    law = compression.curve("c", "made up", [0, 1e4, 5e4, 1e5], [1, 1.1, 1.2, 1.3])
    at = np.array([0.0, 3e3, 6e4, 2e5])
    thinning, slope = law.scaled_modulus(2.0).capacitive_strain(at)
    assert thinning == pytest.approx(law.capacitive_strain(at / 2)[0], rel=1e-14)
    assert slope == pytest.approx(law.capacitive_strain(at / 2)[1] / 2, rel=1e-14)
    risen = 1 / (1 - law.scaled_rise(1.5).capacitive_strain(at)[0]) - 1
    assert risen == pytest.approx(1.5 * (1 / (1 - law.capacitive_strain(at)[0]) - 1), rel=1e-12)
    step = 1.0
    difference = law.scaled_rise(1.5).capacitive_strain(at + step)[0] - law.scaled_rise(1.5).capacitive_strain(at)[0]
    assert law.scaled_rise(1.5).capacitive_strain(at + step / 2)[1] == pytest.approx(difference / step, rel=1e-4)


def test_a_prototype_is_known_and_nothing_is_solved(monkeypatch):
    monkeypatch.setitem(sys.modules, "sensorgen.models.press2d", None)
    for name in ("", "solved"):
        law = law_of(make({"shape": "tri"}), GAPS, name)
        assert (law.compression.name, law.doubts, law.bounded) == ("solved", (), True)
    low, high = (c.ratio[-1] for c in law.others)
    within = 0.006  # of the mesh: the usual block was solved
    assert (low - 1) / (law.compression.ratio[-1] - 1) == pytest.approx(1 - within)
    assert (high - 1) / (law.compression.ratio[-1] - 1) == pytest.approx(1 + within)
    assert set(law.tops) == {"even", "stiff"}


def test_a_cell_of_boxes_is_solved_in_three_dimensions(monkeypatch):
    """An unknown one on two bricks per box and axis, held against one; a prototype's is stored."""
    from sensorgen.models import press3d
    from sensorgen.prediction import compression_law as celllaw

    monkeypatch.setattr(press3d, "BrickCounts", partial(press3d.BrickCounts, 2))
    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 6e4))
    cell = make({"shape": "rect", "parameters": {"dielectric_mm": 0.1, "lower_height_mm": 0.30001}})
    assert "predict --compression solved" in law_of(cell, GAPS).doubts[0]
    even = Tip(block="even")
    law = law_of(cell, GAPS, "solved", tip=even)
    stored = law_of(make({"shape": "rect", "parameters": {"dielectric_mm": 0.1}}), GAPS, tip=even)
    assert (law.compression.name, law.doubts, stored.doubts, stored.bounded) == ("solved", (), (), True)
    rise = [c.compression.capacitive_strain(np.asarray(6e4))[0] for c in (law, stored)]
    assert rise[0] == pytest.approx(rise[1], rel=0.08)
    assert rise[1] == pytest.approx(0.006, rel=0.05)  # 1.0 % at 100 kPa, by another program
    assert 0.006 < law.compression.within < 0.2
    assert set(law.tops) == set(stored.tops) == {"even", "stiff"}
    ratios = [(top["stiff"].ratio[-1] - 1) / (top["even"].ratio[-1] - 1) for top in (law.tops, stored.tops)]
    assert ratios[0] == pytest.approx(ratios[1], abs=0.03)
    assert not law.other_boundaries  # none that were solved for another cell


def test_without_the_solver_a_plate_stands_in_and_that_is_said(monkeypatch):
    loaded = [name for name in sys.modules if name.partition(".")[0] in ("netgen", "ngsolve")]
    for name in ("netgen", "ngsolve", *loaded):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(SensorgenError, match="pip install"):
        law_of(make(OTHER), GAPS, "solved")
    sensed, found = execute(plan(drawn(make(OTHER)), Load((1e3,), 1.0, 0.05), 1e-2))
    assert not sensed.law.bounded
    assert "pip install" in sensed.doubts[-1]
    assert found.width == math.inf


def test_a_curve_ends_where_the_capacitance_is_no_longer_known(monkeypatch):
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    from sensorgen.models import press2d
    from sensorgen.prediction import compression_law as celllaw

    def lost_above_5_kpa(*given, press=press2d.press, **more):
        found = press(*given, **more)
        known = tuple(c if p <= 5e3 else None for p, c in zip(found.stress_pa, found.capacitance_f_per_m2, strict=True))
        return replace(found, capacitance_f_per_m2=known, faults=() if all(known) else ("no capacitance",))

    monkeypatch.setattr(press2d, "press", lost_above_5_kpa)
    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 5e3, 1e4))
    law = law_of(make(OTHER), GAPS, "solved")
    assert law.compression.stress_pa == (0.0, 5e3)
    assert law.doubts == ("the solution of the cell ended at 5 kPa",)


def test_tops_are_those_of_a_cell_that_they_press_also_where_gaps_close_under_one_alone(monkeypatch):
    """Under an even pressure the thin electrode reaches the tips at 50 kPa; under a plate it does not."""
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    from sensorgen.prediction import compression_law as celllaw

    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 1e4, 3e4, 5e4))
    sizes = {"period_mm": 5.0, "electrode_mm": 0.06, "lower_height_mm": 0.06, "hang_height_mm": 0.3, "tip_mm": 0.5}
    cell = make({"shape": "tri", "quality": "extrafine", "parameters": sizes | {"dielectric_mm": 0.12}})
    stiff, even = (law_of(cell, GAPS, "solved", tip=Tip(block=block)) for block in ("stiff", "even"))
    rises = [np.array(law.ratio[1:]) - 1 for law in (stiff.tops["even"], even.compression)]
    assert rises[0] == pytest.approx(rises[1], rel=0.02)
    assert rises[0][-1] / rises[0][0] > 10  # it bends


def test_an_unknown_cell_is_solved_once(monkeypatch):
    """A period that is 10 nm off the prototype's is another cell, with the stored curve: to the 0.6 % that it claims.

    What it is solved for is kept: pressing it again would fail.
    """
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    from sensorgen.models import press2d
    from sensorgen.prediction import compression_law as celllaw

    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 3e4))
    cell = make({"shape": "tri", "parameters": {"period_mm": 2.00001}})
    law = law_of(cell, GAPS, "solved")
    stored = compression.solved("tri", vars(make({"shape": "tri"}).params), {"x60": 6e6, "etpu": 22e6})
    at = np.array([3e4])
    rise, expected = (1 / (1 - c.capacitive_strain(at)[0]) - 1 for c in (law.compression, stored))
    within = (law.others[1].ratio[-1] - 1) / (law.compression.ratio[-1] - 1) - 1
    assert 0.00599 <= within < 0.032
    assert rise == pytest.approx(expected, rel=0.006 + within)
    assert {t.quantity for t in law.taken} == {"youngs_modulus_pa", "poisson_ratio"}
    monkeypatch.setattr(press2d, "press", lambda *_, **__: pytest.fail("pressed again"))
    assert law_of(cell, GAPS, "solved").compression == law.compression
