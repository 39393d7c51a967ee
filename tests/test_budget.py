"""The error budget: each term against what can be said of it without the budget."""

import numpy as np
import pytest
from drawn_sensor import sensor_of
from sensorgen.cli.budget_text import lines

from sensorgen.design.design import make
from sensorgen.models import line
from sensorgen.prediction.error_budget import MODELS, budget

TONES = (1.1e3, 99.7e3)
PLATE = {
    "length_m": 0.1,
    "width_m": 0.01,
    "top_thickness_m": 3e-4,
    "bottom_thickness_m": 3e-4,
    "film_m": 6e-4,
    "eps_r": 4.68,
    "modulus_pa": 6e6,
    "force_n": 6.0,
    "tip_m": 0.01,
    "left_m": 0.045,
    "top_resistivity_ohm_m": 0.07,
    "bottom_resistivity_ohm_m": 0.2,
}


def found(shape, accuracy=float("inf"), force=6.0, tones=TONES, design=None, **how):
    drawn = make({"shape": shape} | (design or {}))
    return budget(drawn, sensor_of(drawn, **how), tones, force, 0.05, accuracy)


def shares(got, name):
    return next(term["shares"] for term in got["terms"] if term["name"] == name)


RESISTIVITIES = ("top_resistivity_ohm_m", "bottom_resistivity_ohm_m")


def z(**changes):
    return line.impedance(line.PressedLine(**PLATE | changes, frequency_hz=np.array(TONES)))


@pytest.mark.parametrize(
    ("term", "ends"),
    [
        ("resistivity", [dict.fromkeys(RESISTIVITIES, rho) for rho in (0.07, 1 / 1.2)]),
        ("stiffness", [{"modulus_pa": 1e6}, {"modulus_pa": 6e6}]),
        ("permittivity of x60", [{"eps_r": 4.68}, {"eps_r": 6.33}]),
        ("compression", [{"modulus_pa": 6e6 * 4 / 3 * (1 + (10 / 1.2) ** 2)}]),
    ],
)  # fmt: skip
def test_terms_of_the_plate_by_hand(term, ends):
    """Straight from the line, with the values of the thesis's tables typed in."""
    got, ref = shares(found("reference"), term), z()
    for measure, part in {"magnitude": np.abs, "re": np.real, "im": np.imag}.items():
        expected = max(abs(part(z(**end)) / part(ref) - 1).max() for end in ends)
        assert got[measure] == pytest.approx(expected, rel=1e-9)

    def slope(**end):
        return line.sensitivities(line.PressedLine(**PLATE | end, frequency_hz=np.array(TONES)), of=["force_n"])[1][
            "force_n"
        ]

    assert got["by_force"] == pytest.approx(max(abs(slope(**e) / slope() - 1).max() for e in ends), rel=1e-9)


def test_a_short_line_is_a_capacitor():
    """At a low tone |Z| ~ 1/C: bounds a factor apart are seen as the root of that factor."""
    drawn = make({"shape": "tri"})
    sensed = sensor_of(drawn)
    bounds = sensed.unloaded.answer.capacitance_f
    got = shares(budget(drawn, sensed, [1.0], 0.0, 0.05), "cell")
    assert got["magnitude"] == pytest.approx((bounds.upper / bounds.lower) ** 0.5 - 1, rel=1e-5)
    assert shares(budget(drawn, sensed, [1.0], 0.0, 0.05), "boundary")["magnitude"] == 0.0  # unpressed


def test_a_solved_cell_is_known_to_its_share_of_the_rise():
    """At a light press dZ/dF is in proportion to the rise: 0.6 %, and 2.8 % where faces stick (film of 0.2 mm).

    Below the first solved stress, 1 N, it is known less well: a contact grows from nothing.
    """
    got = found("tri", force=1.01)
    assert shares(got, "compression")["by_force"] == pytest.approx(0.006, rel=0.15)
    assert shares(found("tri", force=1e-3), "boundary")["by_force"] == pytest.approx(0.028, rel=1e-3)
    assert shares(found("tri", force=0.1), "compression")["by_force"] > 0.03


def test_sections_under_a_round_tip_are_counted():
    """The error that the budget states, against 1024 sections."""
    from dataclasses import replace

    drawn = make({"shape": "tri"})
    sensed = sensor_of(drawn, profile="hertz")
    got = shares(budget(drawn, sensed, TONES, 6.0, 0.05), "line")
    exact = replace(sensed.sensor, pieces=1024).response(np.array(TONES), 6.0, 0.05)
    true = sensed.sensor.response(np.array(TONES), 6.0, 0.05)
    assert got["magnitude"] == pytest.approx(abs(abs(true[0]) / abs(exact[0]) - 1).max(), rel=0.1)
    assert shares(found("tri"), "line")["magnitude"] == 0.0


def test_a_cell_taken_for_a_plate_has_no_bound_and_that_is_the_largest_term():
    got = found("rect", design={"parameters": {"air_width_mm": 0.4}})
    assert shares(got, "compression") is None
    assert set(got["largest"].values()) == {"compression"}
    assert got["total"] == dict.fromkeys(got["total"])
    assert any("unknown" in text for text in lines(got))


def test_a_press_beyond_the_law_at_its_soft_end_is_bounded_from_below():
    """At 1 MPa 60 kPa are what 360 kPa are at 6 MPa: three times the last solved point and more; at 1.2 MPa, 300."""
    got = found("tri")
    term = next(t for t in got["terms"] if t["name"] == "stiffness")
    sensor = sensor_of(make({"shape": "tri"})).sensor
    here, harder = (abs(sensor.impedance(np.array(TONES), force, 0.05)) for force in (6.0, 29.9))
    assert term["shares"]["magnitude"] == pytest.approx(max(1 - harder / here), rel=0.02)
    assert (term["at_least"], got["at_least"]) == (True, True)
    assert "beyond the law" in term["what"]
    assert set(got["largest"].values()) == {"stiffness"}
    row = next(line for line in lines(got) if line.startswith("  stiffness"))
    assert row.count(">") == 4
    assert shares(found("tri", force=3.0), "stiffness")["by_force"] > 0.5


def test_the_users_own_value_is_not_doubted():
    own = {"material_values": {"x60": {"relative_permittivity": 4.68}, "etpu": {"resistivity_ohm_m": 0.1}}}
    names = {t["name"] for t in found("reference", design=own)["terms"]}
    assert not {"permittivity of x60", "resistivity"} & names
    assert "stiffness" in names


def test_the_total_adds_up_and_the_largest_is_the_largest():
    got = found("reference")
    for measure, total in got["total"].items():
        assert total == pytest.approx(sum(t["shares"][measure] for t in got["terms"]))
        assert got["largest"][measure] == max(got["terms"], key=lambda t: t["shares"][measure])["name"]


def test_an_accuracy_is_held_against_the_models_and_against_all():
    assert found("reference")["accuracy"] is None
    said = found("reference", 1e-2)["accuracy"]
    assert (said["met_by_models"], said["met"]) == (True, False)
    assert said["missed_by"] == ["resistivity", "permittivity of x60"]
    assert found("reference", 10.0)["accuracy"]["met"]
    tight = found("reference", 1e-4)["accuracy"]
    assert not tight["met_by_models"]
    assert "compression" in tight["missed_by"]


def test_every_term_is_a_model_or_a_material():
    named = {t["name"] for shape in ("tri", "rect", "reference") for t in found(shape)["terms"]}
    assert named - set(MODELS) == {"resistivity", "stiffness", "permittivity of x60"}


@pytest.mark.parametrize(
    ("accuracy", "said"), [(10.0, "is met"), (1e-2, "met by the models, but not"), (1e-5, "not met")]
)
def test_the_text_says_whether_it_is_met(accuracy, said):
    text = " ".join(" ".join(lines(found("reference", accuracy))).split())
    assert said in text
    assert "largest: resistivity (of the electrodes, 0.07 to 0.833 ohm m) for |Z|, R; " in text


def test_what_no_source_can_mean_does_not_count():
    from sensorgen.design.materials import Value, load
    from sensorgen.prediction.error_budget import _range

    values = [
        Value(value=v, source=s, default=s == "a", implausible=s == "b") for v, s in ((2, "a"), (9, "b"), (3, "c"))
    ]
    made_up = load("x60").model_copy(update={"properties": {"stiffness": values}})
    assert _range(made_up, "", "stiffness") == (2, 3)
    assert _range(made_up, "b", "stiffness") == (2, 9)  # what a design names counts
