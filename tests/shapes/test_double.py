"""The double sensor: two plates, three electrodes, and what speaks of them."""

import pytest

from sensorgen.checks.review import review
from sensorgen.design.design import make
from sensorgen.design.shapes import double
from sensorgen.models import columns
from sensorgen.scene.scene import Fill


def scene(**options):
    return double.scene(double.Params(**options), Fill())


def test_its_volumes_are_length_times_width_times_thickness():
    found = scene(lower_dielectric_mm=0.4, upper_dielectric_mm=0.7, electrode_mm=0.25, isolation_mm=0.1)
    assert {b.name: b.volume_mm3() for b in found.bodies} == pytest.approx(
        {"bottom_electrode": 250.0, "lower_dielectric": 400.0, "middle_electrode": 250.0, "upper_dielectric": 700.0,
         "top_electrode": 250.0, "isolation": 100.0}
    )  # fmt: skip
    assert found.size_mm == (100.0, 10.0, pytest.approx(1.95))


def test_each_film_has_its_own_part():
    found = double.scene(double.Params(), Fill("first", "second", film="pla", dielectric="x60"))
    assert [b.material for b in found.bodies] == ["first", "pla", "second", "x60", "second"]


def test_the_columns_refuse_three_electrodes_and_say_who_speaks_of_them():
    assert "sensorgen stack" in (columns.why_not_applicable(scene()) or "")


@pytest.mark.parametrize("film", ["lower", "upper"])
@pytest.mark.parametrize("orientation", ["as-drawn", "upside-down"])
def test_each_film_is_checked(film, orientation):
    def rules(**parameters):
        design = make({"shape": "double", "parameters": {"length_mm": 20.0, **parameters}, "orientation": orientation})
        return {(f.rule, f.severity, f.body) for f in review(design).findings if f.rule[0] in "12"}

    neighbour = "bottom_electrode" if film == "lower" else "top_electrode"
    low_first = (film == "lower") != (orientation == "upside-down")
    body = f"{neighbour} / middle_electrode" if low_first else f"middle_electrode / {neighbour}"
    assert rules() == set()
    assert ("1-short", "error", body) in rules(**{f"{film}_dielectric_mm": 0.0})
    assert ("2-film", "error", body) in rules(**{f"{film}_dielectric_mm": 0.04})
    assert ("2-film", "warning", body) in rules(**{f"{film}_dielectric_mm": 0.1})
