"""Every shape, filled with support or not, lying either way: no false errors about widths, no missed islands."""

from dataclasses import fields
from itertools import product

import pytest

from sensorgen.checks.review import review
from sensorgen.cli import catalogue
from sensorgen.core import plugins as registry
from sensorgen.design import design, shapes

SIZES = {shape: {"length_mm": 1.25, "width_mm": 1.25} for shape in ("bump", "cone")}  # one round body

OFTEN = (0.1, "upside-down", "fine"), (0.2, "as-drawn", "extrafine")


def errors(**data):
    """Of the drawing; what a slicer loses of it (rule 7) is another matter."""
    return {f.rule for f in review(design.make(data)).findings if f.severity == "error"} - {"7-printed"}


@pytest.mark.parametrize(("film_mm", "orientation", "quality"), [
    pytest.param(*each, marks=() if each in OFTEN else pytest.mark.nightly)
    for each in product((0.1, 0.2), ("as-drawn", "upside-down"), ("fine", "extrafine"))
])  # fmt: skip
@pytest.mark.parametrize("shape", sorted(catalogue.shapes().entries))
def test_with_support_every_shape_prints_either_way(shape, film_mm, orientation, quality):
    films = [f.name for f in fields(registry.load(shapes, shape).Params) if f.name.endswith("dielectric_mm")]
    given = {
        "parameters": {**dict.fromkeys(films, film_mm), **SIZES.get(shape, {"length_mm": 12, "width_mm": 6})},
        "materials": {"support": "bvoh"},
    }
    assert errors(shape=shape, orientation=orientation, quality=quality, **given) == set()


@pytest.mark.parametrize("quality", ["fine", "extrafine"])
def test_feet_in_mid_air_are_islands_at_any_layer(quality):
    """At 0.06 mm a tip that vanishes lies under the feet: it must not count as ground."""
    assert errors(shape="tri", orientation="upside-down", quality=quality) == {"9-bridge"}


def test_a_waiver_that_covers_nothing_is_told():
    waivers = [{"rule": "55", "reason": "no such rule"}, {"rule": "3", "reason": "accepted here"}]
    found = review(design.make({"shape": "tri", "waivers": waivers})).findings
    assert [f.message for f in found if f.rule == "10-waiver"] == ["the waiver of rule 55 covers no finding"]
    assert all(f.waiver for f in found if f.rule == "3-grid")
