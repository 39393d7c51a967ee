"""Predictions: what they rest on, what they refuse, and their numbers against the thesis and coth."""

import cmath
import csv
import io
import json
import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from drawn_sensor import sensor_of
from line_cases import PLATE as LINE_PLATE
from line_cases import exact as exact_line

from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.design.values import spread
from sensorgen.models import line
from sensorgen.prediction import quantities
from sensorgen.prediction.bodies import drawn, estimated
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.loaded import LARGEST, ROWS, ImpedanceGrid, Loaded, csv_blocks, grid
from sensorgen.prediction.query import NOISE, Query
from sensorgen.prediction.rest_state import Lost, rest_state
from sensorgen.prediction.results import from_json, to_json
from sensorgen.prediction.sensor_model import sensor_model

TABLE_3_2 = {"top_electrode": "etpu@thesis-3.2", "bottom_electrode": "etpu@thesis-3.2"}  # 1.2 S/m
TABLE_C_1 = {"top_electrode": "etpu@thesis-c.1-top", "bottom_electrode": "etpu@thesis-c.1-bottom"}  # 0.07, 0.2 ohm m
PLATE_F = 69.06266493984e-12  # eps0 4.68 100 x 10 / 0.6 mm


def close(expected, rel: float):
    """Relative only: pytest's absolute tolerance of 1e-12 is more than many a capacitance."""
    return pytest.approx(expected, rel=rel, abs=0)


def prediction(design, *, body=drawn, **query):
    return evaluate(body(design), Query(**query))


def content(found):
    """All but names and run times."""
    return replace(found, design="", design_id="", plan=None)


def values(found) -> dict[tuple[str, str, str], float]:
    return {(v.material, v.quantity, v.source): v.value for v in found.values}


def test_it_names_every_value_and_its_source():
    found = values(prediction(make({"shape": "tri"})))
    assert {key: value for key, value in found.items() if key[1] != "youngs_modulus_pa"} == {
        ("air", "relative_permittivity", "thesis-3.2"): 1.00059,
        ("x60", "relative_permittivity", "thesis-3.2"): 4.68,
        ("etpu", "resistivity_ohm_m", "thesis-d.1"): 0.042,
    }


def test_the_source_that_a_design_names_is_taken():
    slots = dict.fromkeys(("film", "dielectric"), "x60@thesis-c.1")
    found = prediction(make({"shape": "reference", "materials": slots}))
    assert values(found)["x60", "relative_permittivity", "thesis-c.1"] == 6.33
    assert found.capacitance.model.lower == close(PLATE_F * 6.33 / 4.68, 1e-12)


@pytest.mark.parametrize("end", ["top", "bottom"])
def test_each_electrode_has_its_own_resistivity(end):
    """rho L / (H W): 0.8333 ohm m x 0.1 m / (0.3 mm x 10 mm) = 27.8 kohm; cogs leave 0.845677 of the top's."""
    found = prediction(make({"shape": "tri", "materials": {f"{end}_electrode": "etpu@thesis-3.2"}}))
    expected = {"top": 0.042 / 3e-5, "bottom": 0.042 / 3e-5} | {end: 1 / 1.2 / 3e-5}
    expected["top"] *= 0.845677
    assert {name: r.value for name, r in found.resistance.items()} == pytest.approx(expected, rel=3e-4)
    for name, r in found.resistance.items():
        assert r.model.lower <= expected[name] * (1 + 1e-6)
        assert r.model.upper >= expected[name] * (1 - 1e-6)


def test_a_value_that_no_source_gives_is_a_range_that_is_named():
    """PLA in between: the range holds its permittivity by handbooks, 2.5 to 3.5, and the verdict is conditional."""
    design = make({"shape": "reference", "materials": {"dielectric": "pla"}})
    found = prediction(design)
    value = next(v for v in found.values if (v.material, v.quantity) == ("pla", "relative_permittivity"))
    low, high = spread(design, value)
    assert low <= 2.5
    assert high >= 3.5
    assert any(a.startswith("relative_permittivity of pla") and "no source gives it" in a for a in found.assumptions)
    assert found.conditional
    assert found.identifiability.senses_force is None
    assert "no source gives" in found.identifiability.assumed
    assert not replace(found, values=()).conditional


def test_a_short_has_a_reason_in_place_of_numbers():
    found = prediction(make({"shape": "rect", "parameters": {"dielectric_mm": 0.0}}))
    assert (found.capacitance, found.status, found.gap.value) == (None, "short", 0.0)
    assert "the electrodes touch" in found.reason


def test_support_is_dissolved_before_use():
    """So it counts as air, and its own permittivity is never asked for."""
    bare, filled = (prediction(make({"shape": "tri", "materials": m})) for m in ({}, {"support": "pla"}))
    assert content(filled) == content(bare)


@pytest.mark.parametrize("change", [{"orientation": "upside-down"}, {"shrinkage": 0.2}])
def test_how_it_is_printed_does_not_change_what_it_is(change):
    found, plain = (prediction(make({"shape": "tri"} | more)) for more in (change, {}))
    assert content(found) == content(plain)


# Models-line.md: 41.5 kHz at 1.2 S/m. Errata (2.24): 256 kHz with Table C.1's resistivities, 0.07 + 0.2 ohm m.
@pytest.mark.parametrize(("slots", "corner_khz"), [(TABLE_3_2, 41.5), (TABLE_C_1, 256.0)])
def test_corner_frequencies_of_the_plate(slots, corner_khz):
    corner = prediction(make({"shape": "reference", "materials": slots})).corner_frequency
    assert corner.value / 1e3 == pytest.approx(corner_khz, rel=2e-3)
    assert corner.model.lower == close(corner.model.upper, 1e-12)


@pytest.mark.usefixtures("at_rest")
def test_capacitances_of_the_thesis_sensors():
    """100 x 10 mm: tri 79.8, rect 203, plate 69.1 pF (models-cells.md); the first two lie within their bounds."""
    for shape, film, exact in (("tri", 0.1, 79.8e-12), ("rect", 0.1, 203e-12), ("reference", 0.6, PLATE_F)):
        found = prediction(make({"shape": shape, "parameters": {"dielectric_mm": film}}))
        bounds = found.capacitance
        assert bounds.model.lower * (1 - 1e-9) <= exact * (1 + 2e-3)
        assert exact * (1 - 2e-3) <= bounds.model.upper * (1 + 1e-9)
        assert bounds.value == close(bounds.model.middle(), 1e-12)
        assert bounds.lower <= bounds.model.lower < bounds.upper


def test_impedance_at_the_tones_is_coth():
    tones = (1e3, 1e6)
    found = prediction(make({"shape": "reference"}), frequency_hz=tones)
    assert tuple(row.frequency_hz for row in found.impedance) == tones
    resistance = 2 * 0.042 / 3e-5
    for row in found.impedance:
        y = 2j * math.pi * row.frequency_hz * PLATE_F
        z = cmath.sqrt(resistance / y) / cmath.tanh(cmath.sqrt(resistance * y))
        assert row.re.value == close(z.real, 1e-9)
        assert row.im.value == close(z.imag, 1e-11)


def test_the_range_of_a_response_has_the_ways_to_print_at_its_ends(monkeypatch, shared_cache):
    """At rest: how each is pressed, which takes seconds, is looked at by night."""
    design, query = make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}}), Query(law="unconfined", force_n=5.0)
    model = sensor_model(estimated(design), query)[0]
    monkeypatch.setattr(quantities, "at_a_few_pressures", lambda *_, **__: model.law)
    found = [s.capacitance_f() for s in quantities._printed_otherwise(model, query.load(design), query)]
    bodies = [estimated(design, walls) for walls in ("arachne", "classic", "cura", "cura-gaps")]
    each = [rest_state(body, ranges=False).capacitance.value for body in bodies]
    ends = {min(each), max(each)} - {each[0]}
    assert sorted(found) == pytest.approx(sorted(ends), rel=2e-2, abs=0)
    assert ends


@pytest.mark.nightly
def test_ranges_hold_what_each_way_to_print_gives_by_itself():
    """Walls alone decide whether the tips of the triangles are printed, and with them most of the sensitivity."""
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})
    found = prediction(design, body=estimated)
    alone = [prediction(design, body=lambda d, walls=walls: estimated(d, walls)) for walls in ("classic", "cura-gaps")]
    for name in ("capacitance", "sensitivity", "force_resolution", "position_resolution"):
        bounds, values = getattr(found, name), [getattr(one, name).value for one in alone]
        assert all(bounds.lower <= value <= bounds.upper for value in values), name
        assert bounds.print.lower <= 1.1 * min(values), name
        assert bounds.print.upper >= max(values) / 1.1, name
    assert max(one.sensitivity.value for one in alone) > 20 * found.sensitivity.value
    budget = {term.name: term for term in found.budget.terms}
    assert budget["slicer's walls"].changes.magnitude > 0.6  # 0.57 by the capacitance alone


def test_a_cell_that_was_not_solved_has_no_known_error():
    found = prediction(make({"shape": "rect", "parameters": {"dielectric_mm": 0.1}}), body=estimated)
    assert (found.sensitivity.lower, found.sensitivity.upper) == (0, math.inf)
    assert found.force_resolution.upper == math.inf


def test_predictions_of_schema_2_are_read():
    """Their resolutions were numbers without a range."""
    new = prediction(make({"shape": "reference"}), body=estimated)
    data = json.loads(to_json(new))
    for one in (data, data["drawn"]):
        one["schema"] = 2
        for name, unit in (("force_resolution", "n"), ("position_resolution", "m")):
            one[f"{name}_{unit}"] = one.pop(name)["value"]
    old = from_json(json.dumps(data))
    assert (old.schema, old.drawn.schema, old.capacitance) == (new.schema, new.schema, new.capacitance)
    assert old.force_resolution.value == new.force_resolution.value
    assert old.drawn.position_resolution.unit == "m"


@pytest.fixture(scope="module")
def plate():
    """The plate of Table 3.1 with the electrodes of Table C.1, free to expand (B.49), and its design."""
    design = make({"shape": "reference", "materials": TABLE_C_1})
    return design, sensor_of(design, "unconfined")


def exact(f, force, x_mm):
    """B.53 and B.49 with 40 digits, the tip of 10 mm wholly on the sensor."""
    return complex(exact_line(40, **LINE_PLATE | {"force_n": force, "left_m": x_mm / 1e3 - 5e-3, "frequency_hz": f}))


def test_the_grid_is_the_line_with_forty_digits(plate):
    """Re Z by itself: it is a thousandth of |Z| and holds what tells of position."""
    tones, forces, at = (1.1e3, 99.7e3), (0.0, 3.0, 6.0), (7.0, 50.0, 95.0)
    z = grid(plate[1].sensor, tones, forces, np.array(at) * 1e-3)
    assert z.shape == (2, 3, 3)
    for k, f in enumerate(tones):
        for j, force in enumerate(forces):
            for i, x in enumerate(at):
                assert z[k, j, i].real == close(exact(f, force, x).real, 1e-10)
                assert z[k, j, i].imag == close(exact(f, force, x).imag, 1e-12)


def test_at_the_ends_the_tip_overhangs_and_presses_on_what_is_left(plate):
    z = grid(plate[1].sensor, [99.7e3], [3.0], [0.0, 0.1])[0, 0]
    for value, left in zip(z, (0.0, 0.095), strict=True):
        alone = line.impedance(line.PressedLine(**LINE_PLATE | {"tip_m": 0.005, "left_m": left}))
        assert (value.real, value.imag) == (close(alone.real, 1e-12), close(alone.imag, 1e-12))


@pytest.mark.parametrize(
    ("forces", "at_mm", "said"),
    [
        ([1.0, 299.0, 300.0, 400.0], [0.0, 50.0], "force 300 N at position 0 mm: the stress thins the film by 1: at 1 "
         r"its electrodes touch \(Eq. B.49\); expected up to 299 N there, or a longer tip"),
        ([299.9, 600.0], [50.0], "force 600 N at position 50 mm: .* expected up to 299.9 N there, or a longer tip"),
        ([700.0], [100.0], "force 700 N at position 100 mm: .* electrodes touch .*; expected less, or a longer tip"),
        ([1.0], [50.0, 100.001], "position 100.001 mm is outside the sensor; expected 0 to 100 mm"),
    ],
)  # fmt: skip
def test_presses_without_an_answer(plate, forces, at_mm, said):
    """Half the tip carries at the ends: 0.01 x 0.005 m2 x 6 MPa = 300 N."""
    with pytest.raises(OutOfRange, match=said):
        grid(plate[1].sensor, [1e3], forces, np.array(at_mm) * 1e-3)
    with pytest.raises(OutOfRange, match=said):
        next(csv_blocks(plate[1].sensor, [1e3], forces, at_mm))


def test_a_force_beyond_a_solved_curve_is_named_once():
    """Three times 100 kPa on 10 x 10 mm2 are 30 N."""
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}})
    with pytest.raises(OutOfRange, match="force 31 N at position 50 mm") as caught:
        grid(sensor_of(design).sensor, [1e3], [29.0, 31.0, 33.0], [0.05])
    assert str(caught.value).endswith("; expected up to 29 N there, or a longer tip")
    assert str(caught.value).count("press") == 0


def test_too_many_impedances_for_the_memory(plate):
    said = f"1 x 1415 x 1414 frequencies, forces and positions; expected at most {LARGEST} impedances at once"
    with pytest.raises(OutOfRange, match=said):
        _ = Loaded(None, plate[1], ([1e3], range(1415), np.linspace(0, 100, 1414)), NOISE).impedance


def test_moves_are_counted_in_deviations_of_a_reading():
    """By hand: |Z| = 5 ohm at most, so a reading's deviation is 5 milliohm."""
    re = [[[3.0, 3.0, 3.0], [3.0, 3.01, 2.99]]]
    im = [[[-4.0, -4.0, -4.0], [-3.9, -3.98, -3.9]]]
    z = ImpedanceGrid((1e3,), (0.0, 1.0), (0.0, 1.0, 2.0), np.array(re) + 1j * np.array(im))
    (found,) = z.changes(NOISE)
    assert found == pytest.approx((2.0, 4.0, 4.0, 16.0), rel=1e-3)
    (louder,) = z.changes(1e-2)
    assert louder[0] == pytest.approx(found[0] / 10)
    assert NOISE == 1e-3


@pytest.mark.parametrize("count", [ROWS, ROWS + 1])
def test_csv_loses_no_row_between_blocks(plate, count):
    at = np.linspace(5, 95, count)
    _, *blocks = csv_blocks(plate[1].sensor, [1e3], [1.0, 2.0], at)
    whole, left = divmod(2 * count, ROWS)
    assert [text.count("\n") for text in blocks] == [ROWS] * whole + [left] * bool(left)
    rows = np.array(list(csv.reader(io.StringIO("".join(blocks)))), float)
    assert np.array_equal(rows[:, 1], np.tile(at, 2))
    assert np.array_equal(rows[:, 0], np.repeat([1.0, 2.0], count))
    assert rows[count, 2] == close(exact(1e3, 2, 5).real, 1e-10)


def test_csv_of_many_rows_needs_no_more_memory(plate):
    """A block of rows is what is held, however many there are."""
    peaks = []
    for forces in (10, 20):
        blocks = csv_blocks(plate[1].sensor, [1e3], np.linspace(0, 6, forces), np.linspace(0, 100, 1000))
        tracemalloc.start()
        rows = sum(text.count("\n") for text in blocks)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert rows == 20_001
    assert peaks[1] < 1.1 * peaks[0] < 10e6


LOSSES = {"x60": {"loss_tangent": 0.02, "resistivity_ohm_m": 1e9}}
LOSSY = {"shape": "reference", "materials": TABLE_C_1, "material_values": LOSSES}
AREA_M2, FILM_M = 1e-3, 6e-4


def test_losses_reach_the_line():
    """Of a plate: y = (tan delta + j) omega C + A / (rho d), by transfer matrices in 60 digits."""
    found = prediction(make(LOSSY))
    for row in found.impedance:
        lossy = {"tan_delta": 0.02, "force_n": 0, "leak_s_per_m": 0.01 / (1e9 * FILM_M)}
        z = exact_line(60, **LINE_PLATE | lossy | {"frequency_hz": row.frequency_hz})
        assert row.re.value == pytest.approx(float(z.real), rel=1e-6)
        assert row.im.value == pytest.approx(float(z.imag), rel=1e-6)
    assert "dielectric losses: loss_tangent of x60 and resistivity_ohm_m of x60 as given" in found.assumptions
    sensor = sensor_of(make(LOSSY)).sensor
    assert sensor.tan_delta == pytest.approx(0.02, rel=1e-6)
    assert sensor.leak_s_per_m == pytest.approx(0.01 / (1e9 * FILM_M), rel=1e-6, abs=0)


def test_without_losses_nothing_is_asked():
    assert sensor_of(make({"shape": "reference"})).lost == Lost()


def test_a_strong_leak_is_doubted():
    strong = make({"shape": "reference", "material_values": {"x60": {"resistivity_ohm_m": 1e7}}})
    (said,) = [a for a in prediction(strong).doubts if "depends on the frequency" in a]
    assert said.startswith("x60 leaks 0.35 of what it stores at 1.1 kHz")
    weak = make({"shape": "reference", "material_values": {"x60": {"resistivity_ohm_m": 1e8}}})
    assert not any("depends on the frequency" in a for a in prediction(weak).doubts)
