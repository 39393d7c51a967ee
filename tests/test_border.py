"""Borders from SVG and DXF: their size, what they cut, and which share of the capacitance they leave."""

import math

import ezdxf
import numpy as np
import pytest
import shapely

from sensorgen.core.errors import BadInput
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.capacitance_answer import CapacitanceQuestion, answer
from sensorgen.prediction.rest_state import rest_state
from sensorgen.scene.border import share
from sensorgen.scene.geometry import meshes, outline_files

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" viewBox="0 0 {} {}">'


def svg(folder, inside, width="60mm", height="40mm", box=(60, 40), head=""):
    path = folder / "border.svg"
    path.write_text(head + HEAD.format(width, height, *box) + inside + "</svg>")
    return path


ELLIPSE = '<ellipse cx="300" cy="200" rx="280" ry="180"/>'


@pytest.mark.parametrize(
    ("inside", "settings", "size", "area"),
    [
        (ELLIPSE, {"box": (600, 400)}, (56, 36), math.pi * 28 * 18),
        ('<circle cx="50" cy="50" r="48"/>', {"width": "100", "height": "100", "box": (100, 100)},
         (96 * 25.4 / 96, 96 * 25.4 / 96), math.pi * 12.7**2),
        ('<g transform="scale(2)"><polygon points="0,0 20,0 20,10"/></g>', {}, (40, 20), 400),
        ('<path d="M0 0 H30 A5 5 0 0 1 30 10 H0 Z"/>', {}, (35, 10), 300 + math.pi * 12.5),
        ('<path d="M0 0 C 0 20 30 20 30 0 Z"/>', {}, (30, 15), None),
        ('<path d="M0 0 H30 V20 H0 Z M10 5 H15 V10 H10 Z"/>', {}, (30, 20), 575),
        ('<path d="M0 0 H30"/><path d="M30 0 V20 H0"/><path d="M0.0004 20 L0 0"/>', {}, (30, 20), 600),
    ],
    ids=["viewBox", "pixels", "transform", "arc", "spline", "hole", "pieces"],
)  # fmt: skip
def test_svg_outlines_have_their_size(tmp_path, inside, settings, size, area):
    region = outline_files.read(svg(tmp_path, inside, **settings))
    assert region.bounds[:2] == (0.0, 0.0)
    assert region.bounds[2:] == pytest.approx(size, abs=0.011)
    if area is not None:
        flat = outline_files.FLAT_MM
        assert area - flat * region.length <= region.area <= area + flat * region.length


def test_curves_are_met_within_the_stated_distance(tmp_path):
    region = outline_files.read(svg(tmp_path, ELLIPSE, box=(600, 400)))
    x, y = (np.array(region.exterior.coords) - (28, 18)).T
    assert np.abs((x / 28) ** 2 + (y / 18) ** 2 - 1).max() < 1e-5
    middles = (np.array(region.exterior.coords)[1:] + np.array(region.exterior.coords)[:-1]) / 2 - (28, 18)
    radius = np.hypot(*middles.T)
    on_edge = 1 / np.sqrt((middles[:, 0] / radius / 28) ** 2 + (middles[:, 1] / radius / 18) ** 2)
    assert (on_edge - radius).max() < outline_files.FLAT_MM


@pytest.mark.parametrize(
    ("inside", "settings", "message"),
    [
        ('<path d="M0 0 H30 V20 H0"/>', {}, r"the outline is open: a curve ends at \(0, -0\)"),
        ('<path d="M0 0 L30 20 V0 L0 20 Z"/>', {}, r"crosses itself: Self-intersection\[15.* -10"),
        ('<rect width="9" height="9"/><rect x="20" width="9" height="9"/>', {}, "2 outlines side by side"),
        ("", {}, "no outline in it"),
        ('<rect width="0.5" height="0.5"/>', {}, "0.5 x 0.5 mm; expected 1 to 1000 mm"),
        ('<rect width="9" height="9"/>', {"head": '<!DOCTYPE svg [<!ENTITY a "b">]>'}, "entities of its own"),
        ("<rect", {}, "not an SVG"),
    ],
)
def test_svg_that_is_no_border_is_refused(tmp_path, inside, settings, message):
    with pytest.raises(BadInput, match=message):
        outline_files.read(svg(tmp_path, inside, **settings))


def dxf(folder, draw, unit=4):
    made = ezdxf.new(units=unit)
    draw(made.modelspace())
    path = folder / "border.dxf"
    made.saveas(path)
    return path


@pytest.mark.parametrize(("unit", "scale"), [(4, 1.0), (5, 10.0), (1, 25.4)], ids=["mm", "cm", "inch"])
def test_dxf_has_its_own_unit(tmp_path, unit, scale):
    def draw(space):  # a slot of lines and arcs, one of them drawn backwards
        space.add_line((2, 0), (6, 0))
        space.add_arc((6, 1), 1, -90, 90)
        space.add_line((2, 2), (6, 2))
        space.add_arc((2, 1), 1, 90, 270)

    region = outline_files.read(dxf(tmp_path, draw, unit))
    assert region.bounds == pytest.approx((0, 0, 6 * scale, 2 * scale), abs=1e-6)
    assert region.area == pytest.approx((8 + math.pi) * scale**2, abs=outline_files.FLAT_MM * region.length)


def test_dxf_of_bulges_circles_splines_and_blocks(tmp_path):
    def draw(space):
        space.add_lwpolyline([(0, 0, 0), (30, 0, 1), (30, 10, 0), (0, 10, 0)], format="xyb", close=True)
        block = space.doc.blocks.new("HOLE")
        block.add_circle((0, 0), 2)
        space.add_blockref("HOLE", (10, 5))

    region = outline_files.read(dxf(tmp_path, draw))
    assert region.area == pytest.approx(300 + math.pi * 25 / 2 - math.pi * 4, abs=0.2)
    assert len(region.interiors) == 1


@pytest.mark.parametrize(
    ("unit", "content", "message"),
    [(0, None, r"no unit \(\$INSUNITS is 0\)"), (4, b"0\nSECTION\n", "no|not a DXF"), (4, b"\xff\xfe x", "not a DXF")],
)
def test_dxf_that_is_no_border_is_refused(tmp_path, unit, content, message):
    path = dxf(tmp_path, lambda space: space.add_circle((0, 0), 9), unit)
    if content:
        path.write_bytes(content)
    with pytest.raises(BadInput, match=message):
        outline_files.read(path)


def bordered(shape, path, **more):
    return make({"shape": shape, "border": str(path), **more})


@pytest.mark.parametrize("shape", ["reference", "rect", "tri"])
def test_every_body_is_cut(tmp_path, shape):
    design = bordered(shape, svg(tmp_path, ELLIPSE, width="12mm", height="8mm", box=(600, 400)))
    region = shapely.from_wkt(design.border)
    assert design.drawn.size_mm[:2] == pytest.approx((11.2, 7.2), abs=1e-3)
    cut = {body.name: meshes.mesh(body) for body in design.drawn.bodies}
    for body in design.drawn.bodies:
        inside = region.buffer(1e-6)
        assert inside.covers(shapely.MultiPoint(cut[body.name].vertices_mm[:, :2]))
    assert cut["bottom_electrode"].volume_mm3() == pytest.approx(region.area * 0.3, rel=1e-6)
    assert not meshes.faults(design.drawn, cut)
    whole = make({"shape": shape, "parameters": {"length_mm": 11.2, "width_mm": 7.2}})
    assert design.id() != whole.id()
    assert make(design.model_dump(mode="json")).id() == design.id()


def test_capacitance_is_the_share_of_the_cells(tmp_path):
    """A plate has the share of its area; a pattern that the border cuts is between what its whole cells have."""
    path = svg(tmp_path, ELLIPSE, width="30mm", height="20mm", box=(600, 400))
    body = bodies.drawn(bordered("reference", path))
    at_rest = rest_state(body)
    plate, eps = at_rest.capacitance, next(v.value for v in at_rest.values if v.material == "x60")
    exact = 8.8541878128e-12 * eps * math.pi * 14 * 9 * 1e-6 / 0.6e-3
    assert plate.value == pytest.approx(exact, rel=2e-3, abs=0.0)
    assert plate.model.lower < exact < plate.model.upper
    cell = answer(body, CapacitanceQuestion())
    assert cell.lower_f_per_m2 * cell.area_m2 < exact < cell.upper_f_per_m2 * cell.area_m2
    assert (cell.reached, cell.relative_width > cell.accuracy) == (False, True)  # its error is that of a count, too
    assert "accuracy 0.001 not reached: 0.0" in cell.problems()[0]
    assert "is inside the border" in cell.problems()[0]
    loose = answer(body, CapacitanceQuestion(width=0.5))
    assert (loose.reached, loose.problems()) == (True, ())
    tri = make({"shape": "tri", "parameters": {"length_mm": 28.0, "width_mm": 18.0}})
    region = outline_files.read(path)
    left = share(tri.drawn, region, (2.0, 18.0))
    assert left.area == pytest.approx(math.pi / 4, rel=1e-3)
    # A density that varies within the period by any law, integrated over the border: here all at one place of it
    x = np.linspace(0, 28, 280_001)
    wide = 18 * np.sqrt(np.clip(1 - ((x - 14) / 14) ** 2, 0, None))
    for phase in (0.0, 0.5, 1.0, 1.7):
        peak = (np.abs((x - phase) % 2 - 0.05) < 0.05).astype(float)
        of_all = (peak * wide).sum() / (peak * 18).sum()
        assert abs(of_all / left.area - 1) <= left.error
    assert left.error < 0.15


def test_the_error_of_a_share_is_that_of_its_farther_end():
    """13/16 of a plan of 16 cells: 12 of them are whole, and 4 are cut; all or nothing of these is the worst."""
    pattern = make({"shape": "cone", "parameters": {"length_mm": 4.0, "width_mm": 4.0, "period_mm": 1.0}}).drawn
    left = share(pattern, shapely.box(0, 0, 3.25, 4), (1.0, 1.0))
    assert (left.area, left.error) == pytest.approx((13 / 16, 16 / 13 - 1))
    left = share(pattern, shapely.box(0, 0, 3.75, 4), (1.0, 1.0))
    assert (left.area, left.error) == pytest.approx((15 / 16, 1 - 12 / 15))


def test_a_border_counts_the_cells_of_an_array_with_rims(tmp_path):
    """Period of the cell, not the whole sensor: else a border left all of the capacitance open."""
    design = bordered("cone", svg(tmp_path, ELLIPSE, width="12mm", height="8mm", box=(600, 400)))
    cells = bodies.drawn(design).cells
    tiles = (*cells.beside, (cells.first(), cells.count))
    areas = [count * scene.size_mm[0] * scene.size_mm[1] for scene, count in tiles]
    assert sum(areas) == pytest.approx(design.area_mm2, rel=1e-3)
    assert 0.1 < cells.count_error < 0.6


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"parameters": {"length_mm": 100.0}}, "parameters.length_mm is 100.0, but the border is 56 mm"),
        ({"border": "nothing.svg"}, "cannot read '.*nothing.svg': No such file"),
        ({"border": "POLYGON ((0 0, 9 9, 9 0, 0 9, 0 0))"}, r"crosses itself: Self-intersection\[4.5 4.5\] mm"),
        ({"border": "POLYGON ((5 5, 9 5, 9 9, 5 5))"}, "it begins at 5, 5 mm"),
        ({"border": "POLYGON ((0 0"}, "border: "),
    ],
)
def test_borders_that_do_not_fit_are_refused(tmp_path, given, message):
    path = svg(tmp_path, ELLIPSE, box=(600, 400))
    with pytest.raises(BadInput, match=message):
        make({"shape": "tri", "border": str(path)} | given)
