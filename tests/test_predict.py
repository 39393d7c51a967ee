"""Predictions: what they rest on, what they refuse, and their numbers against the thesis and coth."""

import cmath
import math

import pytest

from sensorgen import materials, planner
from sensorgen.design import make
from sensorgen.errors import MissingValue
from sensorgen.interval import Interval
from sensorgen.planner import Unpredictable, capacitance
from sensorgen.predict import TONES_HZ, prediction

EPS = {"x60": 4.68, "air": 1.00059}
TABLE_3_2 = {"top_electrode": "etpu@thesis-3.2", "bottom_electrode": "etpu@thesis-3.2"}  # 1.2 S/m
PLATE_F = 69.06266493984e-12  # eps0 4.68 100 x 10 / 0.6 mm


def close(expected, rel: float):
    """Relative only: pytest's absolute tolerance of 1e-12 is more than many a capacitance."""
    return pytest.approx(expected, rel=rel, abs=0)


def values(found) -> dict[tuple[str, str, str], float]:
    return {(v["material"], v["quantity"], v["source"]): v["value"] for v in found["values"]}


def test_it_names_every_value_and_its_source():
    assert values(prediction(make({"shape": "tri"}))) == {
        ("air", "relative_permittivity", "thesis-3.2"): 1.00059,
        ("x60", "relative_permittivity", "thesis-3.2"): 4.68,
        ("etpu", "resistivity_ohm_m", "thesis-c.1-top"): 0.07,
        ("etpu", "resistivity_ohm_m", "thesis-c.1-bottom"): 0.2,
    }


@pytest.mark.parametrize(("source", "eps"), [("thesis-4.1", 4.79), ("thesis-c.1", 6.33), ("thesis-4.2.3", 5.0)])
def test_the_source_that_a_design_names_is_taken(source, eps):
    slots = dict.fromkeys(("film", "dielectric"), f"x60@{source}")
    found = prediction(make({"shape": "reference", "materials": slots}))
    assert values(found)["x60", "relative_permittivity", source] == eps
    assert found["capacitance_f"]["lower"] == close(PLATE_F * eps / 4.68, 1e-12)


@pytest.mark.parametrize("end", ["top", "bottom"])
def test_each_electrode_has_its_own_resistivity(end):
    """rho L / (H W): 0.8333 ohm m x 0.1 m / (0.3 mm x 10 mm) = 27.8 kohm."""
    found = prediction(make({"shape": "tri", "materials": {f"{end}_electrode": "etpu@thesis-3.2"}}))
    expected = {"top": 0.07 / 3e-5, "bottom": 0.2 / 3e-5} | {end: 1 / 1.2 / 3e-5}
    assert found["electrode_resistance_ohm"] == close(expected, 1e-12)


def test_the_conductivity_printed_for_x60_is_kept_but_never_a_default():
    """Table 3.2's 1.3 S/m would make the dielectric the better conductor (errata)."""
    x60 = materials.load("x60")
    assert x60.value("resistivity_ohm_m", "thesis-3.2").implausible
    assert 1 / x60.value("resistivity_ohm_m", "thesis-3.2").value == pytest.approx(1.3)
    with pytest.raises(MissingValue, match="no default resistivity_ohm_m"):
        x60.value("resistivity_ohm_m")
    for source in sorted(x60.sources() - {"thesis-3.2"}):
        with pytest.raises(MissingValue):
            x60.value("resistivity_ohm_m", source)


def test_a_value_that_no_source_gives_is_missing():
    """PLA as a film: nobody states its permittivity, and it is not taken for 0 or 1."""
    found = prediction(make({"shape": "tri", "materials": {"film": "pla"}}))
    assert found["capacitance_f"] is None
    assert "pla has no default relative_permittivity" in found["reason"]


@pytest.mark.parametrize("shape", ["tri", "rect", "reference"])
def test_a_short_has_a_reason_in_place_of_numbers(shape):
    found = prediction(make({"shape": shape, "parameters": {"dielectric_mm": 0.0}}))
    assert found["capacitance_f"] is None
    assert "the electrodes touch" in found["reason"]
    assert set(found) == {"capacitance_f", "reason"}


@pytest.mark.parametrize("shape", ["tri", "rect"])
@pytest.mark.parametrize("support", ["bvoh", "pla"])
def test_support_is_dissolved_before_use(shape, support):
    """So it counts as air, and its own permittivity is never asked for."""
    bare, filled = (prediction(make({"shape": shape, "materials": m})) for m in ({}, {"support": support}))
    assert filled == bare


@pytest.mark.parametrize("change", [{"orientation": "upside-down"}, {"shrinkage": 0.2}])
def test_how_it_is_printed_does_not_change_what_it_is(change):
    assert prediction(make({"shape": "tri"} | change)) == prediction(make({"shape": "tri"}))


# Models-line.md: 41.5 kHz at 1.2 S/m. Errata (2.24): 256 kHz with Table C.1's resistivities.
@pytest.mark.parametrize(("slots", "corner_khz"), [(TABLE_3_2, 41.5), ({}, 256.0)])
def test_corner_frequencies_of_the_plate(slots, corner_khz):
    corner = prediction(make({"shape": "reference", "materials": slots}))["corner_frequency_hz"]
    assert corner["middle"] / 1e3 == pytest.approx(corner_khz, rel=2e-3)
    assert corner["lower"] == close(corner["upper"], 1e-12)


def test_capacitances_of_the_thesis_sensors():
    """100 x 10 mm: tri 79.8, rect 203, plate 69.1 pF (models-cells.md); the first two lie within their bounds."""
    for shape, film, exact in (("tri", 0.1, 79.8e-12), ("rect", 0.1, 203e-12), ("reference", 0.6, PLATE_F)):
        found = prediction(make({"shape": shape, "parameters": {"dielectric_mm": film}}))
        bounds = found["capacitance_f"]
        assert bounds["lower"] * (1 - 1e-12) <= exact <= bounds["upper"] * (1 + 1e-12)
        assert bounds["middle"] ** 2 == close(bounds["lower"] * bounds["upper"], 1e-12)
        per_area = found["capacitance_per_area_f_per_m2"]
        assert per_area == close({k: v / (0.1 * 0.01) for k, v in bounds.items()}, 1e-12)


def test_impedance_at_the_tones_is_coth():
    found = prediction(make({"shape": "reference"}))
    assert [row["frequency_hz"] for row in found["impedance_ohm"]] == list(TONES_HZ)
    resistance = sum(found["electrode_resistance_ohm"].values())
    for row in found["impedance_ohm"]:
        y = 2j * math.pi * row["frequency_hz"] * PLATE_F
        z = cmath.sqrt(resistance / y) / cmath.tanh(cmath.sqrt(resistance * y))
        assert row["re"] == close(z.real, 1e-9)
        assert row["im"] == close(z.imag, 1e-12)


def test_the_ranges_of_the_impedance_hold_its_middle():
    for row in prediction(make({"shape": "tri"}))["impedance_ohm"]:
        for part in ("re", "im"):
            low, high = row[f"{part}_range"]
            assert low < row[part] < high


def test_the_tones_are_those_of_table_5_1_with_its_slip_corrected():
    """Errata: 4990 stands for 49900."""
    assert TONES_HZ == (1100.0, 2300.0, 5300.0, 10100.0, 19900.0, 49900.0, 99700.0)


class Model:
    """A capacitance model that answers, or refuses."""

    def __init__(self, cost: int, lower: float, upper: float, reason: str = "") -> None:
        self.COST, self.reason, self.asked = cost, reason, 0
        self.bounds = Interval(lower, upper)

    def unfit(self, scene):
        return self.reason or None

    def capacitance(self, scene, permittivity):
        self.asked += 1
        return self.bounds


@pytest.fixture
def ladder(monkeypatch):
    """A function that puts models, cheapest first, in the place of the registered ones."""

    def put(*found: Model) -> None:
        monkeypatch.setattr(planner, "_capacitance_models", lambda: [(f"m{k}", m) for k, m in enumerate(found)])

    return put


def test_the_cheapest_model_that_is_narrow_enough_answers(ladder):
    rough, good, best = Model(0, 1.0, 2.0), Model(1, 1.4, 1.5), Model(2, 1.44, 1.45)
    ladder(rough, good, best)
    assert capacitance(make({"shape": "tri"}).drawn, EPS, width=0.1).model == "m1"
    assert (rough.asked, good.asked, best.asked) == (1, 1, 0)


def test_the_narrowest_answers_where_none_is_narrow_enough(ladder):
    ladder(Model(0, 1.0, 2.0), Model(1, 1.4, 1.5), Model(2, 1.0, 3.0))
    assert capacitance(make({"shape": "tri"}).drawn, EPS, width=1e-6).model == "m1"


def test_refusals_are_passed_on(ladder):
    ladder(Model(0, 1.0, 2.0, reason="too slanted"), Model(1, 1.4, 1.5))
    answer = capacitance(make({"shape": "tri"}).drawn, EPS)
    assert (answer.model, answer.refused) == ("m1", ("m0: too slanted",))


def test_when_all_refuse_their_reasons_are_told(ladder):
    ladder(Model(0, 1.0, 2.0, reason="too slanted"), Model(1, 1.4, 1.5, reason="too tall"))
    with pytest.raises(Unpredictable, match="m0: too slanted; m1: too tall"):
        capacitance(make({"shape": "tri"}).drawn, EPS)
