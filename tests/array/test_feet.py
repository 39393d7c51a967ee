"""Outlines of feet against the tables that they are drawn by, and outlines of arrays that leave no sliver."""

import ezdxf
import numpy as np
import pytest
import shapely

from sensorgen.core.errors import SensorgenError
from sensorgen.design import feet
from sensorgen.design.design import make
from sensorgen.scene.layers import region_at

CELL = {"shape": "tri"}


def region(words: str) -> shapely.Polygon:
    return shapely.Polygon(feet.outline(words))


def breadth_at(foot: shapely.Polygon, share: float) -> float:
    length = foot.bounds[2]
    return shapely.intersection(foot, shapely.LineString([(share * length, -1), (share * length, 200)])).length


@pytest.mark.parametrize(("size", "mm"), [(36, 225), (48, 305)])  # ISO/TS 19407
def test_sizes_have_the_length_of_the_table(size, mm):
    assert feet.length_mm(size) == pytest.approx(mm, abs=0.1)
    assert region(f"foot {size} left").bounds == pytest.approx((0, 0, mm, mm * 98.87 / 263.03), abs=0.1)


def test_breadths_are_those_of_the_survey():
    """2012 Anthropometric Survey of U.S. Army Personnel, of length: heel 26.9 %, the widest at the ball, 37.6 %."""
    foot = region("foot 42 left")
    assert foot.is_valid
    heel = max(breadth_at(foot, share) for share in np.linspace(0.12, 0.22, 21)) / 265
    assert heel == pytest.approx(70.76 / 263.03, rel=0.03)
    ball = shapely.get_coordinates(foot)
    assert ball[ball[:, 1].argmin(), 0] / 265 == pytest.approx(194.75 / 263.03, abs=0.03)  # the first toe's joint
    assert breadth_at(foot, 0.42) < heel * 265  # an arch


def test_left_and_right_are_mirror_images():
    """Seen from above, toes to the right, the big toe of a left foot lies below the middle."""
    left, right = (shapely.get_coordinates(region(f"foot 42 {side}")) for side in ("left", "right"))
    assert left[left[:, 0].argmax(), 1] < 50 < right[right[:, 0].argmax(), 1]
    assert right[:, 1] == pytest.approx(left[:, 1].max() - left[:, 1], abs=2e-4)


def files(folder):
    foot = region("foot 38 right")
    points = " ".join(f"{x:.3f},{150 - y:.3f}" for x, y in foot.exterior.coords[:-1])
    (folder / "a.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="300mm" height="150mm" viewBox="0 0 300 150">'
        f'<polygon points="{points}"/></svg>', "utf-8",
    )  # fmt: skip
    drawing = ezdxf.new(units=4)
    drawing.modelspace().add_lwpolyline(list(foot.exterior.coords)[:-1], close=True)
    drawing.saveas(folder / "a.dxf")
    return {"svg": "a.svg", "dxf": "a.dxf", "foot": "foot 38 right", "rectangle": None}


@pytest.mark.parametrize("kind", ["rectangle", "svg", "dxf", "foot"])
def test_no_outline_leaves_a_sliver(kind, tmp_path):
    size = {"length_mm": 60, "width_mm": 40} if kind == "rectangle" else {}
    data = {"shape": "array", "parameters": size, "cell": CELL}
    design = make(data | ({"border": name} if (name := files(tmp_path)[kind]) else {}), str(tmp_path / "a.yaml"))
    scene, layout = design.drawn, design.layout
    for z_mm in (0.2, 0.55, 0.75, 1.3, 1.7):
        for material in ("etpu", "x60"):
            layer = shapely.union_all([region_at(body, z_mm) for body in scene.bodies if body.material == material])
            wide = layer.buffer(-0.22, join_style="mitre").buffer(0.22, join_style="mitre")  # a line
            assert shapely.difference(layer, wide).area < 1e-3
    everything = shapely.union_all([layout.footprint, *layout.regions])
    assert shapely.area(everything) == pytest.approx(layout.footprint.area)
    if kind != "rectangle":
        foot = region("foot 38 right")
        assert np.array(layout.here).sum() * 100 == pytest.approx(layout.sensing.area)
        assert 0.65 * foot.area < layout.sensing.area < foot.area  # squares that it cuts are left out


@pytest.mark.parametrize(
    ("border", "words"),
    [
        ("foot 42", "expected an EU size and a side, as: foot 42 left"),
        ("foot nan left", "expected an EU size and a side"),
        ("foot 60 left", "EU size 60; expected 15 to 52"),
        ("POLYGON ((0 0, 40 40, 40 0, 0 40, 0 0))", "the outline crosses itself: Self-intersection"),
        ("POLYGON ((0 0, 90 0, 90 9, 0 9, 0 0))", "room for 0 rows"),
        ("POLYGON ((0 0, 90 0, 90 5, 5 5, 5 90, 0 90, 0 0))", "the outline has no room for one crossing"),
    ],
)  # fmt: skip
def test_no_outline_is_an_error(border, words):
    with pytest.raises(SensorgenError, match=words):
        _ = make({"shape": "array", "border": border, "cell": CELL}).drawn
