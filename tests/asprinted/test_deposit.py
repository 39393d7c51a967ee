"""Deposit of lines on a raster, laid in lots, by its volume and first moments, which no raster changes."""

import numpy as np
import pytest

from sensorgen.asprinted import ledger
from sensorgen.asprinted.beads import Beads
from sensorgen.design import design

SHAPE = (150, 120)


def lines(start_mm, end_mm, width_mm, height_mm=0.1):
    way, whole = np.hypot(*(end_mm - start_mm).T), np.zeros(len(start_mm), int)
    height = np.full(len(way), height_mm)
    return Beads(start_mm, end_mm, width_mm, height, way * width_mm * height, *(whole.copy() for _ in range(4)))


@pytest.mark.parametrize("lot", [7, 1000, 10**6])
def test_each_lot_keeps_volume_and_middle_of_its_lines(lot, monkeypatch):
    monkeypatch.setattr(ledger, "_LOT", lot)
    rng = np.random.default_rng(7)
    start, end = (rng.uniform(1.0, [11.0, 8.0], (40, 2)) for _ in range(2))
    beads = lines(start, end, rng.uniform(0.3, 0.6, 40))
    filled = ledger.deposit(beads, SHAPE)
    plan = beads.volume_mm3 / beads.height_mm
    assert filled.sum() * ledger.PITCH_MM**2 == pytest.approx(plan.sum(), rel=1e-5)
    for axis in (0, 1):
        places = (np.arange(SHAPE[axis]) + 0.5 - ledger._MARGIN) * ledger.PITCH_MM
        moment = (filled.sum(1 - axis) * places).sum() * ledger.PITCH_MM**2
        assert moment == pytest.approx((plan * (start + end)[:, axis] / 2).sum(), rel=1e-4)


def test_a_line_fills_its_rectangle_and_what_lies_outside_the_raster_is_left_out():
    """0.5 mm wide along y = 4.25 mm, from the middle of the raster's last rows out of it."""
    end_mm = (SHAPE[0] - ledger._MARGIN) * ledger.PITCH_MM
    filled = ledger.deposit(lines(np.array([[2.0, 4.25]]), np.array([[end_mm + 5.0, 4.25]]), np.array([0.5])), SHAPE)
    inside = filled[ledger._MARGIN + 21 : -2, ledger._MARGIN + 40 : ledger._MARGIN + 45]
    assert inside == pytest.approx(1.0, rel=1e-3)
    assert filled[ledger._MARGIN + 21 : -2].sum() == pytest.approx(inside.sum(), rel=1e-3)
    assert filled[: ledger._MARGIN + 19].sum() == 0


@pytest.mark.parametrize(("share", "refused"), [(1.0, False), (1.5, True)])
def test_strips_that_swell_into_another_material_may_take_all_of_a_line(share, refused):
    """Strips of 0.125 mm, which PrusaSlicer prints 0.34 mm wide into the film beside them: 16.8 mm3 of 100 x 10 mm."""
    cells = {"hang_height_mm": 0.4, "dielectric_mm": 0.2}
    sensor = design.make({"shape": "tri", "parameters": cells})
    x, names = np.arange(1.5, 100.0, 2.0), [body.name for body in sensor.printed.bodies]
    strips = lines(*(np.stack([x, np.full_like(x, y)], axis=1) for y in (0.06, 9.94)), np.full(len(x), 0.34 * share))
    strips.layer[:], strips.body[:] = 5, names.index("hanging_dielectric")
    assert strips.volume_mm3.sum() == pytest.approx(16.8 * share, rel=1e-3)
    around = [ledger.sampled(sensor, off) for off in (0.0, ledger.NEAR_MIDDLE, -ledger.NEAR_MIDDLE)]
    wrong = {(fault.layer, fault.message.split()[0]) for fault in ledger._volumes(sensor, strips, around)}
    assert ((5, "hanging_dielectric") in wrong) == refused
