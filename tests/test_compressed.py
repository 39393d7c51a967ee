"""Cells pressed as near as asked: the bounds hold what other programs found, by the coarsest mesh that will do."""

import json
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.bounds import Interval
from sensorgen.design.design import make
from sensorgen.prediction import compression as compressed
from sensorgen.prediction import mesh_ladder
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.compression import BoundaryConditions, PressQuestion

KNOWN = json.loads((Path(__file__).parent / "reference" / "contact.json").read_text())
LOADS = (0, 2, 6, 10)  # of the reference's, a tenth of its kPa
needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))


def pressed(film, accuracy, loads=LOADS):
    design = make({"shape": "tri", "parameters": {"dielectric_mm": film}, "tip": {"block": "even"}})  # the reference's
    stress = tuple(KNOWN[f"tri_d{film}"]["p_kPa"][k] for k in loads)
    return compressed.answer(drawn(design), PressQuestion(stress, BoundaryConditions(), accuracy=accuracy))


@needs_mesher
@pytest.mark.parametrize(
    ("film", "accuracy", "loads"),
    [(0.2, 5e-2, LOADS[:3]), *(pytest.param(0.1, k, LOADS, marks=pytest.mark.nightly) for k in (5e-2, 1.2e-2))],
)
def test_the_bounds_hold_the_reference_at_every_load(film, accuracy, loads):
    found = pressed(film, accuracy, loads)
    known = KNOWN[f"tri_d{film}"]
    assert found.reached
    for k, low, high in zip(loads, found.lower_f_per_m2, found.upper_f_per_m2, strict=True):
        truth = known["C0_exact_pF_per_m"] + known["dC_pF_per_m"][k]
        assert 2e9 * low < truth < 2e9 * high  # pF per metre of depth and period of 2 mm
    down = np.abs(np.array(found.displacement_um) - np.array(known["uy_um"])[list(loads)])
    off = np.abs(2e9 * np.array(found.rise_f_per_m2) - np.array(known["dC_pF_per_m"])[list(loads)])
    assert (down <= found.displacement_error_um).all()
    assert (off <= 2e9 * np.array(found.rise_error_f_per_m2)).all()
    assert 0 < found.largest_displacement_error < found.largest_rise_error <= accuracy
    assert (found.plan.levels[0].chosen in ("press2d, mesh x 1.5", "press2d")) is (accuracy > 2e-2)


@pytest.mark.nightly
@needs_mesher
def test_what_is_below_the_reach_of_all_meshes_is_told_with_the_best():
    found = pressed(0.2, 1e-5, loads=(0, 2))
    assert not found.reached
    assert mesh_ladder.VERIFIED < found.largest_rise_error < 1.2e-2
    asked = [c.model for c in found.plan.levels[0].candidates if c.seconds is not None]
    assert asked == ["press2d, mesh x 0.7", "press2d, mesh x 0.5"]


def test_one_that_ends_early_is_not_reached(monkeypatch):
    """No bound is known above the load that it ended at, so no accuracy either."""
    from sensorgen.models.press2d import Pressed

    def ends_early(case, stress_pa, level=0, **_):
        bounds = (Interval(1.0, 1.0001), Interval(1.1, 1.1001))
        moved = np.array([0.0, 1e-6])
        return Pressed(np.array(stress_pa[:2]), moved, bounds, (), moved, moved, moved, 0.0, ("converged up to 20",))

    monkeypatch.setattr(mesh_ladder, "pressed", ends_early)
    found = pressed(0.1, 5e-2)
    assert (found.reached, found.largest_rise_error, found.converged_kpa) == (False, None, 20.0)
    rise = 1.1 / 1.00005  # of whatever the capacitance at rest is, which is taken from the sensor's
    assert found.lower_f_per_m2[1] / found.upper_f_per_m2[0] < rise < found.upper_f_per_m2[1] / found.lower_f_per_m2[0]
