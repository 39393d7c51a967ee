"""The error budget: each term against what can be said of it without the budget."""

from dataclasses import replace
from functools import cache
from math import exp
from types import SimpleNamespace

import numpy as np
import pytest
from drawn_sensor import sensor_of
from line_cases import PLATE as LINE_PLATE

from sensorgen.core.document import text
from sensorgen.design.design import make
from sensorgen.design.materials import Value, load
from sensorgen.design.values import material_value, spread
from sensorgen.models import line, sandwich
from sensorgen.prediction.bodies import estimated
from sensorgen.prediction.error_budget import error_budget
from sensorgen.prediction.query import Load
from sensorgen.prediction.sensor_model import build_sensor

TONES = (1.1e3, 99.7e3)
RESISTIVITIES = ("top_resistivity_ohm_m", "bottom_resistivity_ohm_m")
PLATE = LINE_PLATE | dict.fromkeys(RESISTIVITIES, 0.042) | {"force_n": 6.0, "frequency_hz": np.array(TONES)}


def budget(model, tones=TONES, force=6.0, accuracy=None):
    return error_budget(model, Load(tuple(tones), force, 0.05), accuracy)


@cache
def usual(shape):
    """The sensor of a shape as it is."""
    return sensor_of(make({"shape": shape}))


def found(shape, accuracy=None, force=6.0, tones=TONES, design=None, **how):
    model = sensor_of(make({"shape": shape} | (design or {})), **how) if design or how else usual(shape)
    return budget(model, tones, force, accuracy)


def lines(got):
    return list(text(got.document()))


def shares(got, name):
    return next(term.changes for term in got.terms if term.name == name)


def z(**changes):
    return line.impedance(line.PressedLine(**PLATE | changes))


@pytest.mark.parametrize(
    ("term", "ends"),
    [
        ("resistivity", [dict.fromkeys(RESISTIVITIES, rho) for rho in (0.02, 0.088)]),
        ("stiffness", [{"modulus_pa": 1e6}, {"modulus_pa": 6e6 * exp(1.96 * 0.25)}]),
        ("permittivity of x60", [{"eps_r": 4.68}, {"eps_r": 6.33}]),
        ("compression", [{"modulus_pa": sandwich.modulus_pa(
            6e6, 0.01, 6e-4, 6e6 / (3 * (1 - 2 * 0.4999)), electrode_pa=(22e6, 22e6), electrode_m=(3e-4, 3e-4)
        )}]),
    ],
)  # fmt: skip
def test_terms_of_the_plate_by_hand(term, ends):
    """Straight from the line, with the values of the thesis's tables and of its prints typed in; a free plate."""
    got, ref = shares(found("reference", law="unconfined"), term), z()
    for measure, part in {"magnitude": np.abs, "re": np.real, "im": np.imag}.items():
        expected = max(abs(part(z(**end)) / part(ref) - 1).max() for end in ends)
        assert getattr(got, measure) == pytest.approx(expected, rel=1e-9)

    def slope(**end):
        return line.sensitivities(line.PressedLine(**PLATE | end), of=["force_n"])[1]["force_n"]

    assert got.by_force == pytest.approx(max(abs(slope(**e) / slope() - 1).max() for e in ends), rel=1e-9)


def test_a_short_line_is_a_capacitor():
    """At a low tone |Z| ~ 1/C: bounds a factor apart are seen as the root of that factor."""
    drawn = make({"shape": "tri"})
    sensed = sensor_of(drawn)
    bounds = sensed.rest.answer.capacitance_f
    got = shares(budget(sensed, [1.0], 0.0), "cell")
    assert got.magnitude == pytest.approx((bounds.upper / bounds.lower) ** 0.5 - 1, rel=1e-5)
    assert shares(budget(sensed, [1.0], 0.0), "boundary").magnitude == 0.0  # unpressed


def test_a_solved_cell_is_known_to_its_share_of_the_rise():
    """At a light press dZ/dF is in proportion to the rise: 0.6 % of the mesh under the block (film of 0.2 mm).

    It is 2.8 % where faces stick.

    Below the first solved stress, 1 N, it is known less well: a contact grows from nothing.
    """
    got = found("tri", force=1.01)
    assert shares(got, "compression").by_force == pytest.approx(0.006, rel=0.15)
    assert shares(found("tri", force=1e-3), "boundary").by_force == pytest.approx(0.028, rel=1e-2)
    assert shares(found("tri", force=0.1), "compression").by_force > 0.03


def test_sections_under_a_round_tip_are_counted():
    """The error that the budget states, against 1024 sections."""
    drawn = make({"shape": "tri"})
    sensed = sensor_of(drawn, profile="hertz")
    got = shares(budget(sensed), "line")
    exact = replace(sensed.sensor, pieces=1024).response(np.array(TONES), 6.0, 0.05)
    true = sensed.sensor.response(np.array(TONES), 6.0, 0.05)
    assert got.magnitude == pytest.approx(abs(abs(true[0]) / abs(exact[0]) - 1).max(), rel=0.1)
    assert shares(found("tri"), "line").magnitude == 0.0


def test_a_cell_taken_for_a_plate_has_no_bound_and_that_is_the_largest_term():
    got = found("rect", design={"parameters": {"air_width_mm": 0.4}})
    assert shares(got, "compression") is None
    assert got.largest().name == "compression"
    assert got.total is None
    assert any("unknown" in row for row in lines(got))


def test_a_press_beyond_the_law_at_its_soft_end_is_bounded_from_below():
    """At 1 MPa 60 kPa are what 360 kPa are at 6 MPa: three times the last solved point and more; at 1.2 MPa, 300."""
    got = found("tri")
    term = next(t for t in got.terms if t.name == "stiffness")
    sensor = sensor_of(make({"shape": "tri"})).sensor
    here, harder = (abs(sensor.impedance(np.array(TONES), force, 0.05)) for force in (6.0, 29.9))
    assert term.changes.magnitude == pytest.approx(max(1 - harder / here), rel=0.02)
    assert (term.at_least, got.at_least) == (True, True)
    assert "exceeds the compression law" in term.what
    assert got.largest().name == "stiffness"
    assert next(line for line in lines(got) if line.startswith("stiffness")).endswith("  at least")
    assert term.turns == "cannot sense force"
    assert shares(found("tri", force=3.0), "stiffness").by_force > 0.5


def test_the_users_own_value_differs_from_print_to_print_alone():
    """By 10 % of ln of the excess over vacuum, and by a factor of 1.65; other sources do not count."""
    own = {"material_values": {"x60": {"relative_permittivity": 4.68}, "etpu": {"resistivity_ohm_m": 0.1}}}
    terms = {t.name: t.what for t in found("reference", design=own).terms}
    assert terms["permittivity of x60"] == f"{1 + 3.68 / exp(0.196):.3g} to {1 + 3.68 * exp(0.196):.3g}"
    assert terms["resistivity"] == f"of the electrodes, {0.1 / exp(0.98):.3g} to {0.1 * exp(0.98):.3g} ohm m"


def test_leads_and_contacts_are_terms_of_their_own():
    """In series and in parallel with the plate: ohms and farads by hand."""
    leads = {"capacitance_pf": 3, "resistance_ohm": 100}
    terms = {t.name: t for t in found("reference", design={"leads": leads}).terms}
    sensor = sensor_of(make({"shape": "reference"})).sensor
    omega, alone = 2 * np.pi * np.array(TONES), sensor.impedance(np.array(TONES), 6.0, 0.05)

    def at(farad, ohm):
        return ohm + 1 / (1 / alone + 1j * omega * farad)

    usual = at(3e-12, 100)
    changed = {"lead capacitance": [(3.3e-12, 100)], "contact resistance": [(3e-12, 110), (3e-12, 100 / 1.1)]}
    for name, ends in changed.items():
        by_hand = max(abs(abs(at(*end)) / abs(usual) - 1).max() for end in ends)
        share = terms[name].changes.magnitude
        assert share >= by_hand * (1 - 1e-6)
        assert share == pytest.approx(by_hand, rel=1e-6) or name == "lead capacitance"
        assert terms[name].kind == "leads"


def test_the_total_adds_up_and_the_largest_is_the_largest():
    got = found("reference")
    for measure in ("magnitude", "re", "im", "by_force"):
        assert getattr(got.total, measure) == pytest.approx(sum(getattr(t.changes, measure) for t in got.terms))
    assert got.largest().changes.magnitude == max(t.changes.magnitude for t in got.terms)


def test_ways_to_print_it_are_a_term_of_a_print():
    model = build_sensor(estimated(make({"shape": "tri"})), "unconfined")
    width, film, layer, *_ = [t for t in budget(model).terms if t.kind == "print"]
    rest = model.rest
    c = rest.capacitance
    assert (width.name, film.name, layer.name) == ("slicer's walls", "film thickness", "film a layer thinner")
    assert width.changes.magnitude == pytest.approx(c.value / rest.by_width.lower - 1, rel=0.02)  # |Z| of a capacitor
    assert film.changes.magnitude == pytest.approx(1 - c.value / rest.by_film.upper, rel=0.02)
    assert c.print.upper == pytest.approx(rest.by_width.upper * rest.by_film.upper / c.value, rel=1e-12)


@pytest.mark.parametrize(
    ("accuracy", "said"),
    [
        (10.0, "accuracy 10 of |Z| reached"),
        (1e-2, "reached by the models, not by print, material and leads; larger alone: permittivity of x60"),
        (1e-5, "not reached by the models"),
    ],
)
def test_the_text_says_whether_an_accuracy_is_reached(accuracy, said):
    assert said in " ".join(" ".join(lines(found("reference", accuracy))).split())
    assert "accuracy" not in " ".join(lines(found("reference")))


def test_the_text_names_the_largest_term():
    said = " ".join(" ".join(lines(found("reference"))).split())
    assert f"largest: permittivity of x60 ({1 + 3.68 / exp(0.196):.3g} to 6.33)" in said


def test_what_no_source_can_mean_does_not_count():
    told = {"a": 2, "b": 9, "c": 3}
    values = [Value(value=v, source=s, default=s == "a", implausible=s == "b") for s, v in told.items()]
    made_up = load("x60").model_copy(update={"properties": {"stiffness": values}})
    design = SimpleNamespace(material=lambda name: made_up)
    assert spread(design, material_value(made_up, "", "stiffness")) == (2, 3)
    assert spread(design, material_value(made_up, "b", "stiffness")) == (2, 9)  # what a design names counts
