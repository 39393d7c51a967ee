"""Thick lines of a wide nozzle stay below the melt rate, the tower's too: by a reader of this file's own."""

import math
import re
from pathlib import Path

import pytest

from sensorgen.design.design import make
from sensorgen.export import slicing
from sensorgen.export.slicers.loads import ToolLoad, recipe

ROOT = Path(__file__).parents[2]
FINE = (ROOT / "slicer_profiles/qualities/fine.yaml").read_text("utf-8")
MOST_MM3_S = 4.3  # of eTPU and X60
WORD = re.compile(r"([A-Z])(-?[\d.]+)")


def thick(layer_mm):
    quality = re.sub(r"layer_mm: 0\.1", f"layer_mm: {layer_mm}", FINE)
    own = {"qualities": {"rough": quality}}
    size = {"length_mm": 8.0, "width_mm": 6.0}
    return make({"shape": "reference", "parameters": size, "nozzle_mm": 0.6, "quality": "rough", "own": own})


def fastest_mm3_s(text):
    """Greatest flow of a line."""
    x = y = feed = most = 0.0
    for line in text.splitlines():
        words = dict(WORD.findall(line.partition(";")[0]))
        if words.get("G") in ("0", "1"):
            to = float(words.get("X", x)), float(words.get("Y", y))
            feed, way = float(words.get("F", feed)), math.hypot(to[0] - x, to[1] - y)
            x, y = to
            if way > 0.05:  # shorter ones have too few decimals
                most = max(most, float(words.get("E", 0.0)) * math.pi / 4 * 1.75**2 / way * feed / 60)
    return most


@pytest.mark.parametrize("slicer", ["prusa", "cura"])
def test_layers_of_0_2_mm_by_a_nozzle_of_0_6_mm(slicer, program, tmp_path):
    """PrusaSlicer 2.5 lays the tower's first line at the speed of the prime: 5.66 mm3/s."""
    found = program(*{"prusa": ("prusa-slicer",) * 2, "cura": ("cura-engine cura", "CuraEngine")}[slicer])
    made = slicing.sliced([slicing.alone(thick(0.2))], slicer, tmp_path, program=found)
    assert 2.0 < fastest_mm3_s(made.ready.read_text()) <= MOST_MM3_S


def test_speed_is_lowered_where_lines_are_thicker_still():
    design = thick(0.5)
    for tool, load in slicing.plate_loads([slicing.alone(design)]).items():
        assert isinstance(load, ToolLoad)
        done = recipe(design.machine, design.layers, tool, load)
        assert done.speed_mm_s * 0.5 * done.line_mm == pytest.approx(0.95 * MOST_MM3_S)
    usual = make({"shape": "reference"})
    for tool, load in slicing.plate_loads([slicing.alone(usual)]).items():
        done = recipe(usual.machine, usual.layers, tool, load)
        assert (done.speed_mm_s, done.retraction_speed_mm_s) == (20.0, 40.0)
