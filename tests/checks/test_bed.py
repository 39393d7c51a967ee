"""Rule 8 at its limits: footprint and height."""

import pytest

from sensorgen.checks import rules
from sensorgen.checks.review import review
from sensorgen.design.design import make
from sensorgen.design.printer import load_printer
from sensorgen.scene.scene import Scene

HAIR = 1e-6


# The bed of the thesis's printer is 390 x 170 x 200 mm (process.md), that of the other one 360 x 360 x 360.
@pytest.mark.parametrize(
    ("printer", "size", "value_and_limit"),
    [
        ("diabase-h5", (390.0, 170.0, 200.0), []),
        ("diabase-h5", (390.0 + 5e-10, 170.0, 200.0), []),
        ("diabase-h5", (390.0 + HAIR, 170.0, 1.0), [(390.0 + HAIR, 390.0)]),
        ("diabase-h5", (390.0, 170.0 + HAIR, 1.0), [(170.0 + HAIR, 170.0)]),
        ("diabase-h5", (390.0, 170.0, 200.0 + HAIR), [(200.0 + HAIR, 200.0)]),
        ("diabase-h5", (400.0, 180.0, 201.0), [(400.0, 390.0), (201.0, 200.0)]),
        ("prusa-xl5", (330.0, 330.0, 200.0 + HAIR), []),
        ("prusa-xl5", (360.0 + HAIR, 100.0, 1.0), [(360.0 + HAIR, 360.0)]),
    ],
)
def test_the_bed_is_the_limit(printer, size, value_and_limit):
    found = list(rules.bed_findings(Scene((), size), load_printer(printer)))
    assert [(f.value_mm, f.limit_mm) for f in found] == value_and_limit
    assert all(f.severity == "error" and f.advice and f.margin_mm < 0 for f in found)


def test_a_sensor_that_fits_the_other_way_round_is_told_so():
    (found,) = rules.bed_findings(Scene((), (100.0, 300.0, 1.0)), load_printer("diabase-h5"))
    assert "swap length and width" in found.advice


def test_the_insole_of_the_thesis_is_refused_with_the_size_of_the_bed():
    """330 x 330 mm do not fit on 390 x 170 (files-and-slicers.md); the other printer takes them."""
    design = make({"shape": "tri", "parameters": {"length_mm": 330.0, "width_mm": 330.0}})
    (found,) = review(design).findings
    assert (found.rule, found.severity) == ("8-bed", "error")
    assert "330 x 330 mm" in found.message
    assert "390 x 170 mm" in found.message


def test_what_shrinkage_adds_counts():
    """380 mm long as used, 475 mm as printed when the bake takes 20 %."""
    design = make({"shape": "reference", "parameters": {"length_mm": 380.0}, "shrinkage": 0.2})
    (found,) = review(design).findings
    assert (found.value_mm, found.limit_mm) == (pytest.approx(475.0), 390.0)
