"""From a design to its sensor: which law of compression is taken, and what is said of it."""

import pytest
from drawn_sensor import sensor_of

from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.design.design import make
from sensorgen.prediction.query import Query


def sensed(shape, law="", **rest):
    return sensor_of(make({"shape": shape} | rest), law)


def test_the_plate_of_table_3_1():
    found = sensed("reference")
    sensor = found.sensor
    assert (sensor.length_m, sensor.width_m) == (0.1, 0.01)
    assert sensor.electrode_m == pytest.approx((3e-4, 3e-4))
    assert sensor.resistivity_ohm_m == (0.042, 0.042)
    assert sensor.capacitance_f() == pytest.approx(69.06266493984e-12, rel=1e-10, abs=0)
    assert sensor.compression.modulus_pa == pytest.approx(11.77 * 6e6, rel=0.04)  # tests/reference/bonded_plates.json
    assert sensed("reference", "unconfined").sensor.compression.modulus_pa == 6e6
    assert ("x60", "youngs_modulus_pa", 6e6) in {(t.material, t.quantity, t.value) for t in found.values}
    assert "bonded" in found.doubts[0]


INCOMPRESSIBLE = {"x60": {"poisson_ratio": 0.5}, "etpu": {"poisson_ratio": 0.5}}


@pytest.mark.parametrize(
    ("shape", "film", "values"), [("tri", 0.1, {}), ("rect", 0.2, {}), ("tri", 0.2, INCOMPRESSIBLE)]
)
def test_solved_cells_answer_for_themselves(shape, film, values):
    found = sensed(shape, parameters={"dielectric_mm": film}, material_values=values)
    assert found.sensor.compression.name == "solved"
    assert found.doubts == ()


FIRM = {"film": "x60@thesis-4.1", "dielectric": "x60@thesis-4.1"}  # another modulus than the solved cell's


@pytest.mark.parametrize(
    ("shape", "rest"),
    [
        ("rect", {"parameters": {"air_width_mm": 0.4}}),
        ("tri", {"materials": FIRM}),
        ("tri", {"material_values": {"etpu": {"poisson_ratio": 0.3}}}),
        ("rect", {"material_values": {"x60": {"relative_permittivity": 6.33}}}),
        ("tri", {"materials": {"film": "ninjaflex"}, "tools": {"ninjaflex": 1}}),
        ("tri", {"parameters": {"electrode_mm": 0.1}}),
    ],
)
def test_other_cells_are_taken_for_free_plates_and_that_is_said(shape, rest):
    found = sensed(shape, **rest)
    assert found.sensor.compression.name == "unconfined"
    assert "was not solved" in found.doubts[0]


def test_what_cannot_be_is_refused():
    with pytest.raises(OutOfRange, match="applies to a solid plate; tri has gaps"):
        sensed("tri", "bonded")
    with pytest.raises(UnknownName, match="law of compression 'bondet'; did you mean 'bonded'"):
        sensed("tri", "bondet")
    with pytest.raises(UnknownName, match="law of compression 'foo'"):  # where nothing is pressed, too
        Query(law="foo")


def test_a_round_tip_on_the_film_and_on_the_cell_as_a_bed():
    """Length of the contact at 6 N over 10 mm: Hertz's with E / (1 - nu^2), a bed's with pressure over displacement."""
    plate, tri = make({"shape": "reference"}), make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}})
    load, radius = 6 / 0.01, 0.05
    thick = sensor_of(plate, "unconfined", profile="hertz", radius_m=radius).sensor
    assert float(thick.contact_m(6.0)[0]) == pytest.approx(4 * (load * radius / (3.14159265 * 8e6)) ** 0.5, rel=1e-3)
    for design, bed in ((plate, 6e6 / 6e-4), (tri, 1e5 / 33.12e-6)):
        found = sensor_of(design, "unconfined" if design is plate else "", profile="parabola", radius_m=radius).sensor
        assert float(found.contact_m(6.0)[0]) == pytest.approx(2 * (1.5 * radius * load / bed) ** (1 / 3), rel=1e-6)
    stiff = sensor_of(plate, "bonded", profile="parabola", radius_m=radius).sensor
    assert stiff.contact_m(6.0)[0] < thick.contact_m(6.0)[0]
    long = sensor_of(tri, tip_m=2e-3, profile="parabola", radius_m=radius).sensor
    assert float(long.contact_m(6.0)[0]) == 2e-3


def test_a_flat_tip_has_no_radius():
    with pytest.raises(BadInput, match="has no radius"):
        sensor_of(make({"shape": "tri"}), radius_m=0.01)
    with pytest.raises(OutOfRange, match="above 0"):
        sensor_of(make({"shape": "tri"}), profile="hertz", radius_m=0.0)


def test_a_cell_that_says_no_displacement_is_no_bed():
    from sensorgen.models import compression

    law = compression.curve("c", "made up", [0, 1e4], [1, 1.1])
    with pytest.raises(MissingValue, match="displacement of the top"):
        law.foundation_stiffness_pa_per_m(1e-3)


def test_a_modulus_that_no_source_gives_holds_a_rigid_plastic():
    """Handbooks have 3.5 GPa for PLA."""
    from sensorgen.design.values import material_value, spread

    design = make({"shape": "tri", "materials": {"film": "pla"}})
    low, high = spread(design, material_value(design.material("pla"), "", "youngs_modulus_pa"))
    assert low < 3.5e9 < high
