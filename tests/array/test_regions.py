"""Regions of an array: force, pressure and contact by sums over crossings that are named by hand."""

import numpy as np
import pytest

from sensorgen.core import document
from sensorgen.core.errors import BadInput
from sensorgen.design import feet
from sensorgen.design.design import load, make
from sensorgen.prediction.array.frames import PressureMaps
from sensorgen.prediction.array.model import array_model

from .conftest import array_of

SIZE = {"length_mm": 60, "width_mm": 50}


@pytest.fixture(scope="module")
def model():
    return array_of(SIZE, regions={"left": [[0, 0], [20, 50]], "corner": [[40, 30], [60, 30], [60, 50]]})


def test_values_of_a_region_are_those_of_its_crossings(model):
    kpa = np.zeros((2, 5, 6))
    kpa[:, 1, 0], kpa[:, 4, 1], kpa[:, 4, 5] = 100.0, 50.0, 30.0  # r2c1 and r5c2 at the left, r5c6 in the corner
    kpa[1, 1, 0] = np.nan
    maps = PressureMaps(model, "by hand", np.arange(2.0), kpa, np.ones_like(kpa))
    found = {key: values.tolist() for key, values in maps.regions.items()}
    assert found["left_force_n"] == pytest.approx([15.0, 5.0], abs=0.01)  # of 10 x 10 mm each
    assert found["left_mean_kpa"] == pytest.approx([15.0, 5.0], abs=0.01)  # r2c1 as what lies around it: 0
    assert found["left_peak_kpa"] == [100.0, 50.0]
    assert found["left_area_mm2"] == pytest.approx([200.0, 100.0])
    assert found["left_undetermined"] == [0, 1]
    assert found["corner_force_n"] == pytest.approx([3.0, 3.0])
    assert int(model.regions["corner"].sum()) == 3  # r4c6, r5c5 is on the edge, r5c6
    assert maps.regional(0).cells[0] == ("left", 15.0, 15.0, 100.0, 200.0, 0.0)
    assert "corner" in "\n".join(document.text(maps.document()))
    lines = "".join(maps.csv()).splitlines()
    head = lines[0].split(",")
    assert float(lines[2].split(",")[head.index("left_peak_kpa")]) == 50.0
    dark = PressureMaps(model, "none", np.zeros(1), np.full((1, 5, 6), np.nan), np.full((1, 5, 6), np.nan))
    assert np.isnan(dark.regions["left_force_n"]).all()
    assert np.isnan(dark.regions["left_peak_kpa"]).all()
    assert dark.table().cells[0][head.index("left_force_n")] is None


def test_a_foot_has_its_regions(tmp_path):
    """Every crossing in one region, the hallux at the big toe's side of either foot."""
    for side in ("left", "right"):
        path = tmp_path / f"{side}.yaml"
        path.write_text(f"shape: array\nborder: foot 42 {side}\nparameters: {{pitch_x_mm: 10, pitch_y_mm: 10}}\n")
        of = load(path)
        model = array_model(of)
        times = sum(inside.astype(int) for inside in model.regions.values())
        assert (times == model.here).all()
        y = np.array(model.layout.y_mm)
        rows = {name: y[inside.any(1)].mean() for name, inside in model.regions.items()}
        assert (rows["hallux"] < rows["toes"]) == (side == "left")  # lateral is up at the left
        x = np.array(model.layout.x_mm)
        middles = [x[model.regions[name].any(0)].mean() for name in ("heel", "midfoot", "metatarsals", "toes")]
        assert middles == sorted(middles)
        assert of.id() == of.model_copy(update={"regions": {}}).id()
    assert feet.regions("foot 42 left")["metatarsals"][0][0] == pytest.approx(0.51 * 265)


NO_AREA = [[0, 0], [0, 50]]
CROSSED = [[0, 0], [9, 9], [0, 9], [9, 0]]


@pytest.mark.parametrize("corners", [[[0, 0]], NO_AREA, [[70, 0], [90, 9]], CROSSED, [[0, 0, 1], [9, 9]]])
def test_no_region_is_an_error(corners):
    with pytest.raises(BadInput, match=r"regions\.odd: no area with a crossing"):
        _ = array_of(SIZE, regions={"odd": corners}).regions


def test_regions_are_of_arrays_and_have_plain_names():
    with pytest.raises(BadInput, match="regions: tri has no crossings"):
        make({"shape": "tri", "regions": {"a": [[0, 0], [1, 1]]}})
    with pytest.raises(BadInput, match="regions"):
        array_of(SIZE, regions={"../a": [[0, 0], [1, 1]]})
