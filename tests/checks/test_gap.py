"""Rules 1 and 2 at their limits, and what becomes of the gap (files-and-slicers.md, as-printed.md)."""

import pytest

from sensorgen.checks.review import review
from sensorgen.checks.widths import Layers
from sensorgen.design.design import make
from sensorgen.design.shapes import rect, tri
from sensorgen.scene.scene import Body, Fill, Scene, box

HAIR = 1e-6


def tri_scene(film_mm: float, **options):
    return tri.scene(tri.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=film_mm, **options), Fill())


@pytest.mark.parametrize(("gap_mm", "short"), [(0.0, True), (1e-9, True), (2e-9, False), (HAIR, False)])
def test_touching_electrodes_are_a_short(sensor, findings, gap_mm, short):
    found = findings(sensor(), "1-", gap_mm=gap_mm)
    assert [f.severity for f in found] == ["error"] * short
    if short:
        assert (found[0].body, found[0].limit_mm, found[0].place_mm) == ("low / high", 0.0, (0.0, 0.0, 0.3))
        assert "dielectric_mm" in found[0].advice


@pytest.mark.parametrize(("shape", "turned"), [(tri, False), (rect, True)])
def test_a_shape_without_a_film_is_a_short(findings, shape, turned):
    scene = shape.scene(shape.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=0.0), Fill())
    (found,) = findings(scene.turned_over() if turned else scene, "1-")
    assert found.severity == "error"
    assert found.value_mm == 0.0


# Half a layer is 0.05 mm. On the grid, a film of exactly that ends on the sample, which the electrode above it takes.
@pytest.mark.parametrize(
    ("film_mm", "severities"), [(0.05 - HAIR, ["error"]), (0.05, ["error"]), (0.05 + HAIR, ["warning", "warning"])]
)
def test_a_film_under_half_a_layer_is_an_error(sensor, findings, film_mm, severities):
    found = findings(sensor(film_mm=film_mm), "2-film")
    assert [f.severity for f in found] == severities
    assert all(f.advice for f in found)
    if severities == ["error"]:
        assert (found[0].value_mm, found[0].limit_mm) == (pytest.approx(film_mm), 0.05)


def side_by_side(gap_mm: float) -> Scene:
    """Two electrodes on one bed, with a film between them that stands on its edge."""
    far = 9.0 + gap_mm
    bodies = (
        Body("left", "etpu", (box(0, 9, 0, 8, 0, 1.0),), "bottom"),
        Body("right", "etpu", (box(far, 20, 0, 8, 0, 1.0),), "top"),
    )
    film = [Body("film", "x60", (box(9, far, 0, 8, 0, 1.0),))] if gap_mm else []
    return Scene((*bodies, *film), (20.0, 8.0, 1.0))


def test_a_film_on_edge_is_made_of_lines_not_of_layers(findings):
    assert [f.severity for f in findings(side_by_side(0.0), "1-")] == ["error"]
    assert not findings(side_by_side(0.85), "2-")  # 8.5 layers, two lines
    assert {f.body for f in findings(side_by_side(0.1), "5-")} == {"film"}


def test_a_film_under_half_a_layer_is_an_error_though_a_sample_meets_it(sensor, findings):
    """From 0.33 to 0.37 mm: the sample at 0.35 meets it, by luck."""
    assert [f.severity for f in findings(sensor(film_mm=0.04, bottom_mm=0.33), "2-film")] == ["error"]


def test_a_film_between_two_samples_is_an_error_though_thicker_than_half_a_layer(findings):
    """From 0.36 to 0.44 mm: samples at 0.35 and 0.45 miss it, and the feet that hang on it hide that from rule 4."""
    scene = tri_scene(0.08, electrode_mm=0.36)
    assert [f.severity for f in findings(scene, "2-film")] == ["error"]


# Printed values by counting samples at 0.35, 0.45, ... "0.14 prints as 0.2" where it starts at 0.34, 0.1 where at 0.3.
@pytest.mark.parametrize(
    ("bottom_mm", "film_mm", "printed_mm"),
    [(0.3, 0.14, 0.1), (0.34, 0.14, 0.2), (0.3, 0.16, 0.2), (0.3, 0.25, 0.3), (0.3, 0.26, 0.3), (0.33, 0.51, 0.5)],
)
def test_a_film_of_broken_layers_is_told_with_its_printed_value(sensor, findings, bottom_mm, film_mm, printed_mm):
    found = findings(sensor(film_mm=film_mm, bottom_mm=bottom_mm), "2-film")
    assert found[0].severity == "warning"
    assert f"will print {printed_mm:g} mm thick" in found[0].message
    assert found[0].margin_mm == pytest.approx(-abs(film_mm - printed_mm))


@pytest.mark.parametrize("film_mm", [0.2 - HAIR, 0.2, 0.2 + HAIR])
def test_only_whole_layers_pass(sensor, findings, film_mm):
    assert bool(findings(sensor(film_mm=film_mm), "2-film")) is (film_mm != 0.2)


# With 0.06 mm layers a film of 0.1 mm becomes 0.12 and a stack of 1.30 mm 1.32 (files-and-slicers.md).
def test_extra_fine_layers_print_the_film_and_the_stack_of_the_spec(findings, extrafine):
    scene = rect.scene(rect.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=0.1), Fill())
    assert scene.size_mm[2] == pytest.approx(1.3)
    (film,) = findings(scene, "2-film", quality=extrafine)
    assert "will print 0.12 mm thick" in film.message
    assert Layers(tuple(extrafine.boundaries_mm(1.3))).printed_mm(1.3) == 1.32


@pytest.mark.parametrize(("film_mm", "single"), [(0.1, True), (0.2, False), (0.16, False)])
def test_a_single_layer_is_a_warning(sensor, findings, film_mm, single):
    """0.16 mm cross two samples: 0.35 and 0.45."""
    found = [f for f in findings(sensor(film_mm=film_mm), "2-film") if "single layer" in f.message]
    assert [(f.severity, f.value_mm, f.limit_mm) for f in found] == [("warning", 0.1, 0.2)] * single


# Measured: files-and-slicers.md, "What really gets printed", and as-printed.md, column "gap".
@pytest.mark.parametrize(("along", "turned"), [("x", False), ("y", True)])
def test_the_printed_gap_is_the_measured_one(findings, along, turned):
    scene = tri_scene(0.1, along=along)
    (found,) = findings(scene.turned_over() if turned else scene, "2-printed-gap")
    assert found.severity == "warning"
    assert "0.2 mm (Arachne), 0.3 mm (classic walls or plain Cura), 0.1 mm (Cura filling outline gaps)" in found.message
    assert (found.value_mm, found.limit_mm) == (0.3, 0.1)
    assert found.advice


def test_blunt_cogs_keep_their_gap(findings):
    """SqXY: no layer is lost (as-printed.md)."""
    scene = rect.scene(rect.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=0.1), Fill())
    assert findings(scene, "2-printed-gap") == []


def test_a_strip_as_wide_as_a_line_prints_and_a_hair_less_does_not(findings):
    """Classic walls drop what is narrower than 0.44 mm: the lower cogs with it."""
    gaps = []
    for width in (0.44 - HAIR, 0.44, 0.44 + HAIR):
        scene = rect.scene(rect.Params(length_mm=8.0, width_mm=4.0, etpu_width_mm=width), Fill())
        gaps.append([f.value_mm for f in findings(scene, "2-printed-gap")])
    assert gaps == [[0.8], [], []]  # only the plate is left: film 0.2, strips 0.3 and 0.3


def test_another_nozzle_prints_another_gap(findings, printer):
    """A nozzle of 0.25 mm loses what is under 0.075 (Arachne) and 0.275 mm (classic): the tip of 0.1 stays in one."""
    small = printer.model_copy(update={"nozzle_mm": 0.25})
    (found,) = findings(tri_scene(0.1), "2-printed-gap", printer=small)
    assert "0.2 mm (classic walls or plain Cura)" in found.message
    assert "0.1 mm (Arachne, Cura filling outline gaps)" in found.message


def test_a_film_below_one_layer_has_one_size_in_its_advice():
    """No whole layers are below 0.07 mm: planted, "use 0.1 or 0.1 mm"."""
    design = make({"shape": "reference", "quality": "fine", "parameters": {"dielectric_mm": 0.07}})
    assert design.layers.layer_mm == 0.1
    (advice,) = {f.advice for f in review(design).findings if "layers of" in f.message}
    assert advice == "use 0.1 mm"
