"""Labels, holes, and tiles of arrays: what a person reads, what a pin meets, what lies beside what."""

import numpy as np
import pytest
import shapely
from shapely import affinity

from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import make
from sensorgen.scene.geometry import meshes
from sensorgen.scene.geometry.meshes import mesh
from sensorgen.scene.layers import region_at
from sensorgen.workflows.tiles import tiles

C12 = """
### .#. ###
#.. ##. ..#
#.. .#. ###
#.. .#. #..
### ### ###
"""  # as a person draws it
MAT = {"length_mm": 488, "width_mm": 447, "pitch_x_mm": 20, "pitch_y_mm": 20, "column_mm": 16, "row_mm": 16}


def array(**parameters):
    return make({"shape": "array", "parameters": parameters, "cell": {"parameters": {"dielectric_mm": 0.4}}})


@pytest.mark.parametrize(("kind", "pads"), [("raised", "bottom"), ("engraved", "left")])
def test_names_can_be_read_beside_the_pads(kind, pads):
    design = array(length_mm=120, width_mm=20, labels=kind, pads=pads)
    scene = design.drawn
    size, high = scene.size_mm, scene.size_mm[2] - 0.1
    letters = region_at(scene.body("isolation"), high)
    if kind == "engraved":
        letters = shapely.difference(region_at(scene.body("isolation"), high - 0.2), letters)
        assert region_at(scene.body("isolation"), high - 0.3).equals(region_at(scene.body("isolation"), high - 0.2))
    track = design.layout.columns[11]
    middle, pad = (track.pad[0] + track.pad[1]) / 2, track.pad[3]
    want = [list(line.replace(" ", ".")) for line in C12.split("\n")[1:-1]]
    for i, line in enumerate(want):
        for j, dot in enumerate(line):
            along, across = pad + (j + 1.5) * 0.5, (2 - i) * 0.5  # right and up, as one reads
            place = (along, middle + across) if pads == "left" else (middle - across, along)
            assert shapely.contains_xy(letters, *place) == (dot == "#"), (i, j)
    assert size[:2] == (design.layout.size_mm if pads == "bottom" else design.layout.size_mm[::-1])
    assert not list(meshes.faults(scene, {body.name: mesh(body) for body in scene.bodies}))


def test_names_keep_apart():
    """Of pads nearer than letters are high every so many is named, the last one too."""
    layout = array(connector_mm=1.27, lead_mm=0.8, labels="raised").layout
    groups = shapely.get_parts(layout.letters.buffer(0.55, join_style="mitre"))
    assert len(groups) == 4  # r1, r6, c1, c6


def test_pins_meet_no_track():
    design = array(length_mm=40, width_mm=30, hole_mm=3)
    holes = shapely.get_parts(design.layout.holes)
    assert [hole.area for hole in holes] == pytest.approx([9, 9])
    assert holes[1].bounds[0] - holes[0].bounds[2] > 20
    tracks = shapely.union_all(design.layout.regions)
    for z_mm in (0.2, 0.55, 0.9, 1.5, 1.7):
        layer = shapely.union_all([region_at(body, z_mm) for body in design.drawn.bodies])
        assert shapely.disjoint(layer.buffer(-1e-6), design.layout.holes)
    assert shapely.distance(tracks, design.layout.holes) > 0.88  # two lines


def test_tiles_are_the_array():
    """A mat of 488 x 447 mm on a bed of 390 x 170 mm: squares side by side, pads outside, leads under the next tile."""
    found = tiles(array(**MAT))
    assert len(found) == 8
    areas, strips = [], []
    for tile, design in found:
        layout, (length, width, _) = design.layout, design.drawn.size_mm
        assert length <= 390
        assert width <= 170
        exchanged = [affinity.affine_transform(g, [0, 1, 1, 0, 0, 0])
                     for g in (layout.sensing, shapely.union_all(layout.pads), layout.regions[0])]  # fmt: skip
        turned = [affinity.rotate(g, tile.turned_deg, origin=(0, 0)) for g in exchanged]
        x, y = np.array([tile.x_mm, tile.y_mm]) - turned[0].bounds[:2]
        area, pads, leads = (affinity.translate(g, x, y) for g in turned)
        assert area.bounds == pytest.approx((tile.x_mm, tile.y_mm, tile.x_mm + 240, tile.y_mm + tile.width_mm))
        assert pads.bounds[2] < 0 or pads.bounds[0] > 480
        areas.append(area)
        strips.append(shapely.difference(leads, area.buffer(1e-6)))
    whole = shapely.union_all(areas)
    assert whole.area == pytest.approx(480 * 440)
    assert sum(map(shapely.area, areas)) == pytest.approx(whole.area)
    for area, strip in zip(areas, strips, strict=True):
        assert shapely.intersection(strip, area).area == 0
    names = [design.params.tile for _, design in found]
    assert names == list(range(1, 9))


def test_a_tile_reaches_under_the_next():
    """The left ones with their base alone, 5 mm, where the columns of the array go on."""
    (_, left), *_, (_, right) = tiles(array(**MAT))
    edge = [max(x for piece in design.drawn.body(name).pieces for x in piece.span("x"))
            for design in (left, right) for name in ("base", "isolation")]  # fmt: skip
    assert edge[0] - edge[1] == pytest.approx(5.0)
    assert edge[2] == edge[3]


INSOLE_5 = {"border": "foot 42 left", "parameters": {"pitch_x_mm": 5, "pitch_y_mm": 5, "column_mm": 4, "row_mm": 4}}


def test_an_outline_fits_with_the_leads_that_the_refusal_advises():
    narrow = INSOLE_5["parameters"] | {"connector_mm": 2.4}
    assert not tiles(make({"shape": "array", "cell": {}, **INSOLE_5, "parameters": narrow}))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"parameters": {"labels": "engraved", "isolation_mm": 0.2}}, "labels engraved 0.2 mm into an isolation"),
        ({"parameters": {"hole_mm": 6}}, "hole_mm 6: no room beside the leads"),
        ({"parameters": {"seams": "columns", "seam_mm": 5, "base_mm": 0}}, "nothing reaches under the next tile"),
        ({"parameters": {"length_mm": 990, "width_mm": 447}}, "tiles in two columns are too large"),
        ({"border": "POLYGON ((0 0, 488 0, 488 447, 0 447, 0 0))"}, "rectangles .*: expected a smaller outline"),
        (INSOLE_5, r"315\.76 x 172\.04 mm with its leads, the bed 390 x 170 mm.*: expected connector_mm 2\.4"),
    ],
)  # fmt: skip
def test_what_has_no_room_is_an_error(data, words):
    with pytest.raises(SensorgenError, match=words):
        tiles(make({"shape": "array", "cell": {}} | data))
