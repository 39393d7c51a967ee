"""Materials: every value has a source, one of them is the default, and none is made up."""

import math

import pytest

from sensorgen.core.errors import MissingValue
from sensorgen.design import materials

ALL = [
    (name, quantity, values)
    for name in materials.names()
    for group in (materials.load(name).properties, materials.load(name).print)
    for quantity, values in group.items()
]


def test_one_default_at_most_and_never_an_implausible_one():
    known = materials.citations()
    for name, quantity, values in ALL:
        defaults = [v for v in values if v.default]
        assert len(defaults) <= 1, (name, quantity)
        assert not any(v.implausible for v in defaults), (name, quantity)
        assert len({v.source for v in values}) == len(values), (name, quantity)
        assert all(v.source in known for v in values), (name, quantity)
        assert all((math.isfinite(v.value) and v.value >= 0) or not v.default for v in values), (name, quantity)
        assert all(v.note for v in values if v.implausible), (name, quantity)


# Tables of the thesis as printed: material, quantity, source, value.
PRINTED = [
    ("etpu", "relative_permittivity", "thesis-3.2", 5.73),
    ("x60", "relative_permittivity", "thesis-3.2", 4.68),
    ("etpu", "relative_permittivity", "thesis-3.1", 4.68),
    ("x60", "relative_permittivity", "thesis-3.1", 5.73),
    ("x60", "relative_permittivity", "thesis-4.1", 4.79),
    ("x60", "relative_permittivity", "thesis-c.1", 6.33),
    ("etpu", "resistivity_ohm_m", "thesis-3.2", 1 / 1.2),
    ("x60", "resistivity_ohm_m", "thesis-3.2", 1 / 1.3),
    ("etpu", "resistivity_ohm_m", "thesis-c.1-top", 0.07),
    ("etpu", "resistivity_ohm_m", "thesis-c.1-bottom", 0.2),
    ("air", "relative_permittivity", "thesis-3.2", 1.00059),
    ("filaflex-conductive", "resistivity_ohm_m", "bifur-circuits", 0.039),  # 3.9 ohm cm
    ("ninjatek-eel", "youngs_modulus_pa", "ninjatek-eel-cond", 298e6),
]


@pytest.mark.parametrize(("name", "quantity", "source", "value"), PRINTED)
def test_values_as_printed(name, quantity, source, value):
    found = materials.load(name).value(quantity, source)
    assert (found.source, found.value) == (source, pytest.approx(value, rel=1e-15))


def test_the_dielectric_that_would_conduct_is_kept_flagged_and_never_taken_unasked():
    x60 = materials.load("x60")
    assert x60.value("resistivity_ohm_m", "thesis-3.2").implausible
    with pytest.raises(
        MissingValue, match=r"x60 has no default resistivity_ohm_m; name one of its sources: thesis-3.2"
    ):
        x60.value("resistivity_ohm_m")


def test_a_source_that_is_silent_leaves_the_default():
    assert materials.load("x60").value("relative_permittivity", "thesis-4.2").source == "thesis-3.2"


def test_a_missing_value_is_missing():
    with pytest.raises(MissingValue, match="no source gives it"):
        materials.load("bvoh").value("relative_permittivity")
