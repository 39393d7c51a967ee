"""Cogs over an empty layer: found by the estimate of the design and by the G-code, with length and share."""

import pytest
import shapely

from sensorgen.checks.bridges import findings
from sensorgen.checks.review import review
from sensorgen.design import design
from sensorgen.scene.layers import LayerRegions


def test_half_of_a_strip_over_nothing_is_none_and_nine_tenths_are():
    plate = shapely.box(0, 0, 10, 10)
    strip = shapely.box(0, 4, 10, 4.3)
    for end, count in ((5.0, 0), (1.0, 1)):
        below = LayerRegions(0.0, 0.1, {"plate": shapely.clip_by_rect(plate, 0, 0, end, 10)})
        found = list(findings([below, LayerRegions(0.1, 0.2, {"cogs": strip})], 0.44))
        assert len(found) == count
    assert found[0].message == "10 mm of its lines (100%) lie over an empty layer"
    assert (found[0].rule, found[0].layer) == ("9-support", 2)


@pytest.mark.parametrize(("shape", "count"), [("tri", 1), ("rect", 0)])
def test_first_cogs_of_the_triangular_sensor(shape, count):
    """50 cogs of 10 mm in the sensor of 100 x 10 mm; slicers print 485 mm of them."""
    found = review(design.make({"shape": shape, "parameters": {"dielectric_mm": 0.2}})).findings
    cogs = [f for f in found if f.rule == "9-support" and f.body == "top_electrode_with_cogs"]
    assert [(f.layer, f.message) for f in cogs] == [(7, "500 mm of its lines (100%) lie over an empty layer")] * count
