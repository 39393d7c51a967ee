"""Resistance of a body's electrodes, drawn and printed: one value in prediction, line model and fit."""

from dataclasses import replace

import pytest

from sensorgen.analysis.comparison import _per_resistivity
from sensorgen.core.errors import OutOfRange
from sensorgen.design.body import Body, Cells
from sensorgen.design.design import make
from sensorgen.models.conduction import electrode_resistance as of_scene
from sensorgen.prediction.bodies import drawn, estimated
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.rest_state import electrode_resistance
from sensorgen.prediction.sensor_model import sensor_model
from sensorgen.scene.scene import Scene, box

PLATE_OHM = {"top": 0.042 / 3e-5, "bottom": 0.042 / 3e-5}  # rho L / (H W)
ACROSS, ALONG = 0.845676971, 1 / (1 + 0.125 / 0.3)


def design(shape="tri", **parameters):
    return make({"shape": shape, "parameters": parameters})


@pytest.mark.parametrize(("along", "share"), [("x", ACROSS), ("y", ALONG)])
def test_a_drawing_has_its_cogs(along, share):
    found = electrode_resistance(drawn(design(along=along)))
    assert found["top"].model.lower <= PLATE_OHM["top"] * share * (1 + 1e-12)
    assert found["top"].model.upper >= PLATE_OHM["top"] * share * (1 - 1e-12)
    assert found["top"].value == pytest.approx(PLATE_OHM["top"] * share, rel=2e-6)
    assert found["bottom"].value == pytest.approx(PLATE_OHM["bottom"], rel=1e-12)
    assert all(r.certified for r in found.values())


@pytest.mark.parametrize("shape", ["tri", "reference"])
def test_line_model_and_prediction_have_the_same_resistance(shape):
    body = drawn(design(shape))
    found = evaluate(body)
    both = sum(r.value for r in found.resistance.values())
    model, _ = sensor_model(body)
    assert model.sensor.resistance_ohm() == pytest.approx(both, rel=1e-12)
    assert found.impedance[0].re.value == pytest.approx(both / 3, rel=1e-3)  # of a line whose far end is open
    assert "cogs included" in " ".join(found.assumptions)


def test_both_electrodes_have_one_common_resistivity():
    """The weighted mean: what one resistivity of both would have to be for the same loop."""
    slots = {"top_electrode": "etpu@thesis-c.1-top", "bottom_electrode": "etpu@thesis-c.1-bottom"}  # 0.07, 0.2 ohm m
    sensor = sensor_model(drawn(make({"shape": "tri", "materials": slots})))[0].sensor
    assert sensor.common_resistivity_ohm_m() == pytest.approx((ACROSS * 0.07 + 0.2) / (ACROSS + 1), rel=1e-5)


@pytest.mark.parametrize(("along", "least", "most"), [("x", 0.82, 0.90), ("y", 0.68, 0.78)])
def test_a_print_is_near_its_drawing(along, least, most):
    """Printed cogs lose their tips, and end in steps."""
    found = electrode_resistance(estimated(design(along=along)))
    assert least < found["top"].print.lower / PLATE_OHM["top"] <= found["top"].print.upper / PLATE_OHM["top"] < most
    assert found["top"].print.upper > PLATE_OHM["top"] * {"x": ACROSS, "y": ALONG}[along]
    assert found["bottom"].value == pytest.approx(PLATE_OHM["bottom"], rel=1e-9)


def test_printed_steps_of_a_tooth_by_hand():
    """Along the steps current is parallel, by their cross-section; across them they carry less."""
    scenes = {along: estimated(design(along=along), "arachne").cells.first() for along in "xy"}
    body = scenes["y"].body("top_electrode_with_cogs")
    area = body.volume_mm3() / scenes["y"].size_mm[0]
    exact = 0.07 * scenes["y"].size_mm[0] / area * 1e3
    assert of_scene(scenes["y"], "top", 0.07).middle() == pytest.approx(exact, rel=1e-12)
    across, plate = (of_scene(scenes["x"], end, 0.07) for end in ("top", "bottom"))
    assert across.width() < 1e-3
    share = area / (0.3 * scenes["y"].size_mm[1])
    assert plate.middle() / share < across.lower < across.upper < plate.middle()


def test_the_fit_divides_by_the_same_geometry():
    for along in "xy":
        body = estimated(design(along=along))
        top, bottom = _per_resistivity(body)
        per = {end: r.value / 0.042 for end, r in electrode_resistance(body).items()}
        assert (top.value, bottom.value) == pytest.approx((per["top"], per["bottom"]), rel=1e-12)
        assert 0.9 * top.value < top.lower <= top.value <= top.upper < bottom.value
        assert (bottom.lower, bottom.upper) == pytest.approx((1 / 3e-5,) * 2, rel=1e-3)


def test_an_electrode_that_is_not_printed_through_is_refused():
    """Planted: without its plate."""
    body = drawn(design(length_mm=10.0))
    scene = body.cells.first()
    top = scene.body("top_electrode_with_cogs")
    teeth = [box(k, k + (0.9 if k < 9 else 1.0), 0, 10, 0.5, 1.0) for k in range(10)]
    cut = replace(top, pieces=tuple(teeth))
    broken = Scene((*(b for b in scene.bodies if b is not top), cut), scene.size_mm)
    cells = Cells({"": broken}, 1.0, 2.0, lambda: {"": 0.2})
    with pytest.raises(OutOfRange, match=r"does not conduct along x: nothing of it lies at x = 0\.95 mm"):
        electrode_resistance(Body(body.design, "drawn", "drawn", "", lambda: cells))
