"""What would help: each change does what it says, the best are chosen, and they add up."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_sensor import sensor_of

from card_sensors import BONDED, CAPACITOR, PLATE, setup
from sensorgen.design import materials
from sensorgen.design.design import make
from sensorgen.design.tip import EVEN, STIFF
from sensorgen.models import compression
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import identify as changes
from sensorgen.prediction.identifiability.fisher import Setup, required
from sensorgen.prediction.identifiability.identify import CHANGES, most_helpful, together
from sensorgen.prediction.query import FLAT, TONES_HZ


def helped(start: Setup):
    return most_helpful(start, required(start))


def cell_sensor() -> Sensor:
    return changes.cell(setup()).sensor


# ---- single changes ----


def test_the_worse_filament_is_the_one_of_table_3_2():
    shipped = materials.load("etpu").value("resistivity_ohm_m", "thesis-3.2").value
    assert shipped == pytest.approx(changes.WORSE_ETPU_OHM_M)
    assert changes.worse_filament(setup()).sensor.resistivity_ohm_m == pytest.approx((0.8333, 0.8333), rel=1e-3)
    better = setup(replace(PLATE, resistivity_ohm_m=(2.0, 0.2)))
    assert changes.worse_filament(better).sensor.resistivity_ohm_m == pytest.approx((2.0, 0.8333), rel=1e-3)


def test_the_softer_film_is_that_of_table_4_1():
    x60 = materials.load("x60")
    assert x60.value("youngs_modulus_pa", "thesis-4.1").value == changes.SOFTER_X60_PA
    assert x60.value("youngs_modulus_pa").value / changes.SOFTER_X60_PA == changes.SOFTER_X60
    assert changes.soft_film(setup()).sensor.compression.modulus_pa == pytest.approx(1e6)
    for modulus_pa in (1e6, 5e5):
        soft = setup(replace(PLATE, compression=compression.unconfined(modulus_pa)))
        assert changes.soft_film(soft) == soft
    bonded = changes.soft_film(setup(BONDED)).sensor.compression
    assert bonded.modulus_pa == pytest.approx(compression.bonded(1e6, 0.01, 6e-4).modulus_pa)


def test_changes_of_a_plate():
    """Resistance, capacitance, far end and tip; a solved curve is not scaled, nor a bonded plate's capacitance."""
    ohm, cell = PLATE.resistance_ohm(), setup(cell_sensor())
    assert changes.resistive(setup()).sensor.resistance_ohm() == pytest.approx(5 * ohm)
    assert changes.thin_electrodes(setup()).sensor.resistance_ohm() == pytest.approx(2 * ohm)
    assert changes.thin_film(setup()).sensor.capacitance_f() == pytest.approx(2 * PLATE.capacitance_f())
    assert changes.thin_film(setup(BONDED)) == setup(BONDED)
    assert (changes.soft_film(cell), changes.thin_film(cell)) == (cell, cell)
    assert changes.ended(setup()).sensor.far_end == pytest.approx(9000.0)
    for sensor in (replace(PLATE, far_end="short"), CAPACITOR):
        assert changes.ended(setup(sensor)) == setup(sensor)
    assert changes.tip(2.0)(setup()).sensor.tip_m == pytest.approx(0.02)
    assert changes.tip(2.0)(setup(replace(PLATE, tip_m=0.07))).sensor.tip_m == pytest.approx(0.1)


def test_the_cell_is_the_one_that_a_design_makes():
    """Capacitance within the bounds of the columns, curve the solved one; no tip makes it another cell."""
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}})
    made, cell = sensor_of(design).sensor, cell_sensor()
    assert cell.compression == made.compression
    assert cell.capacitance_f_per_m == pytest.approx(made.capacitance_f_per_m, rel=0.05)
    assert cell.capacitance_f() == pytest.approx(79.8e-12, rel=1e-3)  # solved: 159.65204 pF/m per 2 mm
    for block in (EVEN, STIFF, FLAT.block):
        own = sensor_of(design, block=block).sensor
        assert changes.cell(setup(own)) == setup(own)


def test_tones_stay_within_the_instrument():
    assert changes.higher_frequencies(setup()).frequency_hz == pytest.approx([10 * f for f in TONES_HZ])
    assert changes.higher_frequencies(setup(tones=[2e5])) == setup(tones=[2e5])
    assert max(changes.frequencies_at_corner(setup()).frequency_hz) == pytest.approx(1e6)


# ---- which help ----


def test_the_best_of_each_kind_in_order():
    """All changes tried by hand: the three best kinds by the worse of sigma_F/0.6 N and sigma_x/10 mm."""
    by_kind = {}
    for change in CHANGES:
        found = change.apply(setup()).bounds()
        short = max(float(found.force_n) / 0.6, float(found.position_m) / 0.01)
        by_kind[change.kind] = min(by_kind.get(change.kind, np.inf), short)
    best = sorted(by_kind, key=by_kind.get)[:3]
    tried = helped(setup())
    assert [t.change.kind for t in tried] == best
    assert [t.shortfall for t in tried] == pytest.approx([by_kind[kind] for kind in best], rel=1e-9)


def test_position_asks_for_resistance_where_force_is_known():
    """On the cell, tones and electrodes bring 8.3 mm below 2.5 mm at the same force."""
    found = {t.change.kind: t for t in helped(setup(cell_sensor()))}
    for kind in ("electrodes", "frequencies"):
        assert float(found[kind].bounds.position_m) < 2.5e-3
        assert float(found[kind].bounds.force_n) < 0.2
    assert "film" not in found


def test_what_changes_nothing_is_not_advised():
    """A resistor at the far end lets the current past the film: it makes this short line worse."""
    before = float(required(setup()).shortfall(setup().bounds()))
    ended = changes.ended(setup()).bounds()
    assert float(required(setup()).shortfall(ended)) > before
    assert all(tried.shortfall < before for tried in helped(setup()))


def test_a_change_has_to_help_by_a_twentieth(monkeypatch):
    """Position rules here, and its error is proportional to the noise."""
    for factor, helps in ((0.94, True), (0.96, False), (1.1, False)):
        louder = changes.Remedy("noise", "", "", lambda s, k=factor: replace(s, noise=k * s.noise))
        monkeypatch.setattr(changes, "CHANGES", (louder,))
        assert bool(helped(setup())) is helps


def test_a_change_that_presses_the_film_flat_is_passed_over():
    """60 kPa against 0.1 MPa: half the width, 120 kPa, would close the film."""
    soft = replace(PLATE, compression=compression.unconfined(1e5))
    start = setup(soft)
    assert changes.narrow(start).sensor.stress_pa(6.0, 0.05) > 1e5
    assert "outline" not in {t.change.kind for t in helped(start)}


# ---- at once ----


def test_changes_together_are_all_made():
    tried = helped(setup())
    assert {t.change.kind for t in tried} == {"film", "noise", "frequencies"}
    all_made = setup(cell_sensor(), [10 * f for f in TONES_HZ], noise=1e-4).bounds()
    found = together(setup(), tried)
    assert float(found.force_n) == pytest.approx(float(all_made.force_n))
    assert float(found.position_m) == pytest.approx(float(all_made.position_m))


def test_tones_go_by_the_corner_of_the_changed_sensor():
    by_name = {c.apply: c for c in CHANGES}
    both = (changes.frequencies_at_corner, changes.worse_filament)
    pair = [changes.Tried(by_name[apply], apply(setup()), setup().bounds(), 1.0) for apply in both]
    expected = changes.frequencies_at_corner(changes.worse_filament(setup())).bounds()
    assert float(together(setup(), pair).position_m) == pytest.approx(float(expected.position_m))


def test_together_has_no_answer_where_the_film_closes():
    """120 kPa under half the width, against 0.1 MPa."""
    start = setup(replace(PLATE, compression=compression.unconfined(1e5)))
    narrow = next(c for c in CHANGES if c.apply is changes.narrow)
    assert together(start, [changes.Tried(narrow, start, start.bounds(), 1.0)]) is None
