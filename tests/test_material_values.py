"""Values of the user's own: they go before every source's, everywhere, and are told as such."""

import math

import numpy as np
import pytest
from drawn_sensor import sensor_of

from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.design import materials
from sensorgen.design.design import make
from sensorgen.design.values import permittivities
from sensorgen.prediction import capacitance_answer, compression
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.capacitance_answer import CapacitanceQuestion
from sensorgen.prediction.compression_law import elastic
from sensorgen.prediction.double_layer import stacked
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.rest_state import electrode_resistance, rest_state
from sensorgen.solvers.contact.boundary import BoundaryConditions


def design(values, shape="reference", **rest):
    return make({"shape": shape, "material_values": values} | rest)


def test_a_value_goes_before_every_source():
    x60 = materials.load("x60").with_values({"relative_permittivity": 3.0})
    for source in ("", "thesis-3.2", "thesis-4.1"):
        found = x60.value("relative_permittivity", source)
        assert (found.value, found.source) == (3.0, "set by the user")
    assert x60.value("youngs_modulus_pa").value == 6e6
    assert materials.load("x60").value("relative_permittivity").value == 4.68
    assert x60.sources() == materials.load("x60").sources()


def test_permittivity_scales_a_plate():
    """C = eps0 eps A / d."""
    states = (rest_state(drawn(design(v)), ranges=False) for v in ({}, {"x60": {"relative_permittivity": 2.34}}))
    plain, half = (state.answer.capacitance_f.lower for state in states)
    assert half == pytest.approx(plain / 2, rel=1e-12, abs=0)


def test_the_gap_of_interfaces_lies_in_series_with_a_film():
    """C = eps0 A / (d / eps + g) of plates, also where an electrode sinks in; between both limits in a cell."""
    for g in (10e-6, -7e-6):
        values = {"x60": {"relative_permittivity": 4.68, "interface_gap_m": g}}
        state = rest_state(drawn(design(values)))
        assert state.capacitance.value == pytest.approx(8.8541878128e-12 * 1e-3 / (0.6e-3 / 4.68 + g), rel=1e-9)
        assert [v.value for v in state.values if v.quantity == "interface_gap_m"] == [g]
        body, asked = drawn(design(values)), compression.PressQuestion((0.0, 10.0), BoundaryConditions())
        for alone in (capacitance_answer.answer(body, CapacitanceQuestion()), compression.answer(body, asked)):
            assert "predict takes their gap" in " ".join(alone.doubts)
        cell, perfect = (rest_state(drawn(design(v, "tri"))).capacitance for v in (values, {}))
        ends = sorted(perfect.value / (1 + g * by) for by in (perfect.value / 8.8541878128e-15, 4.68 / 0.2e-3))
        assert cell.material.lower < ends[0] < cell.value < ends[1] < cell.material.upper
        terms = {term.name: term for term in evaluate(drawn(design(values, "tri"))).budget.terms}
        assert terms["interfaces"].changes.capacitance == pytest.approx(
            (ends[1] - ends[0]) / (ends[0] + ends[1]), rel=1e-3
        )


def test_the_source_is_told_and_the_name_of_the_design_is_another():
    own = design({"x60": {"relative_permittivity": 3.0}})
    taken = {(t.material, t.quantity): (t.value, t.source) for t in rest_state(drawn(own), ranges=False).values}
    assert taken["x60", "relative_permittivity"] == (3.0, "set by the user")
    assert taken["air", "relative_permittivity"] == (1.00059, "thesis-3.2")
    assert own.name != design({}).name == "reference"
    assert own.id() != design({}).id()
    other = design({"x60": {"relative_permittivity": 3.1}})
    assert len({own.name, other.name}) == len({own.id(), other.id()}) == 2


def test_resistivity_reaches_both_electrodes():
    body = drawn(design({"etpu": {"resistivity_ohm_m": 0.1}}))
    found = {end: r.value for end, r in electrode_resistance(body).items()}
    assert found == pytest.approx({"top": 0.1 * 0.1 / (3e-4 * 0.01), "bottom": 0.1 * 0.1 / (3e-4 * 0.01)})


def test_stiffness_and_force_go_together():
    """Twice the modulus and twice the force: the same impedance."""
    soft, hard = (sensor_of(design({m: {"youngs_modulus_pa": e} for m in ("x60", "etpu")})).sensor for e in (3e6, 6e6))
    for force in (1.0, 2.5):
        assert soft.impedance(1.1e3, force, 0.05) == pytest.approx(hard.impedance(1.1e3, 2 * force, 0.05), rel=1e-12)
    assert soft.impedance(1.1e3, 1.0, 0.05) != hard.impedance(1.1e3, 1.0, 0.05)


def test_compression_of_cells_gets_them():
    x60 = {"youngs_modulus_pa": 3e6, "poisson_ratio": 0.45, "relative_permittivity": 3.0}
    own = design({"x60": x60, "air": {"relative_permittivity": 2.0}}, "tri")
    solids = elastic(own, own.in_use)
    assert (solids["x60"].youngs_modulus_pa, solids["x60"].poisson_ratio) == (3e6, 0.45)
    assert solids["etpu"].youngs_modulus_pa == 22e6
    assert {t.material: t.value for t in permittivities(own)} == {"x60": 3.0, "air": 2.0}


def test_the_halves_of_a_double_sensor_get_them():
    own = design({"x60": {"relative_permittivity": 3.0}}, "double")
    assert stacked(own).isolation_eps_r == 3.0
    values = {(v.material, v.value) for v in stacked(own).taken if v.quantity == "relative_permittivity"}
    assert {value for material, value in values if material == "x60"} == {3.0}


@pytest.mark.parametrize(
    ("values", "error", "said"),
    [
        ({"x61": {"relative_permittivity": 3.0}}, UnknownName, "unknown material 'x61'; did you mean 'x60'"),
        ({"x60": {"permitivity": 3.0}}, UnknownName, "unknown quantity of x60 'permitivity'"),
        ({"x60": {"relative_permittivity": 1.01e9}}, OutOfRange, "expected 1e-09 to 1e\\+09"),
        ({"x60": {"youngs_modulus_pa": 0.0}}, OutOfRange, "is 0; expected a number above 0"),
        ({"x60": {"youngs_modulus_pa": float("inf")}}, OutOfRange, "is inf"),
        ({"x60": {"poisson_ratio": 0.51}}, OutOfRange, "poisson_ratio of x60 is 0.51; expected -1 to 0.5"),
        ({"x60": {"relative_permittivity": "3"}}, BadInput, "material_values.x60.relative_permittivity is '3'"),
        ({"x60": 3.0}, BadInput, "material_values.x60 is 3.0"),
    ],
)
def test_what_no_material_can_have(values, error, said):
    with pytest.raises(error, match=said):
        design(values)


@pytest.mark.parametrize("value", [1e-9, 1e9])
@pytest.mark.parametrize("shape", ["tri", "rect"])
def test_the_bounds_hold_over_the_whole_range_of_permittivities(shape, value):
    """More permittivity never makes less capacitance, nor less of its bounds."""
    found = rest_state(drawn(design({"x60": {"relative_permittivity": value}}, shape)), math.inf).answer.capacitance_f
    more = rest_state(
        drawn(design({"x60": {"relative_permittivity": min(2 * value, 1e9)}}, shape)), math.inf
    ).answer.capacitance_f
    assert 0 < found.lower <= found.upper < np.inf
    assert found.lower <= more.lower
    assert found.upper <= more.upper


def test_a_later_value_goes_before_the_designs_own():
    own = drawn(design({"x60": {"relative_permittivity": 3.0, "youngs_modulus_pa": 2e6}}))
    later = own.with_values({"x60": {"relative_permittivity": 2.0}}).design
    assert later.material_values == {"x60": {"relative_permittivity": 2.0, "youngs_modulus_pa": 2e6}}
